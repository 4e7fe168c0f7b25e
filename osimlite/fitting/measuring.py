"""Scale factors of bodies from ratios of distances between markers, measured to model."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import format_count, join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.model import Model
from osimlite.schema.tools.scale import Measurement, Scale, ScaleSet

TIME_TOLERANCE_S = 1e-16
"""Time by which the last frame of a range may precede its end, as in OpenSim, s."""


class ScaleFactors(NamedTuple):
    """Scale factors of bodies, and the measurements behind them."""

    # Factors along the three axes of every physical frame, by name in the order of the model.
    factors: dict[str, list[float]]
    ratios: dict[str, float]  # ratio of measured to model distances by measurement
    notes: list[str]  # messages about measurements that are left out


class ScaleFactorFinder:
    """Finder of scale factors for the bodies of a model.

    Args:
        model: generic model.

    Attributes:
        mechanism: mechanism of the model.
        result: scale factors so far.
        frames: names of the physical frames.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self.mechanism = build_mechanism(model)
        self._stations = find_marker_stations(model, self.mechanism)
        self._state = self.mechanism.at(_compute_default_pose(self.mechanism))
        # OpenSim's scale set has all physical frames, not only bodies.
        names = [frame.name for frame in model.components(PhysicalFrame)]
        self.result = ScaleFactors({name: [1.0, 1.0, 1.0] for name in names}, {}, [])
        self.frames = names

    def apply_factors(self, scales: Iterable[Scale]) -> None:
        """Set scale factors that a setup prescribes."""
        for scale in scales:
            if scale.apply:
                # A segment is a name in files, and may be an object in Python.
                name = str(getattr(scale.segment, "name", scale.segment))
                if self._check_name(name, "the scale factors set by hand"):
                    self.result.factors[name] = [float(factor) for factor in scale.scales]

    def apply_measurements(
        self, measurements: Iterable[Measurement], data: MarkerData, start: float, end: float
    ) -> None:
        """Set scale factors by measurements: mean ratios of distances over the pairs of markers.

        A measurement is left out if one of its markers is missing or unseen in a frame of the
        range.

        Args:
            measurements: measurements; later ones overwrite earlier ones.
            data: measured markers of the standing subject.
            start: start of the range over which distances are averaged, s.
            end: end of the range, s.
        """
        frames = select_frames(data.times, start, end)
        for number, measurement in enumerate(measurements, start=1):
            if not measurement.apply:
                continue
            name = measurement.name or f"number {number}"
            ratio, reason = self._compute_ratio(measurement, data, frames)
            if reason:
                self.result.notes.append(f"measurement '{name}': {reason}")
                continue
            self.result.ratios[name] = ratio
            for body in measurement.body_scale_set.objects:
                for axis in (
                    body.axes if self._check_name(body.name, f"measurement '{name}'") else ()
                ):
                    # Other letters are ignored.
                    if axis.lower() in ("x", "y", "z"):
                        self.result.factors[body.name]["xyz".index(axis.lower())] = ratio

    def _compute_ratio(
        self, measurement: Measurement, data: MarkerData, frames: slice
    ) -> tuple[float, str]:
        """Return the ratio of measured to model distances.

        Returns:
            The ratio, and ""; or 0 and the reason why the measurement is left out.
        """
        ratios = []
        for pair in measurement.marker_pair_set.objects:
            names = [getattr(marker, "name", None) or str(marker) for marker in pair.markers]
            if len(names) != 2:
                return 0.0, f"a pair names {format_count(len(names), 'marker')}"
            for marker in names:
                if marker not in self._stations:
                    return (
                        0.0,
                        f"the model has no marker '{marker}'{suggest_name(marker, self._stations)}",
                    )
                if marker not in data.names:
                    return (
                        0.0,
                        f"the data have no marker '{marker}'{suggest_name(marker, data.names)}",
                    )
            first, second = (self._state.point(*self._stations[marker]) for marker in names)
            model_length = float(np.linalg.norm(first - second))
            positions = data.select_values(names)[frames]
            measured_length = float(
                np.mean(np.linalg.norm(positions[:, 0] - positions[:, 1], axis=1))
            )
            # One unseen marker makes the mean undefined, as in OpenSim.
            if not np.isfinite(measured_length):
                return 0.0, f"{join_words(names)} were not seen in every frame of the time range"
            if not model_length > 0.0:
                return 0.0, f"{join_words(names)} have the same position in the model"
            # OpenSim averages ratios, not distances.
            ratios.append(measured_length / model_length)
        return (float(np.mean(ratios)), "") if ratios else (0.0, "it has no pairs of markers")

    def _check_name(self, name: str, user_description: str) -> bool:
        """Return whether the model has a frame of a name; add a note if not."""
        if name not in self.result.factors:
            self.result.notes.append(
                f"body '{name}' of {user_description}: the model has no such body{suggest_name(name, self.result.factors)}"
            )
        return name in self.result.factors


def create_scale_set(frames: Iterable[str], scale_factors: ScaleFactors) -> ScaleSet:
    """Return scale factors as the object that OpenSim writes.

    Args:
        frames: names of physical frames, in order.
        scale_factors: result that has factors for these frames.
    """
    scales = [
        Scale(scales=tuple(scale_factors.factors[name]), segment=name, apply=True)
        for name in frames
    ]
    return ScaleSet(objects=scales)


def select_frames(times: Array, start_time: float, end_time: float) -> slice:
    """Return the frames that OpenSim averages over a range of times.

    They reach from the last frame up to the first time to the first frame from the last time on.

    Args:
        times: times of the frames (t,), s.
        start_time: start of the range, s.
        end_time: end of the range, s.

    Raises:
        SettingError: the range ends before it begins.
    """
    if start_time > end_time:
        raise SettingError(
            f"the time range ends at {end_time:g} s, before it begins at {start_time:g} s"
        )
    start = max(int(np.searchsorted(times, start_time, side="right")) - 1, 0)
    frames_from_end = np.flatnonzero(times[start:] >= end_time - TIME_TOLERANCE_S)
    return slice(start, start + int(frames_from_end[0]) + 1 if len(frames_from_end) else len(times))


def _compute_default_pose(mechanism: Mechanism) -> Array:
    """Return the default pose (n,), which satisfies the constraints."""
    return mechanism.assemble({})
