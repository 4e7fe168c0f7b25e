"""Declaration of a probe type, from which its packing, kernel, integrals and columns follow.

A probe adds or lists the values of a law for each of its subjects, which are actuators or muscles.
The law is a scalar function of floats. Its arguments are recorded quantities of the subject, a curve
if there is one, and a named tuple of numbers. The kernel of a probe type is generated from this. It
runs together with the forces if the probe integrates, since its integrals are states; otherwise
it runs on demand.

Integers of the record: number of subjects; index of the first subject's result (-1 if there is only
the sum); number of integrals; offset of the first integral in y; offset of the curve; and for each
subject the offsets in the work vector of the law's inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.quantity import warn_caller
from osimlite.base.records import dataclass
from osimlite.base.text import suggest_name
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.table import PARAMETERS, compile_text
from osimlite.mechanics.multibody.function_tables import table_of_one
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_records import CONTROLS, ForceElement, ForceRecord, Silent
from osimlite.simulation.elements.force_type import DeclaredForce
from osimlite.simulation.elements.registry import PROBE_TYPES, kernel_name
from osimlite.simulation.states import StateVariable

HEAD = ITEM.DETAILS + 5
"""Offset of the integers of a probe's subjects, after its own integers."""

INTEGRATE = "integrate"
"""Operation of a probe that reports an integral over time."""


class ProbeSubject(NamedTuple):
    """Actuator for which a law is called.

    Attributes:
        actuator: the component.
        numbers: named tuple of the numbers that the law takes for it.
    """

    actuator: Any
    numbers: Any


class Reading(NamedTuple):
    """Inputs of a probe, and the labels of its results.

    Attributes:
        labels: labels of its results.
        subjects: actuators that the law is called for.
        first: index of the first subject's result; -1 if the sum is the only result. The sum is the
            first result unless this index is 0.
        constant: first term of the sum, which is also the second result if `first` is 2.
        curve: curve that the law takes.
        details: data for `measure`.
    """

    labels: tuple[str, ...]
    subjects: tuple[ProbeSubject, ...] = ()
    first: int = -1
    constant: float = 0.0
    curve: SmoothFunction | None = None
    details: Any = ()


@dataclass(frozen=True, eq=False)
class ProbeType:
    """Declaration of how the probes of one class are computed.

    Attributes:
        component: class of the probes.
        read: function that returns the inputs of a probe; it raises an UnsupportedError if osimlite
            cannot compute the probe.
        law: function that returns the quantity of one subject.
        inputs: inputs of the law from a subject: recorded quantities, or "actuation", "speed" and
            "control".
        numbers: type of the last argument of the law, a named tuple.
        measure: function that computes the results instead of a law, from the probe, the system
            after an evaluation of its forces, and the time (s) and state of the evaluation.
        has_curve: whether the law takes a curve.
    """

    component: type
    read: Callable[[ElementBuilder, Any], Reading]
    law: Callable[..., float] | None = None
    inputs: tuple[str, ...] = ()
    numbers: Any = tuple
    measure: Callable[[DeclaredProbe, Any, float, Sequence[float]], Sequence[float]] | None = None
    has_curve: bool = False

    @property
    def name(self) -> str:
        """Name of its kernel, which is the name of the class in snake case."""
        return kernel_name(self.component.__name__)

    @cached_property
    def kernel(self) -> Callable[..., int]:
        """Function that computes one probe."""
        scope = {"law": self.law, self.numbers.__name__: self.numbers}
        return compile_text(self.name, PROBE_TYPES.module_of(self.component), self.source, **scope)

    @property
    def source(self) -> str:
        """Source text of the kernel."""
        # The text is restricted Python, so that the kernel can be translated to C++ like the
        # others.
        size, count = len(self.numbers._fields), len(self.inputs)
        arguments = [f"data[a[{k}]]" for k in range(count)]
        arguments += [f"at(p, i[{HEAD - 1}])"] if self.has_curve else []
        arguments.append(f"{self.numbers.__name__}({', '.join(f'b[{k}]' for k in range(size))})")
        lines = [
            f'def {self.name}({PARAMETERS}, item: "int") -> "int":',
            "i = at(model, item)",
            "p, record = at(reals, i[ITEM.NUMBERS]), at(data, i[ITEM.RECORD])",
            "first, total = i[ITEM.DETAILS + 1], p[0]",
            "for k in range(i[ITEM.DETAILS]):",
            f"    a, b = at(i, {HEAD} + {count} * k), at(p, 1 + {size} * k)",
            f"    value = law({', '.join(arguments)})",
            "    total += value",
            "    if first >= 0:",
            "        record[first + k] = value",
            "if first != 0:",
            "    record[0] = total",
            "if first == 2:",
            "    record[1] = p[0]",
            "for k in range(i[ITEM.DETAILS + 2]):",
            "    f[i[ITEM.DETAILS + 3] + k] = record[k]",
        ]
        return "\n    ".join([*lines, "return OUTCOME.OK"]) + "\n"


@dataclass(frozen=True)
class DeclaredProbe(Silent):
    """Probe of a declared type.

    It is a :class:`osimlite.simulation.elements.force_records.ForceElement` without forces.

    Attributes:
        component: class of the component.
        path: path of the component.
        name: name of the component.
        operation: operation on its results: "value", "integrate" and so on.
        gain: factor of the reported results.
        initial: initial values of integrals.
        reading: inputs.
        input_offsets: path of the element whose record has the input, and offset of the input in this
            record, for each subject and each input.
        numbers: last argument of the law for each subject.
    """

    component: type
    path: str
    name: str
    operation: str
    gain: float
    initial: tuple[float, ...]
    reading: Reading
    input_offsets: tuple[tuple[tuple[str, int], ...], ...] = ()
    numbers: tuple[tuple[float, ...], ...] = ()

    @property
    def probe_type(self) -> ProbeType:
        """Declaration of the probe's class."""
        return PROBE_TYPES.find(self.component)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Integrals that the probe reports, which are states.

        Returns:
            One state for each result; none if the operation is not `integrate`.
        """
        labels = self.reading.labels if self.operation == INTEGRATE else ()
        return tuple(StateVariable(f"{self.path}/{label}", is_named=False) for label in labels)

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the record that the kernels compute; none if the probe has no law."""
        if self.probe_type.law is None:
            return []
        reading = self.reading
        integrals = len(self.states)
        numbers = [reading.constant, *(number for row in self.numbers for number in row)]
        ints = [len(self.input_offsets), reading.first, integrals, 0, len(numbers)]
        # What a probe reads is in the records of forces, whose offsets are known after packing:
        # they are references.
        input_offsets = [read for row in self.input_offsets for read in row]
        references = tuple(
            (len(ints) + number, owner) for number, (owner, _) in enumerate(input_offsets)
        )
        ints += [offset for _, offset in input_offsets]
        if reading.curve is not None:
            numbers += table_of_one(reading.curve, f"the curve of '{self.path}'")
        return [
            ForceRecord(
                self.probe_type.name,
                tuple(ints),
                tuple(numbers),
                record_size=len(reading.labels),
                is_part=not integrals,
                states=(3,) if integrals else (),
                record_references=references,
            )
        ]


def make_probes(builder: ElementBuilder, elements: Sequence[ForceElement]) -> list[DeclaredProbe]:
    """Return the enabled probes of a model, in its order.

    Components whose outputs are reported are included. A probe that cannot be computed is left out,
    with a warning.

    Args:
        builder: builder of the elements.
        elements: forces of the model.

    Returns:
        The probes.

    Raises:
        ModelError: a probe names something that does not exist, where OpenSim fails too.
    """
    by_path = {element.path: element for element in elements}
    result = []
    for probe in builder.tree.components:
        probe_type = PROBE_TYPES.find(type(probe))
        if probe_type is None or not getattr(probe, "enabled", True):
            continue
        try:
            result.append(_make_probe(probe_type, builder, probe, by_path))
        except UnsupportedError as error:
            warn_caller(f"left out of the results: {error.message}")
    return result


def _make_probe(
    probe_type: ProbeType, builder: ElementBuilder, probe: Any, elements: Mapping[str, ForceElement]
) -> DeclaredProbe:
    path = builder.path(probe)
    reading = probe_type.read(builder, probe)
    # A component with outputs has no operations: it reports values.
    operation = getattr(probe, "probe_operation", "value")
    gain = float(getattr(probe, "gain", 1.0))
    if operation == INTEGRATE and probe_type.law is None:
        raise builder.make_unsupported_error(probe, ", whose integral osimlite does not compute")
    initial: tuple[float, ...] = tuple(getattr(probe, "initial_conditions_for_integration", ()))
    if len(initial) != len(reading.labels):
        # As in OpenSim, which reports an error and continues.
        initial = (0.0,) * len(reading.labels)
    subjects = [
        _locate_inputs(probe_type, builder, probe, subject, elements)
        for subject in reading.subjects
    ]
    builder.check_finite(
        probe, [gain, reading.constant, *initial, *(x for _, numbers in subjects for x in numbers)]
    )
    return DeclaredProbe(
        type(probe),
        path,
        probe.name,
        operation,
        gain,
        initial,
        reading,
        tuple(offsets for offsets, _ in subjects),
        tuple(numbers for _, numbers in subjects),
    )


def _locate_inputs(
    probe_type: ProbeType,
    builder: ElementBuilder,
    probe: Any,
    subject: ProbeSubject,
    elements: Mapping[str, ForceElement],
) -> tuple[tuple[tuple[str, int], ...], tuple[float, ...]]:
    """Return the positions in the records at which the inputs of a law are found.

    Args:
        probe_type: declaration of the probe's class.
        builder: builder of the elements.
        probe: probe component of the model.
        subject: one of its actuators.
        elements: forces of the model by path.

    Returns:
        Path of the element whose record has the input and offset in this record, for each input;
        and the numbers of the subject.

    Raises:
        UnsupportedError: the actuator is not computed, or does not record an input.
    """
    actuator, numbers = subject
    path = builder.path(actuator)
    control = CONTROLS, builder.controls.find_first(builder, actuator)
    element = elements.get(path)
    if not actuator.appliesForce and "factor" in getattr(numbers, "_fields", ()):
        # A force that is off is 0.
        return (control,) * len(probe_type.inputs), tuple(map(float, numbers._replace(factor=0.0)))
    if not isinstance(element, DeclaredForce) or not actuator.appliesForce:
        raise builder.make_unsupported_error(probe, f" of '{path}', whose force is not computed")
    record_offsets = element.force_type.record_names
    offsets = []
    for name in probe_type.inputs:
        offset = record_offsets.get(name)
        if offset is None and name != "control":
            raise builder.make_unsupported_error(
                probe, f" of '{path}', whose {name.replace('_', ' ')} is unknown"
            )
        offsets.append(control if offset is None else (path, offset))
    return tuple(offsets), tuple(map(float, numbers))


def find_members(
    builder: ElementBuilder, probe: Any, words: Sequence[Any], path: str, probe_type: str
) -> list[Any]:
    """Return the components in a set that a probe names; the single word `all` means all.

    Args:
        builder: builder of the elements.
        probe: probe component of the model.
        words: names, or components.
        path: path of the set.
        probe_type: class name of the components in the set.

    Returns:
        The components, in the order of the words.

    Raises:
        ModelError: the set has no component of a name.
    """
    members = builder.tree.list_members(path, probe_type)
    names = [word if isinstance(word, str) else word.name for word in words]
    if names and names[0].upper() == "ALL":
        return list(members.values())
    for name in names:
        if name not in members:
            raise ModelError(
                f"'{builder.path(probe)}' names the {probe_type.lower()} '{name}', which the model does not have"
                f"{suggest_name(name, members)}"
            )
    return [members[name] for name in names]
