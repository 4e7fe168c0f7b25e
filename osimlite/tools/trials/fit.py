"""Measurements of a motion: marker errors, ranges of coordinates, filters and tracking errors."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import degrees
from pathlib import Path

import numpy as np

from osimlite.base.text import append_clause
from osimlite.errors import OsimliteError
from osimlite.fitting.fitted_motion import MARKER_ERROR_LIMITS_M, FittedMotion
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import MarkerTarget
from osimlite.fitting.scale_tool import compute_scaled_model
from osimlite.io.tables.storage import expect_time_range
from osimlite.lint.trial import Measurement
from osimlite.mechanics.multibody.parts import CoordinateInfo
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.tools.ik_tasks import IKMarkerTask
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.tools.evidence import find_root_coordinates
from osimlite.tools.job import NO_FILE
from osimlite.tools.trials.folder import MOTIONS, MissingInput, TrialFolder, TrialTool

MAX_FRAMES = 500
"""Number of frames of a motion, evenly spread, that are compared with the markers."""
MAX_COST_RATIO = 0.5
"""Largest ratio of the costs with and without an exchange of two markers that proves a swap."""
SWAP_FRAMES = 24
"""Number of frames, evenly spread, in which two markers are exchanged."""
MAX_MOVEMENT_HZ = 15.0
"""Highest frequency of human movement on foot, Hz."""
MIN_CHANGE = np.radians(5.0), 0.02
"""Smallest range (rad, m) of a coordinate whose accelerations are analysed."""
MIN_PERIODS = 3.0
"""Shortest motion that is analysed, in periods of `MAX_MOVEMENT_HZ`."""
Numbers = Iterator[tuple[Path, Measurement]]
"""Measured numbers with their files."""


def measure_scale_errors(tool: TrialTool) -> Numbers:
    """Yield marker errors of a scaled model in its static pose, before the markers are moved.

    Raises:
        MissingInput: the tool places no markers, or none of the markers with large weights was
            measured.
    """
    placer = tool.setup.marker_placer
    if not placer.apply:
        raise MissingInput(f"{tool} places no markers")
    result = compute_scaled_model(tool.setup, tool.job.file.parent).placed
    if result is None:
        raise MissingInput(f"{tool} places no markers")
    # Markers with less than a tenth of the largest weight hardly influence the pose.
    tasks = [
        task for task in placer.ik_task_set.objects if task.apply and isinstance(task, IKMarkerTask)
    ]
    weights = {task.name: float(task.weight) for task in tasks}
    largest_weight = max(weights.values(), default=0.0)
    pose = result.pose
    selected = [
        index
        for index, name in enumerate(pose.markers)
        if weights.get(name, 1.0) > 0.1 * largest_weight
    ]
    errors = pose.marker_errors[:, selected]
    if not np.isfinite(errors).any():
        raise MissingInput(f"{tool} fits no marker")
    name = pose.markers[selected[int(np.nanargmax(np.nanmax(errors, axis=0)))]]
    subject = "the errors of the markers in the static pose"
    for statistic, value in (("rms", np.sqrt(np.nanmean(errors**2))), ("peak", np.nanmax(errors))):
        worst_name = name if statistic == "peak" else ""
        yield (
            tool.job.file,
            Measurement(
                "scale-marker-error",
                statistic,
                subject,
                100.0 * float(value),
                "cm",
                where=worst_name,
            ),
        )


def measure_marker_errors(tool: TrialTool) -> Numbers:
    """Return an iterator over marker errors of inverse kinematics and swapped markers.

    Yields:
        File, and the number that was measured from it.

    Raises:
        MissingInput: the motion does not exist, or neither the markers nor a file of marker errors
            can be read.
    """
    setup, folder = tool.setup, tool.folder
    name = setup.output_motion_file.strip()
    file = None if name in NO_FILE else folder.find_file(tool.job.get_output_path(name))
    if file is None:
        raise MissingInput(f"the motion of {tool} is missing ('{name}'); run this setup")
    try:
        motion = _read_fitted_motion(tool, file)
    # Without the model or the markers, the errors that the tool itself wrote have to do.
    except OsimliteError as error:
        errors = tool.find_result(f"{setup.name}_ik_marker_errors.sto")
        if errors is None:
            raise MissingInput(
                append_clause(error.message, "a file of marker errors is missing, too")
            ) from error
        yield from measure_written_errors(folder, errors)
        return
    summary = motion.summary
    subject = "the errors of the markers"
    rms = 100.0 * summary["rms_marker_error"]
    peak = 100.0 * summary["largest_marker_error"]
    time = summary["worst_time"]
    position = folder.locate_time(file, time)
    location = f"{summary['worst_marker']} at {time:g} s"
    rms_by_marker = np.sqrt(
        np.nanmean(
            np.where(np.isfinite(motion.marker_errors), motion.marker_errors, np.nan) ** 2, axis=0
        )
    )
    worst_marker = motion.markers[int(np.nanargmax(rms_by_marker))]
    worst_note = f"over all markers; the largest of one marker is {100.0 * np.nanmax(rms_by_marker):.3g} cm, {worst_marker}"
    yield (
        file,
        Measurement(
            "marker-error",
            "rms",
            subject,
            rms,
            "cm",
            where=worst_note,
            at=folder.locate_row(file, 0),
        ),
    )
    yield (
        file,
        Measurement("marker-error", "peak", subject, peak, "cm", where=location, at=position),
    )
    data = tool.require_input("marker_file")
    pairs = [*_find_swapped_markers(tool, motion)]
    for first_name, second_name, frames in pairs:
        percentage = 100.0 * len(frames) / SWAP_FRAMES
        times = motion.times[frames]
        subject = f"share of frames in which the markers '{first_name}' and '{second_name}' fit better if swapped"
        location = f"from {times[0]:g} to {times[-1]:g} s"
        yield (
            data,
            Measurement("swapped-markers", "share", subject, percentage, "%", where=location),
        )
    if not pairs:
        yield (
            data,
            Measurement(
                "swapped-markers",
                "share",
                "share of frames in which two markers fit better if swapped",
                0.0,
                "%",
            ),
        )


def measure_written_errors(folder: TrialFolder, file: Path) -> Numbers:
    """Yield marker errors from a file that the tool wrote.

    Args:
        folder: files of the trial.
        file: table of marker errors.
    """
    table = folder.read_table(file)
    subject = "the errors of the markers"
    rms = float(np.sqrt(np.mean(table["marker_error_RMS"] ** 2)))
    row = int(np.argmax(table["marker_error_max"]))
    yield (
        file,
        Measurement(
            "marker-error", "rms", subject, 100.0 * rms, "cm", at=folder.locate_row(file, 0)
        ),
    )
    peak = 100.0 * float(table["marker_error_max"][row])
    time_note = f"at {table.times[row]:g} s"
    yield (
        file,
        Measurement(
            "marker-error",
            "peak",
            subject,
            peak,
            "cm",
            where=time_note,
            at=folder.locate_row(file, row),
        ),
    )


def _read_fitted_motion(tool: TrialTool, file: Path) -> FittedMotion:
    """Return the motion in a file with the measured markers, at the times of both.

    Args:
        tool: setup of the class InverseKinematicsTool.
        file: table of its motion.

    Raises:
        MissingInput: the motion and the markers have no times in common.
    """
    model, mechanism = tool.model, tool.mechanism
    recorded = tool.folder.read_motion(file, tool.model_file)
    data = MarkerData.from_source(tool.require_input("marker_file")).select_times(
        *expect_time_range(tool.setup.time_range)
    )
    tasks = [
        task
        for task in tool.setup.ik_task_set.objects
        if task.apply and isinstance(task, IKMarkerTask)
    ]
    stations = find_marker_stations(model, mechanism)
    names = data.find_shared_names(
        [*stations], {task.name: task.weight for task in tasks if task.weight > 0.0} or None
    )
    # Find the frame of the markers that is nearest to each time of the motion.
    rows_after = np.clip(
        np.searchsorted(data.times, recorded.times), 1, max(1, len(data.times) - 1)
    )
    rows_after = np.minimum(rows_after, len(data.times) - 1)
    rows_before = np.maximum(rows_after - 1, 0)
    is_before = recorded.times - data.times[rows_before] < data.times[rows_after] - recorded.times
    rows = np.where(is_before, rows_before, rows_after)
    step = float(np.median(np.diff(data.times))) if len(data.times) > 1 else 1.0
    # Times in files are rounded, so that those of one frame may differ slightly.
    matched_rows = np.flatnonzero(np.abs(data.times[rows] - recorded.times) < 0.1 * step)
    if not len(matched_rows):
        raise MissingInput(f"'{file}' and the markers of {tool} have no times in common")
    matched_rows = matched_rows[
        np.unique(
            np.linspace(0, len(matched_rows) - 1, min(len(matched_rows), MAX_FRAMES)).astype(int)
        )
    ]
    values = recorded.values[matched_rows]
    states = [mechanism.at(q) for q in values]
    positions = np.array([[state.point(*stations[name]) for name in names] for state in states])
    zeros = np.zeros(len(values))
    return FittedMotion(
        mechanism,
        recorded.times[matched_rows],
        values,
        tuple(names),
        data.select_values(names)[rows[matched_rows]],
        positions,
        zeros,
        zeros,
    )


def _find_swapped_markers(
    tool: TrialTool, motion: FittedMotion
) -> Iterator[tuple[str, str, Array]]:
    """Yield pairs of markers that fit much better if they are exchanged.

    The pose of the frame with the largest error is fitted again for every pair.

    Args:
        tool: setup of the class InverseKinematicsTool.
        motion: motion that the tool has fitted.

    Yields:
        Names of both markers, and the numbers of the frames in which the exchange fits better.
    """
    errors = motion.marker_errors
    finite_errors = np.where(np.isfinite(errors), errors, 0.0)
    worst_frame = int(np.argmax(finite_errors.max(axis=1)))
    # A swap moves two markers far: without a large error there was no swap.
    if finite_errors[worst_frame].max() < MARKER_ERROR_LIMITS_M[1] or len(motion.markers) < 2:
        return
    stations = find_marker_stations(tool.model, motion.mechanism)
    weights = {task.name: float(task.weight) for task in tool.setup.ik_task_set.objects}
    pose_fit = PoseFit(
        motion.mechanism,
        [MarkerTarget(stations[name], weights.get(name, 1.0)) for name in motion.markers],
    )

    def compute_cost(frame: int, pair: tuple[int, int] = (0, 0)) -> float:
        order = np.arange(len(motion.markers))
        # The default pair exchanges a marker with itself, which keeps the order.
        order[list(pair)] = order[list(reversed(pair))]
        measured = motion.measured[frame : frame + 1, order].reshape(1, -1)
        return float(
            pose_fit.fit_frames(
                measured, motion.times[frame : frame + 1], motion.values[frame]
            ).costs[0]
        )

    frames = np.unique(np.linspace(0, len(motion.times) - 1, SWAP_FRAMES).astype(int))
    costs_in_order = {frame: compute_cost(frame) for frame in (worst_frame, *frames.tolist())}
    # All pairs are tried in the worst frame only: m markers have m (m - 1) / 2 pairs, and each
    # needs a fit.
    costs = {
        pair: compute_cost(worst_frame, pair)
        for pair in combinations(range(len(motion.markers)), 2)
    }
    first, second = min(costs, key=lambda pair: costs[pair])
    if costs[first, second] < MAX_COST_RATIO * costs_in_order[worst_frame]:
        better_frames = [
            frame
            for frame in frames.tolist()
            if compute_cost(frame, (first, second)) < MAX_COST_RATIO * costs_in_order[frame]
        ]
        yield (
            motion.markers[first],
            motion.markers[second],
            # The worst frame may lie between the sampled ones.
            np.array(better_frames or [worst_frame]),
        )


def measure_ranges(tool: TrialTool, file: Path) -> Numbers:
    """Yield the amounts by which a motion leaves the ranges of coordinates.

    The coordinates of the joint to ground do not count.

    Args:
        tool: tool with the model.
        file: table of the motion.
    """
    motion = tool.folder.read_motion(file, tool.model_file)
    mechanism = tool.mechanism
    root = find_root_coordinates(mechanism)
    violation_count = 0
    for index, info in enumerate(mechanism.coordinates):
        lower, upper = info.range
        excess = np.maximum(lower - motion.values[:, index], motion.values[:, index] - upper)
        row = int(np.argmax(excess))
        # Up to 0.05 degrees or cm may come from the rounding of files.
        size = _to_display_unit(info, float(excess[row]))
        # Ranges of the joint to ground mean nothing; missing columns have default values.
        if index in root or info.name in motion.missing or info.locked or size < 0.05:
            continue
        violation_count += 1
        range_text = f"{_to_display_unit(info, lower):.3g} to {_to_display_unit(info, upper):.3g} {_get_display_unit(info)}"
        time = float(motion.times[row])
        unit = _get_display_unit(info)
        location = f"at {time:g} s, the range is {range_text}"
        subject = f"'{info.name}' beyond its range"
        yield (
            file,
            Measurement(
                "beyond-range",
                "peak",
                subject,
                size,
                unit,
                where=location,
                at=tool.folder.locate_time(file, time),
            ),
        )
    if not violation_count:
        yield (
            file,
            Measurement(
                "beyond-range", "peak", "the distance of coordinates from their ranges", 0.0, "deg"
            ),
        )


def measure_tracking_errors(folder: TrialFolder, file: Path, tool: TrialTool | None) -> Numbers:
    """Yield the tracking errors of RRA or CMC.

    Args:
        folder: files of the trial.
        file: table of the errors.
        tool: setup of the tool; None if it is missing.
    """
    table = folder.read_table(file)
    infos = {} if tool is None else {info.name: info for info in tool.mechanism.coordinates}
    for name in table.columns:
        info = infos.get(name)
        # Without a setup only the name tells the unit: translations in OpenSim's models end in _tx,
        # _ty and _tz.
        turning = (
            info.motion_type == "rotational"
            if info is not None
            else not name.endswith(("_tx", "_ty", "_tz"))
        )
        column = np.abs(table[name]) * (
            100.0 if not turning else 1.0 if table.in_degrees else degrees(1.0)
        )
        row = int(np.argmax(column))
        unit = "deg" if turning else "cm"
        subject = f"the error of '{name}'"
        time_note = f"at {table.times[row]:g} s"
        position = folder.locate_row(file, row)
        yield (
            file,
            Measurement(
                "tracking-error",
                "peak",
                subject,
                float(column[row]),
                unit,
                where=time_note,
                at=position,
            ),
        )
        statistic = "rms" if turning else "rms-translation"
        value = float(np.sqrt(np.mean(column**2)))
        yield (
            file,
            Measurement(
                "tracking-error", statistic, subject, value, unit, at=folder.locate_row(file, 0)
            ),
        )


def measure_filter(tool: TrialTool) -> Numbers:
    """Yield the part of a motion that a filter removes, and the noise that it leaves."""
    file = tool.require_input(*MOTIONS)
    motion = tool.motion
    start, end = (min(max(time, motion.times[0]), motion.times[-1]) for time in tool.span)
    if tool.cutoff > 0.0:
        filtered = motion.apply_lowpass(tool.cutoff)
        in_span = (motion.times >= start) & (motion.times <= end)
        most_changed, size, unit = "", 0.0, "deg"
        for index, info in enumerate(motion.mechanism.coordinates):
            column = np.interp(motion.times[in_span], filtered.times, filtered.values[:, index])
            removed = _to_display_unit(
                info, float(np.sqrt(np.mean((column - motion.values[in_span, index]) ** 2)))
            )
            if removed > size:
                most_changed = info.name
                size = removed
                unit = _get_display_unit(info)
        subject = (
            f"change of '{most_changed}' (root mean square) by the filter of {tool.cutoff:g} Hz"
        )
        yield tool.job.file, Measurement("filter-content", "change", subject, size, unit)
        motion = filtered
    if (
        _is_from_markers(file)
        and (noise_fraction := _measure_noise(motion, start, end)) is not None
    ):
        subject = "noise: the part of the power of the accelerations that is above 15 Hz"
        filter_note = (
            f"the motion is filtered at {tool.cutoff:g} Hz"
            if tool.cutoff > 0.0
            else "the motion is not filtered"
        )
        yield (
            tool.job.file,
            Measurement(
                "filter-content", "noise", subject, 100.0 * noise_fraction, "%", side=filter_note
            ),
        )


def _is_from_markers(file: Path) -> bool:
    """Return whether inverse kinematics made a motion, and not a tool that integrates."""
    # A motion of RRA or CMC is integrated and therefore smooth; it says nothing about the markers.
    return not file.name.endswith(("_Kinematics_q.sto", "_states.sto", "_q.mot"))


def _measure_noise(motion: RecordedMotion, start: float, end: float) -> float | None:
    """Return the median share of the accelerations' power above 15 Hz; None if it is unknown.

    Args:
        motion: motion of the trial.
        start: first time, s.
        end: last time, s.
    """
    in_span = (motion.times >= start) & (motion.times <= end)
    times = motion.times[in_span]
    if len(times) < 8 or times[-1] - times[0] < MIN_PERIODS / MAX_MOVEMENT_HZ:
        return None
    step = (times[-1] - times[0]) / (len(times) - 1)
    values = motion.values[in_span]
    even_times = np.linspace(times[0], times[-1], len(times))
    # Slower sampling has no frequencies well above the limit (half of the rate, Nyquist).
    if step > 0.5 / (1.5 * MAX_MOVEMENT_HZ):
        return None
    noise_shares = []
    frequencies = np.fft.rfftfreq(len(times), step)
    for index, info in enumerate(motion.mechanism.coordinates):
        # The accelerations of a coordinate that hardly moves are noise in any trial.
        if np.ptp(values[:, index]) < MIN_CHANGE[info.motion_type != "rotational"]:
            continue
        # Resample evenly for the Fourier transform; a Hann window removes the ends.
        acceleration = np.interp(even_times, times, motion.rates[1][in_span, index])
        power = (
            np.abs(np.fft.rfft((acceleration - acceleration.mean()) * np.hanning(len(times)))) ** 2
        )
        noise_shares.append(
            float(power[frequencies > MAX_MOVEMENT_HZ].sum() / (power.sum() or 1.0))
        )
    # The median, so that one noisy coordinate does not decide.
    return float(np.median(noise_shares)) if noise_shares else None


def _to_display_unit(info: CoordinateInfo, value: float) -> float:
    """Return a value in the unit of :func:`_get_display_unit`."""
    return degrees(value) if info.motion_type == "rotational" else 100.0 * value


def _get_display_unit(info: CoordinateInfo) -> str:
    """Return the unit in which a coordinate is shown, degrees or cm."""
    return "deg" if info.motion_type == "rotational" else "cm"
