"""Variables of a sweep: names, ranges, and what they change in the model or its initial state.

======================================  ==========================================================
``RHip_rz``, ``?Hip_rz``                initial value of a coordinate, by name or path, or of several
``RHip_rz/speed``                       initial generalized speed
``/bodyset/Pelvis/mass``                any number of the model, by the path of a component or its name
``/forceset/*Foot*/.../stiffness``      several numbers that are equal in each run
``*/max_isometric_force@scale``         factor of numbers of the model
``BRA/control``                         number that is added to the control of an actuator at all times
``{*}_?/control``                       one for each muscle, shared by both legs
``soleus_?/control@0.1``                other variables of :mod:`controls <osimlite.studies.sweep.controls>`
``thigh_length``                        parameter of the function that makes the model
``flexor-elbow.KP``, ``*.KV``           parameter of a controller, or several
``slope``                               gravity tilted in the x-y plane: a floor that falls towards +x
======================================  ==========================================================

If the function or the controller has a parameter `slope`, the name means this parameter. A locked
coordinate keeps the value that a variable gives it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.quantity import Quantity, parse_quantity
from osimlite.base.records import dataclass, replace
from osimlite.base.text import format_count, suggest_name
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.forces import Actuator
from osimlite.schema.model import Model
from osimlite.simulation.initial_state import describe_suspect_value
from osimlite.simulation.properties import (
    PropertyPath,
    expand_braces,
    find_properties,
    list_property_paths,
    match_components,
)
from osimlite.studies.sweep.controls import SCALE, Control, expand_nodes, parse_control

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.parts import CoordinateInfo
    from osimlite.simulation.control_steps import Gain

Floats = NDArray[np.float64]
Range = float | str | Sequence[Any]
"""Range of a variable.

It is a value; `(low, high)` or `(low, high, count)`, each with `"log"` at its end; or the text for
it.
"""


@dataclass(frozen=True)
class Start:
    """Initial value or speed of coordinates.

    Attributes:
        coordinates: paths of the coordinates.
        is_speed: whether it is the speed.
    """

    coordinates: tuple[str, ...]
    is_speed: bool

    @property
    def parts(self) -> tuple[Start, ...]:
        """Targets of the single coordinates.

        Returns:
            One target per coordinate, so that two variables of the same one can be found.
        """
        return tuple(Start((path,), self.is_speed) for path in self.coordinates)


@dataclass(frozen=True)
class Property:
    """Numbers of the model that are equal, or are multiplied by the same factor.

    Attributes:
        paths: paths of the properties.
        is_scaled: whether the variable is a factor.
    """

    paths: tuple[PropertyPath, ...]
    is_scaled: bool = False

    @property
    def parts(self) -> tuple[PropertyPath, ...]:
        """Numbers that no other variable may change.

        Returns:
            Path of each property.
        """
        return self.paths


@dataclass(frozen=True)
class FunctionParameter:
    """Argument of the user's function that makes the model.

    Attributes:
        name: name of the argument.
        default: default value of the argument; None if it has none.
    """

    name: str
    default: float | None = None


@dataclass(frozen=True)
class Slope:
    """Gravity of constant magnitude, tilted about the z axis by an angle (rad)."""


@dataclass(frozen=True)
class Gains:
    """Parameters of a controller that are equal.

    Attributes:
        parts: names of the parameters.
        current_value: value of the first parameter.
    """

    parts: tuple[str, ...]
    current_value: float


Target = Start | Property | Control | FunctionParameter | Slope | Gains
"""Numbers that a variable can change."""


@dataclass(frozen=True)
class Variable:
    """Number that differs from run to run.

    Attributes:
        name: name as the user wrote it.
        target: number that the variable changes.
        low: smallest value (rad, m or the unit of the property).
        high: largest value.
        count: number of values in a grid, or None.
        is_log: whether the range is logarithmic.
        warning: sentence about a suspicious range, or "".
        unit: unit of the values, such as rad/s; "" if they have none, or it is not known.
    """

    name: str
    target: Target
    low: float
    high: float
    count: int | None = None
    is_log: bool = False
    warning: str = ""
    unit: str = ""

    def interpolate(self, fraction: Floats) -> Floats:
        """Return the values at fractions of the range, clipped to it, and exact at either end."""
        # exp(log(x)) is not exactly x, so that the ends are set explicitly.
        result = np.clip(self.extrapolate(fraction), self.low, self.high)
        return np.where(fraction <= 0.0, self.low, np.where(fraction >= 1.0, self.high, result))

    def extrapolate(self, fraction: Floats) -> Floats:
        """Return the values at fractions of the range, which may be below 0 or above 1."""
        if self.is_log:
            log_low, log_high = math.log(self.low), math.log(self.high)
            return np.exp(log_low + fraction * (log_high - log_low))
        return self.low + fraction * (self.high - self.low)

    def compute_fraction(self, value: float) -> float:
        """Return the fraction of the range at which a value lies: 0 at low and 1 at high."""
        if self.is_log:
            return (math.log(value) - math.log(self.low)) / (
                math.log(self.high) - math.log(self.low)
            )
        return (value - self.low) / (self.high - self.low)

    def differentiate(self, value: float) -> float:
        """Return the derivative of the value by its fraction, at a value."""
        return value * math.log(self.high / self.low) if self.is_log else self.high - self.low

    @property
    def is_fixed(self) -> bool:
        """True if the range is a single value."""
        return self.low == self.high

    def settings(self) -> dict[str, Any]:
        """Return the definition of the variable, as data for JSON.

        Returns:
            Name, bounds, and count and "log" if they are set.
        """
        row: dict[str, Any] = {"name": self.name, "low": self.low, "high": self.high}
        if self.count is not None:
            row["count"] = self.count
        return {**row, "log": True} if self.is_log else row


def parse_ranges(arguments: Sequence[str]) -> dict[str, Range]:
    """Parse ranges from words `NAME=LOW:HIGH[:COUNT][:log]` or `NAME=VALUE`.

    Returns:
        Text of the range by name.

    Raises:
        SettingError: a word is malformed, or a name occurs twice.
    """
    result: dict[str, Range] = {}
    for argument in arguments:
        name, equals, text = (text_part.strip() for text_part in argument.partition("="))
        if not (name and equals and text):
            raise SettingError(
                f"--vary takes NAME=LOW:HIGH or NAME=LOW:HIGH:COUNT, got '{argument}'"
            )
        if name in result:
            raise SettingError(f"'{name}' is varied twice; give it once")
        result[name] = text
    return result


def resolve_variables(
    ranges: Mapping[str, Range],
    model: Model,
    mechanism: Mechanism,
    parameters: Mapping[str, Any] = MappingProxyType({}),
    gains: Sequence[Gain] = (),
) -> tuple[Variable, ...]:
    """Find the targets that names stand for, and read their ranges.

    Args:
        ranges: range by name.
        model: model that varies.
        mechanism: mechanism of the model.
        parameters: parameters of the function that makes the model, with their defaults.
        gains: parameters of a controller.

    Returns:
        Variables in the order of the names; a name with braces stands for several.

    Raises:
        SettingError: a name is unknown (the message suggests the nearest), a range is malformed, a
            unit does not fit, or two variables are the same number.
    """  # noqa: DOC501 - a function makes the SettingError
    result: list[Variable] = []
    for names, value_range in ranges.items():
        meanings = [
            (name, _resolve_target(name, model, mechanism, parameters, gains))
            for expanded_name in expand_braces(names, model)
            for name in expand_nodes(expanded_name)
        ]
        for name, meaning in meanings:
            if meaning is not None:
                variable = _make_variable(name, *meaning, value_range)
                # Radians and degrees are easily confused in initial angles.
                if isinstance(variable.target, Start) and not variable.target.is_speed:
                    variable = replace(
                        variable, warning=_describe_suspect_range(variable, value_range, mechanism)
                    )
                result.append(variable)
        if all(meaning is None for _, meaning in meanings):
            raise _describe_unknown_name(
                names, model, mechanism, [*parameters, *(gain.name for gain in gains)]
            )
    name_by_target: dict[object, str] = {}
    for resolved in result:
        for single_target in getattr(resolved.target, "parts", (resolved.target,)):
            # Two variables of one number would depend on the order of application.
            if single_target in name_by_target:
                raise SettingError(
                    f"'{name_by_target[single_target]}' and '{resolved.name}' are the same quantity; vary one of them"
                )
            name_by_target[single_target] = resolved.name
    return tuple(result)


def reject_grid_ranges(variables: Sequence[Variable]) -> None:
    """Reject ranges with a number of grid points, such as ``0:1:5``: a search takes any value of a range.

    Raises:
        SettingError: a variable has a number of values.
    """
    for variable in variables:
        if variable.count is not None and not variable.is_fixed:
            raise SettingError(
                f"the range of '{variable.name}' has {format_count(variable.count, 'grid point')}, but only a sweep "
                "uses a grid; leave out the number of points"
            )


def _resolve_target(
    name: str,
    model: Model,
    mechanism: Mechanism,
    parameters: Mapping[str, Any],
    gains: Sequence[Gain],
) -> tuple[Target, str] | None:
    """Return the target of a name and its unit, or None for a name without a target.

    The first match counts, in the order of the table above: coordinate, parameter of the function,
    parameter of the controller, control, property, slope.
    """
    stem, _, ending = name.rpartition("/")
    # The complete name first: a coordinate may have a name that ends like a suffix.
    for key, is_speed in ((name, False), (stem, ending == "speed")):
        if (key == name or ending in ("value", "speed")) and (
            matches := match_components(key, mechanism.coordinates)
        ):
            return _list_coordinates(name, matches, is_speed, model)
    if name in parameters:
        default = parameters[name]
        return FunctionParameter(
            name, float(default) if type(default) in (int, float) else None
        ), "parameter"
    if matched_gains := match_components(name, gains):
        return Gains(
            tuple(gain.name for gain in matched_gains), matched_gains[0].value
        ), "parameter"
    route, _, suffix = name.partition("@")
    stem, _, ending = route.rpartition("/")
    if ending == "control" and (
        matched_actuators := match_components(stem, model.components(Actuator))
    ):
        control = parse_control(name, [actuator.path for actuator in matched_actuators], suffix)
        return control, control.unit
    if suffix in ("", SCALE) and (result := find_properties(model, route)):
        unit = result[0].unit
        # The unit of such a property depends on the motion type of its coordinate.
        if unit.startswith("rad | m") and (
            infos := match_components(result[0].component, mechanism.coordinates)
        ):
            unit = infos[0].unit or "rad | m"
        return Property(result, bool(suffix)), "" if suffix else unit
    if name == "slope":
        return Slope(), "rad"
    return None


def _describe_unknown_name(
    name: str, model: Model, mechanism: Mechanism, parameters: Sequence[str]
) -> SettingError:
    """Return the error for a name without a meaning, with a suggestion."""
    route = name.partition("@")[0]
    if match_components(route, model.components(Actuator)):
        return SettingError(
            f"'{name}' is an actuator: vary '{route}/control', or one of its properties"
        )
    known_names = [
        f"{info.name}{ending}" for info in mechanism.coordinates for ending in ("", "/speed")
    ] + [
        *parameters,
        "slope",
    ]
    known_names += [
        f"{info.path}{ending}" for info in mechanism.coordinates for ending in ("", "/speed")
    ]
    known_names += [
        f"{key}/control"
        for actuator in model.components(Actuator)
        for key in (actuator.name, actuator.path)
    ]
    # Properties are many; they are searched only if the name is a path.
    known_names += list_property_paths(model) if "/" in name else []
    suggestion = suggest_name(name, known_names)
    return SettingError(
        f"the model has no coordinate, parameter, control or numeric property '{name}' to vary{suggestion}"
    )


def _list_coordinates(
    name: str, infos: Sequence[CoordinateInfo], is_speed: bool, model: Model
) -> tuple[Target, str]:
    """Return the target of coordinates and its unit; locked ones are varied by their default value.

    Raises:
        SettingError: a locked coordinate has no speed, or some coordinates are locked and others
            are not.
    """
    unit = infos[0].unit or "rad | m"
    locked = [info for info in infos if info.locked]
    if locked and is_speed:
        raise SettingError(
            f"the coordinate '{locked[0].name}' is locked, so it has no speed; unlock it in the model"
        )
    if not locked:
        return Start(tuple(info.path for info in infos), is_speed), unit
    # A locked coordinate is a property, a free one an initial value; one variable cannot be both.
    if len(locked) < len(infos):
        raise SettingError(
            f"'{name}' matches the locked coordinate '{locked[0].name}' and coordinates that move; vary the "
            "moving ones by their names"
        )
    return Property(
        find_properties(model, ",".join(info.path for info in infos) + "/default_value")
    ), unit


def _make_variable(name: str, target: Target, unit: str, value_range: Range) -> Variable:
    """Return the variable of a target with its range.

    Args:
        name: name of the variable.
        target: number that the variable changes.
        unit: unit of the number.
        value_range: range as the user wrote it.

    Raises:
        SettingError: the range is malformed or descends, its unit does not fit, its number of
            values does not fit its ends, or a logarithmic range is not above 0.
    """
    fields = (
        value_range.split(":")
        if isinstance(value_range, str)
        else [value_range]
        if isinstance(value_range, int | float)
        else list(value_range)
    )
    count, is_log = None, False
    if len(fields) > 1 and fields[-1] == "log":
        is_log = True
        fields.pop()
    if len(fields) == 3:
        text = str(fields.pop())
        if not text.strip().isdigit() or int(text) < 1:
            raise SettingError(
                f"the number of values of '{name}' must be a whole number of at least 1, not '{text}'"
            )
        count = int(text)
    if len(fields) not in (1, 2):
        raise SettingError(
            f"'{name}' takes LOW:HIGH, LOW:HIGH:COUNT or one value, not '{value_range}'"
        )
    lower, upper = (_parse_number(name, bound_text, unit) for bound_text in (fields[0], fields[-1]))
    _refuse_mixed_units(name, fields, unit)
    # A single value is a fixed variable.
    if len(fields) == 1:
        count = 1
    if lower > upper:
        raise SettingError(
            f"the range of '{name}' ends below its start: {lower:g} to {upper:g}; write the lower end first"
        )
    if is_log and lower <= 0.0:
        raise SettingError(
            f"the logarithmic range of '{name}' must be above 0, but begins at {lower:g}"
        )
    if count is not None and count > 1 and lower == upper:
        raise SettingError(
            f"'{name}' cannot have {count} values between {lower:g} and {upper:g}; give one value"
        )
    if count == 1 and lower != upper:
        raise SettingError(f"'{name}' has one value only; give it as {name}=VALUE")
    # "rad | m" is either, by a coordinate that is not known here.
    value_unit = "" if "|" in unit or unit == "parameter" else unit
    if value_unit and isinstance(target, Start) and target.is_speed:
        value_unit += "/s"
    return Variable(name, target, lower, upper, count, is_log, unit=value_unit)


def _refuse_mixed_units(name: str, bound_texts: Sequence[object], unit: str) -> None:
    """Refuse a range such as `20deg:40` in rad; 0 needs no unit.

    Raises:
        SettingError: only one end of the range has a unit, which is not that of the variable, and
            the other end is not 0.
    """
    quantities = [parse_quantity(str(bound_text)) for bound_text in bound_texts]
    with_unit = [
        quantity.unit
        for quantity in quantities
        if quantity is not None and quantity.unit is not None
    ]
    numbers_without_unit = [
        quantity.number
        for quantity in quantities
        if quantity is not None and quantity.unit is None and quantity.number != 0.0
    ]
    if with_unit and numbers_without_unit and not unit.startswith(f"{with_unit[0]}"):
        raise SettingError(
            f"the range of '{name}' has a unit at one end only: {bound_texts[0]}:{bound_texts[-1]}; "
            f"write it at both, as in {numbers_without_unit[0]:g}{with_unit[0]}"
        )


def _describe_suspect_range(variable: Variable, value_range: Range, mechanism: Mechanism) -> str:
    """Return a sentence if an initial angle seems to be written in degrees without a unit, else ""."""
    assert isinstance(variable.target, Start)
    bounds = (
        value_range.split(":")[:2]
        if isinstance(value_range, str)
        else [variable.low, variable.high]
    )
    infos = [
        mechanism.coordinates[mechanism.coordinate_index(path)]
        for path in variable.target.coordinates
    ]
    messages = (
        describe_suspect_value(info, variable.name, end) for info in infos for end in bounds
    )
    return next((message for message in messages if message), "")


def _parse_number(name: str, number_or_text: object, unit: str) -> float:
    """Return a number in the unit of the variable; `30deg` is converted.

    Raises:
        SettingError: the text is not a finite number, or its unit does not fit the variable.
    """
    if isinstance(number_or_text, int | float):
        quantity: Quantity | None = Quantity(float(number_or_text), None)
    else:
        quantity = parse_quantity(str(number_or_text))
    if quantity is None or not math.isfinite(quantity.number):
        raise SettingError(
            f"'{number_or_text}' is not a number for '{name}'; write one such as 0.5 or 30deg"
        )
    # A plain number is in the unit of the variable.
    if quantity.unit is None:
        return quantity.number
    # Some properties of OpenSim, such as limits of CoordinateLimitForce, are in degrees.
    if quantity.is_angle and unit.startswith("deg"):
        return quantity.number if quantity.unit == "deg" else math.degrees(quantity.number)
    if quantity.is_angle and unit.startswith("rad"):
        return quantity.value
    if not quantity.is_angle and unit in ("m", "m/s", "rad | m", "rad/s | m/s"):
        return quantity.value
    if unit == "parameter":
        raise SettingError(
            f"'{name}' is a parameter of a function or controller, whose unit osimlite does not know; give a plain number"
        )
    raise SettingError(
        f"'{name}' {f'is in {unit}' if unit else 'has no unit'}, but '{number_or_text}' has another unit"
    )
