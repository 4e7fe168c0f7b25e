"""Inverse kinematics of live markers and sensors, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.text import format_count, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import (
    compute_first_pose,
    find_marker_stations,
    lock_translations,
)
from osimlite.fitting.orientation_data import to_rotations
from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import MarkerTarget, SensorTarget
from osimlite.fitting.sensors import find_sensor_frames
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Values
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model


class FrameSolver:
    """Solver of the pose that fits markers, sensors or both; each frame starts from the one before.

    Args:
        model: model that has the markers and sensors.
        markers: names of the markers whose positions :meth:`step` receives, in that order; by
            default all markers, or none if sensors are named.
        weights: weights of markers and sensors by name; the others have weight 1.
        sensors: names of the frames whose orientations :meth:`step` receives, in that order.
        constraints: whether the constraints of the model hold.

    Attributes:
        markers: names of the markers.
        sensors: names of the sensors.
        coordinates: names of the coordinates, in the order of the result of :meth:`step`.

    Raises:
        SettingError: the model lacks a marker or frame, or has no markers at all.
        UnsupportedError: osimlite does not support a joint or constraint of the model.
    """

    def __init__(
        self,
        model: Model,
        markers: Sequence[str] | None = None,
        weights: Mapping[str, float] | None = None,
        *,
        sensors: Sequence[str] = (),
        constraints: bool = True,
    ) -> None:
        mechanism = build_mechanism(model)
        stations = find_marker_stations(model, mechanism)
        self.markers = tuple((() if sensors else stations) if markers is None else markers)
        self.sensors = tuple(sensors)
        for name in (*self.markers, *(weights or {})):
            if name not in stations and name not in self.sensors:
                raise SettingError(
                    f"'{model.name}' has no marker '{name}'{suggest_name(name, stations)}"
                )
        if not self.markers and not sensors:
            raise SettingError(f"'{model.name}' has no markers; add some, or name sensors to fit")
        # One by one, because among known names an unknown one would be left out without an error.
        frames = {
            name: find_sensor_frames(model, mechanism, (name,))[name] for name in self.sensors
        }
        # Orientation sensors do not measure positions.
        self._mechanism = mechanism if self.markers else lock_translations(mechanism)
        all_weights = dict.fromkeys((*self.markers, *self.sensors), 1.0) | dict(weights or {})
        self.coordinates = mechanism.coordinate_names
        self._fit = PoseFit(
            self._mechanism,
            [MarkerTarget(stations[name], all_weights[name]) for name in self.markers],
            [SensorTarget(frame, all_weights[name]) for name, frame in frames.items()],
            constraints=constraints,
        )
        # At time 0, because the time of the first frame is not known yet.
        self._begin = compute_first_pose(self._mechanism, 0.0, constraints)
        self._frame = self._fit.create_single_frame_fit()
        self.reset()

    def reset(self, q: Values | None = None) -> None:
        """Forget the frames before, and start from a pose, or from the default pose."""
        self._fit.set_pose(self._begin if q is None else self._mechanism.values(q))

    def step(
        self, positions: ArrayLike = (), time: float = 0.0, *, orientations: ArrayLike = ()
    ) -> Array:
        """Return the pose that fits one frame best.

        Args:
            positions: positions of the markers in ground (m, 3), m; NaN for an unseen marker.
                Without any measurement the pose stays.
            time: time in s, for prescribed coordinates.
            orientations: orientations of the sensors in ground, quaternions (k, 4), scalar first,
                or rotation matrices (k, 3, 3).

        Returns:
            Values of all coordinates (n,), rad and m.

        Raises:
            SettingError: the arrays do not fit the numbers of markers and sensors.
            SimulationError: no pose satisfies the constraints.
        """
        marker_positions = np.asarray(positions, dtype=float)
        rotations = np.asarray(orientations, dtype=float)
        if marker_positions.shape != (len(self.markers), 3) and (
            self.markers or marker_positions.size
        ):
            raise SettingError(
                f"expected {format_count(len(self.markers), 'row')} of 3 numbers, one for each marker; found "
                f"{' × '.join(map(str, marker_positions.shape)) or 'one number'}"
            )
        if self.sensors or rotations.size:
            rotations = to_rotations(rotations, "the frame")
            if rotations.shape != (len(self.sensors), 3, 3):
                raise SettingError(
                    f"expected {len(self.sensors)} quaternions or matrices, one for each sensor; "
                    "found "
                    f"{' × '.join(map(str, rotations.shape[:-2])) or 'one'}"
                )
        return self._frame(
            np.concatenate((marker_positions.reshape(-1), rotations.reshape(-1))), time
        )

    @property
    def places(self) -> Array:
        """Positions of the markers in the latest pose (m, 3), m."""
        return self._frame.places

    @property
    def turns(self) -> Array:
        """Rotation vectors of the sensors from their measurements (k, 3), in ground, rad.

        They belong to the latest pose.
        """
        return self._frame.turns
