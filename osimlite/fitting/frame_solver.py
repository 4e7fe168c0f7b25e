"""Poses frame by frame, as they are measured: inverse kinematics of live markers and sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import first_pose, marker_stations, without_slides
from osimlite.fitting.orientation_data import rotations
from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import Marker, Sensor
from osimlite.fitting.sensors import sensor_frames
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Values
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model


class FrameSolver:
    """Finds the pose that fits markers, sensors or both, each from the one before.

    Args: model: whose poses. markers: names of its markers whose positions `step` is given, in that
        order; if neither they nor sensors are named, all of them. weights: of markers and sensors
        by name; those left out weigh 1. sensors: names of frames whose orientations `step` is
        given, in that order. constraints: whether those of the model hold.

    Attributes:
        markers: as given.
        sensors: as given.
        coordinates: names of the coordinates, in the order of what `step` returns.

    Raises:
        SettingError: the model has no such marker or frame, or no markers at all.
        UnsupportedError: the model has a joint or a constraint that cannot be computed.
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
        stations = marker_stations(model, mechanism)
        self.markers = tuple((() if sensors else stations) if markers is None else markers)
        self.sensors = tuple(sensors)
        for name in (*self.markers, *(weights or {})):
            if name not in stations and name not in self.sensors:
                raise SettingError(
                    f"'{model.name}' has no marker '{name}'{suggest_name(name, stations)}"
                )
        if not self.markers and not sensors:
            raise SettingError(f"'{model.name}' has no markers; add some, or name those to fit")
        frames = {name: sensor_frames(model, mechanism, (name,))[name] for name in self.sensors}
        self._mechanism = mechanism if self.markers else without_slides(mechanism)
        weighed = dict.fromkeys((*self.markers, *self.sensors), 1.0) | dict(weights or {})
        self.coordinates = mechanism.coordinate_names
        self._fit = PoseFit(
            self._mechanism,
            [Marker(stations[name], weighed[name]) for name in self.markers],
            [Sensor(frame, weighed[name]) for name, frame in frames.items()],
            constraints=constraints,
        )
        self._begin = first_pose(self._mechanism, 0.0, constraints)
        self._frame = self._fit.frame()
        self.reset()

    def reset(self, q: Values | None = None) -> None:
        """Begin anew, from a pose or from the default one: the next frame has nothing to do with those before."""
        self._fit.start(self._begin if q is None else self._mechanism.values(q))

    def step(
        self, positions: ArrayLike = (), time: float = 0.0, *, orientations: ArrayLike = ()
    ) -> Array:
        """The pose that fits one frame best: values of all coordinates (n,), rad and m.

        Args: positions: of the markers in ground (m, 3), m; NaN for one that is not seen. If
            nothing is, the pose stays. time: s, for prescribed coordinates. orientations: of the
            sensors in ground, quaternions (k, 4), scalar first, or rotation matrices (k, 3, 3).

        Raises:
            SettingError: the values are not those of so many markers and sensors.
            SimulationError: no pose fulfils the constraints.
        """
        places, turned = np.asarray(positions, dtype=float), np.asarray(orientations, dtype=float)
        if places.shape != (len(self.markers), 3) and (self.markers or places.size):
            raise SettingError(
                f"the positions of {len(self.markers)} markers are as many rows of 3 numbers; got "
                f"{' × '.join(map(str, places.shape)) or 'one number'}"
            )
        if self.sensors or turned.size:
            turned = rotations(turned, "the frame")
            if turned.shape != (len(self.sensors), 3, 3):
                raise SettingError(
                    f"the orientations of {len(self.sensors)} sensors are as many quaternions or matrices; got "
                    f"{' × '.join(map(str, turned.shape[:-2])) or 'one'}"
                )
        return self._frame(np.concatenate((places.reshape(-1), turned.reshape(-1))), time)

    @property
    def places(self) -> Array:
        """Where the markers are in the pose that was found last (m, 3), m."""
        return self._frame.places

    @property
    def turns(self) -> Array:
        """How the sensors are turned from where they were measured in that pose (k, 3), in ground, rad."""
        return self._frame.turns
