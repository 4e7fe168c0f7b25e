"""The kernels of a kind of force, written from its declaration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.batched_curves import (
    LANES,
    answer,
    ask,
    ask_sum,
    missed_of,
    value_of,
)
from osimlite.mechanics.kernels.condensation import WIDTH
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.table import GIVEN, written
from osimlite.mechanics.laws.dual_numbers import carrying, carrying_room, slope_of
from osimlite.simulation.elements.laws import ABREAST, EQUILIBRIUM, OFF, RESPONSE, RIGID
from osimlite.simulation.elements.registry import FORCE_TYPES

if TYPE_CHECKING:
    from osimlite.simulation.elements.force_type import ForceType, State
    from osimlite.simulation.elements.parameters import Parameter

SOLVED = "solved"
"""The output that tells whether the law has a solution; without it, it always has one."""

SOUGHT_ROUNDS = 4
"""Of a search for a sum, from between the ends of a section."""


class Asked(NamedTuple):
    """A part of a law that follows when curves were asked."""

    # names of the curves, each with the name of what is known that is its argument
    curves: dict[str, str]
    law: Callable[..., Any]  # given what is known, the first parameter, and the value of each curve
    results: tuple[str, ...]  # names of what it finds


class Sought(NamedTuple):
    """A part of a law that follows when one of some curves was asked, itself or a sum of it and its argument."""

    curves: tuple[str, ...]  # names of the curves
    # given what is known and the first parameter, tells the number of the curve, factors of it and
    # of its argument, and what the sum of both is; a curve itself is asked where the first factor
    # is 0 and the second 1
    asking: Callable[..., Any]
    # given the same, the value of the curve, and how far a search has missed
    law: Callable[..., Any]
    results: tuple[str, ...]  # names of what it finds


class Abreast(NamedTuple):
    """A law in parts, for several forces: their curves are asked together, which a processor does side by side.

    The results are those of the law to the last bit.
    """

    known: type[Any]  # named tuple of what the parts find
    # makes it, from what the law is given of the moment, and the first parameter
    begin: Callable[..., Any]
    asked: Asked  # the first part
    sought: Sought  # the second
    end: Callable[..., Any]  # the results of the law, from what is known and the first parameter


@dataclass(frozen=True, eq=False)
class KernelText:
    """Writes the kernels of a kind."""

    force_type: ForceType  # the declaration

    @cached_property
    def kernel(self) -> Callable[..., int]:
        """The function that computes and applies one force."""
        return self._function(
            "", self.force_type.law, [*self._computing, *self.force_type.geometry.after]
        )

    @cached_property
    def off_kernel(self) -> Callable[..., int]:
        """The function that computes one force and does not apply it."""
        return self._function(OFF, self.force_type.law, self._computing)

    @cached_property
    def equilibrium_kernel(self) -> Callable[..., int]:
        """The function that brings the states of one force into equilibrium."""
        force_type = self.force_type
        lines = [f"{', '.join((SOLVED, *force_type.settled))} = {self._call(self._arguments)}"]
        lines += self._noted((*force_type.geometry.inputs, *force_type.settled))
        lines += [f"if not {SOLVED}:", "    return OUTCOME.UNSOLVED"]
        for place, state in self._places.items():
            if state.name in force_type.settled:
                lines += [f"if i[{place}] >= 0:", f"    y[i[{place}]] = {state.name}"]
        return self._function(EQUILIBRIUM, force_type.equilibrium, lines)

    @cached_property
    def rigid_kernel(self) -> Callable[..., int]:
        """The function of a muscle that pulls with its control times the force of fully active fibers."""
        lines = [f"active_fiber_force = {self._call(self._arguments)}"]
        lines += [f"activation = {self._arguments[len(self.force_type.geometry.inputs)]}"]
        lines += ["tension = activation * active_fiber_force"]
        lines += self._noted(
            ("tension", "activation", "active_fiber_force", *self.force_type.geometry.inputs)
        )
        return self._function(
            RIGID, self.force_type.rigid, [*lines, *self.force_type.geometry.after]
        )

    @cached_property
    def response_kernel(self) -> Callable[..., int]:
        """The function that applies 1 of a force along a displacement, and leaves its derivatives in SCRATCH.

        A row for the force and for the rate of each state, see
        :mod:`osimlite.mechanics.kernels.condensation`. The moment is that of the last evaluation,
        whose record tells what that has found.
        """
        force_type, force = self.force_type, self.force_type.geometry.along[0]
        rows, changed = (force, *(state.rate for state in force_type.states)), self.changed_outputs
        arguments = self._arguments
        directions = {column: direction for direction, column in enumerate(changed)}
        law, count = force_type.again or force_type.law, len(changed)
        for column, place in changed.items():
            arguments[place] = f"carrying({arguments[place]}, {directions[column]}, {count})"
        # Formulas compute in the record; controls have what reflexes add to them.
        arguments = [
            f"carrying_room({each}, {count})"
            if each.startswith("at(found")
            else each.replace(", rate)", ", 0.0)")
            for each in arguments
        ]
        if force_type.again is not None and force_type.law is not None:
            given = signature(force_type.law).parameters
            arguments += [
                f"found[{force_type.recorded[name]}]"
                for name in signature(force_type.again).parameters
                if name not in given
            ]
        # A rate may have the name of an output of another meaning, such as that of a state.
        lines = [
            f"{', '.join(f'{name}_0' for name in force_type.outputs)} = {self._call(arguments)}"
        ]
        lines += [f"{force} = 1.0", *force_type.geometry.after, "change = at(data, WORK.SCRATCH)"]
        for row, name in enumerate(rows):
            for column in range(WIDTH):
                value = (
                    f"slope_of({name}_0, {directions[column]})" if column in directions else "0.0"
                )
                lines.append(f"change[{WIDTH * row + column}] = {value}")
        lines[:0] = (
            *self._places_of_item,
            *(force_type.geometry.again or force_type.geometry.before),
        )
        carried = {function.__name__: function for function in (carrying, carrying_room, slope_of)}
        return self._written(RESPONSE, "item", lines, law=law, **carried)

    @cached_property
    def abreast_kernel(self) -> Callable[..., int]:
        """The function that computes and applies several forces that follow one another."""
        force_type, made = self.force_type, self.force_type.abreast
        if made is None:
            raise TypeError(f"the law of {force_type.name} has no parts")
        inputs, recorded, arguments = (
            force_type.geometry.inputs,
            force_type.recorded,
            self._arguments,
        )
        # Up to the end the record has what is known.
        own = (f"found[{place}]" for name, place in recorded.items() if name not in inputs)
        known = dict(zip(made.known._fields, own, strict=False))
        of_moment = len(self.input_names) + 1 + sum(state.given for state in force_type.states)
        told = f"known({', '.join(known.values())}), {arguments[of_moment]}"
        begin = f"{', '.join(known.values())} = {self._call(arguments[: of_moment + 1], 'begin')}"
        first, second = made.asked, made.sought
        *_, curves = force_type.terms
        places, number = {}, self.size - curves.size
        for name, term in zip(curves.type._fields, curves.terms, strict=True):  # type: ignore[attr-defined]
            places[name], number = f"i[ITEM.NUMBERS] + {number}", number + term.size
        count = len(first.curves)
        asks = [
            f"ask(reals, lanes, asked + {k}, {places[curve]}, {known[name]})"
            for k, (curve, name) in enumerate(first.curves.items())
        ]
        lines = [
            "asked = 0",
            *self._each(
                [
                    *force_type.geometry.before,
                    *self._noted(inputs),
                    begin,
                    *asks,
                    f"asked += {count}",
                ]
            ),
        ]
        answers = ", ".join(f"value_of(lanes, {count} * asked + {k})" for k in range(count))
        place = places[second.curves[-1]]
        for number, curve in reversed([*enumerate(second.curves[:-1])]):
            place = f"{places[curve]} if which == {number} else {place}"
        # Whoever has an answer asks for the next at once, in the room of what is answered.
        lines += [
            "answer(lanes, asked, 1)",
            "asked = 0",
            *self._each(
                [
                    f"{', '.join(known[name] for name in first.results)} = law({told}, {answers})",
                    f"which, of_curve, of_argument, total = asking({told})",
                    f"place = {place}",
                    "if of_curve == 0.0 and of_argument == 1.0:",
                    "    ask(reals, lanes, asked, place, total)",
                    "else:",
                    "    ask_sum(reals, lanes, asked, place, of_curve, of_argument, total)",
                    "asked += 1",
                ]
            ),
        ]
        lines += [f"answer(lanes, asked, {SOUGHT_ROUNDS})", "asked = 0"]
        found = ", ".join(known[name] for name in second.results)
        ended = [
            f"{found} = found_law({told}, value_of(lanes, asked), missed_of(lanes, asked))",
            "asked += 1",
        ]
        end = [f"{', '.join(force_type.outputs)} = end({told})"]
        end += self._results(name for name in recorded if name not in inputs)
        lines += self._each([*ended, *end, *force_type.geometry.after])
        return self._written(
            ABREAST,
            "run",
            [
                "lanes, first = at(data, model[run + RUN.ROOM]), model[run + RUN.FIRST]",
                "while first < model[run + RUN.END]:",
                f"    end_of_part = min(first + {LANES // count}, model[run + RUN.END])",
                *(f"    {line}" for line in lines),
                "    first = end_of_part",
            ],
            **{"known": made.known, "begin": made.begin, "law": first.law, "asking": second.asking},
            **{
                "found_law": second.law,
                "end": made.end,
                "ask": ask,
                "ask_sum": ask_sum,
                "answer": answer,
            },
            **{"value_of": value_of, "missed_of": missed_of},
        )

    def _each(self, lines: Sequence[str]) -> list[str]:
        """Lines about each item of a run; who is told of an item without a solution is told its number."""
        refused = "    return OUTCOME.UNSOLVED"
        told = [
            new
            for line in lines
            for new in (("    f[0] = number", line) if line == refused else (line,))
        ]
        return [
            "for number in range(first, end_of_part):",
            "    item = model[model[MODEL.ITEM_AT] + number]",
            *(f"    {line}" for line in (*self._places_of_item, *told)),
        ]

    @property
    def changed_outputs(self) -> dict[int, int]:
        """By column of the derivatives the place of the argument that is changed."""
        force_type = self.force_type
        inputs = list(self.input_names)
        result = {
            column: inputs.index(name)
            for column, name in enumerate(force_type.geometry.inputs)
            if name in inputs
        }
        given = [column for column, state in enumerate(force_type.states) if state.given]
        first = len(inputs) + force_type.controlled
        return result | {2 + column: first + number for number, column in enumerate(given)}

    @property
    def responds(self) -> bool:
        """Whether its forces have derivatives along one displacement."""
        force_type = self.force_type
        return (
            force_type.law is not None
            and force_type.geometry.along[0] in force_type.outputs
            and bool(self.changed_outputs)
        )

    def _function(
        self, form: str, law: Callable[..., Any] | None, lines: Sequence[str]
    ) -> Callable[..., int]:
        return self._written(
            form, "item", [*self._places_of_item, *self.force_type.geometry.before, *lines], law=law
        )

    @property
    def _places_of_item(self) -> list[str]:
        recorded = len(self.force_type.recorded)
        return [
            "i = at(model, item)",
            "p, found = at(reals, i[ITEM.NUMBERS]), at(data, i[ITEM.RECORD])",
            f"g, gp, room = at(i, {ITEM.OWN + self.heads}), at(p, {self.size}), at(found, {recorded})",
        ]

    def _written(
        self, form: str, place: str, lines: Sequence[str], **own: Any
    ) -> Callable[..., int]:
        force_type, name = self.force_type, self.force_type.name + form
        source = "\n    ".join(
            [
                f'def {name}({GIVEN}, {place}: "int") -> "int":',
                *lines,
                "return OUTCOME.OK\n",
            ]
        )
        scope = {
            name: value for term in force_type.terms for name, value in term.functions().items()
        }
        if force_type.together is not None:
            scope[force_type.together.__name__] = force_type.together
        return written(
            name,
            FORCE_TYPES.module_of(force_type.component),
            source,
            **own,
            **force_type.geometry.functions(),
            **scope,
        )

    @property
    def _computing(self) -> list[str]:
        """What is done with the law, but for the force."""
        force_type, lines = self.force_type, []
        if force_type.law is not None:
            results = f"{', '.join(force_type.outputs)} = " if force_type.outputs else ""
            lines.append(f"{results}{self._call(self._arguments)}")
        return lines + self._results(force_type.recorded)

    def _results(self, names: Iterable[str]) -> list[str]:
        """Note results of the law by their names, and what it says of states."""
        force_type, lines = self.force_type, self._noted(names)
        if SOLVED in force_type.outputs:
            lines += [f"if not {SOLVED}:", "    return OUTCOME.UNSOLVED"]
        for place, state in self._places.items():
            lines += [f"if i[{place}] >= 0:", f"    f[i[{place}]] = {state.rate}"]
        return lines

    def _noted(self, names: Iterable[str]) -> list[str]:
        recorded = self.force_type.recorded
        return [f"found[{recorded[name]}] = {name}" for name in names if name in recorded]

    @property
    def _places(self) -> dict[int, State]:
        """Each state, by the integer of an item that says where it is, -1 if it has none."""
        first = ITEM.OWN + sum(term.heads for term in self.force_type.terms)
        return {first + number: state for number, state in enumerate(self.force_type.states)}

    @property
    def _arguments(self) -> list[str]:
        """What a law is called with."""
        force_type = self.force_type
        terms = arguments_of(force_type.terms, ITEM.OWN, 0)
        given = [place for place, state in self._places.items() if state.given]
        states = [f"(y[i[{place}]] if i[{place}] >= 0 else 0.0)" for place in given]
        count = 1 if force_type.controlled else 0
        return [*self.input_names, *terms[:count], *states, *terms[count:]]

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of what the law gets from the geometry."""
        return (
            self.force_type.geometry.inputs
            if self.force_type.inputs is None
            else self.force_type.inputs
        )

    def _call(self, arguments: Sequence[str], law: str = "law") -> str:
        """The law called with these; as one, those that change with time, if the kind says so."""
        made = self.force_type.together
        if made is None:
            return f"{law}({', '.join(arguments)})"
        names = (
            *self.input_names,
            "excitation",
            *(state.name for state in self.force_type.states if state.given),
        )
        given = dict(zip(names, arguments, strict=False))
        first = f"{made.__name__}({', '.join(given.get(name, '0.0') for name in made._fields)})"
        return f"{law}({', '.join((first, *arguments[len(names) :]))})"

    @property
    def heads(self) -> int:
        """How many integers of an item are the kind's own."""
        return sum(term.heads for term in self.force_type.terms) + len(self.force_type.states)

    @property
    def size(self) -> int:
        """How many numbers of an item are the parameters."""
        return sum(term.size for term in self.force_type.terms)


def arguments_of(terms: Iterable[Parameter], head: int, number: int) -> list[str]:
    """What a law is called with for terms whose integers and numbers begin at these places."""
    result = []
    for term in terms:
        result += term.arguments(head, number)
        head, number = head + term.heads, number + term.size
    return result
