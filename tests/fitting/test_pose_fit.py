"""Tests of pose fitting: derivatives of the cost, minima, constraints, ranges and missing measurements."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import osimlite
from osimlite import Body, Model, PhysicalOffsetFrame, PinJoint
from osimlite.errors import SimulationError
from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import CoordinateTarget, MarkerTarget, SensorTarget
from osimlite.mechanics.kernels import pose_cost, pose_record
from osimlite.mechanics.kernels.pose_fit import compute_weights
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism, StationPlacement
from osimlite.mechanics.multibody.spatial import make_transform, rotation_xyz
from osimlite.simulation.engines.linking import MACHINE_CODE, PYTHON_CODE
from tests.fitting.support import cost_of, places_at
from tests.mechanics.multibody.strategies import Case, cases, constraint_of
from tests.simple_models import make_marked_body
from tests.suite import choose

ROUND = "ConstantCurvatureJoint"
"""Joint whose coordinates interact nonlinearly; the solver's Newton matrix neglects these second derivatives."""


def rotation_class() -> Any:
    """Return SciPy's class of rotations, which takes too long to import while tests are collected."""
    from scipy.spatial.transform import Rotation  # type: ignore[import-untyped]

    return Rotation


def markers_of(mechanism: Mechanism, rng: np.random.Generator, each: int = 3) -> list[MarkerTarget]:
    """Return markers at random positions on every body.

    Args:
        mechanism: the mechanism.
        rng: source of random numbers.
        each: number of markers per body.
    """
    return [
        MarkerTarget(
            StationPlacement(body, rng.uniform(-0.3, 0.3, 3)), float(rng.uniform(0.2, 5.0))
        )
        for body in range(len(mechanism.bodies))
        for _ in range(each)
    ]


def derivatives(fit: PoseFit, frame: Any, q: Any) -> tuple[float, Any, Any]:
    """Evaluate the cost of a fit at a pose.

    Args:
        fit: the fit.
        frame: measurements of one frame.
        q: coordinates of the pose.

    Returns:
        Cost, gradient (n,) and Hessian (n, n), in the order of the fit's coordinates.
    """
    system, shape = fit.system, fit.layout
    size = len(fit.order)
    m = pose_record.Fit(
        system.program.ints,
        system.numbers,
        system.work_vector,
        np.zeros(2 * size),
        shape.ints,
        shape.numbers,
        shape.work,
    )
    m.v[m.p[pose_record.FIT.MEASURED] :][: fit.width] = frame
    assert compute_weights(m)
    y = np.zeros(2 * size)
    y[:size] = q[fit.order]
    value = pose_cost.evaluate_cost(m, y)
    stiffness, bend = (
        m.v[m.p[part] :][: size * size].reshape(size, size)
        for part in (pose_record.FIT.STIFFNESS, pose_record.FIT.BEND)
    )
    return value, m.v[m.p[pose_record.FIT.SLOPE] :][:size].copy(), stiffness + bend


@given(cases(max_bodies=4), st.integers(0, 99))
@settings(max_examples=25)
def test_the_derivatives_are_those_of_the_cost(case: Case, seed: int) -> None:
    """Compare gradient and Hessian with differences, for markers, a goal and a marker that is not visible."""
    mechanism, rng = case.mechanism, np.random.default_rng(seed)
    if not mechanism.coordinates:
        return
    markers = markers_of(mechanism, rng, 2)
    fit = PoseFit(mechanism, markers, goals=[CoordinateTarget(0, 0.3)], code=PYTHON_CODE)
    measured = places_at(mechanism, markers, case.q) + rng.normal(0.0, 0.1, (len(markers), 3))
    measured[-1, 1] = np.nan
    frame = [*measured.ravel(), 0.2]
    value, slope, second = derivatives(fit, frame, case.q)
    assert value == pytest.approx(
        cost_of(mechanism, markers, measured, case.q) + 0.15 * (case.q[0] - 0.2) ** 2, rel=1e-12
    )
    for number, place in enumerate(fit.order):
        step = np.zeros(len(case.q))
        step[place] = 1e-5
        ahead, behind = (derivatives(fit, frame, case.q + sign * step) for sign in (1.0, -1.0))
        assert slope[number] == pytest.approx((ahead[0] - behind[0]) / 2e-5, abs=2e-9)
        if not any(body.mobilizer.joint_type == ROUND for body in mechanism.bodies):
            assert second[number] == pytest.approx((ahead[1] - behind[1]) / 2e-5, abs=2e-8)


def sensors_of(mechanism: Mechanism, rng: np.random.Generator) -> list[SensorTarget]:
    """Return a sensor on every body and one in ground, with random orientations and weights."""
    return [
        SensorTarget(
            FramePlacement(body, make_transform(rotation_xyz(rng.uniform(-3.0, 3.0, 3)))),
            float(rng.uniform(0.2, 5.0)),
        )
        for body in (-1, *range(len(mechanism.bodies)))
    ]


def orientations_at(mechanism: Mechanism, sensors: list[SensorTarget], q: Any) -> Any:
    """Return the orientations of the sensors (k, 3, 3) at a pose."""
    state = mechanism.at(q)
    return np.array(
        [
            (state.transform(sensor.frame.body) @ sensor.frame.transform)[:3, :3]
            for sensor in sensors
        ]
    )


def turns_between(wanted: Any, found: Any) -> Any:
    """Return the rotation vectors (k, 3) in ground that rotate `wanted` into `found` (rad)."""
    return rotation_class().from_matrix(found @ np.swapaxes(wanted, -1, -2)).as_rotvec()


@given(cases(max_bodies=4), st.integers(0, 99), st.floats(0.0, 2.9))
@settings(max_examples=25)
def test_the_derivatives_of_angles_are_those_of_the_cost(case: Case, seed: int, far: float) -> None:
    """Compare gradient and Hessian with differences, for sensors with large errors and a sensor without data."""
    mechanism, rng = case.mechanism, np.random.default_rng(seed)
    if not mechanism.coordinates:
        return
    sensors = sensors_of(mechanism, rng)
    axes = rng.normal(size=(len(sensors), 3))
    off = (
        rotation_class().from_rotvec(far * axes / np.linalg.norm(axes, axis=1)[:, None]).as_matrix()
    )
    measured = off @ orientations_at(mechanism, sensors, case.q)
    measured[-1, 1, 1] = np.nan if len(sensors) > 2 else measured[-1, 1, 1]
    fit = PoseFit(mechanism, [], sensors, code=PYTHON_CODE)
    frame = measured.ravel()
    value, slope, second = derivatives(fit, frame, case.q)
    # OpenSim's cost is half the weighted mean of the squared angles.
    assert value == pytest.approx(0.5 * far**2, rel=1e-9, abs=1e-15)
    for number, place in enumerate(fit.order):
        step = np.zeros(len(case.q))
        step[place] = 1e-5
        ahead, behind = (derivatives(fit, frame, case.q + sign * step) for sign in (1.0, -1.0))
        assert slope[number] == pytest.approx((ahead[0] - behind[0]) / 2e-5, abs=1e-8)
        if not any(body.mobilizer.joint_type == ROUND for body in mechanism.bodies):
            assert second[number] == pytest.approx(
                (ahead[1] - behind[1]) / 2e-5, abs=1e-7, rel=1e-6
            )


@given(
    cases(max_bodies=4),
    st.integers(0, 99),
    st.sampled_from(["", "coupler", "point", "distance", "line", "weld"]),
)
@settings(max_examples=choose(20, 40))
def test_a_pose_is_a_minimum_where_the_constraints_hold(case: Case, seed: int, kind: str) -> None:
    """No direction that the constraints permit decreases the cost."""
    mechanism, rng = case.mechanism, np.random.default_rng(seed)
    if not mechanism.coordinates or (kind and len(mechanism.bodies) < 2):
        return
    if kind:
        mechanism = replace(mechanism, constraints=(constraint_of(kind, mechanism, rng),))
    try:
        start = mechanism.assemble(0.3 * case.q)
    except SimulationError:
        return
    markers = markers_of(mechanism, rng)
    measured = places_at(mechanism, markers, start) + rng.normal(0.0, 0.02, (len(markers), 3))
    fit = PoseFit(mechanism, markers)
    try:
        poses = fit.fit_frames(measured.reshape(1, -1), q=start)
    except SimulationError:
        assert kind not in ("", "coupler")
        return
    assert not poses.unsettled
    q = poses.values[0]
    assert poses.costs[0] == pytest.approx(
        cost_of(mechanism, markers, measured, q), rel=1e-9, abs=1e-18
    )
    assert poses.costs[0] <= cost_of(mechanism, markers, measured, start) * (1.0 + 1e-12)
    assert poses.places[0] == pytest.approx(places_at(mechanism, markers, q), abs=1e-12)
    state = mechanism.at(q)
    rows = np.zeros((0, len(q)))
    for item in mechanism.constraints:
        assert np.abs(item.position_errors(state)).max(initial=0.0) < 1e-9
        count = len(item.position_errors(state))
        rows = np.vstack(
            [
                rows,
                item.velocity_equations(state)[0][:count] @ np.linalg.inv(mechanism.rate_matrix(q)),
            ]
        )
    slope = np.array(
        [
            (
                cost_of(mechanism, markers, measured, q + e)
                - cost_of(mechanism, markers, measured, q - e)
            )
            / 2e-6
            for e in 1e-6 * np.eye(len(q))
        ]
    )
    across = np.linalg.lstsq(rows.T, slope, rcond=1e-10)[0] if len(rows) else np.zeros(0)
    assert slope - rows.T @ across == pytest.approx(0.0, abs=3e-8)


def test_python_and_machine_code_find_the_same_poses() -> None:
    """Python and machine code are the same kernels."""
    case = _free_body()
    markers = markers_of(case, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    motion = [places_at(case, markers, 0.3 * np.sin(0.1 * t + np.arange(6))) for t in range(4)]
    frames = np.array(motion).reshape(4, -1) + rng.normal(0.0, 0.01, (4, 3 * len(markers)))
    result = [
        PoseFit(case, markers, code=code).fit_frames(frames, q=np.zeros(6)).values
        for code in (MACHINE_CODE, PYTHON_CODE)
    ]
    assert result[0] == pytest.approx(result[1], abs=1e-10)


def _free_body() -> Mechanism:
    """Return a mechanism of one free body."""
    return osimlite.mechanism(make_marked_body({}))


def _pendulum(**changes: Any) -> Mechanism:
    """Return a double pendulum with links of one metre; `changes` apply to the second coordinate."""
    model = Model(name="two")
    last: Any = model.ground
    for number in range(2):
        body = Body(name=f"b{number}", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
        model.add(body)
        model.add(PinJoint(name=f"j{number}", socket_parent_frame=last, socket_child_frame=body))
        last = model.add(
            PhysicalOffsetFrame(
                name=f"end{number}",
                socket_parent=f"/bodyset/b{number}",
                translation=(1.0, 0.0, 0.0),
            )
        )
    mechanism = osimlite.mechanism(model)
    infos = (mechanism.coordinates[0], replace(mechanism.coordinates[1], **changes))
    return replace(mechanism, coordinates=infos)


ARM = [
    MarkerTarget(StationPlacement(1, np.array(point)))
    for point in ((1.0, 0.0, 0.0), (0.5, 0.5, 0.0))
]


def test_a_clamped_coordinate_stays_in_its_range() -> None:
    """The other coordinate minimizes the cost within this limit."""
    free, clamped = _pendulum(), _pendulum(clamped=True, range=(-0.5, 0.25))
    markers = [*ARM, MarkerTarget(StationPlacement(0, np.array((1.0, 0.0, 0.0))))]
    measured = places_at(free, markers, np.array((0.3, 0.9))).reshape(1, -1)
    assert PoseFit(free, markers).fit_frames(measured).values[0] == pytest.approx(
        (0.3, 0.9), abs=1e-9
    )
    poses = PoseFit(clamped, markers).fit_frames(measured)
    assert poses.values[0, 1] == 0.25 and 0.3 < poses.values[0, 0] < 0.9
    ahead, here, behind = (
        cost_of(free, markers, measured.reshape(-1, 3), poses.values[0] + (step, 0.0))
        for step in (1e-4, 0.0, -1e-4)
    )
    assert here < min(ahead, behind)


def test_a_range_of_what_depends_bounds_what_it_depends_on() -> None:
    """The dependent coordinate of a coupler is clamped: the independent one stops where the dependent one ends."""
    mechanism = _pendulum(clamped=True, range=(-0.4, 0.4))
    mechanism = replace(mechanism, constraints=(Coupler(1, (0,), f.Linear(2.0, 0.1)),))
    measured = places_at(_pendulum(), ARM, np.array((0.5, 1.1))).reshape(1, -1)
    assert PoseFit(mechanism, ARM).fit_frames(measured).values[0] == pytest.approx(
        (0.15, 0.4), abs=1e-9
    )


def test_locked_and_prescribed_coordinates_are_held() -> None:
    """A locked coordinate keeps its default, and a prescribed one follows its function of time."""
    measured = places_at(_pendulum(), ARM, np.array((0.3, 0.9))).reshape(1, -1)
    locked = PoseFit(_pendulum(locked=True, default_value=0.7), ARM).fit_frames(measured)
    assert locked.values[0, 1] == 0.7
    driven = PoseFit(_pendulum(prescribed=f.Linear(1.0, 0.2)), ARM).fit_frames(
        np.repeat(measured, 2, 0), [0.0, 0.5]
    )
    assert driven.values[:, 1] == pytest.approx((0.2, 0.7), abs=1e-12)


def test_goals_pull_coordinates() -> None:
    """A goal of a locked coordinate has no effect, and NaN means no goal."""
    mechanism = _pendulum()
    measured = places_at(mechanism, ARM, np.array((0.3, 0.9))).reshape(-1)
    fit = PoseFit(mechanism, ARM, goals=[CoordinateTarget(1, 1e6)])
    values = fit.fit_frames(np.array([[*measured, 0.1], [*measured, np.nan]])).values
    assert values[0, 1] == pytest.approx(0.1, abs=1e-5) and values[1] == pytest.approx(
        (0.3, 0.9), abs=1e-9
    )
    held = PoseFit(_pendulum(locked=True, default_value=0.7), ARM, goals=[CoordinateTarget(1, 1e6)])
    assert held.fit_frames(np.array([[*measured, 0.1]])).values[0, 1] == 0.7


def test_what_is_not_seen_leaves_the_pose_as_it_was() -> None:
    """A frame without data keeps the previous pose; with one marker, the nearest pose that fits it is found."""
    mechanism = _free_body()
    markers = markers_of(mechanism, np.random.default_rng(0))
    pose = np.array((0.3, -0.2, 0.1, 0.5, 0.6, 0.7))
    places = places_at(mechanism, markers, pose).reshape(1, -1)
    frames = np.repeat(places, 4, axis=0)
    frames[1] = np.nan
    frames[2, 3:] = np.nan
    frames[2, :3] += 0.01
    poses = PoseFit(mechanism, markers).fit_frames(frames, q=np.zeros(6))
    assert poses.unseen == (1,)
    assert poses.values[[0, 1, 3]] == pytest.approx(np.tile(pose, (3, 1)), abs=1e-8)
    assert poses.places[2, 0] == pytest.approx(frames[2, :3], abs=1e-7)
    assert np.abs(poses.values[2] - pose).max() < 0.05


def test_nothing_seen_from_the_beginning_is_the_start() -> None:
    """All frames are without data."""
    poses = PoseFit(_free_body(), markers_of(_free_body(), np.random.default_rng(0))).fit_frames(
        np.full((3, 9), np.nan), q=np.arange(6.0)
    )
    assert poses.unseen == (0, 1, 2) and (poses.values == np.arange(6.0)).all()


@pytest.mark.parametrize("far", [0.0, 1.5, 3.0])
def test_sensors_turn_bodies(far: float) -> None:
    """Rotations are fitted exactly where that is possible, from near and far starting poses."""
    mechanism = _free_body()
    frame = make_transform(rotation_xyz(np.array((0.2, 0.5, -0.3))), (0.1, 0.0, 0.0))
    pose = np.array((0.4 + far, 0.3, 0.2, 0.0, 0.0, 0.0))
    wanted = mechanism.at(pose).rotations[0] @ frame[:3, :3]
    fit = PoseFit(mechanism, [], [SensorTarget(FramePlacement(0, frame))])
    poses = fit.fit_frames(wanted.reshape(1, -1), q=np.zeros(6))
    assert poses.costs[0] == pytest.approx(0.0, abs=1e-16)
    assert mechanism.at(poses.values[0]).rotations[0] @ frame[:3, :3] == pytest.approx(
        wanted, abs=1e-8
    )


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, -0.8, 0.0), (-0.6, 0.0, 0.8)]
)
@pytest.mark.parametrize("short", [0.0, 1e-13, 1e-7, 1e-3])
def test_a_sensor_that_is_half_a_turn_off_is_found(
    axis: tuple[float, float, float], short: float
) -> None:
    """At an error of half a turn the gradient vanishes or is ambiguous, but the pose is no minimum."""
    mechanism = _free_body()
    sensor = SensorTarget(FramePlacement(0, np.eye(4)))
    wanted = rotation_class().from_rotvec((np.pi - short) * np.array(axis)).as_matrix()
    value, _, _ = derivatives(
        PoseFit(mechanism, [], [sensor], code=PYTHON_CODE), wanted.ravel(), np.zeros(6)
    )
    assert value == pytest.approx(0.5 * (np.pi - short) ** 2, rel=1e-12)
    poses = PoseFit(mechanism, [], [sensor]).fit_frames(wanted.reshape(1, -1), q=np.zeros(6))
    assert orientations_at(mechanism, [sensor], poses.values[0])[0] == pytest.approx(
        wanted, abs=1e-8
    )


def test_markers_and_sensors_count_as_shares() -> None:
    """The cost is the sum of the means over markers and over sensors; remaining rotations are reported."""
    mechanism, rng = _free_body(), np.random.default_rng(5)
    markers, sensors = (
        markers_of(mechanism, rng),
        [SensorTarget(FramePlacement(0, np.eye(4)), 3.0) for _ in range(3)],
    )
    q = np.array((0.3, 0.2, -0.1, 0.4, 0.5, 0.6))
    measured = places_at(mechanism, markers, q) + rng.normal(0.0, 0.02, (3, 3))
    noise = rotation_class().from_rotvec(rng.normal(0.0, 0.1, (3, 3))).as_matrix()
    rotations = noise @ orientations_at(mechanism, sensors, q)
    rotations[1] = np.nan
    poses = PoseFit(mechanism, markers, sensors).fit_frames(
        np.concatenate([measured.ravel(), rotations.ravel()])[None], q=q
    )
    result = poses.values[0]
    turns = turns_between(rotations[[0, 2]], orientations_at(mechanism, sensors, result)[[0, 2]])
    angles = np.sum(turns**2, axis=1)
    assert poses.costs[0] == pytest.approx(
        cost_of(mechanism, markers, measured, result) + 0.25 * angles.sum()
    )
    assert (
        poses.turns[0, [0, 2]] == pytest.approx(turns, abs=1e-12)
        and np.isnan(poses.turns[0, 1]).all()
    )


def test_a_jump_is_followed() -> None:
    """Positions that jump from one frame to the next are fitted in each frame."""
    mechanism = _free_body()
    markers = markers_of(mechanism, np.random.default_rng(3))
    poses = np.array(
        [
            (0.1, 0.0, 0.0, 0.0, 0.0, 0.0),
            (0.9, 0.5, -0.4, 2.0, 3.0, -4.0),
            (0.1, 0.0, 0.0, 0.0, 0.0, 0.0),
        ]
    )
    frames = np.array([places_at(mechanism, markers, q) for q in poses]).reshape(3, -1)
    assert PoseFit(mechanism, markers).fit_frames(frames, q=np.zeros(6)).values == pytest.approx(
        poses, abs=1e-8
    )


@pytest.mark.parametrize("goal", [False, True])
def test_the_first_pose_has_no_whole_turns(goal: bool) -> None:
    """For any orientation of the body, the angles stay within half a turn of the starting pose."""
    model, body = (
        Model(name="arm"),
        Body(name="b", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)),
    )
    model.add(body)
    model.add(
        osimlite.GimbalJoint(name="j", socket_parent_frame=model.ground, socket_child_frame=body)
    )
    mechanism, rng = osimlite.mechanism(model), np.random.default_rng(0)
    markers = markers_of(mechanism, rng)
    fit = PoseFit(mechanism, markers, goals=[CoordinateTarget(0, 1e-4)] if goal else [])
    for _ in range(60):
        q = rng.uniform(-3.0, 3.0, 3)
        poses = fit.fit_frames(
            np.array([[*places_at(mechanism, markers, q).ravel(), 0.0]]), q=np.zeros(3)
        )
        assert (
            np.abs(poses.values).max() <= np.pi + (0.05 if goal else 1e-8) and not poses.unsettled
        )
        assert poses.costs[0] <= (0.5e-4 * np.pi**2 if goal else 1e-20)


def test_a_subject_may_face_anywhere() -> None:
    """A range that ends just before half a turn does not stop the search for the first pose."""
    free = _free_body()
    infos = tuple(replace(info, clamped=True, range=(-3.14, 3.14)) for info in free.coordinates[:3])
    mechanism = replace(free, coordinates=(*infos, *free.coordinates[3:]))
    markers = markers_of(mechanism, np.random.default_rng(0))
    fit = PoseFit(mechanism, markers)
    for heading in np.linspace(-3.0, 3.0, 25):
        q = np.array((0.1, heading, -0.2, 2.0, 1.0, -1.0))
        poses = fit.fit_frames(places_at(mechanism, markers, q).reshape(1, -1), q=np.zeros(6))
        assert poses.costs[0] < 1e-18, heading
