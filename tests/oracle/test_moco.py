"""Compare osimlite's optimal control problems with OpenSim's Moco.

MocoTrajectory must read the solutions. Objective terms and constraint violations at Moco's iterates
and solutions must agree.
"""

from __future__ import annotations

import gzip
import json
import re
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.io.tables.writers import write_trc
from tests.optimal.small import coupled, links
from tests.optimal.studies import moco_said, study_file
from tests.optimal.study_faults import project
from tests.scripts import CASADI, OPENSIM, run_script

pytestmark = pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")


@pytest.mark.parametrize("name", ["pendulum-50"])
def test_solutions_are_read(name, tmp_path, repo):
    osim = pytest.importorskip("opensim")
    file = study_file(tmp_path, name)
    # CasADi and OpenSim cannot be loaded into one process.
    command = [sys.executable, "-m", "osimlite", "run", str(file), "-o", str(tmp_path)]
    done = subprocess.run(command, cwd=repo, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert ", infeasibility " in done.stderr
    path = str(tmp_path / "MocoStudy_solution.sto")
    trajectory = osim.MocoTrajectory(path)
    assert trajectory.getNumTimes() == 101
    assert next(iter(trajectory.getStateNames())) == "/jointset/j0/q0/value"
    assert trajectory.getFinalTime() == pytest.approx(moco_said(name)["final_time"], rel=1e-6)


OURS = """
import json
import osimlite
from osimlite import moco
from osimlite.optimal.program import Program
scaled = {"of_tau1": "/tau1", "of_tip": "tip_2"}
program = Program(moco.build_problem("study.omoco", scaled=scaled))
theirs = moco.MocoTrajectory.read("theirs.sto")
# OpenSim loses those of markers and contacts as it copies its pointers to them.
theirs.parameters["of_tip"] = 1.0
terms, missed = moco.evaluate(program, theirs)
# Limited memory ends within rounding of such a tolerance, or not.
study = osimlite.read_document("study.omoco")
study.solver.optim_hessian_approximation = "exact"
found = moco.solve(study, scaled=scaled)
print(json.dumps([terms, missed[0].size, found.objective, found.success, found.parameters]))
"""


@pytest.mark.full
def test_markers_controls_and_bounds_over_time(tmp_path):
    """Objective terms at Moco's solution agree, with weights of columns.

    The objective of our own solution is not larger.
    """
    osim = pytest.importorskip("opensim")
    model = osim.ModelFactory.createDoublePendulum()
    model.addMarker(osim.Marker("tip", model.getBodySet().get(1), osim.Vec3(0.1, 0.05, 0.02)))
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "model.osim"))
    t = np.linspace(0.0, 1.0, 31)
    places = np.stack([np.cos(2 * t), np.sin(2 * t), 0.01 * t], axis=1)
    write_trc(tmp_path / "markers.trc", t, ("tip",), places)
    write_sto(
        tmp_path / "controls.sto",
        "",
        t,
        ("/tau0", "/tau1"),
        np.stack([np.sin(3 * t), t * t], axis=1),
    )
    columns = {
        "/jointset/j0/q0/value": np.sin(2 * t),
        "/jointset/j0/q0/speed": 2 * np.cos(2 * t),
        "/jointset/j1/q1/value": 0.3 * t,
        "/jointset/j1/q1/speed": np.full(31, 0.3),
        "/tau0": 0.5 * t + 0.1,
        "/tau1": -0.2 * t,
        "of_tau1": np.where(t == 0, 0.9, np.nan),
        "of_tip": np.where(t == 0, 0.9, np.nan),
    }
    guess = tmp_path / "guess.sto"
    write_sto(guess, "", t, tuple(columns), np.column_stack([*columns.values()]), has_missing=True)
    counts = "num_controls=2\nnum_derivatives=0\nnum_input_controls=0\nnum_multipliers=0\nnum_parameters=2\nnum_slacks=0\n"
    text = guess.read_text().partition("endheader")[2]
    guess.write_text(
        f"inDegrees=no\n{counts}num_states=4\nDataType=double\nversion=3\nendheader{text}"
    )
    said = [
        _said(tmp_path, command) for command in (["-m", "tests.oracle.moco_goals"], ["-c", OURS])
    ]
    theirs, (terms, missed, objective, success, factors) = said
    assert terms == pytest.approx(theirs, rel=1e-10)
    assert missed < 1e-6 and success
    assert objective <= sum(theirs.values()) * (1.0 + 1e-6)
    assert min(abs(factor - 1.0) for factor in factors.values()) > 0.01


OUR_FRAMES = """
import json
import osimlite
from osimlite import moco
from osimlite.optimal.program import Program
study = osimlite.read_document("study.omoco")
next(goal for goal in study.problem.phases.goals if goal.name == "turns").rotation_reference_file = "turns.sto"
terms, _ = moco.evaluate(Program(moco.build_problem(study)), moco.MocoTrajectory.read("theirs.sto"))
for goal in study.problem.phases.goals:
    goal.enabled = goal.name in ("places", "turns", "heavy")
study.problem.phases.path_constraints[0].frame_pairs[0].maximum_distance = 1.2
study.solver.optim_max_iterations, study.solver.optim_convergence_tolerance = 200, 1e-3
study.solver.optim_hessian_approximation = "exact"
found = moco.solve(study)
mechanism, apart = osimlite.mechanism(osimlite.read("model.osim")), []
for k in range(0, len(found.states.times)):
    q = [found.states[f"{info.path}/value"][k] for info in mechanism.coordinates]
    x, y, z = mechanism.frame_transform("/bodyset/b1", q)[:3, 3]
    apart.append(((0.2 * x - y) ** 2 / 1.04 + z * z) ** 0.5)
print(json.dumps([terms, found.success, found.parameters["mass"], min(apart), max(apart)]))
"""


@pytest.mark.full
def test_frames_and_expressions(tmp_path):
    """Terms of frames, step asymmetry and parameters agree after one iteration of Moco."""
    osim = pytest.importorskip("opensim")
    model = osim.ModelFactory.createDoublePendulum()
    turn = osim.Vec3(0.0, 0.0, -np.pi / 2)
    floor = osim.ContactHalfSpace(osim.Vec3(0.0, -0.6, 0.0), turn, model.getGround(), "floor")
    model.addContactGeometry(floor)
    for number in range(2):
        body = model.getBodySet().get(number)
        sphere = osim.ContactSphere(0.1, osim.Vec3(0.02, -0.05, 0.01), body, f"sphere{number}")
        model.addContactGeometry(sphere)
        model.addComponent(osim.SmoothSphereHalfSpaceForce(f"contact{number}", sphere, floor))
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "model.osim"))
    t = np.linspace(0.0, 1.0, 21)
    bodies = ("/bodyset/b0", "/bodyset/b1")
    swing = np.stack([np.sin(2 * t), 0.5 * t, 0.1 * t * t, np.cos(3 * t), t, 0.2 * t], axis=1)
    for name in ("places", "spins", "pulls"):
        write_sto(tmp_path / f"{name}.sto", "", t, bodies, swing, kind="Vec3")
    half = np.stack([np.cos(t), 0 * t, 0.3 * t, np.sin(t)], axis=1)
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    write_sto(
        tmp_path / "turns.sto",
        "",
        t,
        bodies,
        np.hstack([half, half[:, [0, 2, 1, 3]]]),
        kind="Quaternion",
    )
    motion = {
        "/jointset/j0/q0/value": np.sin(2 * t),
        "/jointset/j0/q0/speed": 2 * np.cos(2 * t),
        "/jointset/j1/q1/value": 0.3 * t,
        "/jointset/j1/q1/speed": np.full(21, 0.3),
    }
    write_sto(tmp_path / "motion.sto", "", t, tuple(motion), np.column_stack([*motion.values()]))
    theirs, ours = (
        _said(tmp_path, command)
        for command in (["-m", "tests.oracle.moco_frames"], ["-c", OUR_FRAMES])
    )
    terms, success, mass, nearest, farthest = ours
    assert terms == pytest.approx(theirs, rel=1e-9)
    assert success
    # The only term that depends on the mass is the expression, so its derivative vanishes at the
    # optimum.
    assert 2 * (mass - 0.7) == pytest.approx(1 / mass**2, abs=0.05)
    assert nearest > 0.2 - 1e-3 and 1.0 < farthest < 1.2 + 1e-3


# Class, output, index of the element, exponent, operation and second output of each goal.
OF_OUTPUTS = [
    ("MocoOutputGoal", "/|com_position", 1, 1, "", ""),
    ("MocoFinalOutputGoal", "/|com_velocity", -1, 2, "", ""),
    ("MocoOutputGoal", "/|com_acceleration", 0, 1, "", ""),
    ("MocoInitialOutputGoal", "/bodyset/b1|position", 0, 3, "", ""),
    ("MocoOutputGoal", "/bodyset/b1|linear_velocity", -1, 1, "", ""),
    ("MocoOutputGoal", "/bodyset/b1|angular_velocity", 2, 1, "", ""),
    ("MocoOutputGoal", "/bodyset/b1|linear_acceleration", -1, 2, "", ""),
    ("MocoFinalOutputGoal", "/bodyset/b0|angular_acceleration", 2, 1, "", ""),
    ("MocoOutputGoal", "/markerset/tip|location", 0, 2, "", ""),
    ("MocoOutputGoal", "/markerset/tip|velocity", -1, 1, "", ""),
    ("MocoOutputGoal", "/markerset/tip|acceleration", 1, 1, "", ""),
    ("MocoOutputGoal", "/jointset/j0/q0|value", -1, 3, "", ""),
    ("MocoOutputGoal", "/jointset/j1/q1|speed", -1, 1, "", ""),
    ("MocoOutputGoal", "/jointset/j1/q1|acceleration", -1, 1, "", ""),
    ("MocoOutputGoal", "/forceset/muscle|fiber_length", -1, 1, "", ""),
    ("MocoOutputGoal", "/forceset/muscle|activation", -1, 2, "", ""),
    ("MocoOutputGoal", "/forceset/muscle|active_fiber_force", -1, 1, "", ""),
    ("MocoOutputGoal", "/bodyset/b1|position", -1, 1, "subtraction", "/bodyset/b0|position"),
    ("MocoOutputGoal", "/bodyset/b1|position", -1, 2, "multiplication", "/markerset/tip|location"),
    ("MocoOutputGoal", "/jointset/j0/q0|speed", -1, 1, "addition", "/jointset/j1/q1|speed"),
    ("MocoOutputGoal", "/bodyset/b1|position", 0, 1, "division", "/bodyset/b0|position"),
]
OUR_OUTPUTS = """
import json
import osimlite
from osimlite import moco
from osimlite.optimal.program import Program
study = osimlite.read_document("study.omoco")
terms, _ = moco.evaluate(Program(moco.build_problem(study)), moco.MocoTrajectory.read("theirs.sto"))
study.problem.phases.goals = [osimlite.MocoControlGoal(name="effort")]
study.solver.optim_max_iterations = 200
found = moco.solve(study)
mechanism, high = osimlite.mechanism(osimlite.read("model.osim")), []
for k in range(0, len(found.states.times), 2):
    q = [found.states[f"{info.path}/value"][k] for info in mechanism.coordinates]
    high.append(mechanism.station_positions(q)["/markerset/tip"][1] - (0.5 * found.states.times[k] - 1.2))
print(json.dumps([terms, found.success, max(high)]))
"""


def test_outputs(tmp_path):
    """Terms of outputs agree after one iteration of Moco; bounds of outputs hold in our solution."""
    osim = pytest.importorskip("opensim")
    model = osim.ModelFactory.createDoublePendulum()
    model.addMarker(osim.Marker("tip", model.getBodySet().get(1), osim.Vec3(0.1, 0.05, 0.02)))
    muscle = osim.DeGrooteFregly2016Muscle()
    muscle.setName("muscle")
    for name, value in (
        ("max_isometric_force", 30.0),
        ("optimal_fiber_length", 0.4),
        ("tendon_slack_length", 0.1),
    ):
        getattr(muscle, f"set_{name}")(value)
    muscle.set_ignore_tendon_compliance(True)
    muscle.set_pennation_angle_at_optimal(0.2)
    muscle.addNewPathPoint("origin", model.getGround(), osim.Vec3(0.1, 0.3, 0.0))
    muscle.addNewPathPoint("insertion", model.getBodySet().get(0), osim.Vec3(-0.7, 0.05, 0.0))
    model.addForce(muscle)
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "model.osim"))
    (tmp_path / "outputs.json").write_text(json.dumps(OF_OUTPUTS))
    theirs, ours = (
        _said(tmp_path, command)
        for command in (["-m", "tests.oracle.moco_outputs"], ["-c", OUR_OUTPUTS])
    )
    terms, success, high = ours
    # OpenSim declares that values and speeds as outputs need no stage of realization. Moco
    # therefore uses those of an earlier evaluation, and the test computes them from the table
    # instead.
    table = read_sto(tmp_path / "theirs.sto")
    q, u = (
        np.stack([table[f"/jointset/j{k}/q{k}/{what}"] for k in (0, 1)])
        for what in ("value", "speed")
    )
    simpson = np.convolve([1, 4, 1], [1, 0, 1, 0, 1, 0, 1]) / 24
    theirs |= zip(
        ("g11", "g12", "g19"),
        (simpson @ np.abs(q[0]) ** 3, simpson @ u[1], simpson @ u.sum(axis=0)),
        strict=True,
    )
    named = {f"g{number}": output for number, output in enumerate(OF_OUTPUTS)}
    assert {named[name]: value for name, value in terms.items()} == pytest.approx(
        {named[name]: value for name, value in theirs.items()}, rel=1e-9
    )
    assert success and high < 1e-3


OUR_LOADS = """
import json
from osimlite import moco
from osimlite.optimal.program import Program
terms, _ = moco.evaluate(Program(moco.build_problem("study.omoco")), moco.MocoTrajectory.read("theirs.sto"))
print(json.dumps(terms))
"""


@pytest.mark.parametrize("kind", ["implicit", "explicit", "constrained"])
def test_loads(kind, tmp_path):
    """Terms of joint reactions, generalized forces, contact and tendons agree after one iteration of Moco."""
    osim = pytest.importorskip("opensim")
    model = osim.ModelFactory.createDoublePendulum()
    turn = osim.Vec3(0.0, 0.0, -np.pi / 2)
    floor = osim.ContactHalfSpace(osim.Vec3(0.0, -0.6, 0.0), turn, model.getGround(), "floor")
    model.addContactGeometry(floor)
    b1 = model.getBodySet().get(1)
    for number in range(2):
        sphere = osim.ContactSphere(
            0.1, osim.Vec3(0.02 - 0.1 * number, -0.05, 0.01), b1, f"sphere{number}"
        )
        model.addContactGeometry(sphere)
        model.addComponent(osim.SmoothSphereHalfSpaceForce(f"contact{number}", sphere, floor))
    # One more body is welded to the second one, and another hangs on a hinge of it.
    middle, inertia = osim.Vec3(0.01, 0.02, -0.03), osim.Inertia(0.01, 0.02, 0.03)
    load, last = osim.Body("load", 0.7, middle, inertia), osim.Body("last", 0.4, middle, inertia)
    at, turned = osim.Vec3(0.1, 0.2, 0.3), osim.Vec3(0.3, 0.2, 0.1)
    zero = osim.Vec3(0)
    weld = osim.WeldJoint("weld", b1, at, turned, load, osim.Vec3(0.0, 0.1, 0.0), zero)
    hinge = osim.PinJoint("hinge", load, at, zero, last, osim.Vec3(0.2, 0.0, 0.1), turned)
    hinge.updCoordinate().setName("q2")
    for body, joint in ((load, weld), (last, hinge)):
        model.addBody(body)
        model.addJoint(joint)
    for number, dynamics in enumerate(
        ("implicit", "explicit" if kind == "explicit" else "implicit")
    ):
        muscle = osim.DeGrooteFregly2016Muscle()
        muscle.setName(f"muscle{number}")
        for name, value in (
            ("max_isometric_force", 30.0),
            ("optimal_fiber_length", 0.4),
            ("tendon_slack_length", 0.2),
        ):
            getattr(muscle, f"set_{name}")(value)
        muscle.set_ignore_tendon_compliance(False)
        muscle.set_tendon_compliance_dynamics_mode(dynamics)
        muscle.set_pennation_angle_at_optimal(0.2)
        muscle.set_fiber_damping(0.1)
        muscle.addNewPathPoint("origin", model.getGround(), osim.Vec3(0.1, 0.3, 0.1 * number))
        muscle.addNewPathPoint("insertion", model.getBodySet().get(0), osim.Vec3(-0.7, 0.05, 0.0))
        model.addForce(muscle)
    if kind == "constrained":
        place = last.findStationLocationInGround(model.initSystem(), at).to_numpy()
        far = float(np.linalg.norm(place - [0.0, 2.0, 0.5]))
        model.addConstraint(
            osim.ConstantDistanceConstraint(
                model.getGround(), osim.Vec3(0.0, 2.0, 0.5), last, at, far
            )
        )
        coupler = osim.CoordinateCouplerConstraint()
        names = osim.ArrayStr()
        names.append("q0")
        coupler.setIndependentCoordinateNames(names)
        coupler.setDependentCoordinateName("q1")
        coupler.setFunction(osim.LinearFunction(0.5, 0.1))
        model.addConstraint(coupler)
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "model.osim"))
    t = np.linspace(0.0, 1.0, 21)
    labels = ["q0_moment", "q2_moment"] + ["q1_moment"] * (kind != "constrained")
    columns = np.stack([3 * np.sin(2 * t), 1 + t * t, np.cos(t)], axis=1)[:, : len(labels)]
    write_sto(tmp_path / "moments.sto", "", t, labels, columns)
    write_sto(
        tmp_path / "loads.sto",
        "",
        t,
        ["f_x", "f_y", "f_z"],
        np.stack([5 * t, 20 + t, 0 * t], axis=1),
    )
    force = osim.ExternalForce()
    force.setName("foot")
    force.set_applied_to_body("b1")
    force.set_force_identifier("f_")
    loads = osim.ExternalLoads()
    loads.setDataFileName("loads.sto")
    loads.cloneAndAppend(force)
    loads.printToXML(str(tmp_path / "loads.xml"))
    theirs, ours = (
        _said(tmp_path, command)
        for command in (["-m", "tests.oracle.moco_loads"], ["-c", OUR_LOADS])
    )
    assert ours == pytest.approx(theirs, rel=1e-9)


@pytest.mark.full
def test_loads_of_a_motion_that_is_given(tmp_path):
    """Terms of joint reactions and generalized forces agree for a prescribed motion with a constraint."""
    pytest.importorskip("opensim")
    model = coupled(links("rigid", "implicit", count=3), "q1")
    motion = osimlite.PositionMotion(name="motion")
    for number in range(3):
        sine = osimlite.Sine(
            name=f"/jointset/j{number}/q{number}", amplitude=0.3 + number, omega=2.0, phase=0.1
        )
        motion.functions.objects.append(sine)
    model.add(motion)
    osimlite.write(model, tmp_path / "model.osim")
    t = np.linspace(0.0, 1.0, 21)
    write_sto(
        tmp_path / "moments.sto",
        "",
        t,
        ["q0_moment", "q2_moment"],
        np.stack([3 * np.sin(2 * t), t], axis=1),
    )
    theirs, ours = (
        _said(tmp_path, command)
        for command in (["-m", "tests.oracle.moco_loads"], ["-c", OUR_LOADS])
    )
    assert {"joint0", "joint1", "joint2", "force0", "force1", "force2"} <= theirs.keys()
    assert ours == pytest.approx(theirs, rel=1e-9)


OUR_PROJECTION = """
import json
import numpy as np
import osimlite
from osimlite import moco
from osimlite.optimal.program import Program
from osimlite.optimal.ipopt import find_violations
program = Program(moco.build_problem("study.omoco"))
layout, theirs = program.layout, moco.MocoTrajectory.read("theirs.sto")
w, times = layout.guess_from_trajectory(theirs), theirs.times
# The file has neither where intervals lead to, nor what moves states but as lines over other times than theirs.
places = layout.indices["slacks"]
moved = np.flatnonzero(places[:, 0] >= 0)
knots = np.linspace(times[0], times[-1], len(moved))
lines = np.stack([np.interp(times, knots, unit) for unit in np.eye(len(moved))], axis=1)
for number, name in enumerate(layout.names["slacks"]):
    w[places[moved, number]] = np.linalg.lstsq(lines, theirs.columns[name], rcond=None)[0]
count = len(layout.names["projections"])
of = layout.indices["projections"][moved]
for row in range(len(moved)):
    x = w[layout.indices["states"][moved[row]]]
    g = np.array(program.problem.functions.constraints(times[moved[row]], x, 0 * x, [])[3])
    mu = w[places[moved[row]]].reshape(2, -1)
    w[of[row]] = x[:count] - (mu @ g).ravel()
costs, rows = program.compute_values(w)
study = osimlite.read_document("study.omoco")
study.solver.optim_hessian_approximation = "exact"
found = moco.solve(study, guess="theirs.sto")
terms, slack = dict(zip(program.costs, costs)), float(np.abs(w[places[moved]]).max())
print(json.dumps([terms, find_violations(program, w, rows)[0].size, found.violations[0].size, found.objective, slack]))
"""


@pytest.mark.parametrize(
    ("scheme", "mode"),
    [("trapezoidal", "explicit"), ("hermite-simpson", "implicit")],
)
@pytest.mark.full
def test_states_that_are_moved_onto_constraints(scheme, mode, tmp_path):
    """Terms agree for the projection of Bordalba 2023.

    Moco's solution fulfils the constraints, and the objective of our own solution is not larger.
    """
    pytest.importorskip("opensim")
    model = coupled(links(count=3), "q1", "q2")
    for contact in list(model.components(osimlite.SmoothSphereHalfSpaceForce)):
        model.remove(contact)
    osimlite.write(model, tmp_path / "model.osim")
    commands = ["-m", "tests.oracle.moco_projection", scheme, mode], ["-c", OUR_PROJECTION]
    theirs, ours = (_said(tmp_path, command) for command in commands)
    terms, missed, left, objective, slack = ours
    assert terms == pytest.approx(theirs, rel=1e-9)
    assert missed < 1e-6 < slack
    # The search may end where no better step exists, within the tolerance of the constraints.
    assert left < 1e-4
    assert objective <= sum(theirs.values()) * (1.0 + 1e-4)


TAKEN = """
import json, sys
import opensim as osim
osim.Logger.setLevelString("off")
solution = osim.MocoStudy("study.omoco").solve()
print(json.dumps(solution.getStatus()))
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (r"<bounds>(0.6 0.9)<", "nan 1", "bounds is nan, which is not a number"),
        (
            r"<bounds>(0.6 0.9)<",
            "-2 -1",
            "the latest final time, -1 s, is not after the earliest initial time, 0 s",
        ),
        (
            r"<bounds>(0.6 0.9)<",
            "5 9",
            "the table covers 0 s to 1 s, but the motion lasts at least from 0.2 s to 5 s",
        ),
        (
            r"(<MocoVariableInfo name=\"/jointset/j0/q0/value.*?</MocoVariableInfo>)",
            '<Constant name="no" />',
            "objects of this class are not allowed here",
        ),
        (
            r"<MocoControlTrackingGoalReference name=\"(/forceset/motor0)",
            "/motor0",
            "has no control '/motor0'",
        ),
    ],
)
def test_what_moco_takes_without_a_word(old, new, said, tmp_path):
    """Moco accepts these studies without a message; osimlite rejects them with one sentence."""
    pytest.importorskip("opensim")
    project("followed", tmp_path)
    study = tmp_path / "study.omoco"
    text = study.read_text()
    at = re.search(old, text, re.DOTALL).span(1)
    study.write_text(text[: at[0]] + new + text[at[1] :])
    assert _said(tmp_path, ["-c", TAKEN]) == "Maximum_Iterations_Exceeded"
    # CasADi and OpenSim cannot be loaded into one process, therefore use another one.
    code = "import osimlite; osimlite.moco.solve('study.omoco')"
    done = run_script(code, folder=tmp_path, check=False, modules=CASADI)
    assert done.returncode == 1 and said in done.stderr.splitlines()[-1]


SCALED = """
import opensim as osim
from tests.oracle.moco_studies import ended
study = osim.MocoStudy("squat-25.omoco")
solver = osim.MocoCasADiSolver.safeDownCast(study.updSolver())
solver.set_scale_variables_using_bounds(True)
solver.set_minimize_lagrange_multipliers(True)
solver.set_multibody_dynamics_mode("implicit")
solver.set_minimize_implicit_multibody_accelerations(True)
solver.set_optim_max_iterations(2)
ended(study)
"""


def test_costs_of_scaled_variables(tmp_path):
    """Terms of multipliers and accelerations agree after two iterations of Moco."""
    pytest.importorskip("opensim")
    study_file(tmp_path, "squat-25")
    theirs, ours = (_said(tmp_path, ["-c", code]) for code in (SCALED, OUR_LOADS))
    assert {"multipliers", "accelerations"} < theirs.keys()
    assert ours == pytest.approx(theirs, rel=1e-9)


TRACKED = """
import json
import opensim as osim
osim.Logger.setLevelString("Off")
tool = osim.MocoTrack()
tool.setName("t")
tool.setModel(osim.ModelProcessor("model.osim"))
tool.setMarkersReferenceFromTRC("markers.trc")
tool.set_markers_global_tracking_weight(3.0)
weights = osim.MocoWeightSet()
weights.cloneAndAppend(osim.MocoWeight("tip", 2.0))
tool.set_markers_weight_set(weights)
tool.set_mesh_interval(0.1)
study = tool.initialize()
osim.MocoCasADiSolver.safeDownCast(study.updSolver()).set_optim_max_iterations(5)
solution = study.solve()
solution.unseal()
solution.write("theirs.sto")
names = solution.getObjectiveTermNames()
print(json.dumps({name: solution.getObjectiveTermByIndex(place) for place, name in enumerate(names)}))
"""
OUR_TRACKED = """
import json
import osimlite
from osimlite import moco
from osimlite.optimal.program import Program
lowpass = osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)
tool = osimlite.MocoTrack(
    name="t",
    model=osimlite.ModelProcessor(filepath="model.osim"),
    markers_reference=osimlite.TableProcessor(filepath="markers.trc", operators=[lowpass]),
    markers_global_tracking_weight=3.0,
    mesh_interval=0.1,
)
tool.markers_weight_set.objects.append(osimlite.MocoWeight(name="tip", weight=2.0))
problem, _ = moco.build_track_problem(tool)
print(json.dumps(moco.evaluate(Program(problem), moco.MocoTrajectory.read("theirs.sto"))[0]))
"""


@pytest.mark.full
def test_tracked_markers(tmp_path):
    """Terms of tracked markers agree after five iterations of Moco."""
    osim = pytest.importorskip("opensim")
    model = osim.ModelFactory.createDoublePendulum()
    for name, body in (("tip", 1), ("elbow", 0)):
        model.addMarker(osim.Marker(name, model.getBodySet().get(body), osim.Vec3(0.1, 0.05, 0.02)))
    model.finalizeConnections()
    model.printToXML(str(tmp_path / "model.osim"))
    t = np.linspace(0.0, 1.0, 31)
    places = np.stack([np.cos(2 * t), np.sin(2 * t), 0.01 * t, np.sin(t), 0.5 * t, 0.0 * t], axis=1)
    write_trc(tmp_path / "markers.trc", t.tolist(), ("tip", "elbow"), places.tolist())
    theirs, ours = (_said(tmp_path, ["-c", code]) for code in (TRACKED, OUR_TRACKED))
    assert ours == pytest.approx(theirs, rel=1e-10)


ANYWHERE = """
import json, sys
import numpy as np
import osimlite
from osimlite import moco
from osimlite.optimal.ipopt import find_violations
from osimlite.optimal.program import Program
# One that does not act has states and no control; MocoControlGoal takes wrong ones for those behind it.
model = osimlite.read("model.osim")
[*model.components(osimlite.Actuator)][-1].appliesForce = sys.argv[1] == "implicit"
osimlite.write(model, "model.osim")
phase = osimlite.MocoPhase(name="phases", model=osimlite.ModelProcessor(name="model", filepath="model.osim"))
if sys.argv[1] == "implicit":
    phase.model.operators += [osimlite.ModOpRemoveMuscles(), osimlite.ModOpAddReserves(optimal_force=7.0)]
phase.time_initial_bounds = osimlite.MocoInitialBounds(bounds=(0.0,))
phase.time_final_bounds = osimlite.MocoFinalBounds(bounds=(1.0,))
for name, bounds in ((".*/value", (-0.3, 0.4)), (".*/speed", (-2.0, 3.0))):
    phase.state_infos_pattern.append(osimlite.MocoVariableInfo(name=name, bounds=bounds))
phase.control_infos_pattern.append(osimlite.MocoVariableInfo(name=".*", bounds=(0.1, 0.7)))
phase.goals.append(osimlite.MocoSumSquaredStateGoal(name="some", pattern=".*_r/.*"))
phase.goals.append(osimlite.MocoControlGoal(name="effort"))
solver = osimlite.MocoCasADiSolver(multibody_dynamics_mode=sys.argv[1], num_mesh_intervals=2, optim_max_iterations=0)
study = osimlite.MocoStudy(problem=osimlite.MocoProblem(name="problem", phases=phase), solver=solver)
osimlite.write(study, "study.omoco")
program = Program(moco.build_problem("study.omoco"))
layout = program.layout
lower, upper = (np.where(np.isfinite(x), x, end) for x, end in ((layout.lower, -1.0), (layout.upper, 1.0)))
w = np.random.default_rng(0).uniform(lower, upper)
moco.MocoTrajectory.from_variables(layout, w).write("ours.sto")
costs, rows = program.compute_values(w)
print(json.dumps([costs.sum(), find_violations(program, w, rows)[0].size]))
"""
BEGUN = """
import json
from pathlib import Path
import opensim as osim
# Ipopt reads that it is not to move the guess away from its bounds.
Path("ipopt.opt").write_text("bound_push 1e-16\\nbound_frac 1e-16\\nbound_relax_factor 0\\n")
study = osim.MocoStudy("study.omoco")
osim.MocoCasADiSolver.safeDownCast(study.updSolver()).setGuessFile("ours.sto")
solution = study.solve()
solution.unseal()
solution.write("theirs.sto")
print(json.dumps(solution.getObjective()))
"""


@pytest.mark.parametrize(
    ("number", "mode"),
    [
        ("m0115", "explicit"),
        ("m0115", "implicit"),
        pytest.param("m0116", "implicit", marks=pytest.mark.full),
    ],
)
def test_columns_are_where_moco_looks_for_them(number, mode, tmp_path, corpus):
    """Objective and violation agree at a random guess between the bounds, so that all variables correspond."""
    pytest.importorskip("opensim")
    entry = next(item for item in corpus if item.id == number)
    (tmp_path / "model.osim").write_bytes(gzip.decompress(entry.converted.read_bytes()))
    objective, missed = _said(tmp_path, ["-c", ANYWHERE, mode])
    told = _record_iteration(tmp_path, ["-c", BEGUN])
    assert json.loads(told.splitlines()[-1]) == pytest.approx(objective, rel=1e-12)
    said = re.search(r"Constraint violation\.+:\s+\S+\s+(\S+)", told)
    # Accelerations of OpenSim's custom joints differ slightly from the derivatives of their speeds.
    assert float(said[1]) == pytest.approx(missed, rel=1e-9 if mode == "explicit" else 1e-5)
    ours, theirs = (read_sto(tmp_path / f"{name}.sto") for name in ("ours", "theirs"))
    assert ours.columns == theirs.columns


COUPLED = """
import json
import opensim as osim
osim.Logger.setLevelString("Off")
model = osim.Model("model.osim")
model.initSystem()
result = []
for overwrite in (True, False):
    processor = osim.TableProcessor("motion.sto")
    processor.append(osim.TabOpUseAbsoluteStateNames())
    processor.append(osim.TabOpAppendCoupledCoordinateValues(overwrite))
    table = processor.process(model)
    result.append([list(table.getColumnLabels()), table.getMatrix().to_numpy().tolist()])
print(json.dumps(result))
"""
OUR_COUPLED = """
import json
import osimlite
from osimlite import moco
from osimlite.optimal.tables import read_reference
phase = osimlite.MocoPhase(model=osimlite.ModelProcessor(filepath="model.osim"))
problem = moco.build_problem(osimlite.MocoStudy(problem=osimlite.MocoProblem(phases=phase)))
result = []
for overwrite in (True, False):
    operators = [
        osimlite.TabOpUseAbsoluteStateNames(),
        osimlite.TabOpAppendCoupledCoordinateValues(overwrite_existing_columns=overwrite),
    ]
    processor = osimlite.TableProcessor(filepath="motion.sto", operators=operators)
    table = read_reference(problem, phase, processor)
    result.append([table.columns, table.rows.tolist()])
print(json.dumps(result))
"""


def test_values_of_coupled_coordinates(tmp_path):
    """Values of coupled coordinates agree, even if the table has a column of the dependent coordinate."""
    pytest.importorskip("opensim")
    osimlite.write(coupled(links(), "q1"), tmp_path / "model.osim")
    t = np.linspace(0.0, 1.0, 7)
    write_sto(tmp_path / "motion.sto", "", t, ("q1", "q0"), np.column_stack([t, np.sin(3 * t)]))
    said = [_said(tmp_path, ["-c", code]) for code in (COUPLED, OUR_COUPLED)]
    for (names, theirs), (columns, ours) in zip(*said, strict=True):
        assert columns == names and len(names) == 2
        assert ours == pytest.approx(np.array(theirs), rel=1e-12)


def _said(folder, command):
    """Return the last line that a program prints, read as JSON."""
    return json.loads(_record_iteration(folder, command).splitlines()[-1])


def _record_iteration(folder, command):
    """Run a program in a process of its own and return what it prints."""
    first, code, *words = command
    if first == "-m":
        code = f"import runpy; runpy.run_module({code!r}, run_name='__main__', alter_sys=True)"
    # OpenSim and CasADi cannot be loaded into one process.
    modules = OPENSIM if first == "-m" or re.search("import.*opensim", code) else CASADI
    done = run_script(code, *words, folder=folder, check=False, modules=modules)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
