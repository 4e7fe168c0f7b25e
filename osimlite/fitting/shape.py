"""Where the markers of a model are if its bodies are larger or smaller: at one pose, a linear function of the factors.

All translations of a mechanism are multiplied by factors, and no rotation is. So what one factor
does is the difference of two models, exactly, whatever the joints are; no joint has a formula for
it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import Marker, substituted
from osimlite.fitting.scaling import scale_model
from osimlite.fitting.segments import Segments
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock, Prescribed
from osimlite.mechanics.multibody.mechanism import Mechanism, StationPlacement
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.link_motion import moving
from osimlite.simulation.system import System

AT_END = 1e-9
"""How near a clamped coordinate is to an end of its range that holds it (rad or m)."""


class Shape:
    """A mechanism whose bodies have factors.

    Args:
        model: what is scaled.
        names: of the m markers that count; none of them is on ground.
        segments: whose k factors may change.
    """

    def __init__(self, model: Model, names: Sequence[str], segments: Segments) -> None:
        self._bare = model.copy_deep()
        for held in (self._bare.force_set, self._bare.controller_set, self._bare.probe_set):
            held.objects.clear()
        self._names, self.segments = list(names), segments
        ones = np.ones(len(segments.parts))
        self._first = self._points(ones)
        self._larger = [self._points(ones + unit) for unit in np.eye(len(ones))]

    def scaled(self, sizes: Array) -> tuple[Mechanism, list[StationPlacement]]:
        """The mechanism, and where its markers are fixed, for numbers (k,)."""
        model = self._bare.copy_deep()
        scale_model(model, self.segments.factors(sizes))
        mechanism, tree = build_mechanism(model), model.tree()
        places: dict[str, StationPlacement] = {}
        for marker in model.components(ModelMarker):
            places.setdefault(marker.name, mechanism.stations[tree.path_of(marker) or ""])
        return mechanism, [places[name] for name in self._names]

    def _points(self, sizes: Array) -> _Points:
        return _Points(*self.scaled(sizes))

    def columns(self, values: Array) -> tuple[Array, Array]:
        """What the factors and the offsets of markers do to their places in poses (t, n) of all coordinates.

        Returns: Derivatives (t, m, 3, k) of the places by the factors, m; rotations (t, m, 3, 3) of
            the markers' bodies.
        """
        places, rotations = self._first.places(values)
        return np.stack(
            [larger.places(values)[0] - places for larger in self._larger], axis=-1
        ), rotations


class Posed:
    """A shape of one size: its poses that fit measured markers, and how its markers move there.

    Args:
        shape: the bodies.
        sizes: their numbers (k,).
        offsets: of the markers, on top of where they are then (m, 3), m.
        weights: of the markers (m,).
    """

    def __init__(self, shape: Shape, sizes: Array, offsets: Array, weights: Array) -> None:
        self.mechanism, stations = shape.scaled(sizes)
        moved = [
            place._replace(location=place.location + by)
            for place, by in zip(stations, offsets, strict=True)
        ]
        self._points = _Points(self.mechanism, moved)
        markers = [
            Marker(place, weight) for place, weight in zip(moved, weights.tolist(), strict=True)
        ]
        self._fit = PoseFit(self.mechanism, markers)

    def poses(self, measured: Array, starts: Array) -> tuple[Array, Array]:
        """The best pose for each of some frames (t, m, 3), m, of which none follows another.

        Args:
            measured: places of the markers; NaN where one was not seen.
            starts: poses (t, n) to begin with.

        Returns:
            Values of all coordinates (t, n), and where the markers are then (t, m, 3), m.
        """
        frames = [
            self._fit.fit(frame[None], q=start)
            for frame, start in zip(measured, starts, strict=True)
        ]
        return np.concatenate([frame.values for frame in frames]), np.concatenate(
            [frame.places for frame in frames]
        )

    def freedoms(self, values: Array) -> list[Array]:
        """For each of some poses (t, n) how the markers can move (m, 3, f), a column for each free direction."""
        return self._points.freedoms(values)


class _Points:
    """Points of the bodies of a mechanism at many poses, whatever constrains it."""

    def __init__(self, mechanism: Mechanism, stations: Sequence[StationPlacement]) -> None:
        self._mechanism, free = mechanism, mechanism.released()
        self._system = System(free, Forces(()), apart=True)
        links = [self._system.placements[place.body][0] for place in stations]
        self._carrying, self._links = np.unique(links, return_inverse=True)
        frames = [self._system.placements[place.body][1] for place in stations]
        located = zip(frames, stations, strict=True)
        self._own = np.array(
            [frame[:3, :3] @ place.location + frame[:3, 3] for frame, place in located]
        )
        self._turned = np.array([frame[:3, :3] for frame in frames])
        holds = [item for item in mechanism.constraints if not isinstance(item, Lock | Prescribed)]
        self._couplers, _ = substituted(holds, set())
        self._holds = holds
        self._still = [
            k
            for k, info in enumerate(mechanism.coordinates)
            if info.locked or info.prescribed is not None
        ]

    def places(self, values: Array) -> tuple[Array, Array]:
        """Places (t, m, 3), m, and rotations (t, m, 3, 3) of their bodies; what depends on others follows them."""
        followed = values.copy()
        for coupler in self._couplers:
            others = list(coupler.independent)
            followed[:, coupler.dependent] = [
                coupler.function.evaluate(row[others])[0] for row in followed
            ]
        links = self._moving(followed, np.zeros_like(followed))
        turned = links[..., :9].reshape(*links.shape[:2], 3, 3) @ self._turned
        return moving(links, self._own)[..., :3], turned

    def freedoms(self, values: Array) -> list[Array]:
        """As :meth:`Posed.freedoms`."""
        count, size = values.shape
        each = [self._moving(values, np.tile(unit, (count, 1))) for unit in np.eye(size)]
        moves = np.stack([moving(links, self._own)[..., 3:] for links in each], axis=-1)
        return [rates @ self._free(q) for rates, q in zip(moves, values, strict=True)]

    def _free(self, q: Array) -> Array:
        """The speeds (n, f) that joints, constraints and ends of ranges allow in a pose."""
        held = [
            k
            for k, (info, value) in enumerate(
                zip(self._mechanism.coordinates, q.tolist(), strict=True)
            )
            if info.clamped and not info.range[0] + AT_END < value < info.range[1] - AT_END
        ]
        rows = [np.eye(len(q))[[*self._still, *held]]]
        if self._holds:
            state = self._mechanism.at(q)
            rows += [item.velocity_equations(state)[0] for item in self._holds]
        _, lengths, directions = np.linalg.svd(np.vstack(rows))
        return np.asarray(directions[int((lengths > AT_END).sum()) :].T)

    def _moving(self, values: Array, speeds: Array) -> Array:
        """What the kernels find of the links of the markers (t, m, ...)."""
        order, still = list(self._system.order), np.zeros((len(values), 1))
        result = self._system.links_of(
            np.hstack((still, values[:, order], speeds[:, order])), self._carrying.tolist()
        )
        return result[:, self._links]
