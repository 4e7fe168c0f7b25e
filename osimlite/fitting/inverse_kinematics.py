"""Inverse kinematics: the motion of a model that fits measured markers best, each frame to the last digits.

OpenSim minimises the same cost, but for numbers that it leaves out: half the weighted mean of the squared distances of
the markers that were seen, and half of the weighted squared deviations of coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.errors import SettingError
from osimlite.fitting.marker_data import MarkerData, Measured
from osimlite.fitting.pose_fit import PoseFit, Poses
from osimlite.fitting.pose_layout import Goal, Marker
from osimlite.multibody import build_mechanism
from osimlite.multibody.mechanism import Mechanism, StationPlacement
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass, field
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model
from osimlite.simulation.tabular import Tabular
from osimlite.text import did_you_mean

ADVICE = 0.02, 0.04
"""What OpenSim's documentation calls good: a root mean square of the marker errors of less than 2 cm, and a largest one
of less than 4 cm (m)."""


@dataclass(frozen=True, eq=False)
class FittedMotion(Tabular):
    """A motion of a model that fits measured markers.

    Attributes:
        mechanism: what moves.
        times: of the frames (t,), s.
        values: of all n coordinates (t, n), in the mechanism's order, rad and m.
        markers: names of the m markers that were fitted.
        measured: where they were measured (t, m, 3), m; NaN where one was not seen.
        places: where they are in the fitted poses (t, m, 3), m.
        costs: what is least in each frame (t,).
        steps: Newton steps of each frame (t,).
        unseen: numbers of the frames in which nothing was seen: they have the pose before.
        unsettled: numbers of the frames whose best pose was not reached.
        model: what was fitted.
    """

    mechanism: Mechanism
    times: Array
    values: Array
    markers: tuple[str, ...]
    measured: Array
    places: Array
    costs: Array
    steps: Array
    unseen: tuple[int, ...] = ()
    unsettled: tuple[int, ...] = ()
    model: Model | None = field(default=None, repr=False)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates, in the mechanism's order."""
        return self.mechanism.coordinate_names

    @property
    def marker_errors(self) -> Array:
        """How far each marker is from where it was measured (t, m), m; NaN where it was not seen."""
        return np.asarray(np.linalg.norm(self.places - self.measured, axis=2))

    @property
    def table(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """The coordinates over ``time``, rad and m."""
        return {"time": self.times}, dict(zip(self.coordinates, self.values.T, strict=True))

    def to_xarray(self) -> Any:
        """An xarray Dataset: ``value`` over ``time`` and ``coordinate``, ``marker_error`` over ``time`` and ``marker``.

        Raises:
            MissingDependency: xarray is not installed.
        """
        from osimlite._require import require

        xarray = require("xarray", extra="frame", purpose="a data set of xarray")
        return xarray.Dataset(
            {
                "value": (("time", "coordinate"), self.values),
                "marker_error": (("time", "marker"), self.marker_errors),
            },
            {"time": self.times, "coordinate": list(self.coordinates), "marker": list(self.markers)},
            {"model": self.mechanism.name},
        )

    @property
    def in_degrees(self) -> Array:
        """The values (t, n) with rotational coordinates in degrees, as OpenSim's files have them."""
        turning = [info.motion_type == "rotational" for info in self.mechanism.coordinates]
        return np.where(turning, np.rad2deg(self.values), self.values)

    @property
    def summary(self) -> dict[str, Any]:
        """Root mean square and largest of all marker errors (m), the worst marker and frame, and what was not seen."""
        errors = self.marker_errors
        seen = np.isfinite(errors)
        found: dict[str, Any] = {"frames": len(self.times), "markers": len(self.markers)}
        if seen.any():
            filled = np.where(seen, errors, -1.0)
            frame, marker = np.unravel_index(int(filled.argmax()), filled.shape)
            found |= {
                "rms_marker_error": float(np.sqrt(np.mean(errors[seen] ** 2))),
                "largest_marker_error": float(filled.max()),
                "worst_marker": self.markers[int(marker)],
                "worst_time": float(self.times[int(frame)]),
            }
        missing = 1.0 - seen.mean(axis=0)
        found["partly_unseen"] = {
            name: round(float(part), 4) for name, part in zip(self.markers, missing, strict=True) if part
        }
        found["frames_unseen"], found["frames_unsettled"] = len(self.unseen), len(self.unsettled)
        return found


def inverse_kinematics(
    model: Model,
    markers: Measured,
    *,
    times: ArrayLike | None = None,
    weights: Mapping[str, float] | None = None,
    coordinates: Mapping[str, float | tuple[float, float]] | None = None,
    constraints: bool = True,
    start: float = -np.inf,
    end: float = np.inf,
) -> FittedMotion:
    """Fit the pose of a model to measured markers, frame by frame.

    Args:
        model: whose markers have the names of the measured ones.
        markers: a .trc, .c3d or .sto file, or arrays (t, 3) by name in ground, m; NaN where a marker was not seen.
        times: of the frames of arrays, s; by default 0, 1, 2 ...
        weights: of markers by name; those left out weigh 1, those of 0 do not count.
        coordinates: weights (1/rad², 1/m²) of coordinates that are to keep their default values, by name, or the
            weight and the value (rad or m) that one is to have. Beside the mean over the markers such a weight of 1 is
            large.
        constraints: whether those of the model hold.
        start: first time, s.
        end: last time, s.

    Returns:
        The motion, every frame at its minimum to 1e-8 rad. Clamped coordinates stay in their ranges, locked ones at
        their defaults.

    Raises:
        OsimliteError: a file cannot be read, or no marker is in both the model and the data.
        SettingError: a weight or a goal names what is not there.
        SimulationError: no pose fulfils the constraints.
        UnsupportedError: the model has a joint or a constraint that cannot be computed.
    """
    data = MarkerData.of(markers, times).between(start, end)
    mechanism = build_mechanism(model)
    stations = marker_stations(model, mechanism)
    names = data.shared([*stations])
    weighed = {name: 1.0 for name in names}
    for name, weight in (weights or {}).items():
        if name not in stations:
            raise SettingError(f"'{model.name}' has no marker '{name}'{did_you_mean(name, stations)}")
        if not 0.0 <= weight < np.inf:
            raise SettingError(f"the weight {weight:g} of marker '{name}' is no weight; give one from 0 on")
        if name in weighed:
            weighed[name] = float(weight)
    goals, wanted = [], []
    for name, goal in (coordinates or {}).items():
        place = mechanism.coordinate_index(name)
        weight, value = goal if isinstance(goal, tuple) else (goal, mechanism.coordinates[place].default_value)
        goals.append(Goal(place, float(weight)))
        wanted.append(float(value))
    return fitted(model, mechanism, data, weighed, goals, np.tile(wanted, (len(data.times), 1)), constraints)


def fitted(
    model: Model,
    mechanism: Mechanism,
    data: MarkerData,
    weights: Mapping[str, float],
    goals: Sequence[Goal],
    wanted: Array,
    constraints: bool = True,
) -> FittedMotion:
    """Fit markers of a model that are in the data, by their weights, and coordinates to values (t, k)."""
    stations, names = marker_stations(model, mechanism), tuple(weights)
    fit = PoseFit(
        mechanism, [Marker(stations[name], weights[name]) for name in names], goals=goals, constraints=constraints
    )
    measured = data.only(names)
    frames = np.hstack([measured.reshape(len(measured), -1), wanted.reshape(len(measured), -1)])
    poses: Poses = fit.fit(frames, data.times, first_pose(mechanism, float(data.times[0]), constraints))
    return FittedMotion(
        mechanism,
        data.times,
        poses.values,
        names,
        measured,
        poses.places,
        poses.costs,
        poses.steps,
        poses.unseen,
        poses.unsettled,
        model,
    )


def first_pose(mechanism: Mechanism, time: float, constraints: bool) -> Array:
    """Where a fit begins: the default pose."""
    return mechanism.assemble({}, time) if constraints else mechanism.values({})


def marker_stations(model: Model, mechanism: Mechanism) -> dict[str, StationPlacement]:
    """Where the markers of a model are on its bodies, by their names; of markers that share a name the first."""
    tree, found = model.tree(), dict[str, StationPlacement]()
    for marker in model.components(ModelMarker):
        placed = mechanism.stations.get(tree.path_of(marker) or "")
        if placed is not None:
            found.setdefault(marker.name, placed)
    return found
