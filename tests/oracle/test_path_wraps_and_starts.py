"""Compare ranges of path wraps and the initial muscle equilibrium with OpenSim.

OpenSim never evaluates wraps whose range lies beyond the path. It equilibrates muscles before
speeds fulfil the constraints.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import ModelError, OsimliteError
from osimlite.simulation import Simulation
from tests.scripts import run_script

pytestmark = pytest.mark.oracle

SLIDER = """<SliderJoint name="{0}"><socket_parent_frame>/ground</socket_parent_frame>
    <socket_child_frame>/bodyset/{0}</socket_child_frame><coordinates><Coordinate name="{0}_x">
    <default_value>{1}</default_value><default_speed_value>{2}</default_speed_value></Coordinate></coordinates>
    </SliderJoint>"""
BODY = '<Body name="{}"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>'
POINT = """<PathPoint name="p{0}"><socket_parent_frame>{1}</socket_parent_frame><location>{2}</location></PathPoint>"""


def model(forces: str, *, more: str = "", ground: str = "") -> str:
    bodies, joints = (
        BODY.format("a") + BODY.format("b"),
        SLIDER.format("a", 0.3, 0.2) + SLIDER.format("b", 0.1, -0.7),
    )
    return (
        f'<OpenSimDocument Version="40600"><Model name="m">{ground}<BodySet><objects>{bodies}</objects></BodySet>'
        f"<JointSet><objects>{joints}</objects></JointSet>{more}<ForceSet><objects>{forces}</objects></ForceSet>"
        "</Model></OpenSimDocument>"
    )


def answer(code: str, path: Path) -> list[list[float]] | None:
    """Run code on a model in OpenSim and return what it prints, or None if it fails."""
    head = (
        'import json, sys, opensim as o\no.Logger.setLevelString("Off")\nm = o.Model(sys.argv[1])\n'
    )
    done = run_script(head + code, path, check=False)
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else None


# Script that computes the length of a path at several coordinates with OpenSim.
LENGTHS = """
s = m.initSystem()
path, x, rows = o.PathSpring.safeDownCast(m.getForceSet().get(0)).getGeometryPath(), m.getCoordinateSet().get(0), []
for value in (0.0, 0.05, 0.2):
    x.setValue(s, value)
    m.realizePosition(s)
    rows.append([path.getLength(s), path.computeMomentArm(s, x)])
print(json.dumps(rows))
"""


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize(
    "ranges",
    [
        ["-1 -1"],
        ["0 0"],
        ["-5 2"],
        ["2 -1"],
        ["-1 1"],
        ["3 2"],
        ["4 3"],
        ["1 4"],
        ["5 9"],
        ["-1 -1", "3 2"],
        ["3 1", "1 9"],
        ["-1 -1", "9 2", "4 5"],
        ["1 9", "3 1"],
        ["2 2", "1 9"],
    ],
    ids=str,
)
def test_ranges_of_wraps(tmp_path: Path, ranges: list[str], count: int) -> None:
    points = "".join(
        POINT.format(
            k,
            "/ground" if k < count - 1 else "/bodyset/a",
            f"{k / (count - 1) - 0.5} 0.0{k + 2} 0.01",
        )
        for k in range(count)
    )
    wraps = "".join(
        f'<PathWrap name="w{k}"><wrap_object>s{k}</wrap_object><range>{ends}</range></PathWrap>'
        for k, ends in enumerate(ranges)
    )
    spheres = "".join(
        f'<WrapSphere name="s{k}"><translation>{0.25 * k - 0.2} 0 0</translation><radius>0.1</radius></WrapSphere>'
        for k in range(len(ranges))
    )
    spring = f"""<PathSpring name="f"><resting_length>0.5</resting_length><stiffness>1</stiffness>
        <dissipation>0</dissipation><GeometryPath name="path"><PathPointSet><objects>{points}</objects></PathPointSet>
        <PathWrapSet><objects>{wraps}</objects></PathWrapSet></GeometryPath></PathSpring>"""
    ground = f'<Ground name="ground"><WrapObjectSet><objects>{spheres}</objects></WrapObjectSet></Ground>'
    path = tmp_path / "m.osim"
    path.write_text(model(spring, ground=ground))
    theirs = answer(LENGTHS, path)
    errors = osimlite.validate(path, select="OSIM617").errors
    assert (theirs is None) == bool(errors)
    if theirs is None:
        with pytest.raises(ModelError, match=r"the range of .* ends at point"):
            osimlite.paths(osimlite.read(path))
        return
    result = osimlite.paths(osimlite.read(path))
    for value, (length, arm) in zip((0.0, 0.05, 0.2), theirs, strict=True):
        (ours,), (arms,) = (
            result.lengths([value, 0.1]).values(),
            result.moment_arms([value, 0.1]).values(),
        )
        assert ours == pytest.approx(length, rel=1e-14)
        assert next(iter(arms.values())) == pytest.approx(arm, abs=1e-9)


# Script that computes lengths at `POSES` and simulates the model with OpenSim.
RUN = """
s = m.initSystem()
path, (x, y) = o.GeometryPath.safeDownCast(m.getComponent("/forceset/f/path")), m.getCoordinateSet()
rows = []
for values in POSES:
    for c, value in zip((x, y), values):
        c.setValue(s, value, False)
    try:
        m.realizePosition(s)
        rows.append(path.getLength(s))
    except RuntimeError:
        rows.append(None)
manager, s = o.Manager(m), m.initializeState()
manager.setIntegratorAccuracy(1e-7)
try:
    manager.initialize(s)
    s = manager.integrate(0.05)
    rows.append([c.getValue(s) for c in (x, y)])
except RuntimeError:
    rows.append(None)
print(json.dumps([rows]))
"""
POSES = ((0.3, 0.1), (0.0, 0.2), (0.05, 0.0), (-0.1, 0.3))
SPRING = """<PathSpring name="f">{}<resting_length>0.5</resting_length><stiffness>9</stiffness><dissipation>0.1
    </dissipation>{}</PathSpring>"""
LIGAMENT = '<Ligament name="f">{}<resting_length>0.5</resting_length><pcsa_force>10</pcsa_force>{}</Ligament>'
MUSCLE = """<Thelen2003Muscle name="f">{}<max_isometric_force>10</max_isometric_force><optimal_fiber_length>0.5
    </optimal_fiber_length><tendon_slack_length>0.3</tendon_slack_length>{}</Thelen2003Muscle>"""
ACTUATOR = '<PathActuator name="f">{}<optimal_force>5</optimal_force>{}</PathActuator>'
OFF = "<appliesForce>false</appliesForce>"
SPHERE, CYLINDER = (
    ("Sphere", "<radius>0.1</radius>"),
    ("Cylinder", "<radius>0.05</radius><length>1</length>"),
)
ELLIPSOID, TORUS = (
    ("Ellipsoid", "<dimensions>0.1 0.07 0.09</dimensions>"),
    ("Torus", "<inner_radius>0.02</inner_radius><outer_radius>0.08</outer_radius>"),
)


# A pair of numbers for a point is the range of /jointset/b/b_x in which the point is active. None
# for the surface of a wrap stands for a wrap object that is not active.
@pytest.mark.parametrize(
    ("force", "off", "points", "wraps"),
    [
        pytest.param(SPRING, "", (0, 0), [("3 3", SPHERE)], id="both beyond"),
        pytest.param(MUSCLE, "", (0, 0, 0), [("1 4", ELLIPSOID)], id="end beyond"),
        pytest.param(ACTUATOR, "", (0, 0), [("5 -1", CYLINDER)], id="start beyond"),
        pytest.param(LIGAMENT, "", (0, 0, 0), [("5 0", TORUS)], id="start beyond and the last"),
        pytest.param(
            MUSCLE,
            "",
            (0, 0),
            [("9 4", CYLINDER), ("1 9", SPHERE)],
            id="start behind end, both beyond",
        ),
        pytest.param(
            SPRING, "", (0, 0, 0), [("-7 -2", ELLIPSOID), ("-1 3", SPHERE)], id="negative"
        ),
        pytest.param(LIGAMENT, OFF, (0, 0), [("1 3", SPHERE)], id="a force that is off"),
        pytest.param(MUSCLE, OFF, (0, 0, 0), [("2 7", SPHERE)], id="a muscle that is off"),
        pytest.param(
            ACTUATOR, "", (0, 0, 0), [("1 9", None), ("1 3", SPHERE)], id="a surface that is off"
        ),
        pytest.param(
            SPRING, "", (0, (0.15, 1), 0), [("2 2", SPHERE), ("1 4", SPHERE)], id="not in all poses"
        ),
        pytest.param(
            MUSCLE,
            "",
            (0, (-1, 0.05), (-1, 0.15), 0),
            [("2 3", TORUS), ("3 9", SPHERE)],
            id="two points",
        ),
        pytest.param(
            ACTUATOR,
            "",
            (0, (0.15, 1), 0),
            [("2 2", None), ("2 4", SPHERE)],
            id="by one that is off",
        ),
        pytest.param(
            SPRING,
            "",
            (0, 0, (0.15, 1), 0),
            [("-1 2", SPHERE), ("3 -1", TORUS), ("3 5", SPHERE)],
            id="three",
        ),
        pytest.param(
            LIGAMENT, "", (0, (0.15, 1), 0), [("1 4", SPHERE), ("2 2", SPHERE)], id="before it"
        ),
    ],
)
def test_models_whose_ranges_leave_their_paths(
    tmp_path: Path, force: str, off: str, points: tuple, wraps: list
) -> None:
    placed = [
        POINT.format(
            k,
            "/ground" if k < len(points) - 1 else "/bodyset/a",
            f"{k / (len(points) - 1) - 0.5} 0.0{k + 2} 0.01",
        )
        for k in range(len(points))
    ]
    for k, within in enumerate(points):
        if within:
            more = (
                "<socket_coordinate>/jointset/b/b_x</socket_coordinate><range>{} {}</range>".format(
                    *within
                )
            )
            placed[k] = (
                placed[k]
                .replace("PathPoint", "ConditionalPathPoint")
                .replace("</Cond", more + "</Cond")
            )
    bent = "".join(
        f'<PathWrap name="w{k}"><wrap_object>s{k}</wrap_object><range>{ends}</range></PathWrap>'
        for k, (ends, _) in enumerate(wraps)
    )
    surfaces = "".join(
        f'<Wrap{kind} name="s{k}"><active>{str(surface is not None).lower()}</active><translation>{0.25 * k - 0.2} 0 0'
        f"</translation>{sizes}</Wrap{kind}>"
        for k, (_, surface) in enumerate(wraps)
        for kind, sizes in [surface or SPHERE]
    )
    geometry = (
        f'<GeometryPath name="path"><PathPointSet><objects>{"".join(placed)}</objects></PathPointSet><PathWrapSet>'
        f"<objects>{bent}</objects></PathWrapSet></GeometryPath>"
    )
    ground = f'<Ground name="ground"><WrapObjectSet><objects>{surfaces}</objects></WrapObjectSet></Ground>'
    path = tmp_path / "m.osim"
    path.write_text(model(force.format(off, geometry), ground=ground))
    theirs = answer(RUN.replace("POSES", repr(POSES)), path)
    assert theirs is not None
    (*lengths, end), read = theirs[0], osimlite.read(path)

    def length_in(pose: tuple[float, float]) -> float | None:
        try:
            return osimlite.paths(read).lengths(list(pose))["/forceset/f"]
        except OsimliteError:
            return None

    def moved() -> list[float] | None:
        try:
            motion = osimlite.simulate(read, 0.05, "compiled", accuracy=1e-7)
        except OsimliteError:
            return None
        return [motion.columns[name][-1] for name in ("a_x", "b_x")]

    for pose, length in zip(POSES, lengths, strict=True):
        assert length_in(pose) == (None if length is None else pytest.approx(length, abs=1e-13))
    assert moved() == (None if end is None else pytest.approx(end, abs=1e-8))
    # A model with the error OSIM617 must not run in OpenSim.
    assert not (osimlite.validate(path, select="OSIM617").errors and end)


START = """
s = m.initSystem()
m.equilibrateMuscles(s)
manager = o.Manager(m)
manager.initialize(s)
s = manager.integrate(1e-9)
muscle = o.Muscle.safeDownCast(m.getForceSet().get(0))
print(json.dumps([[muscle.getFiberLength(s)], [c.getSpeedValue(s) for c in m.getCoordinateSet()]]))
"""
COUPLER = """<ConstraintSet><objects><CoordinateCouplerConstraint name="c"><coupled_coordinates_function>
    <LinearFunction><coefficients>0.5 0</coefficients></LinearFunction></coupled_coordinates_function>
    <independent_coordinate_names>a_x</independent_coordinate_names>
    <dependent_coordinate_name>b_x</dependent_coordinate_name></CoordinateCouplerConstraint></objects></ConstraintSet>"""


def test_muscles_are_in_equilibrium_at_speeds_that_break_constraints(tmp_path: Path) -> None:
    points = POINT.format(0, "/ground", "0 0 0") + POINT.format(1, "/bodyset/b", "0.2 0 0")
    muscle = f"""<Thelen2003Muscle name="f"><max_isometric_force>100</max_isometric_force>
        <optimal_fiber_length>0.15</optimal_fiber_length><tendon_slack_length>0.2</tendon_slack_length>
        <default_activation>0.4</default_activation><GeometryPath name="path"><PathPointSet><objects>{points}</objects>
        </PathPointSet></GeometryPath></Thelen2003Muscle>"""
    path = tmp_path / "m.osim"
    path.write_text(model(muscle, more=COUPLER))
    theirs = answer(START, path)
    assert theirs is not None
    with Simulation(osimlite.read(path), "compiled") as simulation:
        y = simulation.initial_state({}, {}, equilibrate=True)
        free = simulation.engine.equilibrate_muscles(0.0, y)
    assert y[2:4] == pytest.approx(theirs[1], abs=1e-6)
    assert y[-1] == pytest.approx(theirs[0][0], rel=1e-7)
    # The equilibrium at the projected speeds has a different fiber length.
    assert free[-1] != pytest.approx(theirs[0][0], rel=1e-4)
