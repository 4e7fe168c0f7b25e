"""The numbers of a model by path: ``/forceset/RFootForce/contact_parameters/stiffness``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from typing import Protocol, TypeVar

from osimlite.base.records import dataclass, replace
from osimlite.errors import SettingError
from osimlite.schema.actuators import Actuator
from osimlite.schema.base import Component, Object
from osimlite.schema.fields import Value
from osimlite.schema.model import Model


class Named(Protocol):
    """What has a name and a path."""

    @property
    def name(self) -> str:
        """Without what it is in."""

    @property
    def path(self) -> str:
        """With it."""


N = TypeVar("N", bound=Named)

Step = str | int
"""Name of a property, or place in the list that the step before led to."""


@dataclass(frozen=True)
class Place:
    """One number of a component."""

    component: str  # path
    steps: tuple[Step, ...]  # from the component to the number
    unit: str  # in the words of the schema, empty if it has none

    def setter(self, model: Model) -> Setter:
        """What puts numbers there.

        Raises:
            SettingError: this model has no such number.
        """
        holder: object = model.tree().by_path.get(self.component)
        try:
            for step in self.steps[:-2]:
                holder = _at(holder, step)
            *_, last = self.steps
            if isinstance(last, str):
                holder = holder if len(self.steps) == 1 else _at(holder, self.steps[-2])
                return Setter(_object(holder), last, None)
            return Setter(_object(holder), str(self.steps[-2]), last)
        except (AttributeError, LookupError, TypeError):
            words = "/".join(str(step) for step in self.steps)
            raise SettingError(
                f"'{self.component}' has no number '{words}' in every model of the sweep"
            ) from None


@dataclass(frozen=True)
class Setter:
    """Puts numbers into one property, or one entry of it; of one with a `factor` those times it."""

    holder: Object
    name: str
    entry: int | None
    factor: float = 1.0

    def scaling(self) -> Setter:
        """The same with what is there now as the factor."""
        return replace(self, factor=self.get())

    def put(self, value: float) -> None:
        """Set the number.

        Raises:
            ModelError: the property does not take it.
        """
        value *= self.factor
        if self.entry is None:
            setattr(self.holder, self.name, value)
        else:
            numbers = list(getattr(self.holder, self.name))
            numbers[self.entry] = value
            setattr(self.holder, self.name, tuple(numbers))

    def get(self) -> float:
        """The number that is there."""
        result = getattr(self.holder, self.name)
        return float(result if self.entry is None else result[self.entry])


def named(pattern: str, components: Iterable[N]) -> list[N]:
    """Components by name or path, or by several with commas; ``*``, ``?`` and ``[lr]`` stand for parts of a name.

    None if one of several means nothing.
    """
    known = list(components)
    result: dict[int, N] = {}
    for part in pattern.split(","):
        own = [
            item
            for item in known
            if _is_meant(part, item.path if part.startswith("/") else item.name)
        ]
        if not own:
            return []
        result |= {id(item): item for item in own}
    return [item for item in known if id(item) in result]


def each(name: str, model: Model) -> list[str]:
    """A name for each different text that stands for what is in braces in the name or path of a component.

    ``{*}_?/control`` is ``soleus_?/control``, ``vasti_?/control`` and so on.
    """
    head, brace, rest = name.partition("{")
    if not brace:
        return [name]
    inner, _, tail = rest.partition("}")
    end = re.split("[/@]", tail)[0]
    form = re.compile(f"{_regular(head)}({_regular(inner)}){_regular(end)}")
    components = model.components(
        Actuator if re.match("/control(@|$)", tail[len(end) :]) else Component
    )
    known = (item.path if head.startswith("/") else item.name for item in components)
    return [
        f"{head}{text}{tail}"
        for text in dict.fromkeys(result[1] for result in map(form.fullmatch, known) if result)
    ]


def _regular(pattern: str) -> str:
    """A part of a name as a regular expression."""
    return "".join(
        {"*": "[^/]*", "?": "[^/]", "[": "[", "]": "]"}.get(letter, re.escape(letter))
        for letter in pattern
    )


def _is_meant(pattern: str, name: str) -> bool:
    return name.count("/") == pattern.count("/") and fnmatchcase(name, pattern)


def places(model: Model, path: str) -> tuple[Place, ...]:
    """The numbers that a path means, as of `named` components; none if there are no such.

    A path is that of a component, or its name, and then the names of properties, with ``/``;
    entries of lists are counted from 0 (``/bodyset/Pelvis/mass_center/1``). What stands alone in a
    list needs no number.

    Args:
        model: whose.
        path: as above.
    """
    words = path.split("/")
    for count in range(len(words) - 1, 0, -1):
        pattern, route = "/".join(words[:count]) or "/", "/".join(words[count:])
        matching = named(pattern, model.components())
        if matching:
            every = [(item, dict(_numbers(item)).get(route)) for item in matching]
            return tuple(Place(item.path, *numbers) for item, numbers in every if numbers)
    return ()


def spellings(model: Model) -> list[str]:
    """Paths of all numbers, and what they are called by the names of their components."""
    routes = [(item, route) for item in model.components() for route, _ in _numbers(item)]
    return [
        f"{front.rstrip('/')}/{route}" for item, route in routes for front in (item.path, item.name)
    ]


def _numbers(holder: Object) -> Iterator[tuple[str, tuple[tuple[Step, ...], str]]]:
    """Every number below an object that is not below another component: how it is called, steps, unit."""
    for spec in type(holder).field_specs().values():
        kind = spec.kind
        if isinstance(kind, Value) and kind.scalar == "double":
            value = getattr(holder, spec.name)
            if isinstance(value, tuple):
                for entry in range(len(value)):
                    yield f"{spec.tag}/{entry}", ((spec.name, entry), kind.unit or "")
            elif value is not None:
                yield spec.tag, ((spec.name,), kind.unit or "")
    for spec, item in holder.objects_held():
        if isinstance(item, Component) and item.is_component:
            continue
        held = getattr(holder, spec.name)
        rest = list(_numbers(item))
        if not isinstance(held, list):
            for route, (steps, unit) in rest:
                yield f"{spec.tag}/{route}", ((spec.name, *steps), unit)
            continue
        place = next(number for number, other in enumerate(held) if other is item)
        # The list of a set is all that there is to it, so that its name says nothing.
        front = "" if spec.tag == "objects" else f"{spec.tag}/"
        names = [str(place), *([item.name] if item.name else []), *([""] if len(held) == 1 else [])]
        for route, (steps, unit) in rest:
            for name in names:
                yield (
                    front + (f"{name}/" if name else "") + route,
                    ((spec.name, place, *steps), unit),
                )


def _at(holder: object, step: Step) -> object:
    return getattr(holder, step) if isinstance(step, str) else holder[step]  # type: ignore[index]


def _object(holder: object) -> Object:
    if not isinstance(holder, Object):
        raise TypeError
    return holder
