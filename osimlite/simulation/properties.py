"""Numbers of a model by path, such as ``/forceset/RFootForce/contact_parameters/stiffness``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from typing import Protocol, TypeVar

from osimlite.base.records import dataclass, replace
from osimlite.errors import SettingError
from osimlite.schema.base import Component, Object
from osimlite.schema.fields import Value
from osimlite.schema.forces import Actuator
from osimlite.schema.model import Model


class NamedItem(Protocol):
    """Object with a name and a path."""

    @property
    def name(self) -> str:
        """Name of the component, without its parents."""

    @property
    def path(self) -> str:
        """Path of the component in the model."""


NamedItemType = TypeVar("NamedItemType", bound=NamedItem)

Step = str | int
"""Name of a property, or index in the list to which the previous step led."""


@dataclass(frozen=True)
class PropertyPath:
    """Path to one number of a component.

    Attributes:
        component: path of the component.
        steps: names of properties and indices of lists from the component to the number.
        unit: unit in the schema's notation, or "".
    """

    component: str  # path of the component
    steps: tuple[Step, ...]  # steps from the component to the number
    unit: str  # unit in the schema's notation, or ""

    def make_setter(self, model: Model) -> PropertySetter:
        """Return the setter of this number in a model.

        Raises:
            SettingError: the model has no such number.
        """
        holder: object = model.tree().by_path.get(self.component)
        try:
            for step in self.steps[:-2]:
                # All steps but the last two lead to the object that holds the number.
                holder = _get_step(holder, step)
            *_, field = self.steps
            if isinstance(field, str):
                holder = holder if len(self.steps) == 1 else _get_step(holder, self.steps[-2])
                return PropertySetter(_expect_object(holder), field, None)
            return PropertySetter(_expect_object(holder), str(self.steps[-2]), field)
        except (AttributeError, LookupError, TypeError):
            words = "/".join(str(step) for step in self.steps)
            raise SettingError(
                f"'{self.component}' lacks the number '{words}' in some models of the sweep"
            ) from None


@dataclass(frozen=True)
class PropertySetter:
    """Setter of one property, or of one entry of it.

    Attributes:
        holder: object with the property.
        name: name of the property.
        entry: index in the property if it is a vector.
        factor: factor by which values are multiplied before they are set.
    """

    holder: Object
    name: str
    entry: int | None
    factor: float = 1.0

    def make_factor_setter(self) -> PropertySetter:
        """Return a setter of multiples of the present value."""
        return replace(self, factor=self.get_value())

    def set_value(self, value: float) -> None:
        """Set the number to a value times `factor`.

        Args:
            value: number to set, which is multiplied by `factor` first.

        Raises:
            ModelError: the property does not accept the number.
        """
        value *= self.factor
        if self.entry is None:
            setattr(self.holder, self.name, value)
        else:
            # Vectors of the schema are tuples, so the complete one is replaced.
            numbers = list(getattr(self.holder, self.name))
            numbers[self.entry] = value
            setattr(self.holder, self.name, tuple(numbers))

    def get_value(self) -> float:
        """Return the present value of the number."""
        result = getattr(self.holder, self.name)
        return float(result if self.entry is None else result[self.entry])


def match_components(pattern: str, components: Iterable[NamedItemType]) -> list[NamedItemType]:
    """Return the components that a pattern selects; none if a part of it selects nothing.

    Args:
        pattern: a name or path, or several with commas; ``*``, ``?`` and ``[lr]`` stand for parts
            of a name.
        components: the candidates.
    """
    candidates = list(components)
    result: dict[int, NamedItemType] = {}
    for alternative in pattern.split(","):
        # A part with a slash at its beginning is compared with paths.
        matches = [
            item
            for item in candidates
            if _matches_pattern(
                alternative, item.path if alternative.startswith("/") else item.name
            )
        ]
        # A part that selects nothing is probably misspelt.
        if not matches:
            return []
        result |= {id(item): item for item in matches}
    return [item for item in candidates if id(item) in result]


def expand_braces(name: str, model: Model) -> list[str]:
    """Return the names that result from a pattern in braces.

    The pattern is compared with the names or paths of the components, and each different text that
    it stands for gives one name: ``{*}_?/control`` becomes ``soleus_?/control``,
    ``vasti_?/control`` and so on.

    Args:
        name: a name, path or pattern, with at most one pair of braces.
        model: model with the components.

    Returns:
        Names in the order of the model; the name itself without braces.
    """
    prefix, brace, remainder = name.partition("{")
    # Without braces the name stands for itself.
    if not brace:
        return [name]
    inner, _, tail = remainder.partition("}")
    end = re.split("[/@]", tail)[0]
    form = re.compile(
        f"{_to_regular_expression(prefix)}({_to_regular_expression(inner)}){_to_regular_expression(end)}"
    )
    components = model.components(
        Actuator if re.match("/control(@|$)", tail[len(end) :]) else Component
    )
    candidates = (item.path if prefix.startswith("/") else item.name for item in components)
    return [
        f"{prefix}{text}{tail}"
        for text in dict.fromkeys(result[1] for result in map(form.fullmatch, candidates) if result)
    ]


def _to_regular_expression(pattern: str) -> str:
    """Return a part of a pattern as a regular expression."""
    return "".join(
        # "*" stays within one component of a path.
        {"*": "[^/]*", "?": "[^/]", "[": "[", "]": "]"}.get(letter, re.escape(letter))
        for letter in pattern
    )


def _matches_pattern(pattern: str, name: str) -> bool:
    return name.count("/") == pattern.count("/") and fnmatchcase(name, pattern)


def find_properties(model: Model, path: str) -> tuple[PropertyPath, ...]:
    """Return the numbers that a path selects.

    A path consists of the path or name of a component (see :func:`match_components`), and the names
    of properties, separated by ``/``. Entries of lists are counted from 0
    (``/bodyset/Pelvis/mass_center/1``); the only entry of a list needs no index.

    Args:
        model: model with the components.
        path: the path.

    Returns:
        One path for each selected component that has the number; none if there are no such numbers.
    """
    words = path.split("/")
    # Components may have components, so the longest front that is a component wins.
    for count in range(len(words) - 1, 0, -1):
        pattern = "/".join(words[:count]) or "/"
        route = "/".join(words[count:])
        matching = match_components(pattern, model.components())
        if matching:
            numbers_by_item = [(item, dict(_iterate_numbers(item)).get(route)) for item in matching]
            return tuple(
                PropertyPath(item.path, *numbers) for item, numbers in numbers_by_item if numbers
            )
    return ()


def list_property_paths(model: Model) -> list[str]:
    """Return the paths of all numbers, and their short forms with names of components."""
    routes = [(item, route) for item in model.components() for route, _ in _iterate_numbers(item)]
    return [
        f"{front.rstrip('/')}/{route}" for item, route in routes for front in (item.path, item.name)
    ]


def _iterate_numbers(holder: Object) -> Iterator[tuple[str, tuple[tuple[Step, ...], str]]]:
    """Yield every number below an object, except those of other components.

    Args:
        holder: the object.

    Yields:
        Name of the number, its steps, and its unit with the schema's notation.
    """
    for spec in type(holder).field_specs().values():
        field_type = spec.kind
        if isinstance(field_type, Value) and field_type.scalar == "double":
            value = getattr(holder, spec.name)
            if isinstance(value, tuple):
                for entry in range(len(value)):
                    yield f"{spec.tag}/{entry}", ((spec.name, entry), field_type.unit or "")
            elif value is not None:
                yield spec.tag, ((spec.name,), field_type.unit or "")
    for spec, item in holder.list_owned_objects():
        # Components have paths of their own.
        if isinstance(item, Component) and item.is_component:
            continue
        field_value = getattr(holder, spec.name)
        inner_numbers = list(_iterate_numbers(item))
        if not isinstance(field_value, list):
            for route, (steps, unit) in inner_numbers:
                yield f"{spec.tag}/{route}", ((spec.name, *steps), unit)
            continue
        index = next(number for number, sibling in enumerate(field_value) if sibling is item)
        # A set consists of its list only, so the name of the list is omitted.
        front = "" if spec.tag == "objects" else f"{spec.tag}/"
        # An entry is named by its index, by its name, or not at all if it is the only one.
        names = [
            str(index),
            *([item.name] if item.name else []),
            *([""] if len(field_value) == 1 else []),
        ]
        for route, (steps, unit) in inner_numbers:
            for name in names:
                yield (
                    front + (f"{name}/" if name else "") + route,
                    ((spec.name, index, *steps), unit),
                )


def _get_step(holder: object, step: Step) -> object:
    return getattr(holder, step) if isinstance(step, str) else holder[step]  # type: ignore[index]


def _expect_object(holder: object) -> Object:
    if not isinstance(holder, Object):
        raise TypeError
    return holder
