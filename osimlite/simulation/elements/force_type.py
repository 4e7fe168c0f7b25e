"""Declaration of a force type, from which its packing, kernel, states, columns, records and energy follow.

A force type names where its forces act (a geometry), the arguments of a law, and what the law's
results mean. The law is a scalar function of floats. Its arguments are, in this order: the inputs
of the geometry, the control if there is one, the states, the parameters. The kernel of a force
type is generated from this (:mod:`osimlite.simulation.elements.kernel_text`) and compiled as every
other kernel is. A second law with the same arguments may compute equilibrium states; its kernel is
generated in the same way.

Layout of a force in the vectors of the kernels:

- integers: offsets of everything that varies in length (curves, formulas, controls), then offsets
  of the states, then the geometry's integers;
- numbers: the parameters, then the geometry's numbers, then the tables;
- record: the outputs that are no rates of states, the recorded inputs, the geometry's part, and
  the registers of formulas.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

from osimlite.base.records import dataclass, field
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.schema.resolution import derives_from, is_a
from osimlite.schema.states import list_states
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import ForceRecord, Response, Silent
from osimlite.simulation.elements.geometries.geometry import ForceGeometry
from osimlite.simulation.elements.kernel_text import SOLVED, BatchedLaw, KernelText
from osimlite.simulation.elements.laws import BATCHED, EQUILIBRIUM, OFF, RESPONSE, RIGID
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
"""Name of the output that is the potential energy (J) of a force; without it the energy is 0."""


@dataclass(frozen=True)
class State:
    """State of a force type: its value is an argument of the law, its derivative an output.

    Attributes:
        name: OpenSim's name of the state.
        start: initial value from the component; by default its property `default_<name>`, or 0
            without one.
        is_argument: whether its value is an argument of the law.
        output: output that is its derivative; by default `<name>_rate`.
        is_simbody: whether it is a state of Simbody, not of OpenSim.
    """

    name: str
    start: Callable[[Any], float] | None = None
    is_argument: bool = True
    output: str = ""
    is_simbody: bool = False

    def initial_value(self, component: Any) -> float:
        """Return the value at the start of a simulation."""
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
    """Declaration of how the forces of one class are computed and applied.

    Attributes:
        component: class of the forces.
        geometry: geometry of the forces, which computes inputs of the law and applies its results.
        law: function that computes the outputs.
        outputs: names of the results of the law: loads that the geometry applies, rates of states,
            recorded quantities.
        parameters: arguments of the law from a component; a name stands for a property that is a
            number.
        inputs: inputs of the geometry that are arguments of the law; all if None.
        recorded_inputs: inputs and rates of states that are recorded too.
        has_control: whether the controls of the actuator are arguments of the law.
        states: states of each force.
        inputs_type: named tuple that combines inputs, excitation and states into one argument;
            separate arguments if None.
        equilibrium: function with the arguments of the law that returns whether there is an
            equilibrium, and the values of `solved_states`.
        solved_states: names of the states in equilibrium.
        rigid_law: muscles only: function with the arguments of the law that returns the force (N)
            of fully active fibers along a rigid tendon.
        law_from_record: cheaper form of the law for derivatives at the last evaluation; its
            additional parameters are names of recorded quantities.
        contact_response: name of the kernel with the derivatives of a contact force along its
            normal and across it.
        batched: the law in stages, for several forces together.
        describe_failure: function that describes a force whose law or equilibrium has no solution,
            from the values of `list_named_values`.
        labels: labels of the report with their outputs, where {name} is the name of the force; the
            labels of the geometry if None.
        compute_energy: function that returns the energy (J) of a force from its record, if the
            energy is not an output of the law.
        check: function that raises a ModelError if the parameters contradict each other.
        shares_numbers: whether a force may depend on properties of others of its class.
        states_change_when_off: whether the states change even if `appliesForce` is false; otherwise
            they are constant.
        terms: the parameters as objects, the control first.
    """

    component: type
    geometry: ForceGeometry
    law: Callable[..., Any] | None = None
    outputs: tuple[str, ...] = ()
    parameters: Sequence[str | Parameter] = ()
    inputs: tuple[str, ...] | None = None
    recorded_inputs: tuple[str, ...] = ()
    has_control: bool = False
    states: tuple[State, ...] = ()
    inputs_type: type[Any] | None = None
    equilibrium: Callable[..., Any] | None = None
    solved_states: tuple[str, ...] = ()
    rigid_law: Callable[..., float] | None = None
    law_from_record: Callable[..., Any] | None = None
    contact_response: str = ""
    batched: BatchedLaw | None = None
    describe_failure: Callable[[Mapping[str, float]], str] | None = None
    labels: Mapping[str, str] | None = None
    compute_energy: Callable[[DeclaredForce, Sequence[float]], float] | None = None
    check: Callable[[ElementBuilder, Any], None] | None = None
    shares_numbers: bool = False
    states_change_when_off: bool = False
    terms: tuple[Parameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        named = [Number(item) if isinstance(item, str) else item for item in self.parameters]
        if self.has_control and derives_from(self.component, "Actuator"):
            from osimlite.schema.muscles import Muscle

            actuator: Any = self.component
            is_muscle = issubclass(actuator, Muscle)
            # Laws take the control first. Controllers that act by a muscle's lengthening speed add
            # to it in the kernel.
            named.insert(0, ReflexControl() if is_muscle else Control(actuator.control_count))
        # The record is frozen; this is its only field that follows from others.
        object.__setattr__(self, "terms", tuple(named))
        if self.inputs_type is not None and not {state.name for state in self.states} <= {
            *self.inputs_type._fields
        }:
            raise TypeError(
                f"{self.inputs_type.__name__} lacks a state of {self.component.__name__}"
            )

    @property
    def name(self) -> str:
        """Name of its kernel, which is the name of the class in snake case."""
        return kernel_name(self.component.__name__)

    @property
    def forms(self) -> list[str]:
        """Suffixes of the names of its kernels, "" first."""
        optional = {
            EQUILIBRIUM: self.equilibrium is not None,
            RESPONSE: self.text.responds,
            RIGID: self.rigid_law is not None,
            BATCHED: self.batched is not None,
        }
        return ["", OFF, *(form for form, is_there in optional.items() if is_there)]

    def make(self, builder: ElementBuilder, force: Any) -> DeclaredForce:
        """Return the element of a component.

        Args:
            builder: builder of the model's elements.
            force: force component of the model.

        Raises:
            UnsupportedError: osimlite cannot compute a part of the component.
            ModelError: the component names something that does not exist, or a parameter has no
                meaning.
        """
        path = builder.path(force)
        if self.check is not None:
            self.check(builder, force)
        # A state that the component does not have is 0 for the law.
        state_names = list_states(force)
        states = tuple(
            StateVariable(f"{path}/{state.name}", state.initial_value(force), state.is_simbody)
            if state.name in state_names
            else None
            for state in self.states
        )
        if not (force.appliesForce or self.states_change_when_off):
            return ForceOff(self.component, path, force.name, None, (), states)
        values = tuple(term.read(builder, force) for term in self.terms)
        # A force that is off may still have states that change, as the activation of a muscle in
        # OpenSim does.
        element_class = DeclaredForce if force.appliesForce else ForceOff
        if builder.rigid_tendons and is_a(force, "Muscle"):
            if self.rigid_law is None:
                raise builder.make_unsupported_error(force, " with a rigid tendon")
            element_class = RigidTendon
        return element_class(
            self.component, path, force.name, self.geometry.read(builder, force), values, states
        )

    @cached_property
    def record_offsets(self) -> dict[str, int]:
        """Offset in the record of each recorded quantity, by name.

        Returns:
            Offsets by name, in the order of the record.
        """
        # Rates go into the derivative of the state, and the success of a search into the outcome of
        # the kernel.
        others = {SOLVED, *(state.rate for state in self.states)}
        names = [name for name in self.outputs if name not in others] + list(self.recorded_inputs)
        if self.geometry.speed and derives_from(self.component, "Actuator"):
            names.append(self.geometry.speed)
        return {name: index for index, name in enumerate(dict.fromkeys(names))}

    @cached_property
    def record_names(self) -> dict[str, int]:
        """Offsets in the record by name, with two names that all actuators share.

        "actuation" stands for the force that OpenSim reports, "speed" for the speed along which it
        acts.

        Returns:
            Offsets by name.
        """
        recorded = self.record_offsets
        others = {"actuation": (self.labels or {}).get("{name}", ""), "speed": self.geometry.speed}
        return recorded | {
            alias: recorded[name] for alias, name in others.items() if name in recorded
        }

    @cached_property
    def text(self) -> KernelText:
        """Generator of the kernels of this type."""
        return KernelText(self)

    def make_records(self, force: DeclaredForce, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records of a force: the parts of its geometry, then the force itself.

        Args:
            force: the element.
            link_map: placement of the bodies in the links of the tree.

        Returns:
            The records, each before those that refer to it.
        """
        parts = self.geometry.make_parts(force.location, link_map)
        ints, numbers = self.geometry.pack(force.location, link_map)
        # The geometry's integers begin with the distance back to the record of its last part, a
        # path.
        if parts:
            ints = (ITEM.DETAILS + len(parts[-1].ints), *ints)
        size = len(self.record_offsets) + self.geometry.record_size(force.location)
        tail = Tail(
            ITEM.DETAILS + self.text.int_count + len(ints), self.text.size + len(numbers), size
        )
        offsets: list[int] = []
        parameters: list[float] = []
        for term, value in zip(self.terms, force.values, strict=True):
            term_offsets, term_parameters = term.pack(value, tail, f"'{force.path}'")
            offsets += term_offsets
            parameters += term_parameters
        at_states = tuple(
            len(offsets) + k for k, state in enumerate(force.optional_states) if state is not None
        )
        # -1 stands for a state that the component lacks; the packer writes the offsets of the
        # others.
        all_ints = (*offsets, *[-1] * len(self.states), *ints, *tail.ints)
        state_names = {
            state.name
            for state, variable in zip(self.states, force.optional_states, strict=True)
            if variable is not None
        }
        sense = self.geometry.displacement_output[1]
        responds = self.text.responds and not force.form
        item = ForceRecord(
            self.name + force.form,
            all_ints,
            (*parameters, *numbers, *tail.numbers),
            record_size=tail.record_size,
            states=at_states,
            equilibrium=self.name + EQUILIBRIUM
            if state_names & set(self.solved_states) and not force.form
            else "",
            batched=self.name + BATCHED if self.batched is not None and not force.form else "",
            response=Response(self.name + RESPONSE, len(offsets), len(self.states), sense)
            if responds
            else None,
        )
        responses = []
        if self.contact_response and not force.form:
            derivatives = Response(self.contact_response, 0, 0, 1)
            size = ITEM.DETAILS + 2
            responses = [
                # The first integer leads from this record to the contact behind all three.
                ForceRecord(ints=(size * (3 - axis), axis), is_part=True, response=derivatives)
                for axis in range(3)
            ]
        return [*responses, *parts, item]


@dataclass(frozen=True)
class DeclaredForce:
    """Force of a declared type."""

    form: ClassVar[str] = ""
    """Suffix of its kernel behind the name of the force type."""

    component: type  # class of the component
    path: str  # path of the component
    name: str  # name of the component
    location: Any  # location at which the force acts, from `read` of the geometry
    values: tuple[Any, ...]  # values of the parameters
    # state variable of each state of the force type; None for a state that the component lacks
    optional_states: tuple[StateVariable | None, ...] = ()

    @property
    def force_type(self) -> ForceType:
        """Declaration of the force's class."""
        return FORCE_TYPES.find(self.component)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """States of this force in the order of its declaration, without those that the component lacks.

        Returns:
            States of the component.
        """
        return tuple(state for state in self.optional_states if state is not None)

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records that the kernels compute; none if the force type has no outputs."""
        return (
            self.force_type.make_records(self, link_map)
            if self.force_type.outputs or self.force_type.geometry.apply_code
            else []
        )

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of its report, as OpenSim's ForceReporter writes them.

        Returns:
            One label for each value of `report`.
        """
        force_type = self.force_type
        if force_type.labels is None:
            return force_type.geometry.list_columns(self)
        return tuple(label.format(name=self.name) for label in force_type.labels)

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return one row of the columns; see :class:`osimlite.simulation.elements.force_records.ForceElement`.

        Args:
            records: output records of the force after an evaluation.
            origins: origin of each body in ground, m; the last one is that of ground.
        """
        force_type = self.force_type
        if force_type.labels is None:
            return force_type.geometry.report(
                self, records[-1][len(force_type.record_offsets) :] if records else (), origins
            )
        return [
            float(records[-1][force_type.record_offsets[output]])
            for output in force_type.labels.values()
        ]

    def find_copied_offsets(self) -> Sequence[int] | None:
        """Return the offset of each column in the last record; None if the geometry computes them."""
        force_type = self.force_type
        if force_type.labels is None:
            return None
        return [force_type.record_offsets[output] for output in force_type.labels.values()]

    def list_named_values(self, record: Sequence[float]) -> dict[str, float]:
        """Return the scalar parameters of the force and the values of a record, by name.

        Args:
            record: output record of the force after an evaluation.

        Returns:
            Values by the names of properties and of recorded quantities.
        """
        force_type = self.force_type
        numbers: dict[str, float] = {}
        for term, value in zip(force_type.terms, self.values, strict=True):
            if isinstance(term, Number):
                numbers[term.name] = value
            elif isinstance(term, Fields):
                numbers |= zip(term.names, value, strict=True)
        return numbers | {
            name: record[offset] for name, offset in force_type.record_offsets.items()
        }

    def describe_failure(self, record: Sequence[float]) -> str:
        """Return the words for a message about a force whose law has no solution.

        Args:
            record: output record of the force after an evaluation.

        Returns:
            The path of the force, and what its type adds.
        """
        return f"'{self.path}'" + (
            self.force_type.describe_failure(self.list_named_values(record))
            if self.force_type.describe_failure
            else ""
        )

    def compute_energy(self, records: Sequence[Sequence[float]]) -> float:
        """Return the potential energy of the force, 0 for types without an energy.

        The energy comes from `ForceType.compute_energy`, or else from the output "energy" of the law.
        Types with neither store none, as in OpenSim, whose `Force.computePotentialEnergy` returns 0
        unless a class overrides it.

        Args:
            records: output records of the force after an evaluation. The last one is that of the
                law; records before it belong to the geometry and hold no energy.

        Returns:
            Energy, J.
        """
        force_type = self.force_type
        law_record = records[-1]
        if force_type.compute_energy is not None:
            return float(force_type.compute_energy(self, law_record))
        energy_offset = force_type.record_offsets.get(ENERGY)
        return 0.0 if energy_offset is None else float(law_record[energy_offset])


@dataclass(frozen=True)
class ForceOff(Silent, DeclaredForce):
    """Force whose `appliesForce` is false: only its states are computed, if they change at all."""

    form = OFF

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records of the force; none if its states do not change."""
        return super().make_records(link_map) if self.force_type.states_change_when_off else []


@dataclass(frozen=True)
class RigidTendon(DeclaredForce):
    """Muscle whose tension is its control times the force of fully active fibers along a rigid tendon."""

    form = RIGID
