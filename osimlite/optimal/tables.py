"""Reference tables of studies, as their processors make them, and splines through their columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.records import replace
from osimlite.base.text import format_count
from osimlite.errors import DocumentError
from osimlite.fitting.marker_data import MarkerData
from osimlite.io.tables.storage import StoTable, expect_increasing_times, read_sto
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import SampledCurves
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.layout import MIN_SPLINE_TIMES
from osimlite.optimal.point import TimeFunction
from osimlite.optimal.study_context import StudyContext
from osimlite.schema.base import Object
from osimlite.schema.tools.processors import (
    TableProcessor,
    TabOpAppendCoupledCoordinateValues,
    TabOpLowPassFilter,
    TabOpUseAbsoluteStateNames,
)
from osimlite.simulation.lowpass import filter_lowpass

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem

TIME_TOLERANCE_S = 1e-6
"""Time, s, by which a motion may exceed the data that it tracks."""


def read_reference(problem: Problem, goal: Object, processor: TableProcessor) -> StoTable:
    """Return the reference table of a goal, with angles in rad.

    The table is read from a file, unless the caller of the solver has passed a table for the goal
    in `problem.tables`, by the goal's name.

    Args:
        problem: problem of the study.
        goal: goal that has the reference; messages name it too.
        processor: processor of the goal, which names the file and its operators.

    Returns:
        Table of the file after the operators of the processor; or the passed table, to which the
        operators are not applied.

    Raises:
        UnsupportedError: an operator of the processor is not supported here.
        OsimliteError: the file cannot be read.
    """
    passed_table = problem.tables.get(goal.name)
    if passed_table is not None:
        return passed_table
    return process_table(
        problem, goal, processor, problem.functions.states, problem.functions.mechanism
    )


def process_table(
    problem: StudyContext,
    owner: Object,
    processor: TableProcessor,
    states: Sequence[str],
    mechanism: Mechanism,
) -> StoTable:
    """Read a table and apply the operators of its processor.

    Args:
        problem: study, for its folder and messages.
        owner: part of the study with the processor, for messages.
        processor: processor that names the file.
        states: paths of the model's states.
        mechanism: mechanism of the model.

    Returns:
        Table with angles in rad.

    Raises:
        UnsupportedError: an operator of the processor is not supported here.
        OsimliteError: the file cannot be read.
    """
    if not processor.filepath.strip():
        raise problem.invalid_error(owner, "a filepath is required")
    table = read_table(problem.locate_file(processor.filepath))
    for operator in processor.operators:
        if isinstance(operator, TabOpLowPassFilter):
            table = _filter_lowpass(table, operator)
        elif isinstance(operator, TabOpUseAbsoluteStateNames):
            table = replace(
                table, columns=tuple(_resolve_state_path(name, states) for name in table.columns)
            )
        elif isinstance(operator, TabOpAppendCoupledCoordinateValues):
            if table.in_degrees:
                message = "the table is in degrees, which OpenSim's functions of couplers take for radians; convert it to radians"
                raise problem.make_unsupported_error(operator, message)
            table = _append_coupled_values(problem, operator, table, mechanism)
        else:
            raise problem.make_unsupported_error(operator, "this table operator is not supported")
    return replace(_convert_to_radians(table, mechanism), header={"inDegrees": "no"})


def read_table(path: Path) -> StoTable:
    """Read a table, which may be a marker file.

    Args:
        path: path of the file.

    Returns:
        Table; a marker file gives three columns for each marker, in m, as OpenSim flattens them.
    """
    if path.suffix.lower() != ".trc":
        return read_sto(path)
    markers = MarkerData.from_source(path)
    labels = tuple(f"{name}_{k}" for name in markers.names for k in (1, 2, 3))
    return StoTable(
        "", markers.times, labels, markers.positions.reshape(len(markers.times), -1), file=str(path)
    )


def _filter_lowpass(table: StoTable, operator: TabOpLowPassFilter) -> StoTable:
    """Return the table after OpenSim's low-pass filter, resampled at equal steps first if necessary.

    Args:
        table: table.
        operator: operator with the cutoff frequency, Hz; the table is unchanged if it is negative.
    """
    if operator.cutoff_frequency < 0.0:
        return table
    times = table.times
    rows = table.rows
    step = float(np.diff(times).min())
    # OpenSim's test compares the mean step with the smallest to machine precision, so that nearly
    # all tables with rounded times are resampled.
    if float(times[-1] - times[0]) / (len(times) - 1) - step > np.finfo(float).eps:
        # Resample at equal steps before the table is padded at both ends, in the order of OpenSim's
        # Storage.
        even_times = times[0] + step * np.arange(int((times[-1] - times[0]) / step + 1e-9) + 1)
        (rows,) = SampledCurves(times, rows).derivatives(even_times, (0,))
        times = even_times
    times, rows = filter_lowpass(times, rows, operator.cutoff_frequency)
    if operator.trim_to_original_time_range:
        # Times after resampling differ from the original ones by rounding.
        slack = 1e-6 * (times[1] - times[0])
        is_within = (times >= table.times[0] - slack) & (times <= table.times[-1] + slack)
        times = times[is_within]
        rows = rows[is_within]
    return replace(table, times=times, rows=rows)


def _append_coupled_values(
    problem: StudyContext,
    operator: TabOpAppendCoupledCoordinateValues,
    table: StoTable,
    mechanism: Mechanism,
) -> StoTable:
    """Return the table with the values of coordinates that couplers determine.

    Args:
        problem: study, for messages.
        operator: operator with the setting that overwrites columns.
        table: table in rad and m.
        mechanism: mechanism with the couplers.
    """
    paths = [f"{info.path}/value" for info in mechanism.coordinates]
    for coupler in mechanism.constraints:
        if not isinstance(coupler, Coupler):
            continue
        if paths[coupler.dependent] in table.columns and not operator.overwrite_existing_columns:
            continue
        independent = [paths[index] for index in coupler.independent]
        for name in independent:
            problem.check_name(operator, name, table.columns, "column", owner="the table")
        arguments = np.column_stack([table[name] for name in independent])
        other_columns = [
            k for k, name in enumerate(table.columns) if name != paths[coupler.dependent]
        ]
        # Couplers are functions of rad and m, hence the refusal of degrees before.
        values = [coupler.function.evaluate(row)[0] for row in arguments]
        columns = (*(table.columns[k] for k in other_columns), paths[coupler.dependent])
        table = replace(
            table, columns=columns, rows=np.column_stack([table.rows[:, other_columns], values])
        )
    return table


def _resolve_state_path(label: str, states: Sequence[str]) -> str:
    """Return the path of the state that an old label means; the label itself if it means none.

    Args:
        label: label such as ``knee_angle``, ``knee_angle_u`` or ``soleus.activation``.
        states: paths of the model's states.
    """
    ending = f"{label[:-2]}/speed" if label.endswith("_u") else label.replace(".", "/")
    for end in (label, ending, f"{ending}/value", re.sub(r"^.*/(?=[^/]+/[^/]+$)", "", label)):
        matches = [state for state in states if state == end or state.endswith(f"/{end}")]
        # A label that several states could mean is not guessed.
        if len(matches) == 1:
            return matches[0]
    return label


def _convert_to_radians(table: StoTable, mechanism: Mechanism) -> StoTable:
    """Return the table with angles and angular speeds in rad and rad/s."""
    if not table.in_degrees:
        return table
    angles = {info.path for info in mechanism.coordinates if info.unit == "rad"}
    is_angle = [label in angles or label.rpartition("/")[0] in angles for label in table.columns]
    return replace(
        table, rows=table.rows * np.where(is_angle, np.pi / 180.0, 1.0), in_degrees=False
    )


def fit_splines(problem: Problem, table: StoTable, columns: list[str]) -> list[TimeFunction]:
    """Fit splines of fifth degree through columns of a table, as OpenSim's GCVSplineSet.

    Args:
        problem: problem to which the splines are added as functions of time.
        table: table with the columns.
        columns: names of the columns.

    Returns:
        Function of time for each column.

    Raises:
        DocumentError: a column is missing, has gaps, or does not cover the motion.
    """
    check_columns(table, columns)
    first_time = float(table.times[0])
    last_time = float(table.times[-1])
    # The latest start and the earliest end: a motion with free times may stay within the data.
    start = problem.times[0][1]
    end = problem.times[1][0]
    if start < first_time - TIME_TOLERANCE_S or end > last_time + TIME_TOLERANCE_S:
        message = (
            f"the table covers {first_time:g} s to {last_time:g} s, but the motion lasts at least "
            f"from {start:g} s to {end:g} s"
        )
        raise DocumentError(message, file=table.file)
    curves = SplineCurves(
        table.times, np.column_stack([table.times, *(table[name] for name in columns)])[:, 1:]
    )
    return [
        problem.add_time_function(partial(_sample_column, curves, k), name)
        for k, name in enumerate(columns)
    ]


def sample_function(function: SmoothFunction, times: Array) -> Array:
    """Evaluate a function of time.

    Args:
        function: function of one argument.
        times: times (n,), s.

    Returns:
        Value, first and second derivative (3, n).
    """
    results = (function.evaluate((t,)) for t in times.tolist())
    return np.array([(value, slope[0], curve[0][0]) for value, slope, curve in results]).T


def check_columns(table: StoTable, columns: Sequence[str]) -> None:
    """Check that splines can be fitted through columns of a table.

    Args:
        table: table.
        columns: names of the columns.

    Raises:
        DocumentError: a column is missing or has gaps, or the times are too few or do not rise.
    """
    if len(table.times) < MIN_SPLINE_TIMES:
        message = (
            f"the table has {format_count(len(table.times), 'time')}; splines of fifth degree need at "
            f"least {MIN_SPLINE_TIMES}"
        )
        raise DocumentError(message, file=table.file)
    expect_increasing_times(table.times, table.file)
    for name in columns:
        if name not in table.columns:
            raise DocumentError(f"the table has no column '{name}'", file=table.file)
        if not np.isfinite(table[name]).all():
            raise DocumentError(f"column '{name}' has gaps; fill them", file=table.file)


def _sample_column(curves: SplineCurves, number: int, times: Array) -> Array:
    """Return value and derivatives (3, n) of one column at times (n,)."""
    values: Array = curves.evaluate(times)[:, :, number]
    return values


class SplineCurves:
    """Splines through columns, evaluated together.

    The values at the last times are cached, as each column is a function of time of its own and all
    are evaluated at the same times.

    Args:
        times: times (n,), s.
        rows: values of m columns (n, m).
    """

    def __init__(self, times: Array, rows: Array) -> None:
        self._curves = SampledCurves(times, rows)
        self._times: Array | None = None
        self._values = np.zeros(0)

    def evaluate(self, times: Array) -> Array:
        """Return values, first and second derivatives (3, n, m) of m columns at times (n,)."""
        if self._times is None or not np.array_equal(self._times, times):
            self._times = times.copy()
            self._values = np.array(self._curves.derivatives(times, (0, 1, 2)))
        return self._values
