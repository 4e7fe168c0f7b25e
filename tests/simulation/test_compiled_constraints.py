"""Tests of constraints, prescribed and partly locked coordinates in the compiled engine, against the recursion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from osimlite import Coordinate, Model
from osimlite.errors import SimulationError, UnsupportedError
from osimlite.mechanics.kernels import linear_algebra as ls
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.constraints import Coupler, PrescribedCoordinate
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.function_types import Sine
from osimlite.simulation import Simulation, simulate
from osimlite.simulation.batches import ENDINGS, Watch, run_many
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.laws import find_function
from osimlite.simulation.engines.compiled import CompiledEngine
from osimlite.simulation.engines.linking import PYTHON_CODE
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.system import System
from tests.mechanics.multibody.strategies import KINDS, Case, cases, constraint_of
from tests.simulation.support import MODELS, four_bars, knee, patella, pins
from tests.suite import choose


def accelerations(mechanism: Mechanism, q: Any, u: Any, t: float = 0.0) -> Any:
    return np.array(CompiledEngine(mechanism, Forces(())).compute_accelerations(t, q, u))


# ------------------------------------------------------------------------------------ random trees and constraints
@settings(max_examples=choose(30, 60))
@given(
    cases(max_bodies=4),
    st.sampled_from([*KINDS, "none"]),
    st.integers(0, 2**32 - 1),
    st.integers(0, 3),
)
def test_any_mechanism(case: Case, kind: str, seed: int, locks: int):
    assume(len(case.q))
    rng = np.random.default_rng(seed)
    held = () if kind == "none" else (constraint_of(kind, case.mechanism, rng),)
    infos = [
        replace(info, default_value=float(x))
        for info, x in zip(case.mechanism.coordinates, case.q, strict=True)
    ]
    for place in rng.integers(0, len(infos), locks):
        infos[place] = replace(infos[place], locked=True)
    mechanism = replace(case.mechanism, coordinates=tuple(infos), constraints=held)
    try:
        u = mechanism.project_speeds(case.q, case.u, 0.7)
        expected = mechanism.acceleration(case.q, u, time=0.7)
    except SimulationError:
        return
    # If no speeds fulfil the constraints, accelerations need not either.
    rows = [item.velocity_equations(mechanism.at(case.q, u, 0.7)) for item in mechanism.constraints]
    if any(np.abs(matrix @ u - wanted).max(initial=0.0) > 1e-9 for matrix, wanted in rows):
        return
    # Nearly contradictory constraints make any result uncertain.
    scale = max(1.0, float(np.abs(expected).max()), float(np.abs(u).max()) ** 2)
    assume(scale < 1e5)
    assert np.abs(accelerations(mechanism, case.q, u, 0.7) - expected).max() < 1e-9 * scale


FREE_AND_BALL = ("FreeJoint", "BallJoint", "CustomJoint, spline")
SEVERAL = {
    "one coordinate of several": Coupler(6, (0, 1, 9), f.WeightedSum((0.4, -0.3, 0.2), 0.1)),
    "products": Coupler(
        9, (7, 8), f.MultivariatePolynomial.complete((0.1, 0.2, -0.3, 0.4, 0.5, -0.2), 2, 2)
    ),
    "as OpenSim": Coupler(
        3,
        (6, 10),
        f.MultivariatePolynomial.complete(
            (0.1, 0.2, -0.3, 0.4, 0.5, -0.2), 2, 2, opensim_derivatives=True
        ),
    ),
    "scaled spline": Coupler(
        0,
        (10,),
        f.ScaledFunction(-1.5, f.SimmCubicSpline((-1.5, -0.4, 0.3, 1.6), (0.1, 0.4, -0.2, 0.3))),
    ),
    "angle of a ball": PrescribedCoordinate(7, f.SineWave(0.4, 3.0, 0.2, 0.1)),
    "polynomial of time": PrescribedCoordinate(
        3, f.MultivariatePolynomial.complete((0.1, 0.2, -0.3), 1, 2)
    ),
    "polynomial of time as OpenSim": PrescribedCoordinate(
        3,
        f.ScaledFunction(
            0.7, f.MultivariatePolynomial.complete((0.1, 0.2, -0.3), 1, 2, opensim_derivatives=True)
        ),
    ),
    "the same one twice": Coupler(6, (9, 9), f.WeightedSum((0.4, 0.3), 0.1)),
}


@pytest.mark.parametrize("name", SEVERAL)
def test_couplers_of_all_kinds(name: str):
    from tests.simulation.support import tree

    mechanism = replace(tree(FREE_AND_BALL), constraints=(SEVERAL[name],))
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.0, 1.0, len(mechanism.coordinates))
    u = mechanism.project_speeds(q, rng.uniform(-2.0, 2.0, len(q)), 0.7)
    expected = mechanism.acceleration(q, u, time=0.7)
    assert (
        np.abs(accelerations(mechanism, q, u, 0.7) - expected).max() < 1e-9 * np.abs(expected).max()
    )


@pytest.mark.parametrize("opensim_derivatives", [False, True])
def test_the_derivatives_of_opensim(opensim_derivatives: bool):
    mechanism = knee(opensim_derivatives=opensim_derivatives)
    q, u = np.array((0.4, -0.3, 0.2, 0.5)), np.array((2.0, -1.0, 1.5, 0.7))
    assert accelerations(mechanism, q, u) == pytest.approx(mechanism.acceleration(q, u), rel=1e-11)
    infos = tuple(
        replace(info, locked=index in (1, 2)) for index, info in enumerate(mechanism.coordinates)
    )
    mechanism, still = replace(mechanism, coordinates=infos), np.array((1.0, 0.0, 0.0, 1.0))
    assert accelerations(mechanism, still * q, still * u) == pytest.approx(
        mechanism.acceleration(still * q, still * u), rel=1e-11
    )


# -------------------------------------------------------------------------------------------------------- motion
def prescribed() -> Model:
    model, _ = pins(3)
    first = next(iter(model.components(Coordinate)))
    first.prescribed, first.prescribed_function = True, Sine(amplitude=0.5, omega=3.0, offset=0.2)
    return model


ALL: dict[str, Any] = {**MODELS, "prescribed": prescribed}


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
@pytest.mark.parametrize("make", ALL.values(), ids=ALL)
def test_same_motion_as_with_bullet(make: Any, accuracy: float):
    result = []
    for engine in ("bullet", "compiled"):
        with Simulation(make(), engine) as simulation:
            names = [info.name for info in simulation.mechanism.coordinates if not info.locked]
            trajectory = simulation.run(
                choose(0.5, 1.0),
                accuracy=accuracy,
                initial_speeds={names[-1]: 2.0},
                report_interval=0.05,
            )
            result.append(trajectory)
    theirs, ours = result
    assert ours.summary["constraints"] == theirs.summary["constraints"]
    for count in ("steps", "attempted_steps", "evaluations"):
        assert ours.summary[count] == theirs.summary[count]
    assert np.ptp(ours.values, axis=0).max() > 0.3
    assert np.abs(ours.values - theirs.values).max() < 1e-9
    assert np.abs(ours.speeds - theirs.speeds).max() < 1e-8
    for label, column in theirs.energy.items():
        assert ours.energy[label] == pytest.approx(column, abs=1e-8)


@pytest.mark.parametrize("make", ALL.values(), ids=ALL)
def test_reports_between_steps_fulfil_the_constraints(make: Any):
    accuracy = 1e-5
    with Simulation(make(), "compiled") as simulation:
        trajectory = simulation.run(choose(0.3, 1.0), accuracy=accuracy, report_interval=0.003)
        mechanism = simulation.mechanism
    errors, slips = [], []
    for t, q, u in zip(trajectory.times, trajectory.values, trajectory.speeds, strict=True):
        state = mechanism.at(q, u, float(t))
        errors += [
            float(np.sum(item.position_errors(state) ** 2)) for item in mechanism.constraints
        ]
        rows = [item.velocity_equations(state) for item in mechanism.constraints]
        slips += [float(np.sum((matrix @ u - wanted) ** 2)) for matrix, wanted in rows]
    # The tolerance is that of the root mean square of at most seven equations.
    assert max(*errors, *slips) < 7.0 * (accuracy / 10.0) ** 2


@pytest.mark.parametrize("make", ALL.values(), ids=ALL)
def test_fixed_steps(make: Any):
    ours, theirs = (
        simulate(make(), choose(0.05, 0.2), engine, fixed_step=1e-3)
        for engine in ("compiled", "bullet")
    )
    assert np.abs(ours.values - theirs.values).max() < 1e-9


@pytest.mark.parametrize("make", ALL.values(), ids=ALL)
def test_kernels_are_what_they_mean_in_python(make: Any):
    """Accelerations and projections have the bits of Python."""
    with Simulation(make(), "compiled") as simulation:
        engine: Any = simulation.engine
        y = np.array(simulation.initial_state({}, {}))
    y += np.random.default_rng(1).uniform(-0.02, 0.02, len(y))
    python = System(engine.mechanism, engine.forces, code=PYTHON_CODE)
    assert python.realize(0.0, y.tolist(), STAGE.ACCELERATION) == OUTCOME.OK
    assert python.get_derivative() == engine.compute_derivative(0.0, y)
    ends = run_many(engine, [y], 1e-30, accuracy=1e-8)
    room, result = np.zeros(engine.structure[MODEL.WORK_SIZE]), np.zeros(len(y))
    room[WORK.SCRATCH : WORK.SCRATCH + 2] = 1e-9, np.inf
    assert (
        find_function("project")(python.program.ints, engine.numbers, room, y, result, 0)
        == OUTCOME.OK
    )
    assert y[: len(y) // 2].tolist() == ends.states[0][: len(y) // 2].tolist()


# ------------------------------------------------------------------------------------------------------ batches
@pytest.fixture(scope="module")
def loop() -> Any:
    """Yield a simulation of four bars with a stop on the first joint."""
    model = four_bars()
    stop = CoordinateLimitForce(
        name="stop",
        coordinate="p0",
        upper_limit=60.0,
        upper_stiffness=5.0,
        lower_limit=-60.0,
        lower_stiffness=5.0,
    )
    model.add(stop)
    with Simulation(model, "compiled") as simulation:
        yield simulation


def nearest(engine: Any, y: Any) -> Any:
    """Return the nearest state to y that fulfils the constraints of pins; changes of speeds above 1 are relative."""
    mechanism, order = engine.mechanism, list(engine.order)
    x, u = np.split(y.copy(), 2)
    for _ in range(10):
        state = mechanism.at(engine.state.values([*x, *u]), engine.state.speeds([*x, *u]))
        equations = [item.velocity_equations(state) for item in mechanism.constraints]
        rows, wanted = (
            np.concatenate([g[:, order] for g, _ in equations]),
            np.concatenate([b for _, b in equations]),
        )
        x -= np.linalg.pinv(rows) @ np.concatenate(
            [item.position_errors(state) for item in mechanism.constraints]
        )
    scales = np.maximum(np.abs(u), 1.0)
    return [*x, *(u - scales * (np.linalg.pinv(rows * scales) @ (rows @ u - wanted)))]


def test_runs_start_where_the_constraints_hold(loop: Any):
    engine = loop.engine
    start = np.array(loop.initial_state({}, {"p0": 1.0}))
    starts = start + np.random.default_rng(3).uniform(-0.1, 0.1, (choose(6, 20), len(start)))
    starts[0] = start
    times = np.linspace(0.0, 1.0, 11)
    runs = run_many(engine, starts, 1.0, accuracy=1e-7, report_times=times.tolist())
    for row in runs.reports.reshape(-1, len(start)):
        state = engine.mechanism.at(engine.state.values(row), engine.state.speeds(row))
        for item in engine.mechanism.constraints:
            assert np.abs(item.position_errors(state)).max() < 1e-7
    for row, report in zip(starts, runs.reports, strict=True):
        assert report[0] == pytest.approx(nearest(engine, row), abs=1e-8)
    trajectory = loop.run(1.0, accuracy=1e-7, report_interval=0.1, initial_speeds={"p0": 1.0})
    assert np.array_equal(
        runs.reports[0][:, : len(start) // 2], trajectory.values[:, list(engine.order)]
    )
    one, two = (run_many(engine, starts, 1.0, threads=threads) for threads in (1, 2))
    assert np.array_equal(one.states, two.states)


def test_watches_see_states_where_the_constraints_hold(loop: Any):
    engine = loop.engine
    start = np.array(loop.initial_state({}, {"p0": 2.0}))
    level = start[engine.order.index(1)] - 0.05
    low = Watch("low", coordinate="p1", level=float(level), stops=-1)
    high = Watch("end", body="p2", station=(0.0, -0.4, 0.0), direction=(1.0, 0.0, 0.0), level=0.5)
    runs = run_many(
        engine, [start], 5.0, accuracy=1e-5, watches=[low, high], most_events=90, event_states=True
    )
    assert ENDINGS[int(runs.endings[0])] == "stopped"
    state = runs.states[0].tolist()
    assert state[engine.order.index(1)] == pytest.approx(level, abs=1e-7)
    assert engine.project_state(runs.times[0], state, 1e-6) == state
    assert runs.event_states[0][-1] == pytest.approx(state, abs=1e-12)


def test_starts_from_which_nothing_holds_fail(loop: Any):
    start = np.array(loop.initial_state({}, {}))
    far = start.copy()
    far[:3] = 1.5707, 0.0, 0.0
    runs = run_many(loop.engine, [start, far * np.nan, start], 0.1)
    assert [ENDINGS[int(ending)] for ending in runs.endings] == ["done", "failed", "done"]


# ------------------------------------------------------------------------------------------------------ errors
def test_a_massless_body_may_hang_on_a_constraint():
    from osimlite import Body

    model = patella()
    cap = next(body for body in model.components(Body) if body.name == "cap")
    cap.mass, cap.inertia = 0.0, (0.0,) * 6
    ours, theirs = (
        simulate(model, 0.3, engine, accuracy=1e-8) for engine in ("compiled", "bullet")
    )
    assert np.abs(ours.values - theirs.values).max() < 1e-9
    model.constraint_set.objects[0].isEnforced = False
    with pytest.raises(SimulationError, match="'cap' moves no mass"):
        simulate(model, 0.3, "compiled")


def test_a_motion_without_mass_that_no_constraint_decides_is_named():
    from osimlite import Body

    model = patella()
    for body in model.components(Body):
        body.mass, body.inertia = 0.0, (0.0,) * 6
    with pytest.raises(SimulationError, match="moves no mass"):
        simulate(model, 0.1, "compiled")


def test_a_motion_without_mass_is_named_where_a_coordinate_that_moves_with_others_is_locked():
    from osimlite import BallJoint, Body, Model

    model = Model(name="ball")
    body = model.add(Body(name="body", mass=0.0, inertia=(0.0,) * 6))
    joint = model.add(BallJoint(name="joint").between(model.ground, body))
    joint.coordinates[0].locked = True
    mechanism = build_mechanism(model)
    with pytest.raises(SimulationError, match="moves no mass"):
        CompiledEngine(mechanism, Forces(())).compute_derivative(
            0.0, [0.0, 0.0, 0.0, 99.0, 99.0, 99.0]
        )


def test_an_unknown_constraint_is_refused_by_name():
    mechanism = build_mechanism(four_bars())

    class Strange:
        bodies = ()
        name = "/constraintset/strange"

    with pytest.raises(
        UnsupportedError, match=r"'/constraintset/strange' \(Strange\) cannot be enforced"
    ):
        CompiledEngine(replace(mechanism, constraints=(Strange(),)), Forces(()))


def test_a_function_that_is_unknown_is_refused_by_name():
    class Odd(f.SmoothFunction):
        def evaluate(self, arguments: Any) -> tuple[float, Any, Any]:
            return arguments[0], np.ones(1), np.zeros((1, 1))

    mechanism = build_mechanism(four_bars())
    with pytest.raises(UnsupportedError, match="the function of '/constraintset/odd' is an Odd"):
        CompiledEngine(
            replace(mechanism, constraints=(Coupler(0, (1,), Odd(), "/constraintset/odd"),)),
            Forces(()),
        )
    assert EngineSettings().route == "auto"


# ------------------------------------------------------------------------------------------- linear equations
@settings(max_examples=choose(30, 60))
@given(st.integers(1, 7), st.integers(1, 7), st.integers(0, 5), st.integers(0, 2**32 - 1))
def test_equations_that_repeat_or_contradict_each_other(
    count: int, size: int, rank: int, seed: int
):
    rng = np.random.default_rng(seed)
    rank = min(count, size, rank)
    rows = rng.normal(size=(count, rank)) @ rng.normal(size=(rank, size))
    values = rng.normal(size=count)
    a, room, x = np.zeros(ls.factor_size(count, size)), np.zeros(count), np.zeros(size)
    a[: count * size] = rows.ravel()
    result = ls.factorise_equations(count, size, a, 1e-9)
    assert result == rank
    ls.solve_minimum_norm(count, size, a, result, values, room, x)
    expected = np.linalg.lstsq(rows, values, rcond=1e-9)[0]
    condition = (
        np.linalg.cond(rows)
        if rank == min(rows.shape)
        else np.linalg.norm(rows) * np.linalg.norm(np.linalg.pinv(rows, 1e-9))
    )
    assert np.abs(x - expected).max() < 1e-13 * max(1.0, condition) ** 2 * max(
        1.0, float(np.abs(expected).max())
    )
    for index in range(rank, size):
        free = np.zeros(size)
        free[index] = 1.0
        ls.apply_q(size, a, result, free)
        assert np.linalg.norm(free) == pytest.approx(1.0, abs=1e-13)
        assert np.abs(rows @ free).max(initial=0.0) < 1e-12 * max(1.0, float(np.abs(rows).max()))
