"""Poses frame by frame, as they are measured: inverse kinematics of live data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import first_pose, marker_stations
from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import Marker
from osimlite.multibody import build_mechanism
from osimlite.multibody.mechanism import Values
from osimlite.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.text import did_you_mean


class FrameSolver:
    """Finds the pose that fits markers, each from the one before.

    Args:
        model: whose poses.
        markers: names of its markers whose positions `step` is given, in that order; all of them if left out.
        weights: of markers by name; those left out weigh 1.
        constraints: whether those of the model hold.

    Attributes:
        markers: as given.
        coordinates: names of the coordinates, in the order of what `step` returns.

    Raises:
        SettingError: the model has no such marker, or none at all.
        UnsupportedError: the model has a joint or a constraint that cannot be computed.
    """

    def __init__(
        self,
        model: Model,
        markers: Sequence[str] | None = None,
        weights: Mapping[str, float] | None = None,
        *,
        constraints: bool = True,
    ) -> None:
        self._mechanism = build_mechanism(model)
        stations = marker_stations(model, self._mechanism)
        self.markers = tuple(stations if markers is None else markers)
        for name in (*self.markers, *(weights or {})):
            if name not in stations:
                raise SettingError(f"'{model.name}' has no marker '{name}'{did_you_mean(name, stations)}")
        if not self.markers:
            raise SettingError(f"'{model.name}' has no markers; add some, or name those to fit")
        weighed = dict.fromkeys(self.markers, 1.0) | dict(weights or {})
        self.coordinates = self._mechanism.coordinate_names
        chosen = [Marker(stations[name], weighed[name]) for name in self.markers]
        self._fit = PoseFit(self._mechanism, chosen, constraints=constraints)
        self._begin = first_pose(self._mechanism, 0.0, constraints)
        self._frame = self._fit.frame()
        self.reset()

    def reset(self, q: Values | None = None) -> None:
        """Begin anew, from a pose or from the default one: the next frame has nothing to do with those before."""
        self._fit.start(self._begin if q is None else self._mechanism.values(q))

    def step(self, positions: ArrayLike, time: float = 0.0) -> Array:
        """The pose that fits one frame best: values of all coordinates (n,), rad and m.

        Args:
            positions: of the markers in ground (m, 3), m; NaN for one that is not seen. If none is, the pose stays.
            time: s, for prescribed coordinates.

        Raises:
            SettingError: the positions are not those of so many markers.
            SimulationError: no pose fulfils the constraints.
        """
        places = np.asarray(positions, dtype=float)
        if places.shape != (len(self.markers), 3):
            raise SettingError(
                f"the positions of {len(self.markers)} markers are as many rows of 3 numbers; got "
                f"{' × '.join(map(str, places.shape)) or 'one number'}"
            )
        return self._frame(places, time)

    @property
    def places(self) -> Array:
        """Where the markers are in the pose that was found last (m, 3), m."""
        return self._frame.places
