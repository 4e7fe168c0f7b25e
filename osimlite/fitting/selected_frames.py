"""Frames that represent several trials when a model is fitted to a person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from osimlite.base.text import format_count, join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.inverse_kinematics import check_weight
from osimlite.fitting.marker_data import MarkerData
from osimlite.mechanics.multibody.spatial import Array

STATIC_TRIAL = "static"
"""Name of the trial in which the subject stands."""
STATIC_FRAME_FRACTION = 0.05
"""Share of the frames that come from the static trial."""
MIN_MARKERS = 3
"""Smallest number of markers in a frame that is used."""
OUTLIER_RATIO = 6.0
"""Distance of an outlier, relative to the median distance of its marker."""
OUTLIER_DISTANCE_M = 0.05
"""Smallest distance of an outlier, m: the marker was taken for another."""


class SelectedFrames:
    """Selected frames of all trials.

    Args:
        trials: measured markers by the name of the trial.
        known_names: names of the markers of the model.
        count: number of frames.
        weights: weights of markers by name; the others have weight 1.

    Attributes:
        markers: names of the m markers that the model and a trial have, and whose weight is
            positive.
        weights: weights of these markers (m,).
        trials: name of the trial of each frame.
        times: times of the frames (t,), s.
        measured: positions (t, m, 3), m; NaN where a marker was not seen.
        notes: messages about trials and markers that are left out.
    """

    def __init__(
        self,
        trials: Mapping[str, MarkerData],
        known_names: Sequence[str],
        count: int,
        weights: Mapping[str, float],
    ) -> None:
        for name, weight in weights.items():
            if name not in known_names:
                raise SettingError(
                    f"the model has no marker '{name}'{suggest_name(name, known_names)}"
                )
            check_weight(weight, f"'{name}'")
        if count < 1:
            raise SettingError(f"expected at least 1 frame, found {count}")
        shared_names = {
            name for trial in trials.values() for name in trial.find_shared_names(known_names)
        }
        self.markers = [
            name for name in known_names if name in shared_names and weights.get(name, 1.0) > 0.0
        ]
        if not self.markers:
            raise SettingError("no marker has a positive weight; set one")
        self.weights = np.array([weights.get(name, 1.0) for name in self.markers])
        self.trials = list[str]()
        self.notes = list[str]()
        times = list[float]()
        measured = list[Array]()
        moving_frame_count = sum(
            len(trial.times) for name, trial in trials.items() if name != STATIC_TRIAL
        )
        for name, trial in trials.items():
            frame_fraction = (
                STATIC_FRAME_FRACTION
                if name == STATIC_TRIAL and moving_frame_count
                else len(trial.times) / max(moving_frame_count, 1)
            )
            # All trials have the same columns; markers that a trial lacks are NaN.
            rows = np.full((len(trial.times), len(self.markers), 3), np.nan)
            for index, marker in enumerate(self.markers):
                if marker in trial.names:
                    rows[:, index] = trial.positions[:, trial.names.index(marker)]
            # Fewer markers than three do not determine the pose of any segment.
            usable_frames = np.flatnonzero(np.isfinite(rows).all(axis=2).sum(axis=1) >= MIN_MARKERS)
            # Each trial contributes at least one frame.
            selected_count = max(1, round(count * min(frame_fraction, 1.0)))
            for frame in (
                usable_frames[
                    np.unique(
                        np.linspace(0, len(usable_frames) - 1, selected_count).round().astype(int)
                    )
                ]
                if len(usable_frames)
                else ()
            ):
                self.trials.append(name)
                times.append(float(trial.times[frame]))
                measured.append(rows[frame])
            if not len(usable_frames):
                self.notes.append(f"'{name}' is left out: no frame has three markers of the model")
        if not measured:
            raise SettingError("no frame of any trial has three markers of the model")
        self.times = np.array(times)
        self.measured = np.array(measured)
        self.measured[~np.isfinite(self.measured).all(axis=2)] = np.nan

    def exclude_outliers(self, positions: Array) -> bool:
        """Exclude measured positions that are much farther from fitted ones than usual.

        Args:
            positions: fitted positions of the markers (t, m, 3), m.

        Returns:
            Whether any position was excluded.
        """
        distances = np.linalg.norm(positions - self.measured, axis=2)
        with np.errstate(all="ignore"):
            # The median is robust against the outliers themselves.
            median_distances = np.array(
                [
                    np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0
                    for column in distances.T
                ]
            )
        # A swapped marker pulls its neighbours along; only the worst ones of a frame are outliers.
        with np.errstate(invalid="ignore"):
            largest_in_frame = np.nanmax(
                np.where(np.isfinite(distances), distances, 0.0), axis=1, keepdims=True
            )
            is_outlier = (
                distances > np.maximum(OUTLIER_RATIO * median_distances, OUTLIER_DISTANCE_M)
            ) & (distances > 0.5 * largest_in_frame)
        for index in np.flatnonzero(is_outlier.any(axis=0)):
            trial_names = sorted(
                {self.trials[frame] for frame in np.flatnonzero(is_outlier[:, index])}
            )
            number = format_count(int(is_outlier[:, index].sum()), "frame")
            self.notes.append(
                f"{self.markers[index]} is left out in {number} of {join_words(trial_names)}: up to "
                f"{100.0 * np.nanmax(distances[:, index]):.0f} cm from its fitted position; it may be labelled as "
                "another marker there"
            )
        self.measured[is_outlier] = np.nan
        return bool(is_outlier.any())
