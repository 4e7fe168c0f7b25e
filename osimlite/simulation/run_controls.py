"""Controls of a run as users give them: numbers, functions of time, tables, files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.quantity import warn_caller
from osimlite.base.records import dataclass
from osimlite.base.text import format_count, join_words, suggest_name
from osimlite.errors import SettingError, SimulationError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.kernels.layout import ITEM, MODEL
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.multibody.functions import (
    Arguments,
    ConstantValue,
    FunctionDerivatives,
    ScaledFunction,
    SmoothFunction,
    make_zero_derivatives,
)
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline
from osimlite.schema.base import Object
from osimlite.simulation.elements.control_sets import ControlCurves
from osimlite.simulation.elements.control_tables import TableColumn, read_controls
from osimlite.simulation.elements.controls import Controls

PRINTED_TIME_TOLERANCE_S = 1e-6
"""Tolerance at the ends of a table, s, because its times are printed with few digits."""


@dataclass(frozen=True)
class PythonFunction(SmoothFunction):
    """A Python function that returns a control for a time (s)."""

    function: Callable[[float], float]  # the function
    name: str  # name of the control, for messages

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value at a time, with zero derivatives.

        Raises:
            SettingError: the control at this time is infinite or NaN.
        """
        x = float(arguments[0])
        value = float(self.function(x))
        if not isfinite(value):
            raise SettingError(f"the control of '{self.name}' is {value} at {x:g} s; give a number")
        return make_zero_derivatives(1, value)


def add_controls(
    controls: Controls,
    user_controls: Mapping[str, Any] | StoTable | str | Path | None,
    to: float,
    *,
    start: float = 0.0,
    description: str = "controls",
) -> Controls:
    """Add the controls of a run to those of a model, as another PrescribedController would.

    Values between the rows of a table are interpolated linearly; its first and last values hold
    before and after it.

    Args:
        controls: controls of the model.
        user_controls: a number, a function of time (s) or ``(times, values)`` by the name or path of an
            actuator; or a table with such columns; or the file of a table or of a ControlSet.
        to: end of the motion, s.
        start: start of the motion, s.
        description: plural noun for the added controls, for messages.

    Returns:
        The combined controls; as in OpenSim, those of several controllers of an actuator are
        summed.

    Raises:
        OsimliteError: an actuator does not exist or is set twice, or a file cannot be read.
        SettingError: a control is not a number, or times do not increase.
        SimulationError: a TableSource of the model ends before the motion.
    """
    require_table_span(controls, start, to)
    if user_controls is None:
        return controls
    # Actuators may be named by their name or their path.
    path_of_name = {key: name for name in controls.names for key in (name.rpartition("/")[2], name)}
    functions: dict[str, SmoothFunction] = {}
    begin, end = -inf, inf
    for key, value in _map_by_name(user_controls).items():
        if key not in path_of_name:
            # Tables of OpenSim's tools have controls of the actuators that their setups add.
            advice = suggest_name(key, path_of_name) or (
                "; if it is in the force_set_files of a setup, add these forces to the model first"
            )
            raise SettingError(f"the model has no actuator '{key}' to control{advice}")
        # A name is ambiguous in models with several sets.
        paths = [name for name in controls.names if name.endswith(f"/{key}")]
        if len(paths) > 1:
            raise SettingError(
                f"{len(paths)} actuators are called '{key}': {join_words(paths)}; give the path of one"
            )
        if path_of_name[key] in functions:
            raise SettingError(
                f"'{path_of_name[key]}' is controlled twice, by its name and by its path; leave one out"
            )
        # (times, values) is an interpolated table.
        if isinstance(value, tuple):
            functions[path_of_name[key]], first, last = _interpolate_linearly(key, *value)
            begin, end = max(begin, first), min(end, last)
        else:
            functions[path_of_name[key]] = _make_function(key, value)
    if begin > start + PRINTED_TIME_TOLERANCE_S or end < to - PRINTED_TIME_TOLERANCE_S:
        warn_caller(
            f"the {description} cover only {max(begin, start):g} to {min(end, to):g} s of the motion, which "
            f"goes from {start:g} to {to:g} s; outside, the first and last values are used"
        )
    return controls.add_functions(functions)


def describe_controls(user_controls: Mapping[str, Any] | StoTable | str | Path) -> Any:
    """Return controls in the form of a summary.

    Args:
        user_controls: controls as in :func:`add_controls`.

    Returns:
        The name of a file, "a table", or numbers and descriptions by actuator.
    """
    if not isinstance(user_controls, Mapping):
        return "a table" if isinstance(user_controls, StoTable) else str(user_controls)
    descriptions = {
        name: "a table" if isinstance(value, tuple) else "a function"
        for name, value in user_controls.items()
    }
    return {
        name: value if isinstance(value, int | float | str) else descriptions[name]
        for name, value in user_controls.items()
    }


def parse_controls(words: Iterable[str]) -> dict[str, Any]:
    """Parse words of the command line: files, or ``NAME=VALUE``.

    Returns:
        Controls by the name of the actuator.

    Raises:
        SettingError: a word is neither a file nor ``NAME=VALUE`` with a number, or two words set
            the same control.
        OsimliteError: a file cannot be read.
    """
    result: dict[str, Any] = {}
    for word in words:
        name, equals, value = (piece.strip() for piece in word.partition("="))
        if (equals or not Path(word).suffix) and not Path(word).is_file():
            try:
                new_controls: Mapping[str, Any] = {name: float(value)}
            except ValueError:
                raise SettingError(
                    f"--controls takes a file, or NAME=VALUE with a number; got '{word}'"
                ) from None
        else:
            new_controls = _map_by_name(word)
        for key in new_controls.keys() & result.keys():
            raise SettingError(f"'{key}' is controlled twice; leave one out")
        result |= new_controls
    return result


def require_table_span(controls: Controls, start: float, to: float) -> None:
    """Check that every TableSource covers the motion, because OpenSim stops outside its times.

    Raises:
        SimulationError: a table does not cover the motion.
    """
    for function in (function for functions in controls.functions for function in functions):
        column = function.function if isinstance(function, ScaledFunction) else function
        if isinstance(column, TableColumn) and not column.x[0] <= start < to <= column.x[-1]:
            raise SimulationError(
                f"the table of '{column.source}' goes from {column.x[0]:g} to {column.x[-1]:g} s, but the motion from "
                f"{start:g} to {to:g} s; OpenSim fails outside the table, so extend the table"
            )


def _map_by_name(user_controls: Mapping[str, Any] | StoTable | str | Path) -> Mapping[str, Any]:
    """Return controls by actuator from a mapping, a table or a file.

    Raises:
        SettingError: the controls are of another type, or two columns of a table have the same
            label.
    """
    if isinstance(user_controls, Mapping):
        return user_controls
    # .xml is the older format of control sets.
    if isinstance(user_controls, str | Path) and Path(user_controls).suffix == ".xml":
        curves = ControlCurves.read(Path(user_controls))
        return {name: curves.find_curve(name) for name in curves.actuators}
    if not isinstance(user_controls, str | Path | StoTable):
        raise SettingError(
            f"controls are a mapping of names, a table or a file, not {user_controls!r}"
        )
    table = user_controls if isinstance(user_controls, StoTable) else read_controls(user_controls)
    for index, label in enumerate(table.columns):
        if label in table.columns[:index]:
            raise SettingError(f"the table of controls has two columns '{label}'; leave one out")
    return {label: (table.times, table.rows[:, index]) for index, label in enumerate(table.columns)}


def _make_function(name: str, value: Any) -> SmoothFunction:
    """Return the control of an actuator as a function of time.

    Args:
        name: name of the actuator, for messages.
        value: a number, a function of osimlite or OpenSim, or a Python function.

    Raises:
        SettingError: the value is of another type, or not finite.
    """
    if isinstance(value, SmoothFunction):
        return value
    if isinstance(value, Object):
        return convert_function(value, 1, f"the control of '{name}'")
    if callable(value):
        return PythonFunction(value, name)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise SettingError(
            f"the control of '{name}' is {value!r}; give a number, a function of time or (times, values)"
        ) from None
    if not isfinite(number):
        raise SettingError(f"the control of '{name}' is {number}; give a number")
    return ConstantValue(number)


def _interpolate_linearly(
    name: str, times: Any, values: Any
) -> tuple[SmoothFunction, float, float]:
    """Return the linear interpolation of values at times.

    Args:
        name: name of the actuator, for messages.
        times: increasing times (k,), s.
        values: controls (k,).

    Returns:
        The function of time, and the first and last time (s).

    Raises:
        SettingError: times or values are not lists of numbers, their lengths differ, a number is not
            finite, or times do not increase.
    """
    try:
        x, y = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise SettingError(
            f"the control of '{name}' has a time or value that is not a number ({error}); correct it"
        ) from None
    if x.ndim != 1 or y.ndim != 1:
        raise SettingError(
            f"the control of '{name}' has times of shape {x.shape} and values of shape {y.shape}; "
            "give two lists of numbers"
        )
    if not x.size and not y.size:
        raise SettingError(
            f"the control of '{name}' has no times; give at least one time and value"
        )
    if x.size != y.size:
        raise SettingError(
            f"the control of '{name}' has {format_count(x.size, 'time')}, but {format_count(y.size, 'value')}; "
            "give one value for each time"
        )
    if not (np.isfinite(x).all() and np.isfinite(y).all() and (np.diff(x) > 0.0).all()):
        raise SettingError(
            f"the control of '{name}' has times that do not increase, or a value that is not a finite number; correct it"
        )
    # A smoothing spline of degree 1 without smoothing is the polyline through the values.
    line = ConstantValue(float(y[0])) if len(x) == 1 else smoothing_spline(x, y, 1, 0.0)
    return line, float(x[0]), float(x[-1])


def find_constant_offsets(engine: Any, driven: Controls) -> Ints:
    """Return the offset of the last function of each control in the numbers of a model.

    That function must be a constant, whose only number is its value.

    Args:
        engine: engine whose controls are `driven`.
        driven: controls of the model.

    Returns:
        Offset of each constant in `engine.numbers` (c,).
    """
    ints, numbers, _ = driven.make_record()
    function_ends = [*ints[1 + len(driven.names) :], len(numbers)]
    last_functions = [ints[1 + k] for k in range(len(driven.names))]
    first = int(engine.structure[engine.structure[MODEL.CONTROLS] + ITEM.NUMBERS])
    return np.array([first + function_ends[end] - 1 for end in last_functions], dtype=np.int64)
