"""Motion that fits measurements, and its errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.trajectory import Movement

MARKER_ERROR_LIMITS_M = 0.02, 0.04
"""Limits of good fits in OpenSim's documentation: 2 cm root mean square, 4 cm largest error."""


@dataclass(frozen=True, eq=False)
class FittedMotion(Movement):
    """Motion of a model that fits measured markers and orientations.

    Attributes:
        mechanism: mechanism of the model.
        times: times of the frames (t,), s.
        values: values of all coordinates (t, n), in the mechanism's order, rad and m.
        markers: names of the m fitted markers.
        measured: measured positions (t, m, 3), m; NaN where a marker was not seen.
        places: positions of the markers in the fitted poses (t, m, 3), m.
        costs: minimum of the cost in each frame (t,).
        steps: Newton steps of each frame (t,).
        unseen: numbers of the frames without any measurement, which have the pose of the frame
            before.
        unsettled: numbers of the frames in which the solver did not converge.
        model: model whose motion it is; None if it is unknown.
        sensors: names of the k fitted sensors.
        turns: rotation vectors of the sensors from their measured orientations (t, k, 3), in
            ground, rad; NaN where one was not measured.
        undetermined: names of coordinates that no measurement determines; they start at their
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
        """Distances of the markers from their measured positions (t, m), m; NaN where unseen."""
        return np.asarray(np.linalg.norm(self.places - self.measured, axis=2))

    @property
    def orientation_errors(self) -> Array:
        """Angles of the sensors from their measurements (t, k), rad; NaN where not measured."""
        return np.asarray(np.linalg.norm(self.turns, axis=2))

    def to_xarray(self) -> Any:
        """Return an xarray Dataset of values and errors.

        It has ``value`` over ``time`` and ``coordinate``, ``marker_error`` over ``time`` and
        ``marker``, and with sensors ``orientation_error`` over ``time`` and ``sensor``.

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
        """Errors (m, rad), worst markers, sensors and times, and unseen measurements, by name.

        Returns:
            Root mean square and largest error of each kind with where they occur, share of frames
            in which a marker or sensor is unseen, and numbers of frames.
        """
        result: dict[str, Any] = {"frames": len(self.times), "markers": len(self.markers)}
        partly: dict[str, float] = {}
        error_tables = [("marker", self.markers, self.marker_errors)]
        if self.sensors:
            result["sensors"] = len(self.sensors)
            error_tables.append(("orientation", self.sensors, self.orientation_errors))
        for quantity, names, errors in error_tables:
            is_measured = np.isfinite(errors)
            if is_measured.any():
                # Errors are not negative, so that -1 is never the largest.
                measured_errors = np.where(is_measured, errors, -1.0)
                frame, column = np.unravel_index(
                    int(measured_errors.argmax()), measured_errors.shape
                )
                noun, time = (
                    ("marker", "worst_time")
                    if quantity == "marker"
                    else ("sensor", "worst_sensor_time")
                )
                result |= {
                    f"rms_{quantity}_error": float(np.sqrt(np.mean(errors[is_measured] ** 2))),
                    f"largest_{quantity}_error": float(measured_errors.max()),
                    f"worst_{noun}": names[int(column)],
                    time: float(self.times[int(frame)]),
                }
            missing = (1.0 - is_measured.mean(axis=0)).tolist()
            # Only markers that are unseen in some frame are named.
            partly |= {
                name: round(unseen_fraction, 4)
                for name, unseen_fraction in zip(names, missing, strict=True)
                if unseen_fraction
            }
        result["partly_unseen"] = partly
        result["frames_unseen"], result["frames_unsettled"] = len(self.unseen), len(self.unsettled)
        if self.undetermined:
            result["undetermined"] = list(self.undetermined)
        return result
