"""How large the bodies of a subject are beside those of a generic model: ratios of distances between markers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from osimlite.base.text import join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.model import Model
from osimlite.schema.tools.scale import Measurement, Scale, ScaleSet

NEARLY = 1e-16
"""By how much (s) a time may fall short of the end of a range and be taken for it, as in OpenSim."""


class Measured(NamedTuple):
    """What measurements come to."""

    # along the three axes of every physical frame, by their names in the order of the model
    factors: dict[str, list[float]]
    ratios: dict[str, float]  # of each measurement that counts, measured to model, by name
    notes: list[str]  # what was left out, and why


class Measuring:
    """Finds factors for the bodies of a model.

    Args:
        model: the generic one.

    Attributes:
        mechanism: of it.
    """

    def __init__(self, model: Model) -> None:
        self._model, self.mechanism = model, build_mechanism(model)
        self._stations = marker_stations(model, self.mechanism)
        self._state = self.mechanism.at(_default(self.mechanism))
        names = [frame.name for frame in model.components(PhysicalFrame)]
        self.found = Measured({name: [1.0, 1.0, 1.0] for name in names}, {}, [])
        self.frames = names

    def by_hand(self, scales: Iterable[Scale]) -> None:
        """Take factors that are given."""
        for scale in scales:
            if scale.apply:
                name = str(getattr(scale.segment, "name", scale.segment))
                if self._is_known(name, "scale factors given by hand"):
                    self.found.factors[name] = [float(factor) for factor in scale.scales]

    def by_measurements(
        self, measurements: Iterable[Measurement], data: MarkerData, first: float, last: float
    ) -> None:
        """Take those that distances of markers give, the mean of their ratios over the pairs of each measurement.

        A measurement of which a marker is missing, or was not seen in a frame of the range, is left
        out.

        Args:
            measurements: in the order in which they overwrite one another.
            data: measured markers of the standing subject.
            first: time from which distances are averaged, s.
            last: time up to which, s.
        """
        frames = frames_between(data.times, first, last)
        for number, measurement in enumerate(measurements, start=1):
            if not measurement.apply:
                continue
            name = measurement.name or f"number {number}"
            ratio, reason = self._ratio(measurement, data, frames)
            if reason:
                self.found.notes.append(f"measurement '{name}' is left out: {reason}")
                continue
            self.found.ratios[name] = ratio
            for body in measurement.body_scale_set.objects:
                for axis in body.axes if self._is_known(body.name, f"measurement '{name}'") else ():
                    if axis.lower() in ("x", "y", "z"):
                        self.found.factors[body.name]["xyz".index(axis.lower())] = ratio

    def _ratio(
        self, measurement: Measurement, data: MarkerData, frames: slice
    ) -> tuple[float, str]:
        """Measured to model, or why there is none."""
        ratios = []
        for pair in measurement.marker_pair_set.objects:
            names = [getattr(marker, "name", None) or str(marker) for marker in pair.markers]
            if len(names) != 2:
                return 0.0, f"a pair names {len(names)} markers"
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
            one, two = (self._state.point(*self._stations[marker]) for marker in names)
            length = float(np.linalg.norm(one - two))
            places = data.only(names)[frames]
            measured = float(np.mean(np.linalg.norm(places[:, 0] - places[:, 1], axis=1)))
            if not np.isfinite(measured):
                return 0.0, f"{join_words(names)} were not seen in every frame of the time range"
            if not length > 0.0:
                return 0.0, f"{join_words(names)} are at one place in the model"
            ratios.append(measured / length)
        return (float(np.mean(ratios)), "") if ratios else (0.0, "it has no pairs of markers")

    def _is_known(self, name: str, what: str) -> bool:
        """Whether there is a frame of a name; if not it is noted."""
        if name not in self.found.factors:
            self.found.notes.append(
                f"{what}: the model has no body '{name}'{suggest_name(name, self.found.factors)}"
            )
        return name in self.found.factors


def scale_set(frames: Iterable[str], measured: Measured) -> ScaleSet:
    """The factors of physical frames, by their names, as OpenSim writes them."""
    scales = [
        Scale(scales=tuple(measured.factors[name]), segment=name, apply=True) for name in frames
    ]
    return ScaleSet(objects=scales)


def frames_between(times: Array, first: float, last: float) -> slice:
    """The frames from the last one not after a time to the first one not before another, as OpenSim counts them.

    Raises:
        SettingError: the range ends before it begins.
    """
    if first > last:
        raise SettingError(f"the time range ends at {last:g} s, before it begins at {first:g} s")
    start = max(int(np.searchsorted(times, first, side="right")) - 1, 0)
    later = np.flatnonzero(times[start:] >= last - NEARLY)
    return slice(start, start + int(later[0]) + 1 if len(later) else len(times))


def _default(mechanism: Mechanism) -> Array:
    return mechanism.assemble({})
