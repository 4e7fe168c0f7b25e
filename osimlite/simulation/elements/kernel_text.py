"""Generator of the kernels of a force type from its declaration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from inspect import signature
from typing import TYPE_CHECKING, Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.batched_curves import (
    LANES,
    compute_requests,
    request_residual,
    request_result,
    request_sum,
    request_value,
)
from osimlite.mechanics.kernels.condensation import WIDTH
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.table import PARAMETERS, compile_text
from osimlite.mechanics.laws.dual_numbers import (
    get_derivative,
    make_dual_workspace,
    seed_derivative,
)
from osimlite.simulation.elements.laws import BATCHED, EQUILIBRIUM, OFF, RESPONSE, RIGID
from osimlite.simulation.elements.registry import FORCE_TYPES

if TYPE_CHECKING:
    from osimlite.simulation.elements.force_type import ForceType, State
    from osimlite.simulation.elements.parameters import Parameter

SOLVED = "solved"
"""Output that says whether the law has a solution; a law without it always has one."""

SEARCH_ITERATIONS = 4
"""Iterations of a search for a sum, which starts between the ends of a segment."""


class LookupStage(NamedTuple):
    """Stage of a batched law after the lookup of curve values."""

    # names of the curves, each with the name of the quantity that is its argument
    curves: dict[str, str]
    law: Callable[..., Any]  # function of the quantities, the first parameter, and the curve values
    results: tuple[str, ...]  # names of the quantities that the law returns


class SearchStage(NamedTuple):
    """Stage of a batched law after one lookup: of a curve, or of a weighted sum of a curve and its argument."""

    curves: tuple[str, ...]  # names of the curves
    # function of the quantities and the first parameter that returns the index of the curve, the
    # factors of its value and its argument, and their sum; factors 0 and 1 look up the curve itself
    asking: Callable[..., Any]
    # function of the same, the value of the curve, and the residual of the search
    law: Callable[..., Any]
    results: tuple[str, ...]  # names of the quantities that the law returns


class BatchedLaw(NamedTuple):
    """Law in stages for several forces, whose curves are evaluated together by SIMD lanes.

    The results equal those of the law to the last bit.
    """

    quantities: type[Any]  # named tuple of the quantities that the stages compute
    # function of the law's inputs and the first parameter that returns the quantities
    begin: Callable[..., Any]
    lookup: LookupStage  # first stage
    search: SearchStage  # second stage
    end: Callable[..., Any]  # function of the quantities and the first parameter: the law's results


@dataclass(frozen=True, eq=False)
class KernelText:
    """Generator of the kernels of one force type."""

    force_type: ForceType  # the declaration

    @cached_property
    def kernel(self) -> Callable[..., int]:
        """Function that computes and applies one force."""
        return self._write_function(
            "", self.force_type.law, [*self._law_lines, *self.force_type.geometry.apply_code]
        )

    @cached_property
    def off_kernel(self) -> Callable[..., int]:
        """Function that computes one force and does not apply it."""
        return self._write_function(OFF, self.force_type.law, self._law_lines)

    @cached_property
    def equilibrium_kernel(self) -> Callable[..., int]:
        """Function that sets the states of one force to equilibrium."""
        force_type = self.force_type
        lines = [
            f"{', '.join((SOLVED, *force_type.solved_states))} = {self._write_call(self._arguments)}"
        ]
        lines += self._write_record((*force_type.geometry.inputs, *force_type.solved_states))
        lines += [f"if not {SOLVED}:", "    return OUTCOME.UNSOLVED"]
        for index, state in self._state_indices.items():
            if state.name in force_type.solved_states:
                lines += [f"if i[{index}] >= 0:", f"    y[i[{index}]] = {state.name}"]
        return self._write_function(EQUILIBRIUM, force_type.equilibrium, lines)

    @cached_property
    def rigid_kernel(self) -> Callable[..., int]:
        """Function of a muscle whose tension is its control times the force of fully active fibers."""
        lines = [f"active_fiber_force = {self._write_call(self._arguments)}"]
        lines += [f"activation = {self._arguments[len(self.force_type.geometry.inputs)]}"]
        lines += ["tension = activation * active_fiber_force"]
        lines += self._write_record(
            ("tension", "activation", "active_fiber_force", *self.force_type.geometry.inputs)
        )
        return self._write_function(
            RIGID, self.force_type.rigid_law, [*lines, *self.force_type.geometry.apply_code]
        )

    @cached_property
    def response_kernel(self) -> Callable[..., int]:
        """Function that applies a unit force along the displacement and writes derivatives to SCRATCH.

        There is one row for the force and one for the rate of each state, see
        :mod:`osimlite.mechanics.kernels.condensation`. The derivatives are those at the last evaluation,
        whose record has its results.
        """
        force_type = self.force_type
        force = self.force_type.geometry.displacement_output[0]
        rows = (force, *(state.rate for state in force_type.states))
        changed = self.changed_outputs
        arguments = self._arguments
        # Each input that matters gets a direction of the dual numbers; the other columns of the
        # Jacobian are 0.
        directions = {column: direction for direction, column in enumerate(changed)}
        law = force_type.law_from_record or force_type.law
        count = len(changed)
        for column, index in changed.items():
            arguments[index] = f"seed_derivative({arguments[index]}, {directions[column]}, {count})"
        # Expressions compute in the record. The stored control already includes the reflex (rate 0).
        arguments = [
            f"make_dual_workspace({argument}, {count})"
            if argument.startswith("at(record")
            else argument.replace(", rate)", ", 0.0)")
            for argument in arguments
        ]
        if force_type.law_from_record is not None and force_type.law is not None:
            law_parameters = signature(force_type.law).parameters
            arguments += [
                f"record[{force_type.record_offsets[name]}]"
                for name in signature(force_type.law_from_record).parameters
                if name not in law_parameters
            ]
        # A rate may be named like another state (fiber_velocity), hence the suffix.
        lines = [
            f"{', '.join(f'{name}_0' for name in force_type.outputs)} = {self._write_call(arguments)}"
        ]
        lines += [
            # The geometry applies a force of 1, whose generalized forces are the moment arms of the
            # response.
            f"{force} = 1.0",
            *force_type.geometry.apply_code,
            "change = at(data, WORK.SCRATCH)",
        ]
        for row, name in enumerate(rows):
            for column in range(WIDTH):
                value = (
                    f"get_derivative({name}_0, {directions[column]})"
                    if column in directions
                    else "0.0"
                )
                lines.append(f"change[{WIDTH * row + column}] = {value}")
        lines[:0] = (
            *self._pointer_lines,
            *(force_type.geometry.recorded_setup_code or force_type.geometry.setup_code),
        )
        carried = {
            function.__name__: function
            for function in (seed_derivative, make_dual_workspace, get_derivative)
        }
        return self._compile_kernel(RESPONSE, "item", lines, law=law, **carried)

    @cached_property
    def batched_kernel(self) -> Callable[..., int]:
        """Function that computes and applies several consecutive forces.

        Raises:
            TypeError: the force type has no batched law.
        """
        force_type, stages = self.force_type, self.force_type.batched
        if stages is None:
            raise TypeError(f"the law of {force_type.name} has no parts")
        inputs = force_type.geometry.inputs
        recorded = force_type.record_offsets
        arguments = self._arguments
        # The record stores the quantities between the stages.
        offsets = (f"record[{offset}]" for name, offset in recorded.items() if name not in inputs)
        record_texts = dict(zip(stages.quantities._fields, offsets, strict=False))
        of_moment = (
            len(self.input_names) + 1 + sum(state.is_argument for state in force_type.states)
        )
        quantities = f"known({', '.join(record_texts.values())}), {arguments[of_moment]}"
        begin = f"{', '.join(record_texts.values())} = {self._write_call(arguments[: of_moment + 1], 'begin')}"
        # Forces of one kind are computed in lanes: first all requests of a stage, then their curves
        # together, then the law.
        first, second = stages.lookup, stages.search
        *_, curves = force_type.terms
        table_offsets = {}
        number = self.size - curves.size
        for name, term in zip(curves.type._fields, curves.terms, strict=True):  # type: ignore[attr-defined]
            table_offsets[name], number = f"i[ITEM.NUMBERS] + {number}", number + term.size
        count = len(first.curves)
        requests = [
            f"request_value(reals, lanes, asked + {k}, {table_offsets[curve]}, {record_texts[name]})"
            for k, (curve, name) in enumerate(first.curves.items())
        ]
        lines = [
            "asked = 0",
            *self._write_loop(
                [
                    *force_type.geometry.setup_code,
                    *self._write_record(inputs),
                    begin,
                    *requests,
                    f"asked += {count}",
                ]
            ),
        ]
        lookup_results = ", ".join(
            f"request_result(lanes, {count} * asked + {k})" for k in range(count)
        )
        # The last curve needs no condition: one of the curves is always chosen.
        offset = table_offsets[second.curves[-1]]
        for number, curve in reversed([*enumerate(second.curves[:-1])]):
            offset = f"{table_offsets[curve]} if which == {number} else {offset}"
        # A force requests its second lookup in the lane of its first, whose result is used.
        lines += [
            "compute_requests(lanes, asked, 1)",
            "asked = 0",
            *self._write_loop(
                [
                    f"{', '.join(record_texts[name] for name in first.results)} = law({quantities}, {lookup_results})",
                    f"which, of_curve, of_argument, total = asking({quantities})",
                    f"place = {offset}",
                    "if of_curve == 0.0 and of_argument == 1.0:",
                    "    request_value(reals, lanes, asked, place, total)",
                    "else:",
                    "    request_sum(reals, lanes, asked, place, of_curve, of_argument, total)",
                    "asked += 1",
                ]
            ),
        ]
        lines += [f"compute_requests(lanes, asked, {SEARCH_ITERATIONS})", "asked = 0"]
        results = ", ".join(record_texts[name] for name in second.results)
        ended = [
            f"{results} = search_law({quantities}, request_result(lanes, asked), request_residual(lanes, asked))",
            "asked += 1",
        ]
        end = [f"{', '.join(force_type.outputs)} = end({quantities})"]
        end += self._write_results(name for name in recorded if name not in inputs)
        lines += self._write_loop([*ended, *end, *force_type.geometry.apply_code])
        return self._compile_kernel(
            BATCHED,
            "run",
            [
                "lanes, first = at(data, model[run + RUN.WORKSPACE]), model[run + RUN.FIRST]",
                "while first < model[run + RUN.END]:",
                f"    end_of_part = min(first + {LANES // count}, model[run + RUN.END])",
                *(f"    {line}" for line in lines),
                "    first = end_of_part",
            ],
            **{
                "known": stages.quantities,
                "begin": stages.begin,
                "law": first.law,
                "asking": second.asking,
            },
            **{
                "search_law": second.law,
                "end": stages.end,
                "request_value": request_value,
                "request_sum": request_sum,
                "compute_requests": compute_requests,
            },
            **{"request_result": request_result, "request_residual": request_residual},
        )

    def _write_loop(self, lines: Sequence[str]) -> list[str]:
        """Return a loop over the records of a run.

        A record without a solution reports its number in f[0].

        Args:
            lines: body of the loop.
        """
        refused = "    return OUTCOME.UNSOLVED"
        written_lines = [
            new
            for line in lines
            for new in (("    f[0] = number", line) if line == refused else (line,))
        ]
        return [
            "for number in range(first, end_of_part):",
            "    item = model[model[MODEL.ITEM_AT] + number]",
            *(f"    {line}" for line in (*self._pointer_lines, *written_lines)),
        ]

    @property
    def changed_outputs(self) -> dict[int, int]:
        """Index of the law's argument that is varied for each column of the derivatives.

        The first two columns are the displacement and its speed, the others are the states.

        Returns:
            Index of an argument by column.
        """
        force_type = self.force_type
        inputs = list(self.input_names)
        result = {
            column: inputs.index(name)
            for column, name in enumerate(force_type.geometry.inputs)
            if name in inputs
        }
        columns = [column for column, state in enumerate(force_type.states) if state.is_argument]
        first = len(inputs) + force_type.has_control
        return result | {2 + column: first + number for number, column in enumerate(columns)}

    @property
    def responds(self) -> bool:
        """Flag: the forces of this type have derivatives along one displacement."""
        force_type = self.force_type
        return (
            force_type.law is not None
            and force_type.geometry.displacement_output[0] in force_type.outputs
            and bool(self.changed_outputs)
        )

    def _write_function(
        self, form: str, law: Callable[..., Any] | None, lines: Sequence[str]
    ) -> Callable[..., int]:
        return self._compile_kernel(
            form,
            "item",
            [*self._pointer_lines, *self.force_type.geometry.setup_code, *lines],
            law=law,
        )

    @property
    def _pointer_lines(self) -> list[str]:
        recorded = len(self.force_type.record_offsets)
        return [
            "i = at(model, item)",
            "p, record = at(reals, i[ITEM.NUMBERS]), at(data, i[ITEM.RECORD])",
            f"g, gp, work = at(i, {ITEM.DETAILS + self.int_count}), at(p, {self.size}), at(record, {recorded})",
        ]

    def _compile_kernel(
        self, form: str, offset_name: str, lines: Sequence[str], **scope_of_form: Any
    ) -> Callable[..., int]:
        """Compile the text of one kernel in the module of the force's class.

        Args:
            form: end of the kernel's name, such as `RESPONSE`.
            offset_name: name of its last parameter, the offset of the item in the model.
            lines: statements of its body, without the final return.
            **scope_of_form: objects that the statements use, by name.

        Returns:
            The kernel, a function of `PARAMETERS` that returns an `OUTCOME`.
        """
        force_type = self.force_type
        name = self.force_type.name + form
        source = "\n    ".join(
            [
                f'def {name}({PARAMETERS}, {offset_name}: "int") -> "int":',
                *lines,
                "return OUTCOME.OK\n",
            ]
        )
        scope = {
            name: value
            for term in force_type.terms
            for name, value in term.list_functions().items()
        }
        if force_type.inputs_type is not None:
            scope[force_type.inputs_type.__name__] = force_type.inputs_type
        return compile_text(
            name,
            FORCE_TYPES.module_of(force_type.component),
            source,
            **scope_of_form,
            **force_type.geometry.list_functions(),
            **scope,
        )

    @property
    def _law_lines(self) -> list[str]:
        """Lines that call the law and record its results, without the force being applied."""
        force_type = self.force_type
        lines = []
        if force_type.law is not None:
            results = f"{', '.join(force_type.outputs)} = " if force_type.outputs else ""
            lines.append(f"{results}{self._write_call(self._arguments)}")
        return lines + self._write_results(force_type.record_offsets)

    def _write_results(self, names: Iterable[str]) -> list[str]:
        """Return lines that record results of the law by name, and write the rates of states.

        Args:
            names: names of the results to record.
        """
        force_type = self.force_type
        lines = self._write_record(names)
        if SOLVED in force_type.outputs:
            lines += [f"if not {SOLVED}:", "    return OUTCOME.UNSOLVED"]
        for index, state in self._state_indices.items():
            lines += [f"if i[{index}] >= 0:", f"    f[i[{index}]] = {state.rate}"]
        return lines

    def _write_record(self, names: Iterable[str]) -> list[str]:
        recorded = self.force_type.record_offsets
        return [f"record[{recorded[name]}] = {name}" for name in names if name in recorded]

    @property
    def _state_indices(self) -> dict[int, State]:
        """States by the indices of their offsets among the integers of a record.

        An offset of -1 marks a state that the component lacks.
        """
        first = ITEM.DETAILS + sum(term.int_count for term in self.force_type.terms)
        return {first + number: state for number, state in enumerate(self.force_type.states)}

    @property
    def _arguments(self) -> list[str]:
        """Arguments of the law, as expressions."""
        force_type = self.force_type
        terms = write_arguments(force_type.terms, ITEM.DETAILS, 0)
        indices = [index for index, state in self._state_indices.items() if state.is_argument]
        states = [f"(y[i[{index}]] if i[{index}] >= 0 else 0.0)" for index in indices]
        count = 1 if force_type.has_control else 0
        return [*self.input_names, *terms[:count], *states, *terms[count:]]

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the geometry's inputs that the law takes.

        Returns:
            Names in the order of the arguments.
        """
        return (
            self.force_type.geometry.inputs
            if self.force_type.inputs is None
            else self.force_type.inputs
        )

    def _write_call(self, arguments: Sequence[str], law: str = "law") -> str:
        """Return a call of a law.

        If the force type has an `inputs_type`, the arguments that change with time are combined
        into one.

        Args:
            arguments: arguments as expressions.
            law: name of the law in the kernel.
        """
        inputs_type = self.force_type.inputs_type
        if inputs_type is None:
            return f"{law}({', '.join(arguments)})"
        names = (
            *self.input_names,
            "excitation",
            *(state.name for state in self.force_type.states if state.is_argument),
        )
        arguments_by_name = dict(zip(names, arguments, strict=False))
        first = f"{inputs_type.__name__}({', '.join(arguments_by_name.get(name, '0.0') for name in inputs_type._fields)})"
        return f"{law}({', '.join((first, *arguments[len(names) :]))})"

    @property
    def int_count(self) -> int:
        """Number of integers of a record that belong to the force type."""
        return sum(term.int_count for term in self.force_type.terms) + len(self.force_type.states)

    @property
    def size(self) -> int:
        """Number of numbers of a record that are parameters."""
        return sum(term.size for term in self.force_type.terms)


def write_arguments(terms: Iterable[Parameter], head: int, number: int) -> list[str]:
    """Return the arguments of a law for parameters, as expressions.

    Args:
        terms: the parameters.
        head: index of their first integer.
        number: index of their first number.

    Returns:
        One expression for each argument.
    """
    result = []
    for term in terms:
        result += term.write_arguments(head, number)
        head, number = head + term.int_count, number + term.size
    return result
