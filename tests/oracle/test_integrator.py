"""Compare Runge-Kutta-Merson over OpenSim's accelerations with the steps of OpenSim's Manager.

Both run on one machine with one library, so that only a different method, or a different order of
rounding, can make the steps differ. Where the states are the same numbers, they are compared
without tolerance.
"""

from __future__ import annotations

import csv
import re

import pytest

import osimlite
from osimlite.simulation.engines.linking import MACHINE_CODE, PYTHON_CODE
from tests.simulation.equations import runge_kutta_merson

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle


@pytest.fixture
def walker(fixtures):
    opensim.Logger.setLevelString("error")
    return opensim.Model(str(fixtures / "walker" / "DynamicWalkerModel.osim"))


def dynamics(model, state):
    """Return the derivative of an OpenSim state as a function f(t, y), and the initial state.

    The order of states is Simbody's: all q, all u, all z.
    """
    size = state.getNY()

    def f(t, y):
        state.setTime(t)
        state.setY(opensim.Vector(y))
        model.realizeAcceleration(state)
        derivative = state.getYDot()
        return [derivative.get(i) for i in range(size)]

    initial = state.getY()
    return f, [initial.get(i) for i in range(size)]


def manager_run(model, until, accuracy=None, method=None):
    """Integrate a model with OpenSim's Manager.

    Returns:
        The recorded times, the final state, and the counts (taken steps, attempted steps,
        realizations).
    """
    sink = opensim.StringLogSink()
    state = model.initSystem()
    manager = opensim.Manager(model)
    if method is not None:
        manager.setIntegratorMethod(method)
    if accuracy is not None:
        manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    opensim.Logger.setLevelString("info")
    opensim.Logger.addSink(sink)
    try:
        last = manager.integrate(until).getY()
        log = sink.getString()
    finally:
        opensim.Logger.removeSink(sink)
        opensim.Logger.setLevelString("error")
    counts = re.search(r"realizations: (\d+)[^$]*?taken / attempted: (\d+) / (\d+)", log)
    assert counts is not None
    realizations, taken, attempted = map(int, counts.groups())
    times = list(manager.getStatesTable().getIndependentColumn())
    return times, [last.get(i) for i in range(last.size())], (taken, attempted, realizations)


def counts(integrator):
    return integrator.accepted, integrator.attempted, integrator.evaluations


@pytest.mark.parametrize("code", [MACHINE_CODE, PYTHON_CODE], ids=lambda code: code.name)
@pytest.mark.parametrize(
    ("accuracy", "expected"),
    [(None, (135, 173, 828)), (1e-5, (360, 440, 2121)), (1e-8, (1799, 1972, 9688))],
)
def test_the_walkers_steps_are_opensims(walker, accuracy, expected, code):
    times, last, measured = manager_run(walker, 2.0, accuracy)
    f, y0 = dynamics(walker, walker.initSystem())
    given = {} if accuracy is None else {"accuracy": accuracy}
    integrator = runge_kutta_merson(f, 0.0, y0, 8, code=code, **given)
    steps = list(integrator.iterate_steps(2.0))
    assert counts(integrator) == measured == expected
    assert [t for t, _ in steps] == times[1:]
    assert steps[-1][1] == last


def test_recorded_steps(walker, shared):
    """Compare with times and states of the reference data too, not only with a run of this OpenSim."""
    f, y0 = dynamics(walker, walker.initSystem())
    with (shared / "oracle" / "trajectory_default_internal_steps.csv").open() as text:
        rows = [
            [float(x) for x in row]
            for row in csv.reader(line for line in text if line[0] not in "#t")
        ]
    steps = list(runge_kutta_merson(f, 0.0, y0, 8).iterate_steps(2.0))
    assert len(rows) == 1 + len(steps) == 136
    for row, (t, y) in zip(rows[1:], steps, strict=True):
        assert [t, *y] == pytest.approx(row[:17], rel=1e-9, abs=1e-9)


def test_a_locked_coordinate_left_out_but_counted(walker):
    """The state leaves out the locked platform; count_q and count_u keep OpenSim's error norm."""
    times, last, _ = manager_run(walker, 2.0)
    whole, y0 = dynamics(walker, walker.initSystem())

    def f(t, y):
        derivative = whole(t, [y0[0], *y[:7], 0.0, *y[7:]])
        return derivative[1:8] + derivative[9:]

    y = y0[1:8] + y0[9:]
    integrator = runge_kutta_merson(f, 0.0, y, 7, counted=(8, 8))
    steps = list(integrator.iterate_steps(2.0))
    assert [t for t, _ in steps] == times[1:]
    assert steps[-1][1] == last[1:8] + last[9:]
    uncounted = runge_kutta_merson(f, 0.0, y, 7)
    assert [t for t, _ in uncounted.iterate_steps(2.0)] != times[1:]


@pytest.mark.parametrize("interval", [1, 13, 37])
def test_a_manager_that_is_stopped_often(walker, interval):
    """The Manager does not interpolate: its steps end at each requested time, and so do ours."""
    state = walker.initSystem()
    f, y0 = dynamics(walker, opensim.State(state))
    manager = opensim.Manager(walker)
    manager.initialize(state)
    integrator = runge_kutta_merson(f, 0.0, y0, 8)
    for stop in range(interval, 150 * interval, interval):
        expected = manager.integrate(stop / 1000).getY()
        for _ in integrator.iterate_steps(stop / 1000):
            pass
        assert integrator.state == [expected.get(j) for j in range(16)]


def test_auxiliary_states(walker):
    """The energy that limit forces dissipate is integrated as auxiliary states."""
    for name in ("RKneeLimitTorque", "LHipLimitTorque"):
        force = opensim.CoordinateLimitForce.safeDownCast(walker.updForceSet().get(name))
        force.set_compute_dissipation_energy(True)
    times, last, measured = manager_run(walker, 2.0)
    state = walker.initSystem()
    assert (state.getNQ(), state.getNU(), state.getNZ()) == (8, 8, 2)
    f, y0 = dynamics(walker, state)
    integrator = runge_kutta_merson(f, 0.0, y0, 8)
    steps = list(integrator.iterate_steps(2.0))
    assert counts(integrator) == measured
    assert [t for t, _ in steps] == times[1:]
    assert steps[-1][1] == last


def test_a_free_joint_counts_one_coordinate_more():
    """Simbody has seven q for a free joint, and divides the sum of squared errors by seven."""
    opensim.Logger.setLevelString("error")
    model = opensim.Model()
    body = opensim.Body("body", 1.0, opensim.Vec3(0.1, 0.2, 0.0), opensim.Inertia(0.3, 0.5, 0.4))
    model.addBody(body)
    joint = opensim.FreeJoint("joint", model.getGround(), body)
    model.addJoint(joint)
    for index, (value, speed) in enumerate(
        [(0.3, 4.0), (0.2, -3.0), (-0.5, 5.0), (0, 1), (0, 2), (0, 3)]
    ):
        joint.upd_coordinates(index).setDefaultValue(value)
        joint.upd_coordinates(index).setDefaultSpeedValue(speed)
    times, last, measured = manager_run(model, 1.0, 1e-6)
    state = model.initSystem()
    assert (state.getNQ(), state.getNU()) == (7, 6)
    whole, y0 = dynamics(model, state)

    def f(t, y):
        derivative = whole(t, [*y[:6], 0.0, *y[6:]])
        return derivative[:6] + derivative[7:]

    integrator = runge_kutta_merson(f, 0.0, y0[:6] + y0[7:], 6, accuracy=1e-6, counted=(7, 6))
    steps = list(integrator.iterate_steps(1.0))
    assert counts(integrator)[:2] == measured[:2]
    # Simbody weights errors of q by converting them to u and back, which rounds.
    assert [t for t, _ in steps] == pytest.approx(times[1:], abs=1e-9)
    assert steps[-1][1] == pytest.approx(last[:6] + last[7:], abs=1e-9)


@pytest.mark.parametrize(
    ("path", "until", "accuracy"),
    [
        ("walker/DynamicWalkerModel.osim", 1.0, 1e-3),
        ("walker/DynamicWalkerModel.osim", 0.5, 1e-5),
        ("kinematics/mixed_joint_tree.osim", 0.3, 1e-3),
        ("lint/limb.osim", 0.3, 1e-3),
        ("lint/muscle.osim", 0.3, 1e-3),
    ],
)
def test_semi_explicit_steps_are_simbody_s(fixtures, path, until, accuracy):
    """The models have contact, ball joints, constraints and muscles."""
    method = opensim.Manager.IntegratorMethod_SemiExplicitEuler2
    model = opensim.Model(str(fixtures / path))
    times, last, (taken, attempted, _) = manager_run(model, until, accuracy, method)
    found = osimlite.simulate(
        osimlite.read(fixtures / path),
        to=until,
        engine="compiled",
        accuracy=accuracy,
        integrator="euler2",
        opensim_derivatives=True,
        simbody_early_return=True,
    )
    assert len(times) == taken + 1
    assert (found.summary["steps"], found.summary["attempted_steps"]) == (taken, attempted)
    own = [*found.values[-1], *found.speeds[-1], *(rows[-1] for rows in found.auxiliary.values())]
    # Contact amplifies every rounding error about a hundredfold per second. The lists of states
    # differ by locked coordinates: compare each state of OpenSim with the nearest of ours.
    assert max(min(abs(here - there) for here in own) for there in last) < 1e-6
