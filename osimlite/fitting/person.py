"""Model that fits a person: sizes of segments, positions of markers and poses from any trials.

The objective is the sum of the squared marker distances over selected frames, minus the log prior
of sizes and offsets (a maximum a posteriori estimate). Variable projection (G. Golub and V.
Pereyra, Inverse Problems 19, 2003) eliminates the poses: each frame has its best pose, and a
Gauss-Newton step changes sizes and offsets alone, with normal equations from which the poses are
eliminated frame by frame.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from math import log, sqrt

import numpy as np

from osimlite.base.progress import mute_progress, report_progress, report_stage
from osimlite.base.records import dataclass
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import compute_first_pose, find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.marker_data import MarkerSource as Markers
from osimlite.fitting.scaling import scale_model
from osimlite.fitting.segments import Segments
from osimlite.fitting.selected_frames import STATIC_TRIAL, SelectedFrames
from osimlite.fitting.shape import ScalableMarkers, ScaledPoseFit
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model

SKIN_MOTION_M = 0.01
"""Standard deviation of markers from their positions on rigid segments, m: skin moves."""
INDEPENDENT_FRAMES = 20.0
"""Number of independent frames that all frames are worth: skin moves alike within a movement."""
FIRST_SIZE_DEVIATION = 0.3
"""Standard deviation of the first segment's size from the size in the model."""
NEIGHBOUR_DEVIATION = 0.1
"""Standard deviation of the difference between the sizes of neighbouring segments."""
AXIS_DEVIATION = 0.05
"""Standard deviation of the factors of one segment from their mean."""
MARKER_OFFSET_M = 0.01
"""Scale of the prior of marker offsets on bones, m.

Markers of clusters may be anywhere. Offsets therefore have a Cauchy distribution, which hardly
pulls on distant markers.
"""
MIN_FACTOR = 0.4
"""Smallest scale factor."""
MAX_FACTOR = 2.5
"""Largest scale factor."""
MAX_STEPS = 60
"""Largest number of Gauss-Newton steps in one search."""
OUTLIER_ROUNDS = 3
"""Largest number of searches for markers that were taken for others."""
OUTLIER_STEP = 1e-2
"""Largest change of a factor or offset (m) by the last step before outliers are excluded."""
FINAL_STEP = 1e-4
"""Largest change of a factor or offset (m) by the last step at the end."""


@dataclass(frozen=True, eq=False)
class Person:
    """Model that was fitted to a person.

    Attributes:
        model: scaled model, with the markers at their positions on the person.
        factors: scale factors of each body along its axes, by name.
        uncertain: standard deviations of the factors, as far as the assumptions about skin hold.
        offsets: offsets of movable markers from the scaled model (3,), m, along the axes of their
            bodies.
        trials: name of the trial of each selected frame.
        times: times of the selected frames (t,), s.
        markers: names of the m markers.
        measured: measured positions (t, m, 3), m.
        before: positions in the best poses of the original model (t, m, 3), m.
        after: positions in the best poses of the fitted model (t, m, 3), m.
        notes: messages about data that were left out, and about doubtful factors.
    """

    model: Model
    factors: dict[str, list[float]]
    uncertain: Mapping[str, Sequence[float]]
    offsets: Mapping[str, Array]
    trials: tuple[str, ...]
    times: Array
    markers: tuple[str, ...]
    measured: Array
    before: Array
    after: Array
    notes: tuple[str, ...] = ()

    def errors(self, positions: Array) -> dict[str, float]:
        """Return root mean square distances by trial.

        Args:
            positions: positions as in `before` or `after` (t, m, 3), m.

        Returns:
            Root mean square (m) by name of the trial.
        """
        result = {}
        for trial in dict.fromkeys(self.trials):
            selected = [name == trial for name in self.trials]
            result[trial] = sqrt(
                float(np.nanmean(((positions - self.measured)[selected] ** 2).sum(axis=-1)))
            )
        return result


def fit(
    model: Model,
    trials: Mapping[str, Markers] | Iterable[Markers],
    static: Markers | None = None,
    *,
    weights: Mapping[str, float] | None = None,
    held: Collection[str] | None = None,
    by_axis: bool = False,
    symmetric: bool = True,
    frames: int = 200,
    mass: float = -1.0,
) -> Person:
    """Fit scale factors of bodies and positions of markers to movements of a person.

    The motion of the segments determines the joint centres, so trials in which all joints move are
    the most informative. A marker that is `fixed` in the model, or in `held`, keeps its
    position in the scaled model; all others may move.

    Args:
        model: generic model with markers named as those of the data; it is not changed.
        trials: movements, as .trc, .c3d or .sto files or arrays by name; the keys of a mapping name
            the trials.
        static: markers of the standing subject, as a file or arrays by name; None without them.
        weights: weights of markers by name; the others have weight 1, and weight 0 excludes.
        held: markers that keep their position in the model; by default those that are `fixed`.
        by_axis: whether the factors of a body may differ between its axes.
        symmetric: whether both sides of the body have the same factors.
        frames: number of frames, spread evenly over all trials.
        mass: mass of the subject, kg; if it is not positive, the mass follows from the factors.

    Returns:
        The fitted model with factors, offsets and errors.

    Raises:
        SettingError: there is no trial, or a name is unknown.
        OsimliteError: a file cannot be read, or has no marker of the model.
        SimulationError: no pose satisfies the constraints.
        UnsupportedError: osimlite does not support a joint or constraint of the model.
    """
    mechanism = build_mechanism(model)
    stations = {
        name: station
        for name, station in find_marker_stations(model, mechanism).items()
        # A marker on ground says nothing about the person.
        if station.body != GROUND
    }
    # Neighbouring frames are nearly the same; a selection gives almost all information.
    selected = SelectedFrames(_read_trials(trials, static), list(stations), frames, weights or {})
    movable_markers = {marker.name for marker in model.components(ModelMarker) if not marker.fixed}
    if held is not None:
        unknown = [name for name in held if name not in stations]
        if unknown:
            raise SettingError(
                f"'{model.name}' has no marker '{unknown[0]}'{suggest_name(unknown[0], stations)}"
            )
        movable_markers = set(stations) - set(held)
    names = [body.name for body in mechanism.bodies]
    carriers = {
        body.name: names[body.parent] if body.parent != GROUND else "" for body in mechanism.bodies
    }
    marked = {names[stations[marker].body] for marker in selected.markers}
    segments = Segments.group_bodies(carriers, marked, by_axis=by_axis, symmetric=symmetric)
    search = _PersonFit(
        ScalableMarkers(model, selected.markers, segments),
        selected,
        [name in movable_markers for name in selected.markers],
    )
    report_stage("fitting the poses of the model as it is")
    result = search.start_from_model(mechanism)
    positions_before = result.places
    # Excluding the worst positions changes the fit, which may reveal others.
    for _ in range(OUTLIER_ROUNDS):
        result = search.run(result, OUTLIER_STEP)
        if not selected.exclude_outliers(result.places):
            break
    # Only the last search is worth full accuracy.
    result = search.run(result, FINAL_STEP)
    scaled = model.copy_deep()
    factors = segments.expand_factors(result.sizes)
    scale_model(scaled, factors, mass)
    offsets = {
        name: offset
        for name, offset in zip(selected.markers, result.offsets, strict=True)
        if name in movable_markers
    }
    placements = Placements(scaled.tree())
    for marker in scaled.components(ModelMarker):
        if marker.name in offsets:
            _, frame = placements.resolve_frame(
                placements.follow_socket(marker, "socket_parent_frame")
            )
            # Offsets are along the axes of the body, locations along those of the marker's frame.
            local_offset = frame[:3, :3].T @ offsets[marker.name]
            marker.location = tuple((np.array(marker.location) + local_offset).tolist())
    return Person(
        scaled,
        factors,
        segments.expand_factors(search.compute_deviations(result)),
        offsets,
        tuple(selected.trials),
        selected.times,
        tuple(selected.markers),
        selected.measured,
        positions_before,
        result.places,
        (*selected.notes, *_report_extreme_factors(factors)),
    )


def _read_trials(
    trials: Mapping[str, Markers] | Iterable[Markers], static: Markers | None
) -> dict[str, MarkerData]:
    """Return the markers of all trials by name.

    Args:
        trials: markers of the trials, by name or in order.
        static: markers of the static trial; None without one.

    Raises:
        SettingError: there is no trial.
    """
    if isinstance(trials, Mapping):
        result = {name: MarkerData.from_source(trial) for name, trial in trials.items()}
    else:
        read = [MarkerData.from_source(trial) for trial in trials]
        result = {
            trial.file or f"trial {number}": trial for number, trial in enumerate(read, start=1)
        }
    if static is not None:
        result[STATIC_TRIAL] = MarkerData.from_source(static)
    if not result:
        raise SettingError("nothing to fit; pass at least one trial")
    return result


def _report_extreme_factors(factors: Mapping[str, Sequence[float]]) -> Iterator[str]:
    """Yield a message about factors at the end of their range."""
    bodies_at_limit = [
        body
        for body, body_factors in factors.items()
        if min(body_factors) <= MIN_FACTOR or max(body_factors) >= MAX_FACTOR
    ]
    if bodies_at_limit:
        yield f"{join_words(bodies_at_limit)}: scale factors at a limit; check the names and units of the markers"


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Sizes and offsets with the poses that fit best.

    Attributes:
        sizes: parameters of the segments (k,).
        offsets: offsets of the markers (m, 3), m.
        posed: fit of poses with these parameters.
        values: poses (t, n).
        places: positions of the markers (t, m, 3), m.
        cost: half the sum of weighted squares, and the negative log prior.
    """

    sizes: Array
    offsets: Array
    posed: ScaledPoseFit
    values: Array
    places: Array
    cost: float


class _PersonFit:
    """Maximum a posteriori estimate of sizes and offsets."""

    def __init__(
        self, shape: ScalableMarkers, selected: SelectedFrames, is_movable: Sequence[bool]
    ) -> None:
        self._shape = shape
        self._selected = selected
        self._movable_markers = np.flatnonzero(is_movable)
        self._sizes = len(shape.segments.parts)
        self._offset_count = 3 * len(self._movable_markers)
        frames = len(selected.times)
        # Errors of neighbouring frames are correlated: many frames must not outweigh the prior.
        self._unit = min(1.0, INDEPENDENT_FRAMES / frames) / SKIN_MOTION_M**2
        self._prior, self._prior_rhs = shape.segments.compute_prior(
            FIRST_SIZE_DEVIATION, NEIGHBOUR_DEVIATION, AXIS_DEVIATION
        )

    def start_from_model(self, mechanism: Mechanism) -> _Estimate:
        """Return the estimate for the unscaled model."""
        starts = np.tile(compute_first_pose(mechanism, 0.0, True), (len(self._selected.times), 1))
        return self._evaluate_estimate(
            np.ones(self._sizes), np.zeros((len(self._selected.markers), 3)), starts
        )

    def run(self, start: _Estimate, tolerance: float) -> _Estimate:
        """Return the most likely estimate.

        Args:
            start: estimate to start from.
            tolerance: largest change of a size or offset (m) by the last step.
        """
        report_stage("fitting sizes and markers")
        with mute_progress():
            estimate = self._evaluate_estimate(start.sizes, start.offsets, start.values)
        damping = 1e-6
        first_change = 0.0
        for _ in range(MAX_STEPS):
            with mute_progress():
                matrix, slope = self._compute_normal_equations(estimate)
                while True:
                    # Levenberg-Marquardt: raise the damping until the cost falls.
                    # Damping by the diagonal makes the step independent of the units of sizes and
                    # offsets.
                    step = -np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), slope)
                    sizes = np.clip(estimate.sizes + step[: self._sizes], MIN_FACTOR, MAX_FACTOR)
                    offsets = estimate.offsets.copy()
                    offsets[self._movable_markers] += step[self._sizes :].reshape(-1, 3)
                    trial_estimate = self._evaluate_estimate(sizes, offsets, estimate.values)
                    if trial_estimate.cost <= estimate.cost or np.abs(step).max() < tolerance:
                        break
                    damping = 10.0 * max(damping, 1e-9)
            if trial_estimate.cost <= estimate.cost:
                estimate = trial_estimate
                damping = 0.1 * damping
            change = float(np.abs(step).max())
            if change < tolerance:
                break
            # Steps shrink by about the same factor each, so their orders of magnitude tell how far
            # the search is.
            first_change = max(first_change, change)
            report_progress(
                "fitting sizes and markers",
                min(0.99, max(0.01, log(first_change / change) / log(first_change / tolerance))),
                1.0,
            )
        return estimate

    def compute_deviations(self, estimate: _Estimate) -> Array:
        """Return the standard deviations (k,) of the sizes."""
        return np.sqrt(np.diag(np.linalg.inv(self._compute_normal_equations(estimate)[0])))[
            : self._sizes
        ]

    def _evaluate_estimate(self, sizes: Array, offsets: Array, starts: Array) -> _Estimate:
        """Return sizes and offsets with the poses that fit best, and with their cost.

        Args:
            sizes: sizes of the segments (k,), see :class:`osimlite.fitting.segments.Segments`.
            offsets: offsets of the markers (m, 3), m.
            starts: initial poses (t, n).
        """
        posed = ScaledPoseFit(self._shape, sizes, offsets, self._selected.weights)
        values, positions = posed.fit_poses(self._selected.measured, starts)
        errors = positions - self._selected.measured
        squares = self._unit * float(np.nansum(self._selected.weights[:, None] * errors**2))
        prior_residuals = self._prior @ sizes - self._prior_rhs
        # Negative logarithm of a Cauchy density, up to a constant.
        offset_penalty = float(
            np.log1p((offsets[self._movable_markers] ** 2).sum(axis=1) / MARKER_OFFSET_M**2).sum()
        )
        return _Estimate(
            sizes,
            offsets,
            posed,
            values,
            positions,
            0.5 * (squares + float(prior_residuals @ prior_residuals) + offset_penalty),
        )

    def _compute_normal_equations(self, estimate: _Estimate) -> tuple[Array, Array]:
        """Return matrix and right-hand side of the normal equations for sizes and offsets.

        The poses are eliminated: only the part of each residual's derivative that no change of the
        pose can produce counts.
        """
        values = estimate.values
        columns, rotations = self._shape.compute_derivatives(values)
        errors = estimate.places - self._selected.measured
        is_measured = np.asarray(np.isfinite(errors).all(axis=2))
        roots = np.sqrt(self._unit * self._selected.weights)
        size = self._sizes + self._offset_count
        # Derivatives of the marker positions: by sizes first, then by offsets.
        derivatives = np.zeros((*errors.shape, size))
        derivatives[..., : self._sizes] = columns
        for number, index in enumerate(self._movable_markers):
            first_column = self._sizes + 3 * number
            derivatives[:, index, :, first_column : first_column + 3] = rotations[:, index]
        matrix = np.zeros((size, size))
        slope = np.zeros(size)
        matrix[: self._sizes, : self._sizes] = self._prior.T @ self._prior
        slope[: self._sizes] = self._prior.T @ (self._prior @ estimate.sizes - self._prior_rhs)
        movable_offsets = estimate.offsets[self._movable_markers]
        # Cauchy prior as iteratively reweighted least squares.
        prior_weights = np.repeat(1.0 / (MARKER_OFFSET_M**2 + (movable_offsets**2).sum(axis=1)), 3)
        np.fill_diagonal(matrix[self._sizes :, self._sizes :], prior_weights)
        slope[self._sizes :] = prior_weights * movable_offsets.ravel()
        for frame, jacobian in enumerate(estimate.posed.compute_marker_jacobians(values)):
            is_visible = is_measured[frame]
            scaled = roots[is_visible, None, None]
            rows = (scaled * derivatives[frame, is_visible]).reshape(-1, size)
            # Errors that a change of the pose removes do not count: project them out.
            pose_derivatives = (scaled * jacobian[is_visible]).reshape(
                len(rows), jacobian.shape[-1]
            )
            # Orthonormal directions in which a change of the pose moves the markers.
            squares, axes = np.linalg.eigh(pose_derivatives.T @ pose_derivatives)
            # Directions in which the markers do not move are rounding errors.
            certain = squares > 1e-12 * squares.max(initial=1e-300)
            directions = pose_derivatives @ (axes[:, certain] / np.sqrt(squares[certain]))
            remaining_rows = rows - directions @ (directions.T @ rows)
            matrix += remaining_rows.T @ remaining_rows
            slope += rows.T @ (roots[is_visible, None] * errors[frame][is_visible]).ravel()
        return matrix, slope
