"""The kernels of a kind of force, written from its declaration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

from osimlite.kernels.condensation import WIDTH
from osimlite.kernels.curves_abreast import LANES, answer, ask, slope_of, value_of
from osimlite.kernels.layout import ITEM
from osimlite.kernels.written import written
from osimlite.records import dataclass
from osimlite.simulation.elements.laws import ABREAST, EQUILIBRIUM, OFF, RESPONSE, RIGID

if TYPE_CHECKING:
    from osimlite.simulation.elements.kind import Kind, State
    from osimlite.simulation.elements.parameters import Parameter

SOLVED = "solved"
"""The output that tells whether the law has a solution; without it, it always has one."""

SMALL_CHANGE = 1e-7
"""Of lengths (m), angles, speeds and states, to find derivatives."""


class Asked(NamedTuple):
    """A part of a law that follows when curves were asked."""

    curves: dict[str, str]  # names of the curves, each with the name of what is known that is its argument
    law: Callable[..., Any]  # given what is known, the first parameter, and the value of each curve
    results: tuple[str, ...]  # names of what it finds
    slopes: bool = False  # whether it is given the slope after each value


class Abreast(NamedTuple):
    """A law in parts, for several forces: their curves are asked together, which a processor does side by side.

    The results are those of the law to the last bit.
    """

    known: type[Any]  # named tuple of what the parts find; while the first is positive, the search goes on
    begin: Callable[..., Any]  # makes it, from what the law is given of the moment, and the first parameter
    parts: tuple[Asked, ...]
    search: Asked  # a step of it
    end: Callable[..., Any]  # the results of the law, from what is known and the first parameter


@dataclass(frozen=True, eq=False)
class KernelText:
    """Writes the kernels of a kind."""

    kind: Kind  # the declaration

    @cached_property
    def kernel(self) -> Callable[..., int]:
        """The function that computes and applies one force."""
        return self._function("", self.kind.law, [*self._computing, *self.kind.geometry.after])

    @cached_property
    def off_kernel(self) -> Callable[..., int]:
        """The function that computes one force and does not apply it."""
        return self._function(OFF, self.kind.law, self._computing)

    @cached_property
    def equilibrium_kernel(self) -> Callable[..., int]:
        """The function that brings the states of one force into equilibrium."""
        kind = self.kind
        lines = [f"{', '.join((SOLVED, *kind.settled))} = {self._call(self._arguments)}"]
        lines += self._noted((*kind.geometry.inputs, *kind.settled))
        lines += [f"if not {SOLVED}:", "    return OUTCOME.UNSOLVED"]
        for place, state in self._places.items():
            if state.name in kind.settled:
                lines += [f"if i[{place}] >= 0:", f"    y[i[{place}]] = {state.name}"]
        return self._function(EQUILIBRIUM, kind.equilibrium, lines)

    @cached_property
    def rigid_kernel(self) -> Callable[..., int]:
        """The function of a muscle that pulls with its control times the force of fully active fibers."""
        lines = [f"active_fiber_force = {self._call(self._arguments)}"]
        lines += [f"activation = {self._arguments[len(self.kind.geometry.inputs)]}"]
        lines += ["tension = activation * active_fiber_force"]
        lines += self._noted(("tension", "activation", "active_fiber_force", *self.kind.geometry.inputs))
        return self._function(RIGID, self.kind.rigid, [*lines, *self.kind.geometry.after])

    @cached_property
    def response_kernel(self) -> Callable[..., int]:
        """The function that applies 1 of a force along a displacement, and leaves its derivatives in SCRATCH.

        A row for the force and for the rate of each state, see :mod:`osimlite.kernels.condensation`. The moment is that
        of the last evaluation, whose record tells what that has found.
        """
        kind, outputs, law = self.kind, self.kind.outputs, self.kind.law
        force, _ = kind.geometry.along
        rows, changed = (force, *(state.rate for state in kind.states)), self._changed
        if kind.slopes is not None and law is not None:
            found = [name for name in signature(kind.slopes).parameters if name not in signature(law).parameters]
            arguments = [*self._arguments, *(f"found[{kind.recorded[name]}]" for name in found)]
            law, slopes = kind.slopes, [f"{name}_{column + 1}" for name in rows for column in changed]
            lines = [f"{', '.join(slopes)} = {self._call(arguments)}"]
            slope = "{0}_{1}"
        else:
            # A rate may have the name of an output of another meaning, such as that of a state.
            lines = [f"{', '.join(f'{name}_0' for name in outputs)} = {self._call(self._arguments)}"]
            for column, place in changed.items():
                arguments = self._arguments
                arguments[place] += f" + {SMALL_CHANGE}"
                results = ", ".join(f"{name}_{column + 1}" for name in outputs)
                lines.append(f"{results} = {self._call(arguments)}")
            slope = f"({{0}}_{{1}} - {{0}}_0) / {SMALL_CHANGE}"
        lines += [f"{force} = 1.0", *kind.geometry.after, "change = at(w, WORK.SCRATCH)"]
        for row, name in enumerate(rows):
            for column in range(WIDTH):
                value = slope.format(name, column + 1) if column in changed else "0.0"
                lines.append(f"change[{WIDTH * row + column}] = {value}")
        lines[:0] = *self._places_of_item, *(kind.geometry.again or kind.geometry.before)
        return self._written(RESPONSE, "item", lines, law=law)

    @cached_property
    def abreast_kernel(self) -> Callable[..., int]:
        """The function that computes and applies several forces that follow one another."""
        kind, made = self.kind, self.kind.abreast
        if made is None:
            raise TypeError(f"the law of {kind.name} has no parts")
        inputs, recorded, arguments = kind.geometry.inputs, kind.recorded, self._arguments
        # Up to the end the record has what is known.
        own = (f"found[{place}]" for name, place in recorded.items() if name not in inputs)
        known = dict(zip(made.known._fields, own, strict=False))
        of_moment = len(self._inputs) + 1 + sum(state.given for state in kind.states)
        told = f"known({', '.join(known.values())}), {arguments[of_moment]}"
        begin = f"{', '.join(known.values())} = {self._call(arguments[: of_moment + 1], 'begin')}"
        going = f"if {known[made.known._fields[0]]} > 0.0:"
        *_, last = asks = [self._asking(part, known) for part in (*made.parts, made.search)]
        last[:] = [going, *(f"    {line}" for line in last)]
        lines = ["asked = 0", *self._each([*kind.geometry.before, *self._noted(inputs), begin, *asks[0]])]
        # Whoever has an answer asks for the next at once.
        ready = ["answer(lanes, asked)", "asked = answered = 0"]
        for number, part in enumerate(made.parts):
            lines += [*ready, *self._each([*self._answering(part, f"law_{number}", known, told), *asks[number + 1]])]
        step = self._answering(made.search, "search", known, told)
        step = [*ready, *self._each([going, *(f"    {line}" for line in (*step, *last))])]
        lines += ["while asked > 0:", *(f"    {line}" for line in step)]
        end = [f"{', '.join(kind.outputs)} = end({told})"]
        end += self._results(name for name in recorded if name not in inputs)
        lines += self._each([*end, *kind.geometry.after])
        most = LANES // max(len(part.curves) for part in (*made.parts, made.search))
        scope = {f"law_{number}": part.law for number, part in enumerate(made.parts)}
        return self._written(
            ABREAST,
            "run",
            [
                "lanes, first = at(w, s[run + RUN.ROOM]), s[run + RUN.FIRST]",
                "while first < s[run + RUN.END]:",
                f"    end_of_part = min(first + {most}, s[run + RUN.END])",
                *(f"    {line}" for line in lines),
                "    first = end_of_part",
            ],
            **scope,
            **{"known": made.known, "begin": made.begin, "search": made.search.law, "end": made.end},
            **{"ask": ask, "value_of": value_of, "slope_of": slope_of, "answer": answer},
        )

    def _asking(self, part: Asked, known: Mapping[str, str]) -> list[str]:
        """Ask for the curves of a part."""
        *_, curves = self.kind.terms
        places, number = {}, self.size - curves.size
        for name, term in zip(curves.type._fields, curves.terms, strict=True):  # type: ignore[attr-defined]
            places[name], number = number, number + term.size
        asks = enumerate(part.curves.items())
        return [
            *(f"ask(x, lanes, asked + {k}, i[ITEM.NUMBERS] + {places[curve]}, {known[at]})" for k, (curve, at) in asks),
            f"asked += {len(part.curves)}",
        ]

    def _answering(self, part: Asked, law: str, known: Mapping[str, str], told: str) -> list[str]:
        """Have the law of a part answer."""
        kinds, count = ("value_of", "slope_of")[: 1 + part.slopes], len(part.curves)
        answers = ", ".join(f"{kind}(lanes, answered + {k})" for k in range(count) for kind in kinds)
        results = ", ".join(known[name] for name in part.results)
        return [f"{results} = {law}({told}, {answers})", f"answered += {count}"]

    def _each(self, lines: Sequence[str]) -> list[str]:
        """Lines about each item of a run; who is told of an item without a solution is told its number."""
        refused = "    return OUTCOME.UNSOLVED"
        told = [new for line in lines for new in (("    f[0] = number", line) if line == refused else (line,))]
        return [
            "for number in range(first, end_of_part):",
            "    item = s[s[MODEL.ITEM_AT] + number]",
            *(f"    {line}" for line in (*self._places_of_item, *told)),
        ]

    @property
    def _changed(self) -> dict[int, int]:
        """By column of the derivatives the place of the argument that is changed."""
        kind = self.kind
        inputs = list(self._inputs)
        result = {column: inputs.index(name) for column, name in enumerate(kind.geometry.inputs) if name in inputs}
        given = [column for column, state in enumerate(kind.states) if state.given]
        first = len(inputs) + kind.controlled
        return result | {2 + column: first + number for number, column in enumerate(given)}

    @property
    def responds(self) -> bool:
        """Whether its forces have derivatives along one displacement."""
        kind = self.kind
        return kind.law is not None and kind.geometry.along[0] in kind.outputs and bool(self._changed)

    def _function(self, form: str, law: Callable[..., Any] | None, lines: Sequence[str]) -> Callable[..., int]:
        return self._written(form, "item", [*self._places_of_item, *self.kind.geometry.before, *lines], law=law)

    @property
    def _places_of_item(self) -> list[str]:
        recorded = len(self.kind.recorded)
        return [
            "i = at(s, item)",
            "p, found = at(x, i[ITEM.NUMBERS]), at(w, i[ITEM.RECORD])",
            f"g, gp, room = at(i, {ITEM.OWN + self.heads}), at(p, {self.size}), at(found, {recorded})",
        ]

    def _written(self, form: str, place: str, lines: Sequence[str], **own: Any) -> Callable[..., int]:
        kind, name = self.kind, self.kind.name + form
        source = "\n    ".join(
            [
                f'def {name}(s: "Ints", x: "Floats", w: "Floats", y: "Floats", f: "Floats", {place}: "int") -> "int":',
                *lines,
                "return OUTCOME.OK\n",
            ]
        )
        scope = {name: value for term in kind.terms for name, value in term.functions().items()}
        if kind.together is not None:
            scope[kind.together.__name__] = kind.together
        return written(name, f"{__package__}.kinds.{kind.name}", source, **own, **kind.geometry.functions(), **scope)

    @property
    def _computing(self) -> list[str]:
        """What is done with the law, but for the force."""
        kind, lines = self.kind, []
        if kind.law is not None:
            results = f"{', '.join(kind.outputs)} = " if kind.outputs else ""
            lines.append(f"{results}{self._call(self._arguments)}")
        return lines + self._results(kind.recorded)

    def _results(self, names: Iterable[str]) -> list[str]:
        """Note results of the law by their names, and what it says of states."""
        kind, lines = self.kind, self._noted(names)
        if SOLVED in kind.outputs:
            lines += [f"if not {SOLVED}:", "    return OUTCOME.UNSOLVED"]
        for place, state in self._places.items():
            lines += [f"if i[{place}] >= 0:", f"    f[i[{place}]] = {state.rate}"]
        return lines

    def _noted(self, names: Iterable[str]) -> list[str]:
        recorded = self.kind.recorded
        return [f"found[{recorded[name]}] = {name}" for name in names if name in recorded]

    @property
    def _places(self) -> dict[int, State]:
        """Each state, by the integer of an item that says where it is, -1 if it has none."""
        first = ITEM.OWN + sum(term.heads for term in self.kind.terms)
        return {first + number: state for number, state in enumerate(self.kind.states)}

    @property
    def _arguments(self) -> list[str]:
        """What a law is called with."""
        kind = self.kind
        terms = arguments_of(kind.terms, ITEM.OWN, 0)
        given = [place for place, state in self._places.items() if state.given]
        states = [f"(y[i[{place}]] if i[{place}] >= 0 else 0.0)" for place in given]
        count = 1 if kind.controlled else 0
        return [*self._inputs, *terms[:count], *states, *terms[count:]]

    @property
    def _inputs(self) -> tuple[str, ...]:
        return self.kind.geometry.inputs if self.kind.inputs is None else self.kind.inputs

    def _call(self, arguments: Sequence[str], law: str = "law") -> str:
        """The law called with these; as one, those that change with time, if the kind says so."""
        made = self.kind.together
        if made is None:
            return f"{law}({', '.join(arguments)})"
        names = *self._inputs, "excitation", *(state.name for state in self.kind.states if state.given)
        given = dict(zip(names, arguments, strict=False))
        first = f"{made.__name__}({', '.join(given.get(name, '0.0') for name in made._fields)})"
        return f"{law}({', '.join((first, *arguments[len(names) :]))})"

    @property
    def heads(self) -> int:
        """How many integers of an item are the kind's own."""
        return sum(term.heads for term in self.kind.terms) + len(self.kind.states)

    @property
    def size(self) -> int:
        """How many numbers of an item are the parameters."""
        return sum(term.size for term in self.kind.terms)


def arguments_of(terms: Iterable[Parameter], head: int, number: int) -> list[str]:
    """What a law is called with for terms whose integers and numbers begin at these places."""
    result = []
    for term in terms:
        result += term.arguments(head, number)
        head, number = head + term.heads, number + term.size
    return result
