"""How well a motion fits what was measured: markers, ranges of coordinates, filters, errors of tracking."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import degrees
from pathlib import Path

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.fitting.fitted_motion import ADVICE, FittedMotion
from osimlite.fitting.inverse_kinematics import marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.pose_fit import PoseFit
from osimlite.fitting.pose_layout import Marker
from osimlite.fitting.scale_tool import run_scale
from osimlite.io.tables.storage import both_of
from osimlite.lint.trial import Number
from osimlite.mechanics.multibody.parts import CoordinateInfo
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.tools.inverse_kinematics import IKMarkerTask
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.tools.evidence import root_of
from osimlite.tools.job import NONE
from osimlite.tools.trials.folder import MOTIONS, Folder, Missing, Tool

MOST_FRAMES = 500
"""So many frames of a motion, evenly chosen, are compared with the markers."""
BETTER = 0.5
"""Markers that are exchanged leave less than this part of the squares of all errors."""
SAMPLES = 24
"""In so many frames, evenly chosen, they are exchanged."""
FAST = 15.0
"""Nothing that people do on foot is faster, Hz."""
MOVING = np.radians(5.0), 0.02
"""By so much (rad, m) a coordinate changes whose accelerations are looked at."""
PERIODS = 3.0
"""Of `FAST` that a motion lasts of which the content is looked at."""
Numbers = Iterator[tuple[Path, Number]]
"""What was measured, by files."""


def scale_numbers(tool: Tool) -> Numbers:
    """Errors of the markers of a scaled model in the pose of the static trial, before they were moved."""
    placer = tool.setup.marker_placer
    if not placer.apply:
        raise Missing(f"{tool} places no markers")
    result = run_scale(tool.setup, tool.job.file.parent).placed
    if result is None:
        raise Missing(f"{tool} places no markers")
    # Markers that weigh less than a tenth of the others go where their segment takes them.
    tasks = [
        task for task in placer.ik_task_set.objects if task.apply and isinstance(task, IKMarkerTask)
    ]
    weights = {task.name: float(task.weight) for task in tasks}
    most = max(weights.values(), default=0.0)
    pose = result.pose
    chosen = [
        place for place, name in enumerate(pose.markers) if weights.get(name, 1.0) > 0.1 * most
    ]
    errors = pose.marker_errors[:, chosen]
    if not np.isfinite(errors).any():
        raise Missing(f"{tool} fits no marker")
    name = pose.markers[chosen[int(np.nanargmax(np.nanmax(errors, axis=0)))]]
    of = "the errors of the markers in the static pose"
    for kind, value in (("rms", np.sqrt(np.nanmean(errors**2))), ("peak", np.nanmax(errors))):
        where = name if kind == "peak" else ""
        yield (
            tool.job.file,
            Number("scale-marker-error", kind, of, 100.0 * float(value), "cm", where=where),
        )


def marker_numbers(tool: Tool) -> Numbers:
    """Errors of the markers that inverse kinematics was to fit, and pairs of them that were taken for each other."""
    setup, folder = tool.setup, tool.folder
    name = setup.output_motion_file.strip()
    file = None if name in NONE else folder.near(tool.job.result(name))
    if file is None:
        raise Missing(f"the motion of {tool} is missing ('{name}'); run it")
    try:
        motion = _fitted(tool, file)
    except OsimliteError as error:
        errors = tool.result(f"{setup.name}_ik_marker_errors.sto")
        if errors is None:
            raise Missing(f"{error.message}; and there is no file of marker errors") from error
        yield from error_numbers(folder, errors)
        return
    found = motion.summary
    of = "the errors of the markers"
    rms, peak = 100.0 * found["rms_marker_error"], 100.0 * found["largest_marker_error"]
    time = found["worst_time"]
    at = folder.at(file, time)
    where = f"{found['worst_marker']} at {time:g} s"
    each = np.sqrt(
        np.nanmean(
            np.where(np.isfinite(motion.marker_errors), motion.marker_errors, np.nan) ** 2, axis=0
        )
    )
    worst = f"most of {motion.markers[int(np.nanargmax(each))]}, {100.0 * np.nanmax(each):.3g} cm"
    yield file, Number("marker-error", "rms", of, rms, "cm", where=worst, at=folder.place(file, 0))
    yield file, Number("marker-error", "peak", of, peak, "cm", where=where, at=at)
    data = tool.needed("marker_file")
    pairs = [*_exchanged(tool, motion)]
    for one, other, frames in pairs:
        share, times = 100.0 * len(frames) / SAMPLES, motion.times[frames]
        of = (
            f"share of frames in which the markers '{one}' and '{other}' would fit better exchanged"
        )
        where = f"from {times[0]:g} to {times[-1]:g} s"
        yield data, Number("swapped-markers", "share", of, share, "%", where=where)
    if not pairs:
        yield (
            data,
            Number(
                "swapped-markers", "share", "share of frames with markers to exchange", 0.0, "%"
            ),
        )


def error_numbers(folder: Folder, file: Path) -> Numbers:
    """Errors of markers that the tool has written itself."""
    table = folder.table(file)
    of = "the errors of the markers"
    rms = float(np.sqrt(np.mean(table["marker_error_RMS"] ** 2)))
    row = int(np.argmax(table["marker_error_max"]))
    yield file, Number("marker-error", "rms", of, 100.0 * rms, "cm", at=folder.place(file, 0))
    peak, where = 100.0 * float(table["marker_error_max"][row]), f"at {table.times[row]:g} s"
    yield (
        file,
        Number("marker-error", "peak", of, peak, "cm", where=where, at=folder.place(file, row)),
    )


def _fitted(tool: Tool, file: Path) -> FittedMotion:
    """The motion in a file beside the markers that were to be fitted, at the times of both."""
    model, mechanism = tool.model, tool.mechanism
    recorded = tool.folder.motion(file, tool.model_file)
    data = MarkerData.of(tool.needed("marker_file")).between(*both_of(tool.setup.time_range))
    tasks = [
        task
        for task in tool.setup.ik_task_set.objects
        if task.apply and isinstance(task, IKMarkerTask)
    ]
    stations = marker_stations(model, mechanism)
    names = data.shared(
        [*stations], {task.name: task.weight for task in tasks if task.weight > 0.0} or None
    )
    after = np.clip(np.searchsorted(data.times, recorded.times), 1, max(1, len(data.times) - 1))
    after = np.minimum(after, len(data.times) - 1)
    before = np.maximum(after - 1, 0)
    is_before = recorded.times - data.times[before] < data.times[after] - recorded.times
    rows = np.where(is_before, before, after)
    step = float(np.median(np.diff(data.times))) if len(data.times) > 1 else 1.0
    near = np.flatnonzero(np.abs(data.times[rows] - recorded.times) < 0.1 * step)
    if not len(near):
        raise Missing(f"'{file}' and the markers of {tool} have no times in common")
    near = near[np.unique(np.linspace(0, len(near) - 1, min(len(near), MOST_FRAMES)).astype(int))]
    values = recorded.values[near]
    states = [mechanism.at(q) for q in values]
    places = np.array([[state.point(*stations[name]) for name in names] for state in states])
    nothing = np.zeros(len(values))
    return FittedMotion(
        mechanism,
        recorded.times[near],
        values,
        tuple(names),
        data.only(names)[rows[near]],
        places,
        nothing,
        nothing,
    )


def _exchanged(tool: Tool, motion: FittedMotion) -> Iterator[tuple[str, str, Array]]:
    """Pairs of markers that would fit much better exchanged, with the numbers of frames in which that is so.

    A pose is fitted anew for every pair, in the frame that fits worst.
    """
    errors = motion.marker_errors
    seen = np.where(np.isfinite(errors), errors, 0.0)
    worst = int(np.argmax(seen.max(axis=1)))
    if seen[worst].max() < ADVICE[1] or len(motion.markers) < 2:
        return
    stations = marker_stations(tool.model, motion.mechanism)
    weights = {task.name: float(task.weight) for task in tool.setup.ik_task_set.objects}
    fit = PoseFit(
        motion.mechanism,
        [Marker(stations[name], weights.get(name, 1.0)) for name in motion.markers],
    )

    def cost(frame: int, pair: tuple[int, int] = (0, 0)) -> float:
        order = np.arange(len(motion.markers))
        order[list(pair)] = order[list(reversed(pair))]
        measured = motion.measured[frame : frame + 1, order].reshape(1, -1)
        return float(
            fit.fit(measured, motion.times[frame : frame + 1], motion.values[frame]).costs[0]
        )

    frames = np.unique(np.linspace(0, len(motion.times) - 1, SAMPLES).astype(int))
    own = {frame: cost(frame) for frame in (worst, *frames.tolist())}
    costs = {pair: cost(worst, pair) for pair in combinations(range(len(motion.markers)), 2)}
    one, other = min(costs, key=lambda pair: costs[pair])
    if costs[one, other] < BETTER * own[worst]:
        better = [
            frame for frame in frames.tolist() if cost(frame, (one, other)) < BETTER * own[frame]
        ]
        yield motion.markers[one], motion.markers[other], np.array(better or [worst])


def range_numbers(tool: Tool, file: Path) -> Numbers:
    """By how much a motion leaves the ranges of the coordinates of a model; those of the joint to ground have none."""
    motion, mechanism = tool.folder.motion(file, tool.model_file), tool.mechanism
    root, beyond = root_of(mechanism), 0
    for place, info in enumerate(mechanism.coordinates):
        low, high = info.range
        excess = np.maximum(low - motion.values[:, place], motion.values[:, place] - high)
        row = int(np.argmax(excess))
        size = _sized(info, float(excess[row]))
        if place in root or info.name in motion.missing or info.locked or size < 0.05:
            continue
        beyond += 1
        most = f"{_sized(info, low):.3g} to {_sized(info, high):.3g} {_unit(info)}"
        time, unit = float(motion.times[row]), _unit(info)
        where, of = f"at {time:g} s, the range is {most}", f"'{info.name}' beyond its range"
        yield (
            file,
            Number(
                "beyond-range", "peak", of, size, unit, where=where, at=tool.folder.at(file, time)
            ),
        )
    if not beyond:
        yield file, Number("beyond-range", "peak", "coordinates beyond their ranges", 0.0, "deg")


def tracking_numbers(folder: Folder, file: Path, tool: Tool | None) -> Numbers:
    """By how much RRA or CMC missed the motion."""
    table = folder.table(file)
    infos = {} if tool is None else {info.name: info for info in tool.mechanism.coordinates}
    for name in table.columns:
        info = infos.get(name)
        turning = (
            info.motion_type == "rotational"
            if info is not None
            else not name.endswith(("_tx", "_ty", "_tz"))
        )
        column = np.abs(table[name]) * (
            100.0 if not turning else 1.0 if table.in_degrees else degrees(1.0)
        )
        row, unit = int(np.argmax(column)), "deg" if turning else "cm"
        of = f"the error of '{name}'"
        where, at = f"at {table.times[row]:g} s", folder.place(file, row)
        yield (
            file,
            Number("tracking-error", "peak", of, float(column[row]), unit, where=where, at=at),
        )
        kind, value = "rms" if turning else "rms-translation", float(np.sqrt(np.mean(column**2)))
        yield file, Number("tracking-error", kind, of, value, unit, at=folder.place(file, 0))


def filter_numbers(tool: Tool) -> Numbers:
    """What the filter of a tool takes away of its motion, and what it leaves of noise."""
    file = tool.needed(*MOTIONS)
    motion = tool.motion
    first, last = (min(max(time, motion.times[0]), motion.times[-1]) for time in tool.span)
    if tool.cutoff > 0.0:
        filtered = motion.lowpassed(tool.cutoff)
        own = (motion.times >= first) & (motion.times <= last)
        worst, size, unit = "", 0.0, "deg"
        for place, info in enumerate(motion.mechanism.coordinates):
            column = np.interp(motion.times[own], filtered.times, filtered.values[:, place])
            lost = _sized(info, float(np.sqrt(np.mean((column - motion.values[own, place]) ** 2))))
            if lost > size:
                worst, size, unit = info.name, lost, _unit(info)
        of = f"change of '{worst}' (root mean square) by the filter of {tool.cutoff:g} Hz"
        yield tool.job.file, Number("filter-content", "change", of, size, unit)
        motion = filtered
    if _is_from_markers(file) and (share := _noise(motion, first, last)) is not None:
        of = "noise: the power of the accelerations above 15 Hz, of all"
        how = (
            f"the motion is filtered at {tool.cutoff:g} Hz"
            if tool.cutoff > 0.0
            else "the motion is not filtered"
        )
        yield tool.job.file, Number("filter-content", "noise", of, 100.0 * share, "%", side=how)


def _is_from_markers(file: Path) -> bool:
    """Whether a motion was made by inverse kinematics, not by a tool that moves the model by forces."""
    return not file.name.endswith(("_Kinematics_q.sto", "_states.sto", "_q.mot"))


def _noise(motion: RecordedMotion, first: float, last: float) -> float | None:
    """The median share of the power of accelerations above 15 Hz; None if that cannot be told."""
    own = (motion.times >= first) & (motion.times <= last)
    times = motion.times[own]
    if len(times) < 8 or times[-1] - times[0] < PERIODS / FAST:
        return None
    step = (times[-1] - times[0]) / (len(times) - 1)
    values, even = motion.values[own], np.linspace(times[0], times[-1], len(times))
    if step > 0.5 / (1.5 * FAST):
        return None
    shares = []
    frequencies = np.fft.rfftfreq(len(times), step)
    for place, info in enumerate(motion.mechanism.coordinates):
        if np.ptp(values[:, place]) < MOVING[info.motion_type != "rotational"]:
            continue
        acceleration = np.interp(even, times, motion.rates[1][own, place])
        power = (
            np.abs(np.fft.rfft((acceleration - acceleration.mean()) * np.hanning(len(times)))) ** 2
        )
        shares.append(float(power[frequencies > FAST].sum() / (power.sum() or 1.0)))
    return float(np.median(shares)) if shares else None


def _sized(info: CoordinateInfo, value: float) -> float:
    """A value in the unit of :func:`_unit`."""
    return degrees(value) if info.motion_type == "rotational" else 100.0 * value


def _unit(info: CoordinateInfo) -> str:
    return "deg" if info.motion_type == "rotational" else "cm"
