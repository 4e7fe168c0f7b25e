"""A model that fits a person: sizes of the segments, places of the markers and all poses at once, from any trials.

What is least is the sum of the squared distances of the markers over chosen frames, and of how
unlikely sizes and offsets are (a maximum a posteriori estimate). In each frame the best pose is
found for itself (variable projection, G. Golub and V. Pereyra, Inverse Problems 19, 2003): a step
of Gauss and Newton is taken in sizes and offsets alone, with the normal equations of the poses
eliminated frame by frame, and the poses follow it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from math import sqrt

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.chosen_frames import STATIC, ChosenFrames
from osimlite.fitting.inverse_kinematics import first_pose, marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.marker_data import Measured as Markers
from osimlite.fitting.scaling import scale_model
from osimlite.fitting.segments import Segments
from osimlite.fitting.shape import Posed, Shape
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model

SKIN = 0.01
"""How far markers usually are from where a rigid segment has them (m): skin moves."""
INDEPENDENT = 20.0
"""As many frames as all are worth: skin moves alike in those of one movement."""
FIRST, APART, ACROSS = 0.3, 0.1, 0.05
"""How far the size of the first segment usually is from the model's, those of neighbouring segments
and the factors of one segment from one another.
"""
OFFSET = 0.01
"""How far a marker on a bone usually is from where the model has it (m). Those of clusters may be
anywhere: offsets have the distribution of Cauchy, which does not pull at what is far away.
"""
SMALLEST, LARGEST = 0.4, 2.5
"""Ends of the range of factors."""
STEPS, LOOKS = 60, 3
"""At most so many steps, and so often it is looked at which markers were taken for others."""
NEARLY, ENOUGH = 1e-2, 1e-4
"""By how much the last step changes factors and offsets (m) at most: before that, and at the end."""


@dataclass(frozen=True, eq=False)
class Person:
    """A model that was fitted to a person.

    Attributes: model: the scaled model, its markers where they are on the person. factors: of each
        body along its axes, by name. uncertain: standard deviations of the factors, as far as the
        assumptions about skin hold. offsets: of the markers that may move (3,), m, along the axes
        of their bodies, beside the scaled model's. trials: what the chosen frames are from, by
        frame. times: of the chosen frames (t,), s. markers: names of the m markers. measured: where
        they were measured (t, m, 3), m. before: where they are in the best poses of the model as it
        was (t, m, 3), m. after: likewise of the fitted one. notes: what was left out, and what to
        look at.
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

    def errors(self, places: Array) -> dict[str, float]:
        """Root mean square of the distances (m) by trial, of places as in `before` or `after`."""
        result = {}
        for trial in dict.fromkeys(self.trials):
            chosen = [name == trial for name in self.trials]
            result[trial] = sqrt(
                float(np.nanmean(((places - self.measured)[chosen] ** 2).sum(axis=-1)))
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
    """Fit a model to a person: factors of its bodies and places of its markers, from movements.

    Joint centres are found by how the segments move, so trials in which all joints move tell most.
    A marker that is `fixed` in the model, or in `held`, stays where the scaled model has it; all
    others may move.

    Args: model: the generic model, with markers named as those of the data; it stays as it is.
        trials: movements, as .trc, .c3d or .sto files or arrays by name; a mapping gives them
        names. static: the subject standing. weights: of markers by name; those left out weigh 1,
        those of 0 do not count. held: markers that are known to be where the model has them; by
        default those that are `fixed`. by_axis: whether a body may grow in one direction more than
        in another. symmetric: whether both sides of the body have the same factors. frames: how
        many are looked at, spread evenly over all trials. mass: what the subject weighs, kg; if it
        is not positive that follows from the factors.

    Raises:
        SettingError: nothing is given, or something names what is not there.
        OsimliteError: a file cannot be read, or has no marker of the model.
        SimulationError: no pose fulfils the constraints.
        UnsupportedError: the model has a joint or a constraint that cannot be computed.
    """
    mechanism = build_mechanism(model)
    stations = {
        name: place
        for name, place in marker_stations(model, mechanism).items()
        if place.body != GROUND
    }
    chosen = ChosenFrames(_named(trials, static), list(stations), frames, weights or {})
    moving = {marker.name for marker in model.components(ModelMarker) if not marker.fixed}
    if held is not None:
        unknown = [name for name in held if name not in stations]
        if unknown:
            raise SettingError(
                f"'{model.name}' has no marker '{unknown[0]}'{suggest_name(unknown[0], stations)}"
            )
        moving = set(stations) - set(held)
    names = [body.name for body in mechanism.bodies]
    carriers = {
        body.name: names[body.parent] if body.parent != GROUND else "" for body in mechanism.bodies
    }
    marked = {names[stations[marker].body] for marker in chosen.markers}
    segments = Segments.of(carriers, marked, by_axis=by_axis, symmetric=symmetric)
    search = _Search(
        Shape(model, chosen.markers, segments), chosen, [name in moving for name in chosen.markers]
    )
    result = search.start(mechanism)
    before = result.places
    for _ in range(LOOKS):
        result = search.run(result, NEARLY)
        if not chosen.left_out(result.places):
            break
    result = search.run(result, ENOUGH)
    scaled = model.copy_deep()
    factors = segments.factors(result.sizes)
    scale_model(scaled, factors, mass)
    offsets = {
        name: by for name, by in zip(chosen.markers, result.offsets, strict=True) if name in moving
    }
    placements = Placements(scaled.tree())
    for marker in scaled.components(ModelMarker):
        if marker.name in offsets:
            _, frame = placements.resolve_frame(
                placements.follow_socket(marker, "socket_parent_frame")
            )
            own = frame[:3, :3].T @ offsets[marker.name]
            marker.location = tuple((np.array(marker.location) + own).tolist())
    return Person(
        scaled,
        factors,
        segments.factors(search.deviations(result)),
        offsets,
        tuple(chosen.trials),
        chosen.times,
        tuple(chosen.markers),
        chosen.measured,
        before,
        result.places,
        (*chosen.notes, *_at_ends(factors)),
    )


def _named(
    trials: Mapping[str, Markers] | Iterable[Markers], static: Markers | None
) -> dict[str, MarkerData]:
    """All trials by name; the static one is called so."""
    if isinstance(trials, Mapping):
        result = {name: MarkerData.of(trial) for name, trial in trials.items()}
    else:
        read = [MarkerData.of(trial) for trial in trials]
        result = {
            trial.file or f"trial {number}": trial for number, trial in enumerate(read, start=1)
        }
    if static is not None:
        result[STATIC] = MarkerData.of(static)
    if not result:
        raise SettingError("there is nothing to fit; give at least one trial")
    return result


def _at_ends(factors: Mapping[str, Sequence[float]]) -> Iterator[str]:
    ends = [body for body, own in factors.items() if min(own) <= SMALLEST or max(own) >= LARGEST]
    if ends:
        yield f"{join_words(ends)}: factors at an end of what is allowed; look at the names and the units of the markers"


@dataclass(frozen=True, eq=False)
class _Found:
    """Sizes (k,) and offsets (m, 3), m, their poses (t, n), places of the markers (t, m, 3), m, and the cost."""

    sizes: Array
    offsets: Array
    posed: Posed
    values: Array
    places: Array
    cost: float


class _Search:
    """Looks for the sizes and offsets that are likeliest."""

    def __init__(self, shape: Shape, chosen: ChosenFrames, free: Sequence[bool]) -> None:
        self._shape, self._chosen, self._free = shape, chosen, np.flatnonzero(free)
        self._sizes, self._moved = len(shape.segments.parts), 3 * len(self._free)
        frames = len(chosen.times)
        self._unit = min(1.0, INDEPENDENT / frames) / SKIN**2
        self._prior, self._wanted = shape.segments.expected(FIRST, APART, ACROSS)

    def start(self, mechanism: Mechanism) -> _Found:
        """The model as it is."""
        starts = np.tile(first_pose(mechanism, 0.0, True), (len(self._chosen.times), 1))
        return self._at(np.ones(self._sizes), np.zeros((len(self._chosen.markers), 3)), starts)

    def run(self, known: _Found, enough: float) -> _Found:
        """The likeliest, from what is known on, until a step changes no size and no offset (m) by more than enough."""
        here, damping = self._at(known.sizes, known.offsets, known.values), 1e-6
        for _ in range(STEPS):
            matrix, slope = self._normal(here)
            while True:
                step = -np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), slope)
                sizes = np.clip(here.sizes + step[: self._sizes], SMALLEST, LARGEST)
                offsets = here.offsets.copy()
                offsets[self._free] += step[self._sizes :].reshape(-1, 3)
                there = self._at(sizes, offsets, here.values)
                if there.cost <= here.cost or np.abs(step).max() < enough:
                    break
                damping = 10.0 * max(damping, 1e-9)
            if there.cost <= here.cost:
                here, damping = there, 0.1 * damping
            if np.abs(step).max() < enough:
                break
        return here

    def deviations(self, found: _Found) -> Array:
        """Standard deviations (k,) of the numbers."""
        return np.sqrt(np.diag(np.linalg.inv(self._normal(found)[0])))[: self._sizes]

    def _at(self, sizes: Array, offsets: Array, starts: Array) -> _Found:
        posed = Posed(self._shape, sizes, offsets, self._chosen.weights)
        values, places = posed.poses(self._chosen.measured, starts)
        errors = places - self._chosen.measured
        squares = self._unit * float(np.nansum(self._chosen.weights[:, None] * errors**2))
        likely = self._prior @ sizes - self._wanted
        far = float(np.log1p((offsets[self._free] ** 2).sum(axis=1) / OFFSET**2).sum())
        return _Found(
            sizes, offsets, posed, values, places, 0.5 * (squares + float(likely @ likely) + far)
        )

    def _normal(self, here: _Found) -> tuple[Array, Array]:
        """Matrix and right side of the normal equations in sizes and offsets, the poses eliminated."""
        values = here.values
        columns, turned = self._shape.columns(values)
        errors = here.places - self._chosen.measured
        seen = np.asarray(np.isfinite(errors).all(axis=2))
        roots = np.sqrt(self._unit * self._chosen.weights)
        size = self._sizes + self._moved
        by = np.zeros((*errors.shape, size))
        by[..., : self._sizes] = columns
        for number, place in enumerate(self._free):
            first = self._sizes + 3 * number
            by[:, place, :, first : first + 3] = turned[:, place]
        matrix, slope = np.zeros((size, size)), np.zeros(size)
        matrix[: self._sizes, : self._sizes] = self._prior.T @ self._prior
        slope[: self._sizes] = self._prior.T @ (self._prior @ here.sizes - self._wanted)
        far = here.offsets[self._free]
        pull = np.repeat(1.0 / (OFFSET**2 + (far**2).sum(axis=1)), 3)
        np.fill_diagonal(matrix[self._sizes :, self._sizes :], pull)
        slope[self._sizes :] = pull * far.ravel()
        for frame, moves in enumerate(here.posed.freedoms(values)):
            own = seen[frame]
            scaled = roots[own, None, None]
            rows = (scaled * by[frame, own]).reshape(-1, size)
            # What poses make good is no error of sizes: the part across their directions counts.
            moved = (scaled * moves[own]).reshape(len(rows), moves.shape[-1])
            squares, axes = np.linalg.eigh(moved.T @ moved)
            certain = squares > 1e-12 * squares.max(initial=1e-300)
            directions = moved @ (axes[:, certain] / np.sqrt(squares[certain]))
            across = rows - directions @ (directions.T @ rows)
            matrix += across.T @ across
            slope += rows.T @ (roots[own, None] * errors[frame][own]).ravel()
        return matrix, slope
