"""Ranges of wraps that OpenSim never looks at, and muscles that it equilibrates before speeds fulfil constraints."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.simulation import Simulation

pytestmark = pytest.mark.oracle

SLIDER = """<SliderJoint name="{0}"><socket_parent_frame>/ground</socket_parent_frame>
    <socket_child_frame>/bodyset/{0}</socket_child_frame><coordinates><Coordinate name="{0}_x">
    <default_value>{1}</default_value><default_speed_value>{2}</default_speed_value></Coordinate></coordinates>
    </SliderJoint>"""
BODY = '<Body name="{}"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>'
POINT = """<PathPoint name="p{0}"><socket_parent_frame>{1}</socket_parent_frame><location>{2}</location></PathPoint>"""


def model(forces: str, *, more: str = "", ground: str = "") -> str:
    bodies, joints = BODY.format("a") + BODY.format("b"), SLIDER.format("a", 0.3, 0.2) + SLIDER.format("b", 0.1, -0.7)
    return (
        f'<OpenSimDocument Version="40600"><Model name="m">{ground}<BodySet><objects>{bodies}</objects></BodySet>'
        f"<JointSet><objects>{joints}</objects></JointSet>{more}<ForceSet><objects>{forces}</objects></ForceSet>"
        "</Model></OpenSimDocument>"
    )


def answer(code: str, path: Path) -> list[list[float]] | None:
    """What a piece of code says of a model in OpenSim, None if it fails there."""
    head = 'import json, sys, opensim as o\no.Logger.setLevelString("Off")\nm = o.Model(sys.argv[1])\n'
    done = subprocess.run(
        [sys.executable, "-c", head + code, path], capture_output=True, text=True, timeout=60, check=False
    )
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else None


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
        POINT.format(k, "/ground" if k < count - 1 else "/bodyset/a", f"{k / (count - 1) - 0.5} 0.0{k + 2} 0.01")
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
    found = osimlite.paths(osimlite.read(path))
    for value, (length, arm) in zip((0.0, 0.05, 0.2), theirs, strict=True):
        (ours,), (arms,) = found.lengths([value, 0.1]).values(), found.moment_arms([value, 0.1]).values()
        assert ours == pytest.approx(length, rel=1e-14)
        assert next(iter(arms.values())) == pytest.approx(arm, abs=1e-9)


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
        free = simulation.engine.equilibrated(0.0, y)
    assert y[2:4] == pytest.approx(theirs[1], abs=1e-6)
    assert y[-1] == pytest.approx(theirs[0][0], rel=1e-7)
    # The equilibrium at the projected speeds is another.
    assert free[-1] != pytest.approx(theirs[0][0], rel=1e-4)
