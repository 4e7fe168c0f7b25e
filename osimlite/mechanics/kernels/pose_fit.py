"""Inverse kinematics: the pose that fits measurements best, frame by frame.

Newton's method in the directions that couplers, equations and ends of ranges leave free (J.
Nocedal, S. Wright, Numerical Optimization, 2006, chapters 10.3, 16.7 and 18.3). Where the Hessian
is not positive definite, the Gauss-Newton approximation replaces it; where that fails, the step is
damped by the Levenberg-Marquardt method. Coordinates that no measurement determines hardly move: of
all poses that fit equally well the nearest is found.

A descent may end in a local minimum. The first frame is therefore fitted from several starts, and
later frames also from starts in which angles are a full turn further or a joint is upside down.
"""

from __future__ import annotations

from math import floor, inf, pi

from osimlite.mechanics.kernels.layout import MODEL, OUTCOME
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy_numbers, is_finite
from osimlite.mechanics.kernels.points import station
from osimlite.mechanics.kernels.pose_constraints import (
    clear_curvature,
    compute_curvature,
    fulfil_constraints,
)
from osimlite.mechanics.kernels.pose_cost import count_equations, evaluate_cost, evaluate_pose
from osimlite.mechanics.kernels.pose_record import FIT, FREEDOM, MARKER_NUMBERS, SENSOR_NUMBERS, Fit
from osimlite.mechanics.kernels.pose_sensors import sensor_rotation
from osimlite.mechanics.kernels.pose_starts import (
    RANGE_MARGIN,
    START_ROTATION_RAD,
    remove_full_turns,
    start_away_from_ends,
    start_full_turn,
    start_inside_ranges,
    start_rotated_subtree,
    start_upside_down,
)
from osimlite.mechanics.kernels.pose_step import (
    find_active_range_ends,
    find_step,
    list_free_coordinates,
    release_range_ends,
    solve_free,
)
from osimlite.mechanics.laws.vectors import store_vector

FITTED = 0.0
"""Status of a frame with the best pose."""
UNSEEN = 1.0
"""Status of a frame without measurements, which has the previous pose."""
UNCONVERGED = 2.0
"""Status of a frame whose search ended before it converged."""
UNASSEMBLED = 3.0
"""Status of a frame with no pose near the previous one that fulfils the constraints."""
COORDINATE_ACCURACY = 1e-9
"""Accuracy of the coordinates, as estimated from the decrease of the steps (rad or m)."""
MAX_STEPS = 200
"""Largest number of steps of a descent."""
MIN_DAMPING = 1e-10
"""Smallest damping of a step."""
MAX_DAMPING = 1e12
"""Largest damping of a step."""
FIRST_DAMPING = 1e-4
"""Damping of the first step that is to be short."""
MIN_DAMPING_IF_FLAT = 1e-7
"""Smallest damping where several poses fit alike."""
MIN_PIVOT = 1e-7
"""Smallest pivot relative to the stiffness with which no poses fit alike."""
SMALL_STEPS = 1e-2
"""Damping of the first step of a descent by small steps."""
GAUSS_NEWTON_STEPS = 8
"""Number of steps after which the complete Hessian is used in any case."""
PREVIOUS_POSES = 2
"""Number of previous poses that are kept for extrapolation."""
STEPS_WITHOUT_CURVATURE = 5
"""Number of steps after which the curvature of the equations is computed, which few poses need."""


def fit_frames(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, p: Ints, c: Floats, v: Floats, frames: Floats,
    results: Floats, count: int,
) -> int:  # fmt: skip
    """Fit poses to several frames, one after the other.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: state with the pose to start from; filled with the last pose.
        f: workspace for the rates of a state.
        p: integers of the fit.
        c: parameters of the fit.
        v: workspace of the fit.
        frames: positions of the markers (m, 3) in ground, rotation matrices of the sensors (k, 3,
            3), values of the goals, and prescribed values, of each frame.
        results: filled with the values of all degrees of freedom (n,), the fitted positions of the
            markers (m, 3) in ground, the rotation vectors of the sensors from their measurements
            (k, 3), the cost, the number of steps, and the status, of each frame (count, n + 3 m + 3
            k + 3).
        count: number of frames.

    Returns:
        `OUTCOME.OK`; whether a fit converged is the status in `results`.
    """
    m = Fit(model, reals, data, f, p, c, v)
    size, markers, sensors = model[MODEL.DOFS], p[FIT.MARKERS], p[FIT.SENSORS]
    width = size + 3 * (markers + sensors) + 3
    input_size = 3 * markers + 9 * sensors + p[FIT.GOALS] + p[FIT.PRESCRIBED]
    for number in range(count):
        result = at(results, width * number)
        copy_numbers(input_size, at(frames, input_size * number), at(v, p[FIT.MEASURED]))
        value, steps, status = fit_frame(m, y)
        copy_numbers(size, y, result)
        for k in range(markers):
            position = station(
                model,
                data,
                p[p[FIT.MARKER_AT] + k],
                (c[MARKER_NUMBERS * k], c[MARKER_NUMBERS * k + 1], c[MARKER_NUMBERS * k + 2]),
            )
            store_vector(result, size + 3 * k, position)
        for k in range(sensors):
            store_vector(result, size + 3 * (markers + k), sensor_rotation(m, k))
        end = at(result, size + 3 * (markers + sensors))
        end[0], end[1], end[2] = value, float(steps), status
    return OUTCOME.OK


def fit_frame(m: Fit, y: Floats) -> tuple[float, int, float]:
    """Move a pose to the best fit of a frame.

    Args:
        m: inputs and workspace of the fit.
        y: state; changed.

    Returns:
        Cost, number of steps, and status.
    """
    v = m.v
    p = m.p
    size = m.model[MODEL.DOFS]
    history = at(v, p[FIT.HISTORY])
    previous_count = int(history[0])
    last_pose = at(history, 1)
    trial = at(v, p[FIT.TRIAL])
    has_measurements = compute_weights(m)
    if previous_count > 0:
        copy_numbers(size, last_pose, y)
    if not fulfil_constraints(m, y):
        evaluate_pose(m, y)
        return inf, 0, UNASSEMBLED
    if not has_measurements:
        evaluate_pose(m, y)
        return 0.0, 0, UNSEEN
    update_measured_pattern(m, y)
    value = inf
    is_vague = v[p[FIT.PATTERN] + p[FIT.MARKERS] + p[FIT.SENSORS] + p[FIT.GOALS]] > 0.0
    # Two previous poses allow linear extrapolation of the motion, unless poses fit alike.
    if previous_count > 1 and not is_vague:
        earlier_pose = at(last_pose, size)
        for k in range(size):
            trial[k] = (
                y[k]
                if p[p[FIT.RESOLVED_AT] + k] == FREEDOM.UNDETERMINED
                else 2.0 * last_pose[k] - earlier_pose[k]
            )
        if fulfil_constraints(m, trial):
            value = evaluate_cost(m, trial)
    # If the extrapolated pose costs much more than the previous one, compare it with that.
    if not value < 4.0 * history[1 + PREVIOUS_POSES * size] + 1e-8:
        last_cost = evaluate_cost(m, y)
        if not value < last_cost:
            copy_numbers(size, y, trial)
        value = last_cost if not value < last_cost else evaluate_cost(m, trial)
    lightest = MIN_DAMPING_IF_FLAT if is_vague else MIN_DAMPING
    start = at(history, 2 + PREVIOUS_POSES * size)
    if previous_count == 0:
        copy_numbers(size, trial, last_pose)
    copy_numbers(size, trial, start)
    value, steps, status = descend_to_minimum(m, trial, y, value, lightest, lightest)
    if previous_count == 0:
        # From far away a descent may end in several minima. Small steps find others than large
        # ones, and starts inside the ranges keep coordinates from being held at their ends early.
        value, added_steps, status = descend_from_start(
            m, start, y, value, status, FIRST_DAMPING, lightest
        )
        steps += added_steps
        for inwards in range(2):
            start_away_from_ends(m, last_pose, start, 2.0 * RANGE_MARGIN * (1 + inwards))
            value, added_steps, status = descend_from_start(
                m, start, y, value, status, SMALL_STEPS, lightest
            )
            steps += added_steps
        for number in range(2 * size):
            if start_rotated_subtree(
                m,
                last_pose,
                start,
                number // 2,
                START_ROTATION_RAD if number % 2 == 0 else -START_ROTATION_RAD,
            ):
                value, added_steps, status = descend_from_start(
                    m, start, y, value, status, SMALL_STEPS, lightest
                )
                steps += added_steps
    # Coordinates held at ends of their ranges may have left the way to a better minimum.
    if start_inside_ranges(m, y, start):
        value, added_steps, status = descend_from_start(
            m, start, y, value, status, lightest, lightest
        )
        steps += added_steps
    value, added_steps, status = try_opposite_limits(m, start, y, value, status, lightest)
    steps += added_steps
    for number in range(size):
        if start_upside_down(m, y, start, number):
            upright = value
            value, added_steps, status = descend_from_start(
                m, start, y, value, status, SMALL_STEPS, lightest
            )
            steps += added_steps
            # A pose that was better upside down may need other full turns, too.
            if value < upright:
                value, added_steps, status = try_opposite_limits(
                    m, start, y, value, status, lightest
                )
                steps += added_steps
    # Of poses that fit alike, the first frame reports the one without full turns.
    if previous_count == 0 and remove_full_turns(m, y, last_pose, start, value):
        value, added_steps, status = descend_to_minimum(
            m, start, y, evaluate_cost(m, start), lightest, lightest
        )
        steps += added_steps
    release_range_ends(m)
    earlier_pose = at(last_pose, size)
    for k in range(size):
        # A full turn, from one end of a range to the other, is no motion to extrapolate.
        earlier_pose[k] = last_pose[k] + 2.0 * pi * floor((y[k] - last_pose[k]) / (2.0 * pi) + 0.5)
    copy_numbers(size, y, last_pose)
    history[0], history[1 + PREVIOUS_POSES * size] = (
        min(previous_count + 1.0, float(PREVIOUS_POSES)),
        value,
    )
    evaluate_pose(m, y)
    return value, steps, status


def update_measured_pattern(m: Fit, y: Floats) -> None:
    """Find out whether poses fit alike and which coordinates are idle.

    This is done if other markers, sensors or goals are measured than in the frame before. A
    coordinate is idle if it moves nothing that is measured.

    Args:
        m: inputs and workspace of the fit.
        y: state of a pose.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    count = p[FIT.MARKERS] + p[FIT.SENSORS] + p[FIT.GOALS]
    weights = at(v, p[FIT.WEIGHTS])
    pattern = at(v, p[FIT.PATTERN])
    is_new = False
    for k in range(count):
        is_new = is_new or weights[k] != pattern[k]
        pattern[k] = weights[k]
    if not is_new and at(v, p[FIT.HISTORY])[0] > 0.0:
        return
    resolved = at(p, p[FIT.RESOLVED_AT])
    for k in range(size):
        if resolved[k] == FREEDOM.UNDETERMINED:
            resolved[k] = FREEDOM.VARIABLE
    evaluate_cost(m, y)
    for k in range(size):
        if (
            resolved[k] == FREEDOM.VARIABLE
            and v[p[FIT.STIFFNESS] + size * k + k] == 0.0
            and v[p[FIT.SLOPE] + k] == 0.0
        ):
            resolved[k] = FREEDOM.UNDETERMINED
    for k in range(size):
        v[p[FIT.STEP] + k] = 0.0
    # A Gauss-Newton matrix that is singular leaves some direction undetermined.
    pattern[count] = (
        1.0 if solve_free(m, list_free_coordinates(m), MIN_DAMPING, 0.0, MIN_PIVOT) < 0 else 0.0
    )


def descend_from_start(
    m: Fit, start: Floats, y: Floats, value: float, status: float, damping: float, lightest: float
) -> tuple[float, int, float]:
    """Descend from another start, and keep the better pose.

    Args:
        m: inputs and workspace of the fit.
        start: pose to start from (n,); overwritten.
        y: best pose so far (n,); replaced if the other one is better.
        value: cost of the best pose so far.
        status: status of the best pose so far.
        damping: damping of the first step.
        lightest: smallest damping.

    Returns:
        Cost, number of steps, and status of the better pose.
    """
    size = m.model[MODEL.DOFS]
    best = at(start, size)
    trial = at(m.v, m.p[FIT.TRIAL])
    copy_numbers(size, y, best)
    copy_numbers(size, start, trial)
    release_range_ends(m)
    if not fulfil_constraints(m, trial):
        return value, 0, status
    new, steps, result = descend_to_minimum(m, trial, y, evaluate_cost(m, trial), damping, lightest)
    # A better pose must be clearly better, so that rounding does not choose between equal ones.
    if new < value * (1.0 - 1e-7) - 1e-20:
        return new, steps, result
    copy_numbers(size, best, y)
    return value, steps, status


def try_opposite_limits(
    m: Fit, start: Floats, y: Floats, value: float, status: float, lightest: float
) -> tuple[float, int, float]:
    """Try each angle at an end of its range at the other end, and keep the best pose.

    Args:
        m: inputs and workspace of the fit.
        start: workspace for a pose (n,).
        y: best pose so far (n,); replaced by a better one.
        value: cost of the best pose so far.
        status: status of the best pose so far.
        lightest: smallest damping.

    Returns:
        Cost, number of steps, and status of the best pose.
    """
    steps = 0
    for number in range(m.model[MODEL.DOFS]):
        if start_full_turn(m, y, start, number):
            value, added_steps, status = descend_from_start(
                m, start, y, value, status, lightest, lightest
            )
            steps += added_steps
    return value, steps, status


def compute_weights(m: Fit) -> bool:
    """Compute the weights of this frame, normalized over the measured markers and sensors.

    Args:
        m: inputs and workspace of the fit.

    Returns:
        Whether anything is measured.
    """
    p, c, v = m.p, m.c, m.v
    measured, weights = at(v, p[FIT.MEASURED]), at(v, p[FIT.WEIGHTS])
    markers, sensors = p[FIT.MARKERS], p[FIT.SENSORS]
    numbers, rotations = at(c, MARKER_NUMBERS * markers), at(measured, 3 * markers)
    for k in range(markers):
        # Missing measurements are NaN.
        weights[k] = c[MARKER_NUMBERS * k + 3] if is_finite(3, at(measured, 3 * k)) else 0.0
    for k in range(sensors):
        weights[markers + k] = (
            numbers[SENSOR_NUMBERS * k + 9] if is_finite(9, at(rotations, 9 * k)) else 0.0
        )
    # OpenSim normalizes the weights of markers and sensors, each over those that are measured.
    has_measurements = normalize_weights(markers, weights)
    has_measurements = normalize_weights(sensors, at(weights, markers)) or has_measurements
    numbers = at(numbers, SENSOR_NUMBERS * sensors)
    goals = at(measured, 3 * markers + 9 * sensors)
    for k in range(p[FIT.GOALS]):
        weights[markers + sensors + k] = numbers[k] if is_finite(1, at(goals, k)) else 0.0
        has_measurements = has_measurements or weights[markers + sensors + k] > 0.0
    return has_measurements


def normalize_weights(count: int, weights: Floats) -> bool:
    """Normalize weights to a sum of one.

    Args:
        count: number of weights.
        weights: weights (count,); changed.

    Returns:
        Whether any weight is positive.
    """
    total = 0.0
    for k in range(count):
        total += weights[k]
    for k in range(count):
        weights[k] = weights[k] / total if total > 0.0 else 0.0
    return total > 0.0


def descend_to_minimum(
    m: Fit, start: Floats, y: Floats, value: float, damping: float, lightest: float
) -> tuple[float, int, float]:
    """Descend from a pose whose cost and derivatives are known to the best one nearby.

    Args:
        m: inputs and workspace of the fit.
        start: pose to start from (n,), whose cost and derivatives are known; changed.
        y: filled with the best pose (n,); coordinates at ends of their ranges stay marked.
        value: cost of the start.
        damping: damping of the first step.
        lightest: smallest damping.

    Returns:
        Cost, number of steps, and status.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    step = at(v, p[FIT.STEP])
    previous_length = inf
    uses_hessian = damping == MIN_DAMPING
    status = UNCONVERGED
    copy_numbers(size, start, y)
    steps = 0
    clear_curvature(m)
    while steps < MAX_STEPS:
        steps += 1
        if count_equations(m) > 0 and steps % STEPS_WITHOUT_CURVATURE == 0:
            compute_curvature(m, y)
            evaluate_cost(m, y)
        find_active_range_ends(m, y)
        # Without a convex model, add damping; the Gauss-Newton model needs little.
        if not find_step(m, y, damping, uses_hessian) and not find_step(m, y, damping, False):
            damping = max(10.0 * damping, FIRST_DAMPING)
            if damping > MAX_DAMPING:
                break
            continue
        length = 0.0
        for k in range(size):
            length = max(length, abs(step[k]))
            start[k] = y[k] + step[k]
        is_assembled = fulfil_constraints(m, start)
        new = evaluate_cost(m, start) if is_assembled else inf
        # For tiny steps rounding hides whether the cost decreases.
        if new <= value or (length <= 1e-6 and new <= value * (1.0 + 1e-9) + 1e-24):
            copy_numbers(size, start, y)
            # Convergence is judged by the ratio of successive steps: the remaining distance is
            # estimated by a geometric series.
            value = new
            shrinking = length / previous_length if previous_length < inf else 1.0
            if length <= COORDINATE_ACCURACY or (
                shrinking < 0.5 and length * shrinking <= COORDINATE_ACCURACY * (1.0 - shrinking)
            ):
                status = FITTED
                break
            previous_length = length if damping == lightest else inf
            damping = max(0.1 * damping, lightest)
            # Where poses fit alike, use the complete Hessian last: far from the minimum it is
            # misleading.
            uses_hessian = steps >= GAUSS_NEWTON_STEPS or (
                damping < FIRST_DAMPING and lightest == MIN_DAMPING
            )
        else:
            if length <= 10.0 * COORDINATE_ACCURACY:
                # No better pose can be distinguished from this one.
                status = FITTED
                break
            damping = max(10.0 * damping, FIRST_DAMPING)
            uses_hessian = steps >= GAUSS_NEWTON_STEPS
            previous_length = inf
            if damping > MAX_DAMPING:
                break
            evaluate_cost(m, y)
    return value, steps, status
