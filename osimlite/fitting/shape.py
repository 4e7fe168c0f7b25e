"""Marker positions of a model as a function of scale factors: linear in the factors at one pose.

Scaling multiplies all translations of a mechanism by factors, and changes no rotation. The
derivative by a factor is therefore exactly the difference of two models, for joints of any type.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import MarkerTarget, separate_couplers
from osimlite.fitting.scaling import scale_model
from osimlite.fitting.segments import Segments
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.mechanism import Mechanism, StationPlacement
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.link_motion import locate_points
from osimlite.simulation.system import System

RANGE_TOLERANCE = 1e-9
"""Distance from the end of its range (rad or m) at which a clamped coordinate cannot move."""


class ScalableMarkers:
    """Markers of a model whose bodies have scale factors.

    Args:
        model: unscaled model, which stays unchanged.
        names: names of the m markers; none is on ground.
        segments: segments with k parameters.
    """

    def __init__(self, model: Model, names: Sequence[str], segments: Segments) -> None:
        self._bare = model.copy_deep()
        # Forces do not move markers, and copying and scaling them takes most of the time.
        for component_set in (
            self._bare.force_set,
            self._bare.controller_set,
            self._bare.probe_set,
        ):
            component_set.objects.clear()
        self._names = list(names)
        self.segments = segments
        ones = np.ones(len(segments.parts))
        self._first = self._create_points(ones)
        # Positions are linear in the factors, so that a step of 1 gives the exact derivative.
        self._larger = [self._create_points(ones + unit) for unit in np.eye(len(ones))]

    def scale_mechanism(self, sizes: Array) -> tuple[Mechanism, list[StationPlacement]]:
        """Scale the mechanism.

        Args:
            sizes: parameters (k,) that determine the scale factors.

        Returns:
            The mechanism, and the stations of its markers.
        """
        model = self._bare.copy_deep()
        scale_model(model, self.segments.expand_factors(sizes))
        mechanism = build_mechanism(model)
        tree = model.tree()
        stations: dict[str, StationPlacement] = {}
        for marker in model.components(ModelMarker):
            stations.setdefault(marker.name, mechanism.stations[tree.path_of(marker) or ""])
        return mechanism, [stations[name] for name in self._names]

    def _create_points(self, sizes: Array) -> _MarkerPoints:
        """Return the marker points for parameters (k,)."""
        return _MarkerPoints(*self.scale_mechanism(sizes))

    def compute_derivatives(self, values: Array) -> tuple[Array, Array]:
        """Compute the derivatives of marker positions by factors and offsets.

        Args:
            values: poses (t, n).

        Returns:
            Derivatives (t, m, 3, k) of the positions by the factors, m; rotations (t, m, 3, 3) of
            the markers' bodies.
        """
        positions, rotations = self._first.compute_positions(values)
        return np.stack(
            [larger.compute_positions(values)[0] - positions for larger in self._larger], axis=-1
        ), rotations


class ScaledPoseFit:
    """Fit of poses to markers for fixed parameters.

    Args:
        shape: markers of the model.
        sizes: parameters (k,) that determine the scale factors.
        offsets: offsets of the markers from the scaled model (m, 3), m.
        weights: weights of the markers (m,).
    """

    def __init__(
        self, shape: ScalableMarkers, sizes: Array, offsets: Array, weights: Array
    ) -> None:
        self.mechanism, stations = shape.scale_mechanism(sizes)
        displaced_stations = [
            station._replace(location=station.location + offset)
            for station, offset in zip(stations, offsets, strict=True)
        ]
        self._points = _MarkerPoints(self.mechanism, displaced_stations)
        markers = [
            MarkerTarget(station, weight)
            for station, weight in zip(displaced_stations, weights.tolist(), strict=True)
        ]
        self._fit = PoseFit(self.mechanism, markers)

    def fit_poses(self, measured: Array, starts: Array) -> tuple[Array, Array]:
        """Fit the pose of each frame separately.

        Args:
            measured: positions of the markers (t, m, 3), m; NaN where one was not seen.
            starts: initial poses (t, n).

        Returns:
            Values of all coordinates (t, n), and marker positions (t, m, 3), m.
        """
        frames = [
            self._fit.fit_frames(frame[None], q=start)
            for frame, start in zip(measured, starts, strict=True)
        ]
        return np.concatenate([frame.values for frame in frames]), np.concatenate(
            [frame.places for frame in frames]
        )

    def compute_marker_jacobians(self, values: Array) -> list[Array]:
        """Return, for each pose, the derivatives of marker positions along the model's degrees of freedom.

        A degree of freedom is here a vector of coordinate speeds that fulfils the constraints and
        moves neither locked coordinates nor clamped ones at the end of their range. Their number f
        can therefore differ from pose to pose.

        Args:
            values: poses (t, n).

        Returns:
            Jacobian of the markers (m, 3, f) for each pose, m per unit of the degree of freedom.
        """
        return self._points.compute_marker_jacobians(values)


class _MarkerPoints:
    """Points of bodies of a mechanism in many poses, without regard to constraints."""

    def __init__(self, mechanism: Mechanism, stations: Sequence[StationPlacement]) -> None:
        self._mechanism = mechanism
        unconstrained = mechanism.without_constraints()
        self._system = System(unconstrained, Forces(()), keep_fixed_bodies=True)
        links = [self._system.placements[station.body][0] for station in stations]
        # Several markers are on one link, whose motion is computed once.
        self._marker_links, self._links = np.unique(links, return_inverse=True)
        frames = [self._system.placements[station.body][1] for station in stations]
        located = zip(frames, stations, strict=True)
        self._locations = np.array(
            [frame[:3, :3] @ station.location + frame[:3, 3] for frame, station in located]
        )
        self._rotations = np.array([frame[:3, :3] for frame in frames])
        constraints = [
            constraint
            for constraint in mechanism.constraints
            if not isinstance(constraint, Lock | PrescribedCoordinate)
        ]
        self._couplers, _ = separate_couplers(constraints, set())
        self._constraints = constraints
        self._fixed_coordinates = [
            k
            for k, info in enumerate(mechanism.coordinates)
            if info.locked or info.prescribed is not None
        ]

    def compute_positions(self, values: Array) -> tuple[Array, Array]:
        """Return positions and rotations of the points; coupled coordinates follow the others.

        Args:
            values: poses (t, n).

        Returns:
            Positions (t, m, 3), m, and rotations (t, m, 3, 3) of their bodies.
        """
        # The mechanism of the points has no constraints, so that couplers are applied here.
        coupled_values = values.copy()
        for coupler in self._couplers:
            arguments = list(coupler.independent)
            coupled_values[:, coupler.dependent] = [
                coupler.function.evaluate(row[arguments])[0] for row in coupled_values
            ]
        links = self._compute_link_motion(coupled_values, np.zeros_like(coupled_values))
        rotations = links[..., :9].reshape(*links.shape[:2], 3, 3) @ self._rotations
        return locate_points(links, self._locations)[..., :3], rotations

    def compute_marker_jacobians(self, values: Array) -> list[Array]:
        """Return the Jacobians of the markers; see :meth:`ScaledPoseFit.compute_marker_jacobians`."""
        count, size = values.shape
        # Velocities are linear in the speeds, so that unit speeds give the columns exactly.
        link_motions = [
            self._compute_link_motion(values, np.tile(unit, (count, 1))) for unit in np.eye(size)
        ]
        jacobians = np.stack(
            [locate_points(links, self._locations)[..., 3:] for links in link_motions], axis=-1
        )
        return [
            jacobian @ self._compute_null_space(q)
            for jacobian, q in zip(jacobians, values, strict=True)
        ]

    def _compute_null_space(self, q: Array) -> Array:
        """Return orthonormal speeds (n, f) that joints, constraints and ends of ranges allow in a pose."""
        at_range_end = [
            k
            for k, (info, value) in enumerate(
                zip(self._mechanism.coordinates, q.tolist(), strict=True)
            )
            if info.clamped
            # At the end of its range a clamped coordinate could move one way only; it counts as
            # fixed.
            and not info.range[0] + RANGE_TOLERANCE < value < info.range[1] - RANGE_TOLERANCE
        ]
        # Rows of the constraint matrix; free motions are its null space.
        rows = [np.eye(len(q))[[*self._fixed_coordinates, *at_range_end]]]
        if self._constraints:
            state = self._mechanism.at(q)
            rows += [constraint.velocity_equations(state)[0] for constraint in self._constraints]
        # The singular vectors beyond the rank span the null space, also of redundant constraints.
        _, singular_values, directions = np.linalg.svd(np.vstack(rows))
        rank = int((singular_values > RANGE_TOLERANCE).sum())
        return np.asarray(directions[rank:].T)

    def _compute_link_motion(self, values: Array, speeds: Array) -> Array:
        """Return the records of the markers' links (t, m, ...) for poses and speeds (t, n)."""
        order = list(self._system.order)
        zero_times = np.zeros((len(values), 1))
        result = self._system.evaluate_links(
            np.hstack((zero_times, values[:, order], speeds[:, order])), self._marker_links.tolist()
        )
        return result[:, self._links]
