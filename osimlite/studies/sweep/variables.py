"""What a sweep varies: how it is written, and what of a model or its start it means.

======================================  ==========================================================
``RHip_rz``, ``?Hip_rz``                value at the start, by the name or the path of a coordinate, or of several
``RHip_rz/speed``                       generalized speed at the start
``/bodyset/Pelvis/mass``                any number of the model, by the path of a component or its name
``/forceset/*Foot*/.../stiffness``      several numbers that are the same in each run
``*/max_isometric_force@scale``         factor of numbers of the model
``BRA/control``                         control of an actuator at all times, added to what the model does
``{*}_?/control``                       the same of each muscle, that of both legs alike
``soleus_?/control@0.1``                and what else can be varied of :mod:`controls <osimlite.studies.sweep.controls>`
``thigh_length``                        parameter of the function that makes the model
``flexor-elbow.KP``, ``*.KV``           parameter of a controller, or several
``slope``                               gravity tilted in the plane of x and y: a floor that falls towards +x
======================================  ==========================================================

A parameter of that name is meant by `slope` if there is one. A locked coordinate is held at the
value that it is given.
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
from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.actuators import Actuator
from osimlite.schema.model import Model
from osimlite.simulation.initial_state import describe_suspect_value
from osimlite.simulation.properties import (
    PropertyPath,
    expand_braces,
    find_properties,
    list_property_paths,
    match_components,
)
from osimlite.studies.sweep.controls import SCALE, Control, control, nodes_of

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.parts import CoordinateInfo
    from osimlite.simulation.control_steps import Gain

Floats = NDArray[np.float64]
Range = float | str | Sequence[Any]
"""A value; ``(low, high)``, ``(low, high, count)``, each with ``"log"`` at its end; or the text for it."""


@dataclass(frozen=True)
class Start:
    """Value or speed at the start of coordinates, by their paths."""

    coordinates: tuple[str, ...]
    is_speed: bool

    @property
    def parts(self) -> tuple[Start, ...]:
        """The same of each coordinate."""
        return tuple(Start((path,), self.is_speed) for path in self.coordinates)


@dataclass(frozen=True)
class Property:
    """Numbers of the model that are the same, or are changed by the same factor."""

    places: tuple[PropertyPath, ...]
    is_scaled: bool = False

    @property
    def parts(self) -> tuple[PropertyPath, ...]:
        """What no other variable may be."""
        return self.places


@dataclass(frozen=True)
class Parameter:
    """An argument of the function that makes the model."""

    name: str
    default: float | None = None


@dataclass(frozen=True)
class Slope:
    """Gravity of the same size, tilted about z, in rad."""


@dataclass(frozen=True)
class Gains:
    """Parameters of a controller that are the same."""

    parts: tuple[str, ...]  # their names
    present: float  # value of the first


Target = Start | Property | Control | Parameter | Slope | Gains


@dataclass(frozen=True)
class Variable:
    """A number that differs from run to run."""

    name: str  # as it was given
    target: Target  # what it is
    low: float  # least value, in rad, m or the unit of the property
    high: float  # largest value
    count: int | None = None  # of values in a grid
    is_log: bool = False  # whether its logarithm is what is spread evenly
    doubt: str = ""  # a sentence about what is odd in the range, else ""

    def at(self, fraction: Floats) -> Floats:
        """The values at fractions of the way from low to high, none of which is beyond them; exact at either end."""
        result = np.clip(self.beyond(fraction), self.low, self.high)
        return np.where(fraction <= 0.0, self.low, np.where(fraction >= 1.0, self.high, result))

    def beyond(self, fraction: Floats) -> Floats:
        """The values at fractions of the way from low to high, or farther."""
        if self.is_log:
            a, b = math.log(self.low), math.log(self.high)
            return np.exp(a + fraction * (b - a))
        return self.low + fraction * (self.high - self.low)

    def fraction(self, value: float) -> float:
        """Where a value lies, 0 at low and 1 at high."""
        if self.is_log:
            return (math.log(value) - math.log(self.low)) / (
                math.log(self.high) - math.log(self.low)
            )
        return (value - self.low) / (self.high - self.low)

    def stretch(self, value: float) -> float:
        """The derivative of a value by its fraction."""
        return value * math.log(self.high / self.low) if self.is_log else self.high - self.low

    @property
    def is_fixed(self) -> bool:
        """Whether it has one value only."""
        return self.low == self.high

    def settings(self) -> dict[str, Any]:
        """What makes it, for comparison and for people."""
        row: dict[str, Any] = {"name": self.name, "low": self.low, "high": self.high}
        if self.count is not None:
            row["count"] = self.count
        return {**row, "log": True} if self.is_log else row


def parse_ranges(words: Sequence[str]) -> dict[str, Range]:
    """Ranges by name from words ``NAME=LOW:HIGH[:COUNT][:log]`` or ``NAME=VALUE``.

    Raises:
        SettingError: a word is not of that form, or a name comes twice.
    """
    result: dict[str, Range] = {}
    for word in words:
        name, equals, text = (part.strip() for part in word.partition("="))
        if not (name and equals and text):
            raise SettingError(f"--vary takes NAME=LOW:HIGH or NAME=LOW:HIGH:COUNT, got '{word}'")
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
    """Find what is meant by names, and read their ranges.

    Args:
        ranges: by name.
        model: that is varied.
        mechanism: of it.
        parameters: of the function that makes it, with their defaults.
        gains: of a controller.

    Raises:
        SettingError: a name means nothing (the nearest is told), a range is none, or a unit does
            not fit.
    """
    result: list[Variable] = []
    for names, given in ranges.items():
        known = [
            (name, _resolve_target(name, model, mechanism, parameters, gains))
            for word in expand_braces(names, model)
            for name in nodes_of(word)
        ]
        for name, meaning in known:
            if meaning is not None:
                made = _make_variable(name, *meaning, given)
                if isinstance(made.target, Start) and not made.target.is_speed:
                    made = replace(made, doubt=_looks_like_degrees(made, given, mechanism))
                result.append(made)
        if all(meaning is None for _, meaning in known):
            raise _describe_unknown_name(
                names, model, mechanism, [*parameters, *(gain.name for gain in gains)]
            )
    taken: dict[object, str] = {}
    for item in result:
        for part in getattr(item.target, "parts", (item.target,)):
            if part in taken:
                raise SettingError(
                    f"'{taken[part]}' and '{item.name}' are the same number; vary one of them"
                )
            taken[part] = item.name
    return tuple(result)


def refuse_counts(found: Sequence[Variable]) -> None:
    """Stop at ranges with a number of values, where they are searched and not divided.

    Raises:
        SettingError: a variable has a number of values.
    """
    for item in found:
        if item.count is not None and not item.is_fixed:
            raise SettingError(
                f"the range of '{item.name}' is to have {item.count} values, which is for the grid of a sweep; "
                "a search takes any value of it: leave the number out"
            )


def _resolve_target(
    name: str,
    model: Model,
    mechanism: Mechanism,
    parameters: Mapping[str, Any],
    gains: Sequence[Gain],
) -> tuple[Target, str] | None:
    """What a name means, and in what unit; None if nothing."""
    front, _, last = name.rpartition("/")
    for key, is_speed in ((name, False), (front, last == "speed")):
        if (key == name or last in ("value", "speed")) and (
            meant := match_components(key, mechanism.coordinates)
        ):
            return _list_coordinates(name, meant, is_speed, model)
    if name in parameters:
        default = parameters[name]
        return Parameter(
            name, float(default) if type(default) in (int, float) else None
        ), "parameter"
    if own := match_components(name, gains):
        return Gains(tuple(gain.name for gain in own), own[0].value), "parameter"
    route, _, word = name.partition("@")
    front, _, last = route.rpartition("/")
    if last == "control" and (driven := match_components(front, model.components(Actuator))):
        made = control(name, [item.path for item in driven], word)
        return made, made.unit
    if word in ("", SCALE) and (result := find_properties(model, route)):
        unit = result[0].unit
        if unit.startswith("rad | m") and (
            infos := match_components(result[0].component, mechanism.coordinates)
        ):
            unit = infos[0].unit or "rad | m"
        return Property(result, bool(word)), "" if word else unit
    if name == "slope":
        return Slope(), "rad"
    return None


def _describe_unknown_name(
    name: str, model: Model, mechanism: Mechanism, parameters: Sequence[str]
) -> SettingError:
    """The error for a name that means nothing."""
    route = name.partition("@")[0]
    if match_components(route, model.components(Actuator)):
        return SettingError(
            f"'{name}' is an actuator: vary '{route}/control', or one of its properties"
        )
    known = [f"{info.name}{what}" for info in mechanism.coordinates for what in ("", "/speed")] + [
        *parameters,
        "slope",
    ]
    known += [f"{info.path}{what}" for info in mechanism.coordinates for what in ("", "/speed")]
    known += [
        f"{key}/control" for item in model.components(Actuator) for key in (item.name, item.path)
    ]
    known += list_property_paths(model) if "/" in name else []
    near = suggest_name(name, known)
    return SettingError(
        f"there is no coordinate, parameter, control or number '{name}' to vary{near}"
    )


def _list_coordinates(
    name: str, infos: Sequence[CoordinateInfo], is_speed: bool, model: Model
) -> tuple[Target, str]:
    unit, locked = infos[0].unit or "rad | m", [info for info in infos if info.locked]
    if locked and is_speed:
        raise SettingError(
            f"the coordinate '{locked[0].name}' is locked, so that it has no speed; unlock it in the model"
        )
    if not locked:
        return Start(tuple(info.path for info in infos), is_speed), unit
    if len(locked) < len(infos):
        raise SettingError(
            f"of '{name}', '{locked[0].name}' is locked and others are not; vary these one by one"
        )
    return Property(
        find_properties(model, ",".join(info.path for info in infos) + "/default_value")
    ), unit


def _make_variable(name: str, target: Target, unit: str, given: Range) -> Variable:
    parts = (
        given.split(":")
        if isinstance(given, str)
        else [given]
        if isinstance(given, int | float)
        else list(given)
    )
    count, is_log = None, False
    if len(parts) > 1 and parts[-1] == "log":
        is_log = True
        parts.pop()
    if len(parts) == 3:
        text = str(parts.pop())
        if not text.strip().isdigit() or int(text) < 1:
            raise SettingError(
                f"the number of values of '{name}' is a whole number above zero, not '{text}'"
            )
        count = int(text)
    if len(parts) not in (1, 2):
        raise SettingError(f"'{name}' takes LOW:HIGH, LOW:HIGH:COUNT or one value, not '{given}'")
    low, high = (_parse_number(name, part, unit) for part in (parts[0], parts[-1]))
    _refuse_mixed(name, parts, unit)
    if len(parts) == 1:
        count = 1
    if low > high:
        raise SettingError(
            f"the range of '{name}' ends below its start: {low:g} to {high:g}; turn it round"
        )
    if is_log and low <= 0.0:
        raise SettingError(
            f"'{name}' is spread by its logarithm, so that it must be above zero, not {low:g}"
        )
    if count is not None and count > 1 and low == high:
        raise SettingError(
            f"'{name}' cannot have {count} values between {low:g} and {high:g}; give it one"
        )
    if count == 1 and low != high:
        raise SettingError(f"'{name}' has one value only; give it as {name}=VALUE")
    return Variable(name, target, low, high, count, is_log)


def _refuse_mixed(name: str, ends: Sequence[object], unit: str) -> None:
    """Stop at ``20deg:40`` of what is in rad; zero is the same in every unit."""
    read = [parse_quantity(str(part)) for part in ends]
    with_unit = [each.unit for each in read if each is not None and each.unit is not None]
    bare = [
        each.number
        for each in read
        if each is not None and each.unit is None and each.number != 0.0
    ]
    if with_unit and bare and not unit.startswith(f"{with_unit[0]}"):
        raise SettingError(
            f"the range of '{name}' has a unit at one end only: {ends[0]}:{ends[-1]}; "
            f"write it at both, as in {bare[0]:g}{with_unit[0]}"
        )


def _looks_like_degrees(made: Variable, given: Range, mechanism: Mechanism) -> str:
    """Whether an angle of the start was written as a number of degrees."""
    assert isinstance(made.target, Start)
    ends = given.split(":")[:2] if isinstance(given, str) else [made.low, made.high]
    infos = [
        mechanism.coordinates[mechanism.coordinate_index(path)] for path in made.target.coordinates
    ]
    odd = (describe_suspect_value(info, made.name, end) for info in infos for end in ends)
    return next((words for words in odd if words), "")


def _parse_number(name: str, part: object, unit: str) -> float:
    if isinstance(part, int | float):
        given: Quantity | None = Quantity(float(part), None)
    else:
        given = parse_quantity(str(part))
    if given is None or not math.isfinite(given.number):
        raise SettingError(f"'{part}' is no number for '{name}'; give one such as 0.5 or 30deg")
    if given.unit is None:
        return given.number
    if given.is_angle and unit.startswith("deg"):
        return given.number if given.unit == "deg" else math.degrees(given.number)
    if given.is_angle and unit.startswith("rad"):
        return given.value
    if not given.is_angle and unit in ("m", "m/s", "rad | m", "rad/s | m/s"):
        return given.value
    if unit == "parameter":
        raise SettingError(
            f"'{name}' is a parameter of a function or a controller, whose unit only that knows; give a plain number"
        )
    raise SettingError(f"'{name}' is in {unit or 'no unit'}, which '{part}' does not fit")
