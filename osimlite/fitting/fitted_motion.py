"""A motion that fits measurements, and how far from them it is."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.trajectory import Movement

ADVICE = 0.02, 0.04
"""What OpenSim's documentation calls good: a root mean square of the marker errors of less than 2
cm, and a largest one of less than 4 cm (m).
"""


@dataclass(frozen=True, eq=False)
class FittedMotion(Movement):
    """A motion of a model that fits measured markers and orientations.

    Attributes: mechanism: what moves. times: of the frames (t,), s. values: of all n coordinates
        (t, n), in the mechanism's order, rad and m. markers: names of the m markers that were
        fitted. measured: where they were measured (t, m, 3), m; NaN where one was not seen. places:
        where they are in the fitted poses (t, m, 3), m. costs: what is least in each frame (t,).
        steps: Newton steps of each frame (t,). unseen: numbers of the frames in which nothing was
        seen: they have the pose before. unsettled: numbers of the frames whose best pose was not
        reached. model: what was fitted. sensors: names of the k sensors that were fitted. turns: of
        the sensors from where they were measured (t, k, 3), in ground, rad; NaN where one was not.
        undetermined: names of coordinates that no measurement determines: they start at their
        default values.
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
    sensors: tuple[str, ...] = ()
    turns: Array = field(default_factory=lambda: np.empty((0, 0, 3)))
    undetermined: tuple[str, ...] = ()

    @property
    def marker_errors(self) -> Array:
        """How far each marker is from where it was measured (t, m), m; NaN where it was not seen."""
        return np.asarray(np.linalg.norm(self.places - self.measured, axis=2))

    @property
    def orientation_errors(self) -> Array:
        """The angle of each sensor from where it was measured (t, k), rad; NaN where it was not."""
        return np.asarray(np.linalg.norm(self.turns, axis=2))

    def to_xarray(self) -> Any:
        """An xarray Dataset: ``value`` over ``time`` and ``coordinate``, ``marker_error`` over ``time`` and ``marker``.

        If there are sensors, also ``orientation_error`` over ``time`` and ``sensor``.

        Raises:
            MissingDependency: xarray is not installed.
        """
        errors: dict[str, Any] = {"marker_error": (("time", "marker"), self.marker_errors)}
        names = {"marker": list(self.markers)}
        if self.sensors:
            errors["orientation_error"] = ("time", "sensor"), self.orientation_errors
            names["sensor"] = list(self.sensors)
        return super().to_xarray().assign(errors).assign_coords(names)

    @property
    def summary(self) -> dict[str, Any]:
        """Root mean square and largest of each kind of errors (m, rad), where they are worst, and what was not seen."""
        result: dict[str, Any] = {"frames": len(self.times), "markers": len(self.markers)}
        partly: dict[str, float] = {}
        kinds = [("marker", self.markers, self.marker_errors)]
        if self.sensors:
            result["sensors"] = len(self.sensors)
            kinds.append(("orientation", self.sensors, self.orientation_errors))
        for kind, names, errors in kinds:
            seen = np.isfinite(errors)
            if seen.any():
                filled = np.where(seen, errors, -1.0)
                frame, one = np.unravel_index(int(filled.argmax()), filled.shape)
                noun, time = (
                    ("marker", "worst_time")
                    if kind == "marker"
                    else ("sensor", "worst_sensor_time")
                )
                result |= {
                    f"rms_{kind}_error": float(np.sqrt(np.mean(errors[seen] ** 2))),
                    f"largest_{kind}_error": float(filled.max()),
                    f"worst_{noun}": names[int(one)],
                    time: float(self.times[int(frame)]),
                }
            missing = (1.0 - seen.mean(axis=0)).tolist()
            partly |= {
                name: round(part, 4) for name, part in zip(names, missing, strict=True) if part
            }
        result["partly_unseen"] = partly
        result["frames_unseen"], result["frames_unsettled"] = len(self.unseen), len(self.unsettled)
        if self.undetermined:
            result["undetermined"] = list(self.undetermined)
        return result
