"""One declaration for each kind of force; packing, kernel, states, columns, records and energy follow from it.

A kind says where its forces act (a geometry), what a law is given, and what the law's results mean. The law is a scalar
function of floats. It is given, one after the other: the inputs of the geometry, the control if there is one, the
states, the parameters. The kernel of a kind is written from this once, and compiled as every other kernel is.

The integers of an item are the places of what varies in length (curves, formulas, controls) and of its states, and
after these the geometry's; its numbers the parameters, the geometry's, and the tables; its record the outputs that are
no rates of states, what the geometry keeps, and the registers of formulas.
"""

from __future__ import annotations

import linecache
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from typing import Any

from osimlite.schema.actuators import Actuator
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.gather import ElementBuilder, module_name
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.items import Item, Places
from osimlite.simulation.elements.parameters import Control, Number, Parameter, ReflexControl, Tail
from osimlite.simulation.kernels import layout, pointers
from osimlite.simulation.states import StateVariable

ENERGY = "energy"
"""The output that is the potential energy (J) of a force; a kind without it stores none that is known."""


@dataclass(frozen=True)
class State:
    """A state of a kind: the law is given its value, and gives `<name>_rate`.

    Attributes:
        name: as OpenSim has it.
        start: value at the beginning, from the component.
        exists: whether a component has it; the law is given 0 for one that it has not.
        given: whether the law is given its value at all.
        is_simbody: whether Simbody keeps it, in OpenSim.
    """

    name: str
    start: Callable[[Any], float] = lambda component: 0.0
    exists: Callable[[Any], bool] = lambda component: True
    given: bool = True
    is_simbody: bool = False

    @property
    def rate(self) -> str:
        """Name of the output that is its derivative."""
        return f"{self.name}_rate"


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of force.

    Attributes:
        component: class of the forces.
        geometry: where they act.
        law: computes the outputs.
        outputs: names of the results of the law: what the geometry applies, rates of states, what is recorded.
        parameters: what the law is given of a component; a name stands for a property that is a number.
        inputs: which of the geometry's inputs the law is given; all if None.
        controlled: whether the law is given the control, or the controls if there are several.
        states: of each force.
        labels: of the record, in which {name} stands for that of the force, each with its output; the geometry's own if
            None.
        stored: energy (J) of a force from its record, where it is no output of the law.
        check: raises a ModelError if the parameters have no meaning together.
    """

    component: type
    geometry: Geometry
    law: Callable[..., Any] | None = None
    outputs: tuple[str, ...] = ()
    parameters: Sequence[str | Parameter] = ()
    inputs: tuple[str, ...] | None = None
    controlled: bool = False
    states: tuple[State, ...] = ()
    labels: Mapping[str, str] | None = None
    stored: Callable[[DeclaredForce, Sequence[float]], float] | None = None
    check: Callable[[ElementBuilder, Any], None] | None = None
    terms: tuple[Parameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        named = [Number(item) if isinstance(item, str) else item for item in self.parameters]
        if self.controlled and issubclass(self.component, Actuator):
            is_muscle = issubclass(self.component, Muscle)
            named.insert(0, ReflexControl() if is_muscle else Control(self.component.control_count))
        object.__setattr__(self, "terms", tuple(named))

    @property
    def name(self) -> str:
        """Of its kernel, and of the module that declares it."""
        return module_name(self.component)

    def make(self, builder: ElementBuilder, force: Any) -> DeclaredForce:
        """The element of a component.

        Raises:
            UnsupportedError: something of it cannot be computed.
            ModelError: it names what does not exist, or a parameter has no meaning.
        """
        if self.check is not None:
            self.check(builder, force)
        values = tuple(term.read(builder, force) for term in self.terms)
        path = builder.path(force)
        states = tuple(
            StateVariable(f"{path}/{state.name}", state.start(force), state.is_simbody) if state.exists(force) else None
            for state in self.states
        )
        return DeclaredForce(self.component, path, force.name, self.geometry.read(builder, force), values, states)

    @cached_property
    def recorded(self) -> dict[str, int]:
        """Place in the record of each output that is kept there."""
        rates = {state.rate for state in self.states}
        return {name: place for place, name in enumerate(name for name in self.outputs if name not in rates)}

    # ------------------------------------------------------------------------------------------- the kernel
    @cached_property
    def kernel(self) -> Callable[..., int]:
        """The function that computes and applies one force, written from the declaration."""
        source = self.source
        scope: dict[str, Any] = {
            **self.geometry.functions(),
            **{name: value for term in self.terms for name, value in term.functions().items()},
            **{name: getattr(layout, name) for name in ("NUMBERS", "RECORD", "FREEDOMS", "TIME", "WORK_CONTROL", "OK")},
            "at": pointers.at,
            "law": self.law,
            "__name__": f"{__package__}.kinds.{self.name}",
        }
        file = f"<kernel of {self.component.__name__}>"
        exec(compile(source, file, "exec", dont_inherit=True), scope)
        # Tracebacks and `inspect.getsource` show it as they show a file.
        linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
        kernel: Callable[..., int] = scope[self.name]
        return kernel

    @property
    def source(self) -> str:
        """The text of the kernel."""
        head = self._heads
        arguments = list(self.geometry.inputs if self.inputs is None else self.inputs)
        places = layout.OWN
        number = 0
        terms: list[str] = []
        for term in self.terms:
            terms += term.arguments(places, number)
            places, number = places + term.heads, number + term.size
        of_states = {state: places + k for k, state in enumerate(self.states)}
        values = [f"y[i[{place}]]" for state, place in of_states.items() if state.given]
        count = 1 if self.controlled else 0
        arguments += [*terms[:count], *values, *terms[count:]]
        lines = [
            f'def {self.name}(s: "Ints", x: "Floats", w: "Floats", y: "Floats", f: "Floats", item: "int") -> "int":',
            "i = at(s, item)",
            "p, found = at(x, i[NUMBERS]), at(w, i[RECORD])",
            f"g, gp, room = at(i, {layout.OWN + head}), at(p, {self._size}), at(found, {len(self.recorded)})",
            *self.geometry.before,
        ]
        if self.law is not None:
            results = f"{', '.join(self.outputs)} = " if self.outputs else ""
            lines.append(f"{results}law({', '.join(arguments)})")
        lines += [f"found[{place}] = {name}" for name, place in self.recorded.items()]
        for state, place in of_states.items():
            lines += [f"if i[{place}] > 0:", f"    f[i[{place}]] = {state.rate}"]
        return "\n    ".join([*lines, *self.geometry.after, "return OK"]) + "\n"

    @property
    def _heads(self) -> int:
        return sum(term.heads for term in self.terms) + len(self.states)

    @property
    def _size(self) -> int:
        return sum(term.size for term in self.terms)

    def items(self, force: DeclaredForce, places: Places) -> list[Item]:
        """The parts of the geometry, and after them what the kernel computes of a force."""
        parts = self.geometry.parts(force.place, places)
        ints, numbers = self.geometry.pack(force.place, places)
        if parts:
            ints = (layout.OWN + len(parts[-1].ints), *ints)
        size = len(self.recorded) + self.geometry.room(force.place)
        tail = Tail(layout.OWN + self._heads + len(ints), self._size + len(numbers), size)
        heads: list[int] = []
        own: list[float] = []
        for term, value in zip(self.terms, force.values, strict=True):
            more, plain = term.pack(value, tail, f"'{force.path}'")
            heads += more
            own += plain
        at_states = tuple(len(heads) + k for k, state in enumerate(force.optional_states) if state is not None)
        all_ints = (*heads, *[0] * len(self.states), *ints, *tail.ints)
        item = Item(self.name, all_ints, (*own, *numbers, *tail.numbers), room=tail.room, states=at_states)
        return [*parts, item]


@dataclass(frozen=True)
class DeclaredForce:
    """One force of a kind that is declared.

    Attributes:
        component: its class.
        path: of the component.
        name: of the component.
        place: where it acts, as the geometry has it.
        values: of the parameters.
        optional_states: for each state of the kind what it is called and where it starts, None if there is none.
    """

    component: type
    path: str
    name: str
    place: Any
    values: tuple[Any, ...]
    optional_states: tuple[StateVariable | None, ...] = ()

    @property
    def kind(self) -> Kind:
        """The declaration."""
        kind: Kind = kind_of_class(self.component)
        return kind

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Its states."""
        return tuple(state for state in self.optional_states if state is not None)

    def items(self, places: Places) -> list[Item]:
        """What the kernels compute."""
        return self.kind.items(self, places) if self.kind.outputs or self.kind.geometry.after else []

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of the record, as OpenSim's ForceReporter has them."""
        kind = self.kind
        if kind.labels is None:
            return kind.geometry.columns(self)
        return tuple(label.format(name=self.name) for label in kind.labels)

    def report(self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]) -> list[float]:
        """One row of the columns; see :class:`osimlite.simulation.elements.items.ForceElement`."""
        kind = self.kind
        if kind.labels is None:
            return kind.geometry.report(self, records[-1][len(kind.recorded) :] if records else (), origins)
        return [float(records[-1][kind.recorded[output]]) for output in kind.labels.values()]

    def energy(self, records: Sequence[Sequence[float]]) -> float:
        """Potential energy, J."""
        kind = self.kind
        if kind.stored is not None:
            return float(kind.stored(self, records[-1]))
        return float(records[-1][kind.recorded[ENERGY]]) if ENERGY in kind.recorded else 0.0


def kinds() -> list[Any]:
    """All declarations."""
    package = import_module(f"{__package__}.kinds")
    return [import_module(f"{package.__name__}.{item.name}").KIND for item in iter_modules(package.__path__)]


@cache
def kind_of_class(component: type) -> Any:
    """The declaration of a class of forces, None if there is none."""
    name = f"{__package__}.kinds.{module_name(component)}"
    return import_module(name).KIND if find_spec(name) is not None else None
