"""One declaration for each kind of force; packing, kernel, states, columns, records and energy follow from it.

A kind says where its forces act (a geometry), what a law is given, and what the law's results mean.
The law is a scalar function of floats. It is given, one after the other: the inputs of the
geometry, the control if there is one, the states, the parameters. The kernel of a kind is written
from this (:mod:`osimlite.simulation.elements.kernel_text`), and compiled as every other kernel is.
A second law, given the same, may find states in equilibrium; its kernel is written likewise.

The integers of an item are the places of what varies in length (curves, formulas, controls) and of
its states, and after these the geometry's; its numbers the parameters, the geometry's, and the
tables; its record the outputs that are no rates of states, inputs that are kept, what the geometry
keeps, and the registers of formulas.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

from osimlite.base.records import dataclass, field
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.multibody.links import Places
from osimlite.schema.actuators import Actuator
from osimlite.schema.states import states_of
from osimlite.schema.tree import is_a
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceRecord, Response, Silent
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.kernel_text import SOLVED, Abreast, KernelText
from osimlite.simulation.elements.laws import ABREAST, EQUILIBRIUM, OFF, RESPONSE, RIGID
from osimlite.simulation.elements.parameters import (
    Control,
    Fields,
    Number,
    Parameter,
    ReflexControl,
    Tail,
)
from osimlite.simulation.elements.registry import FORCE_TYPES, kernel_name
from osimlite.simulation.states import StateVariable

ENERGY = "energy"
"""The output that is the potential energy (J) of a force; a kind without it stores none that is known."""


@dataclass(frozen=True)
class State:
    """A state of a kind: the law is given its value, and gives its derivative."""

    name: str  # as OpenSim has it
    # value at the beginning, from the component; its property `default_<name>` if left out, 0 if it
    # has none
    start: Callable[[Any], float] | None = None
    given: bool = True  # whether the law is given its value at all
    output: str = ""  # name of the output that is its derivative; `<name>_rate` if left out
    is_simbody: bool = False  # whether Simbody keeps it, in OpenSim

    def at_start(self, component: Any) -> float:
        """Its value at the beginning."""
        if self.start is not None:
            return float(self.start(component))
        name = f"default_{self.name}"
        return float(getattr(component, name)) if name in type(component).model_fields else 0.0

    @property
    def rate(self) -> str:
        """Name of the output that is its derivative."""
        return self.output or f"{self.name}_rate"


@dataclass(frozen=True, eq=False)
class ForceType:
    """A kind of force."""

    component: type  # class of the forces
    geometry: Geometry  # where they act
    law: Callable[..., Any] | None = None  # computes the outputs
    # names of the results of the law: what the geometry applies, rates of states, what is recorded
    outputs: tuple[str, ...] = ()
    # what the law is given of a component; a name stands for a property that is a number
    parameters: Sequence[str | Parameter] = ()
    # which of the geometry's inputs the law is given; all if None
    inputs: tuple[str, ...] | None = None
    kept: tuple[str, ...] = ()  # which of them, and of the derivatives of states, are recorded too
    # whether the law is given the control, or the controls if there are several
    controlled: bool = False
    states: tuple[State, ...] = ()  # of each force
    # named tuple as which the law is given inputs, excitation and states; one by one if None
    together: type[Any] | None = None
    # computes states in equilibrium from what the law is given: whether it found them, and those
    # that `settled` names
    equilibrium: Callable[..., Any] | None = None
    settled: tuple[str, ...] = ()  # names of the states that it finds
    # force (N) of fully active fibers along a rigid tendon, from what the law is given; of muscles
    rigid: Callable[..., float] | None = None
    # the law where its results are known, given also those that its other parameters name of the
    # record; of derivatives
    again: Callable[..., Any] | None = None
    # name of the kernel that tells how the force of a contact changes along its normal and across
    # it
    contact_response: str = ""
    abreast: Abreast | None = None  # the law in parts, which several forces take together
    # what is said of a force whose law, or equilibrium, has no solution, from what is `known` of it
    told: Callable[[Mapping[str, float]], str] | None = None
    # of the record, in which {name} stands for that of the force, each with its output; the
    # geometry's own if None
    labels: Mapping[str, str] | None = None
    # energy (J) of a force from its record, where it is no output of the law
    stored: Callable[[DeclaredForce, Sequence[float]], float] | None = None
    # raises a ModelError if the parameters have no meaning together
    check: Callable[[ElementBuilder, Any], None] | None = None
    shares: bool = False  # whether a force may have numbers of others of its class
    # whether the states of a force that is off (appliesForce) change as those of others do; else
    # they rest
    goes_on: bool = False
    terms: tuple[Parameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        named = [Number(item) if isinstance(item, str) else item for item in self.parameters]
        if self.controlled and issubclass(self.component, Actuator):
            from osimlite.schema.muscles import Muscle

            is_muscle = issubclass(self.component, Muscle)
            named.insert(0, ReflexControl() if is_muscle else Control(self.component.control_count))
        object.__setattr__(self, "terms", tuple(named))
        if self.together is not None and not {state.name for state in self.states} <= {
            *self.together._fields
        }:
            raise TypeError(f"{self.together.__name__} lacks a state of {self.component.__name__}")

    @property
    def name(self) -> str:
        """Of its kernel, and of the module that declares it."""
        return kernel_name(self.component.__name__)

    @property
    def forms(self) -> list[str]:
        """Return the endings of the names of its kernels, "" first."""
        optional = {
            EQUILIBRIUM: self.equilibrium is not None,
            RESPONSE: self.text.responds,
            RIGID: self.rigid is not None,
            ABREAST: self.abreast is not None,
        }
        return ["", OFF, *(form for form, is_there in optional.items() if is_there)]

    def make(self, builder: ElementBuilder, force: Any) -> DeclaredForce:
        """The element of a component.

        Raises:
            UnsupportedError: something of it cannot be computed.
            ModelError: it names what does not exist, or a parameter has no meaning.
        """
        path = builder.path(force)
        if self.check is not None:
            self.check(builder, force)
        # The law is given 0 for a state that a component has not.
        own = states_of(force)
        states = tuple(
            StateVariable(f"{path}/{state.name}", state.at_start(force), state.is_simbody)
            if state.name in own
            else None
            for state in self.states
        )
        if not (force.appliesForce or self.goes_on):
            return ForceOff(self.component, path, force.name, None, (), states)
        values = tuple(term.read(builder, force) for term in self.terms)
        made = DeclaredForce if force.appliesForce else ForceOff
        if builder.rigid_tendons and is_a(force, "Muscle"):
            if self.rigid is None:
                raise builder.unsupported(force, " with a rigid tendon")
            made = RigidTendon
        return made(
            self.component, path, force.name, self.geometry.read(builder, force), values, states
        )

    @cached_property
    def recorded(self) -> dict[str, int]:
        """Place in the record of all that is kept there."""
        others = {SOLVED, *(state.rate for state in self.states)}
        names = [name for name in self.outputs if name not in others] + list(self.kept)
        if self.geometry.speed and issubclass(self.component, Actuator):
            names.append(self.geometry.speed)
        return {name: index for index, name in enumerate(dict.fromkeys(names))}

    @cached_property
    def known_of(self) -> dict[str, int]:
        """The same, and where "actuation" and "speed" of an actuator are, whatever they are called in its record."""
        recorded = self.recorded
        others = {"actuation": (self.labels or {}).get("{name}", ""), "speed": self.geometry.speed}
        return recorded | {name: recorded[own] for name, own in others.items() if own in recorded}

    @cached_property
    def text(self) -> KernelText:
        """Its kernels."""
        return KernelText(self)

    def items(self, force: DeclaredForce, places: Places) -> list[ForceRecord]:
        """The parts of the geometry, and after them what the kernel computes of a force."""
        parts = self.geometry.parts(force.place, places)
        ints, numbers = self.geometry.pack(force.place, places)
        if parts:
            ints = (ITEM.OWN + len(parts[-1].ints), *ints)
        size = len(self.recorded) + self.geometry.room(force.place)
        tail = Tail(ITEM.OWN + self.text.heads + len(ints), self.text.size + len(numbers), size)
        heads: list[int] = []
        own: list[float] = []
        for term, value in zip(self.terms, force.values, strict=True):
            more, plain = term.pack(value, tail, f"'{force.path}'")
            heads += more
            own += plain
        at_states = tuple(
            len(heads) + k for k, state in enumerate(force.optional_states) if state is not None
        )
        all_ints = (*heads, *[-1] * len(self.states), *ints, *tail.ints)
        there = {
            state.name
            for state, own in zip(self.states, force.optional_states, strict=True)
            if own is not None
        }
        sense = self.geometry.along[1]
        responds = self.text.responds and not force.form
        item = ForceRecord(
            self.name + force.form,
            all_ints,
            (*own, *numbers, *tail.numbers),
            room=tail.room,
            states=at_states,
            equilibrium=self.name + EQUILIBRIUM
            if there & set(self.settled) and not force.form
            else "",
            abreast=self.name + ABREAST if self.abreast is not None and not force.form else "",
            response=Response(self.name + RESPONSE, len(heads), len(self.states), sense)
            if responds
            else None,
        )
        responses = []
        if self.contact_response and not force.form:
            told = Response(self.contact_response, 0, 0, 1)
            size = ITEM.OWN + 2
            responses = [
                ForceRecord(ints=(size * (3 - axis), axis), is_part=True, response=told)
                for axis in range(3)
            ]
        return [*responses, *parts, item]


@dataclass(frozen=True)
class DeclaredForce:
    """One force of a kind that is declared."""

    form: ClassVar[str] = ""
    """Of its kernel, behind the name of the kind."""

    component: type  # its class
    path: str  # of the component
    name: str  # of the component
    place: Any  # where it acts, as the geometry has it
    values: tuple[Any, ...]  # of the parameters
    # for each state of the kind what it is called and where it starts, None if there is none
    optional_states: tuple[StateVariable | None, ...] = ()

    @property
    def force_type(self) -> ForceType:
        """The declaration."""
        return FORCE_TYPES.find(self.component)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Its states."""
        return tuple(state for state in self.optional_states if state is not None)

    def items(self, places: Places) -> list[ForceRecord]:
        """What the kernels compute."""
        return (
            self.force_type.items(self, places)
            if self.force_type.outputs or self.force_type.geometry.after
            else []
        )

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of the record, as OpenSim's ForceReporter has them."""
        force_type = self.force_type
        if force_type.labels is None:
            return force_type.geometry.columns(self)
        return tuple(label.format(name=self.name) for label in force_type.labels)

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """One row of the columns; see :class:`osimlite.simulation.elements.force_records.ForceElement`."""
        force_type = self.force_type
        if force_type.labels is None:
            return force_type.geometry.report(
                self, records[-1][len(force_type.recorded) :] if records else (), origins
            )
        return [
            float(records[-1][force_type.recorded[output]]) for output in force_type.labels.values()
        ]

    def known(self, record: Sequence[float]) -> dict[str, float]:
        """Its parameters that are numbers, and its record, by name."""
        force_type = self.force_type
        numbers: dict[str, float] = {}
        for term, value in zip(force_type.terms, self.values, strict=True):
            if isinstance(term, Number):
                numbers[term.name] = value
            elif isinstance(term, Fields):
                numbers |= zip(term.names, value, strict=True)
        return numbers | {name: record[place] for name, place in force_type.recorded.items()}

    def told(self, record: Sequence[float]) -> str:
        """What is said of it where a law has no solution."""
        return f"'{self.path}'" + (
            self.force_type.told(self.known(record)) if self.force_type.told else ""
        )

    def energy(self, records: Sequence[Sequence[float]]) -> float:
        """Potential energy, J."""
        force_type = self.force_type
        if force_type.stored is not None:
            return float(force_type.stored(self, records[-1]))
        return (
            float(records[-1][force_type.recorded[ENERGY]])
            if ENERGY in force_type.recorded
            else 0.0
        )


@dataclass(frozen=True)
class ForceOff(Silent, DeclaredForce):
    """A force that is off: it has nothing but its states."""

    form = OFF

    def items(self, places: Places) -> list[ForceRecord]:
        """What the kernels compute."""
        return super().items(places) if self.force_type.goes_on else []


@dataclass(frozen=True)
class RigidTendon(DeclaredForce):
    """A muscle that pulls with its control times the force of fully active fibers along a rigid tendon."""

    form = RIGID
