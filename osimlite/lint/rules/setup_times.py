"""OSIM844 to OSIM847: the times, the frequencies and the units of the tables that a setup names."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from typing import Any

from osimlite.base.quantity import LARGEST_JOINT_ANGLE
from osimlite.base.text import format_count
from osimlite.io.tables.headers import MarkerHeader
from osimlite.lint.diagnostic import Severity
from osimlite.lint.posture import coordinate_name, find_angles
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.rules.setup_columns import find_motions
from osimlite.lint.setup import Setup, names_file, select_members
from osimlite.lint.table import Table
from osimlite.lint.words import describe_object
from osimlite.schema.base import Object
from osimlite.schema.specs import get_field_specs
from osimlite.schema.tree import is_a

_FIRST_STATES = 0.03
"""Time that computed muscle control runs to find the states of muscles at the start, s."""
_MIN_JOINTS = 4
"""Smallest number of joint angles that do not all stay near 0 during a motion."""
_RATE_TOLERANCE = 1e-9
"""Relative rounding error of a rate that is computed from times."""
_USUAL_WINDOW = 0.01
"""Default window of computed muscle control, s."""


_TOOL_EXAMPLE = '<{0} name="run">\n    <model_file>leg.osim</model_file>\n    {{}}\n    {1}\n</{0}>'
_FRAMES = {
    "ik": _TOOL_EXAMPLE.format(
        "InverseKinematicsTool", "<output_motion_file>ik.mot</output_motion_file>"
    ),
    "dynamics": _TOOL_EXAMPLE.format(
        "InverseDynamicsTool", "<coordinates_file>leg.mot</coordinates_file>"
    ),
    "any": _TOOL_EXAMPLE.format("InverseDynamicsTool", "<time_range>0 0.05</time_range>"),
    "control": _TOOL_EXAMPLE.format(
        "CMCTool",
        "<desired_kinematics_file>leg.mot</desired_kinematics_file> "
        "<task_set_file>tasks.xml</task_set_file>",
    ),
}


_FAULTS = """\
01 time-count, error, in dynamics: A time range does not have two times. With fewer times the tool fails, or reads
an undefined time. Of more times OpenSim uses the first two.
- <time_range>0</time_range>
+ <time_range>0 0.5</time_range>
02 few-rows, error, in any: A motion has fewer than six rows. OpenSim needs at least six for its spline.
- <coordinates_file>short.mot</coordinates_file>
+ <coordinates_file>leg.mot</coordinates_file>
03 impossible-times, error, in dynamics: A time range of a tool or an analysis is reversed or not a number. The tool
fails, writes tables without rows, or uses other times.
- <time_range>0.5 0</time_range>
+ <time_range>0 0.5</time_range>
04 too-short-for-control, error, in control: The time range of computed muscle control is too short. It needs 0.03 s for the first
states, and then one time window (`cmc_time_window`).
- <initial_time>0</initial_time> <final_time>0.02</final_time>
+ <initial_time>0</initial_time> <final_time>0.5</final_time>
05 no-data-at-times, error, in dynamics: A tool runs completely before or after its data. The tool fails, crashes, or
computes one row at the end of the data. Scaling uses the first or the last frame; that is a warning.
- <time_range>5 6</time_range>
+ <time_range>0 0.5</time_range>
06 stops-at-default, warning, in ik: A tool has no end time and its data continue. Inverse kinematics stops at 2 s: OpenSim
4.6 intends to use all data, but does not.
- <marker_file>slow.trc</marker_file>
+ <marker_file>slow.trc</marker_file> <time_range>0 2.5</time_range>
07 data-end-early, warning, in dynamics: The data end before the last time of the tool. Some tools stop there without a message,
others extrapolate a spline.
- <time_range>0 9</time_range>
+ <time_range>0 0.5</time_range>
08 data-begin-late, warning, in dynamics: The data begin after the first time of the tool. Some tools begin there without a
message, others extrapolate a spline.
- <time_range>-1 0.5</time_range>
+ <time_range>0 0.5</time_range>
"""


@rule(
    "OSIM844", "time-outside-data", severity=WARNING, about="document", faults=_FAULTS,
    frames={name: f"```setup\n{frame}\n```" for name, frame in _FRAMES.items()},
)  # fmt: skip
def report_time_outside_data(setup: Setup, report: FindingCollector) -> None:
    """The time range of a tool is invalid or outside its data.

    Compares the times of a tool with those of the tables that it reads: markers, coordinates,
    sensors. Computed muscle control needs at least 0.03 s plus its time window (`cmc_time_window`).

    Inverse kinematics cuts the times to the data without a message. Without a time range it stops
    at 2 s: OpenSim 4.6 intends to use all data, but does not. If times are in the wrong order, or
    completely outside the data, the tools fail or crash; these findings are errors.
    """
    for item in setup.find_having("time_range"):
        count = len(item.time_range)
        # A disabled loads or task object has a time range that OpenSim does not read.
        if count != 2 and getattr(item, "apply", True):
            consequence, severity = ("takes the first two", WARNING)
            if count < 2:
                # Only inverse dynamics does not look at the number of times.
                consequence = (
                    "reads beyond the end of the list"
                    if is_a(item, "InverseDynamicsTool")
                    else "fails"
                )
                severity = ERROR
            report(
                f"expected two times in a range, found {count}: OpenSim {consequence}",
                item,
                tag="time_range",
                severity=severity,
                fault="time-count",
            )
    for item, tag, motion in find_motions(setup):
        if 0 < motion.rows.count < 6:
            report(
                f"'{getattr(item, tag)}' has {format_count(motion.rows.count, 'row')}: OpenSim needs "
                "at least six for its spline",
                item,
                tag=tag,
                fault="few-rows",
            )
    for item, tags, first, last in _find_time_ranges(setup):
        if first != first or last != last:
            consequence, severity, tag = _describe_unknown_time(item, tags, first != first)
            report(
                f"a time of {describe_object(item)} is not a number: OpenSim {consequence}",
                item,
                tag=tag,
                severity=severity,
                fault="impossible-times",
            )
            continue
        # Only tools must run for some time; AnalyzeTool can analyze one moment.
        if first > last or (
            first == last and is_a(item, "AbstractTool") and not is_a(item, "AnalyzeTool")
        ):
            # Either of the two may be wrong.
            consequence, severity = ("fails", ERROR)
            if is_a(item, "Analysis"):
                consequence, severity = ("uses the times of the tool", WARNING)
            elif is_a(item, "AnalyzeTool"):
                # Static optimization crashes.
                consequence = "writes tables without rows, or crashes"
            for tag in tags:
                report(
                    f"{describe_object(item)} begins at {first:g} s and ends at {last:g} s: "
                    f"OpenSim {consequence}",
                    item,
                    tag=tag,
                    severity=severity,
                    fault="impossible-times",
                )
            continue
        window = getattr(item, "cmc_time_window", math.nan)
        # Without the property the window is NaN, and the comparison false: only computed muscle
        # control has one.
        if last - first < _FIRST_STATES + window:
            report(
                f"{describe_object(item)} runs for {last - first:.4g} s, but needs "
                f"{_FIRST_STATES + window:g} s for its first controls: OpenSim fails",
                item,
                # The window is blamed if it is larger than the default, else the time range.
                tag="cmc_time_window" if window > _USUAL_WINDOW else tags[-1],
                fault="too-short-for-control",
            )
        filter_note = ""
        if getattr(item, "lowpass_cutoff_frequency_for_coordinates", 0.0) > 0.0:
            # Inverse dynamics and the analyses compute rows there as well.
            filter_note = (
                ": the filter extrapolates the motion, and OpenSim also computes rows there"
            )
        for name, kind in _list_tables(item):
            table = setup.read_table(name)
            span = (
                table.span if table is not None and not table.rows.select("order", "time") else None
            )
            if table is None or span is None:
                continue
            # One row more or less, and rounded times, are no fault.
            slack = max(table.step, 1e-9) * 1.01
            if first > span[1] + slack or last < span[0] - slack:
                # OpenSim measures distances in the nearest frame; the default times, -1, mean the
                # first one.
                nearest = "last" if first > span[1] else "first"
                is_scaled = is_a(item, "ModelScaler")
                consequence = ": OpenSim fails or crashes"
                if is_scaled:
                    consequence = f": OpenSim measures in the {nearest} frame"
                elif is_a(item, "InverseDynamicsTool") or is_a(item, "AnalyzeTool"):
                    consequence = f": OpenSim computes the {nearest} row only"
                report(
                    f"{describe_object(item)} runs from {first:g} to {last:g} s, but '{name}' "
                    f"covers {span[0]:g} to {span[1]:g} s{consequence}",
                    item,
                    tag=tags[0] if first > span[1] else tags[-1],
                    severity=WARNING if is_scaled else None,
                    fault="no-data-at-times",
                )
                continue
            # A tool with default times is reported only where the default cuts data off.
            specs = get_field_specs(type(item))
            are_explicit = [
                setup.element_of(item, tag) is not None and not setup.has_note(item, specs[tag])
                for tag in tags
            ]
            if not are_explicit[-1] and last < span[1] - slack:
                report(
                    f"{describe_object(item)} has no {tags[-1]}: OpenSim stops at {last:g} s, but "
                    f"'{name}' continues to {span[1]:g} s",
                    item,
                    tag=tags[-1],
                    fault="stops-at-default",
                )
            if are_explicit[-1] and math.isfinite(last) and last > span[1] + slack:
                report(
                    f"'{name}' ends at {span[1]:g} s, but the tool ends at {last:g} s{kind or filter_note}",
                    item,
                    tag=tags[-1],
                    fault="data-end-early",
                )
            if are_explicit[0] and math.isfinite(first) and first < span[0] - slack:
                report(
                    f"'{name}' begins at {span[0]:g} s, but the tool begins at {first:g} s{kind or filter_note}",
                    item,
                    tag=tags[0],
                    fault="data-begin-late",
                )


def _describe_unknown_time(
    item: Any, tags: tuple[str, ...], is_first: bool
) -> tuple[str, Severity, str]:
    """Return what OpenSim does with a time that is not a number.

    Args:
        item: tool with the times.
        tags: names of the properties that have the times.
        is_first: whether the first time is not a number; otherwise the last one.

    Returns:
        Consequence, severity, and the property that is to blame.
    """
    tag = tags[0] if is_first else tags[-1]
    if is_a(item, "IMUInverseKinematicsTool"):
        return ("begins at the first frame", WARNING, tag) if is_first else ("fails", ERROR, tag)
    if is_a(item, "AnalyzeTool"):
        if is_first:
            return "writes tables without rows, or crashes", ERROR, tag
        return "continues to the end of the data", WARNING, tag
    # Tools with two properties integrate a motion, which ends where it begins.
    if len(tags) > 1 and not is_first:
        return "writes the first row only", ERROR, tag
    return "rejects it", ERROR, tag


def _find_time_ranges(setup: Setup) -> Iterator[tuple[Object, tuple[str, ...], float, float]]:
    for item in setup.find_having("time_range"):
        if len(item.time_range) > 1 and getattr(item, "apply", True):
            yield item, ("time_range",), *item.time_range[:2]
    for item in setup.find_having("initial_time", "final_time"):
        # Without times of their own Moco's tools take those of the data.
        if item.initial_time is not None and item.final_time is not None:
            yield item, ("initial_time", "final_time"), item.initial_time, item.final_time
    for item in setup.find_by_class("Analysis"):
        # Reversed times of an analysis are reported; others are cut to those of its tool, without
        # harm.
        if item.start_time > item.end_time:
            yield item, ("start_time", "end_time"), item.start_time, item.end_time


def _list_tables(item: Any) -> Iterator[tuple[str, str]]:
    """Yield the tables that a tool reads over its time range, with the consequence where they end."""
    for tag in (
        "marker_file",
        "coordinates_file",
        "desired_kinematics_file",
        "coordinate_file",
        "orientations_file",
    ):
        # ForwardTool reads controls, not coordinates; MarkerPlacer reads one pose from its
        # coordinates.
        if is_a(item, "ForwardTool") or (tag == "coordinate_file" and is_a(item, "MarkerPlacer")):
            continue
        yield (
            getattr(item, tag, ""),
            ": OpenSim uses the available data"
            if tag in ("marker_file", "orientations_file")
            else "",
        )


@rule("OSIM845", "loads-end-early", severity=WARNING, about="document")
def report_loads_end_early(setup: Setup, report: FindingCollector) -> None:
    """Measured loads do not cover the times of the tool.

    Compares the times of the data of external loads with those of the tool, or of the motion that
    the tool reads.

    Before the first and after the last row, OpenSim extrapolates the loads linearly, without a
    message. Forces grow to thousands of newtons.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
    -     <time_range>0 0.9</time_range>
    +     <time_range>0 0.4</time_range>
          <external_loads_file>leg_grf.xml</external_loads_file>
          <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    for item, _, first, last in _find_time_ranges(setup):
        loads: Any = setup.read_document(getattr(item, "external_loads_file", ""))
        if loads is None or not hasattr(loads, "datafile"):
            continue
        # OpenSim searches the data beside the loads file, and in the working folder.
        path_from_loads = os.path.join(os.path.dirname(item.external_loads_file), loads.datafile)
        table = setup.read_table(loads.datafile) or setup.read_table(path_from_loads)
        span = table.span if table is not None and not table.rows.select("order", "time") else None
        if table is None or span is None:
            continue
        for tag in ("coordinates_file", "states_file", "desired_kinematics_file"):
            name = getattr(item, tag, "")
            motion = setup.read_table(name)
            if motion is not None and motion.span is not None:
                # The tool runs only where it has a motion as well.
                first, last = max(first, motion.span[0]), min(last, motion.span[1])
            elif names_file(name):
                # It may be written yet, and is not known to last longer than the loads.
                first, last = -math.inf, math.inf
        slack = max(table.step, 1e-9) * 1.01
        if (math.isfinite(last) and last > span[1] + slack) or (
            math.isfinite(first) and first < span[0] - slack
        ):
            report(
                f"the loads are measured from {span[0]:g} to {span[1]:g} s, but the tool runs "
                f"from {first:g} to {last:g} s: OpenSim extrapolates the loads linearly",
                item,
                tag="external_loads_file",
            )


@rule("OSIM846", "filter-frequency", severity=WARNING, about="document")
def report_filter_frequency(setup: Setup, report: FindingCollector) -> None:
    """A filter does not fit the sampling rate of the data.

    Compares the cut-off frequency with half the sampling rate, and reports a cut-off of 0.

    A cut-off above half the sampling rate is impossible, and OpenSim uses another one. A cut-off of
    0 removes the whole motion.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
          <coordinates_file>leg.mot</coordinates_file>
    -     <lowpass_cutoff_frequency_for_coordinates>60</lowpass_cutoff_frequency_for_coordinates>
    +     <lowpass_cutoff_frequency_for_coordinates>6</lowpass_cutoff_frequency_for_coordinates>
      </InverseDynamicsTool>
    ```
    """
    for item, tag, table in find_motions(setup):
        for filter_tag in ("lowpass_cutoff_frequency_for_coordinates", "lowpass_cutoff_frequency"):
            cutoff = getattr(item, filter_tag, -1.0)
            if cutoff == 0.0:
                report(f"{describe_object(item)} filters the motion at 0 Hz", item, tag=filter_tag)
            elif table.rate > 0.0 and cutoff > 0.5 * table.rate * (1.0 + _RATE_TOLERANCE):
                report(
                    # The Nyquist frequency is half the sampling rate.
                    f"{describe_object(item)} filters at {cutoff:g} Hz, but "
                    f"'{getattr(item, tag)}' has {table.rate:.4g} rows per second, so that the "
                    f"cut-off frequency must be below {0.5 * table.rate:.4g} Hz",
                    item,
                    tag=filter_tag,
                )


@rule("OSIM847", "motion-in-degrees", severity=WARNING, about="document")
def report_motion_in_degrees(setup: Setup, report: FindingCollector) -> None:
    """Angles of a motion are in degrees and OpenSim reads them as radians, or vice versa.

    Without `inDegrees=yes`, reports a motion with an angle of more than 10 radians, which no joint
    reaches. With `inDegrees=yes`, reports a motion of many joints in which no angle is larger than 3
    degrees.

    OpenSim gives no message. If it reads degrees as radians, joint moments become hundreds of
    thousands of newton metres.

    ```setup
      <InverseDynamicsTool name="id">
          <model_file>leg.osim</model_file>
    -     <coordinates_file>leg_degrees.mot</coordinates_file>
    +     <coordinates_file>leg.mot</coordinates_file>
      </InverseDynamicsTool>
    ```
    """
    for item, tag, table in find_motions(setup):
        header = table.header
        if isinstance(header, MarkerHeader) or setup.tree is None:
            continue
        angles = find_angles(setup)
        angle_columns = [
            column_index
            for column_index, column in enumerate(table.columns, 1)
            if coordinate_name(column) in angles
        ]
        largest, column_index = _find_largest(table, angle_columns)
        label = table.labels[column_index].text
        # Few joints may stay almost straight for a whole trial; many do not.
        if header.in_degrees and 0.0 < largest < math.pi and len(angle_columns) >= _MIN_JOINTS:
            report(
                f"'{getattr(item, tag)}' has inDegrees=yes, and its largest angle is "
                f"{largest:.3g}: is it in radians?",
                item,
                tag=tag,
            )
        # 10 rad are 573 degrees, while a gait in degrees has knee angles of 60.
        elif largest > LARGEST_JOINT_ANGLE and not header.in_degrees:
            report(
                f"'{getattr(item, tag)}' does not say inDegrees=yes, but '{label}' reaches "
                f"{largest:.4g}: OpenSim reads this in radians",
                item,
                tag=tag,
                severity=ERROR,
            )
    for user, values in setup.iterate_with_tables(
        setup.find_having("ik_task_set", "coordinate_file"), "coordinate_file"
    ):
        if isinstance(values.header, MarkerHeader) or values.header.in_degrees:
            continue
        tasks = select_members(user.ik_task_set, "IKCoordinateTask")
        # OpenSim's inverse kinematics converts the values of this file from degrees without a look
        # at `inDegrees` (4.6).
        read_names = {
            task.name for task in tasks if task.apply and task.value_type == "from_file"
        } & find_angles(setup)
        largest, column_index = _find_largest(
            values, [k for k, column in enumerate(values.columns, 1) if column in read_names]
        )
        if 0.0 < largest < math.pi:
            report(
                f"'{user.coordinate_file}' does not say inDegrees=yes, and "
                f"'{values.labels[column_index].text}' reaches only {largest:.3g}: inverse "
                "kinematics reads it in degrees, whatever the header says",
                user,
                tag="coordinate_file",
            )


def _find_largest(table: Table, column_indices: list[int]) -> tuple[float, int]:
    """Return the largest absolute number in some columns, and its column; zeros without numbers."""
    numbers = (
        (abs(sample[column_index]), column_index)
        for column_index in column_indices
        for sample in table.rows.samples
        # Samples may be shorter than the header; NaN is missing.
        if column_index < len(sample) and sample[column_index] == sample[column_index]
    )
    return max(numbers, default=(0.0, 0))
