"""Rates of a model with their exact derivatives along directions, in machine code.

The kernels are compiled for dual numbers: each float is a row of its value and `DIRECTIONS`
derivatives (forward mode of automatic differentiation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.deprecation import make_deprecated_method
from osimlite.base.records import replace
from osimlite.derivatives.differentiable_model import DifferentiableModel
from osimlite.derivatives.outputs import compute_output_columns, list_probe_items, locate_stations
from osimlite.errors import UnsupportedError
from osimlite.mechanics.kernels import merson
from osimlite.mechanics.kernels.error_control import ERRORS, METHOD_WORK
from osimlite.mechanics.kernels.layout import (
    CONSTRAINED,
    CONSTRAINT,
    ITEM,
    MODEL,
    OUTCOME,
    STAGE,
    WORK,
)
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model, check_is_model
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.elements.laws import DIRECTIONS
from osimlite.simulation.engines.dual_numbers import DualNumber, DualVector, make_dual
from osimlite.simulation.engines.linking import Program, Tangents
from osimlite.simulation.options import MERSON
from osimlite.simulation.pack import PackedModel, pack


def tangents(
    model: Model, parameters: Iterable[str] = (), folder: str | Path | None = None
) -> TangentModel:
    """Return the rates of a model with exact derivatives, by the machine code that simulates it.

    Args:
        model: model to differentiate.
        parameters: paths of numbers of the model that the rates are functions of, as for
            :func:`osimlite.casadi`.
        folder: folder of the model's file, for the files that it names; the current folder if None.

    Returns:
        The model with its rates and derivatives.

    Raises:
        ModelError: the model is not a mechanism.
        SettingError: a parameter does not exist.
        UnsupportedError: a force is computed in Python, or a number cannot be a parameter; the
            message names it.
    """
    check_is_model(model)
    return TangentModel(model, tuple(parameters), Path(folder or "."))


class DualMachine:
    """Machine code of a packed model on dual numbers: rows of a number and its derivatives.

    Args:
        packed: packed model.
        forces: forces of the model.
        entries: names of the kernels that are called.
        extra_size: additional size of the work vector.

    Attributes:
        program: model with the addresses of its code.
        x: numbers of the model (k, 1 + DIRECTIONS).
        w: work vector (k, 1 + DIRECTIONS).

    Raises:
        UnsupportedError: a force is computed in Python.
    """

    def __init__(
        self, packed: PackedModel, forces: Forces, entries: Sequence[str], extra_size: int = 0
    ) -> None:
        for offset, kernel in packed.kernels.items():
            if offset in packed.owners and not isinstance(kernel, str):
                path = forces.elements[packed.owners[offset]].path
                raise UnsupportedError(
                    f"'{path}' is computed in Python, which has no derivatives; set its appliesForce to false"
                )
        # States are never projected onto constraints here.
        laws = tuple(name for name in packed.laws if name != "project")
        self.program = Program(replace(packed, laws=laws), load_tangent_code(), entries)
        # Dual numbers as rows: the value first, then the derivatives along each direction.
        self.x = np.zeros((len(packed.numbers), 1 + DIRECTIONS))
        self.x[:, 0] = packed.numbers
        self.w = np.zeros((int(packed.structure[MODEL.WORK_SIZE]) + extra_size, 1 + DIRECTIONS))

    def bind_kernel(self, name: str, y: Array, f: Array) -> Callable[[int], int]:
        """Return a kernel that is called with the last of its arguments.

        Args:
            name: name of the kernel.
            y: state (x, 1 + DIRECTIONS).
            f: derivative of the state (x, 1 + DIRECTIONS).
        """
        return self.program.code.bind_entry(name, self.program.ints, self.x, self.w, y, f)

    def begin(self, t: float) -> None:
        """Set the time, and clear the derivatives of an earlier evaluation.

        Args:
            t: time, s.
        """
        # Derivatives of an earlier call would be read where a kernel does not write all of its
        # results.
        self.w[:, 1:] = 0.0
        self.w[WORK.TIME, 0] = t


class TangentModel(DifferentiableModel):
    """Model whose rates ``xdot = f(t, x, u, p)`` have derivatives along directions of x, u and p.

    The controls u replace the outputs of the model's controllers (a stretch reflex adds to them).
    Units are those of OpenSim's state files: m, rad, s, N. Where rates do not exist, all results
    are NaN. Where a law has a kink, or a path touches a surface, the derivative is that of the side
    that the machine code takes.

    Arguments and attributes are those of
    :class:`osimlite.derivatives.differentiable_model.DifferentiableModel`.
    """

    def __init__(self, model: Model, parameters: Sequence[str] = (), folder: Path = Path()) -> None:
        super().__init__(model, parameters, folder)
        packed = self._packed
        slopes = self._parameters.slopes if self._parameters else {}
        self._parameter_rows = [*slopes]
        self._slopes = np.zeros((len(slopes), len(self.parameters)))
        for row, terms in zip(self._slopes, slopes.values(), strict=True):
            for number, factor in terms:
                row[number] = factor
        self._machine = machine = DualMachine(packed, self.forces, ("evaluate",))
        # The controls are arguments, so that the model's controllers are switched off.
        machine.program.ints[MODEL.CONTROLS] = 0
        first_control = int(packed.structure[MODEL.WORK_CONTROL])
        self._control_rows = machine.w[first_control : first_control + len(self.controls)]
        self._y, self._f = (np.zeros((len(self.states), 1 + DIRECTIONS)) for _ in range(2))
        self._evaluate = machine.bind_kernel("evaluate", self._y, self._f)

    def take(self, p: Array) -> None:
        """Set the values of the parameters.

        Args:
            p: values (p,), in the units of the file.
        """
        self.p = p
        self.fill_numbers(self._machine.x[:, 0])

    def fill_numbers(self, numbers: Array) -> None:
        """Write the numbers of the model that depend on the parameters.

        Args:
            numbers: numbers of the kernels (k,), which are changed.
        """
        if self._parameters:
            numbers[self._parameter_rows] = (
                self._parameters.base[self._parameter_rows] + self._slopes @ self.p
            )

    def fill_derivatives(self, dp: Array, numbers: Array) -> None:
        """Write the derivatives of the model's numbers along directions of the parameters.

        Args:
            dp: directions of the parameters (p, m).
            numbers: derivatives of the numbers (k, m), which are changed.
        """
        # The numbers are linear in the parameters: their derivatives do not depend on p.
        numbers[self._parameter_rows] = self._slopes @ dp

    def differentiate_along(
        self,
        t: float,
        x: Sequence[float] | Array,
        u: Sequence[float] | Array,
        dx: Array,
        du: Array | None = None,
        dp: Array | None = None,
        after_evaluation: Callable[[slice, slice], None] | None = None,
    ) -> tuple[Array, Array]:
        """Compute the rates and their derivatives along m directions.

        Args:
            t: time, s.
            x: state (x,).
            u: controls (u,).
            dx: directions of the state (x, m).
            du: directions of the controls (u, m); 0 if None.
            dp: directions of the parameters (p, m); 0 if None.
            after_evaluation: function that is called after each evaluation, with the slice of its
                directions and their columns in a row of dual numbers; None for none.

        Returns:
            Rates (x,), and their derivatives (x, m); NaN where the rates do not exist.
        """
        machine = self._machine
        y = self._y
        f = self._f
        y[self.state_indices, 0] = x
        self._control_rows[:, 0] = u
        # NaN stays where the kernels report that a state cannot be evaluated.
        rates = np.full(len(x), np.nan)
        result = np.full(dx.shape, np.nan)
        # Machine code computes DIRECTIONS derivatives at once; more directions take more
        # evaluations.
        for direction_slice, column_slice in split_directions(dx.shape[1]):
            machine.begin(t)
            y[self.state_indices, column_slice] = dx[:, direction_slice]
            if du is not None:
                self._control_rows[:, column_slice] = du[:, direction_slice]
            if dp is not None:
                self.fill_derivatives(dp[:, direction_slice], machine.x[:, column_slice])
            if self._evaluate(STAGE.ACCELERATION) == OUTCOME.OK:
                rates = f[self.state_indices, 0]
                result[:, direction_slice] = f[self.state_indices, column_slice]
                if after_evaluation is not None:
                    after_evaluation(direction_slice, column_slice)
        if dp is not None:
            # The derivatives of the numbers must not remain for calls without directions of
            # parameters.
            machine.x[:, 1:] = 0.0
        return rates, result

    along = make_deprecated_method("differentiate_along")

    @cached_property
    def output_names(self) -> dict[str, tuple[str, ...]]:
        """Names of the entries of each group of outputs; see `CasadiModel.outputs`.

        Returns:
            Names by group.
        """
        return {group: tuple(labels) for group, (labels, _) in self._compute_outputs().items()}

    def compute_outputs(
        self, t: float, x: Array, u: Array, output_indices: Sequence[tuple[str, int]]
    ) -> tuple[Array, Array, Array]:
        """Compute outputs and their derivatives.

        Args:
            t: time, s.
            x: state (x,).
            u: controls (u,).
            output_indices: group of each output, and its index among `output_names` of the group.

        Returns:
            Outputs (y,), and their derivatives by the state (y, x) and by the controls (y, u).
        """
        size = len(x)
        # Unit directions: each state, then each control.
        directions = np.eye(size + len(u))
        y = np.full(len(output_indices), np.nan)
        slopes = np.full((len(output_indices), size + len(u)), np.nan)

        def store_outputs(direction_slice: slice, column_slice: slice) -> None:
            for offset, probe in self._probe_kernels:
                probe(offset)
            output_groups = self._compute_outputs()
            for row, (group, k) in enumerate(output_indices):
                number = output_groups[group][1][k]
                y[row] = number
                slopes[row, direction_slice] = (
                    # A number that depends on nothing has no slopes.
                    number.slopes[: column_slice.stop - 1]
                    if isinstance(number, DualNumber)
                    else 0.0
                )

        self.differentiate_along(
            t, x, u, directions[:size], directions[size:], after_evaluation=store_outputs
        )
        return y, slopes[:, :size], slopes[:, size:]

    def _compute_outputs(self) -> dict[str, tuple[list[str], list[Any]]]:
        """Compute all groups of outputs in the state of the last evaluation.

        Returns:
            Labels and values by group.
        """
        points = [
            axis for _, _, point in locate_stations(self.mechanism, self._packed) for axis in point
        ]
        machine = self._machine
        workspace = DualWorkspace(machine.program.ints, machine.x, machine.w)
        return compute_output_columns(self.mechanism, self._packed, self.forces, workspace, points)

    @cached_property
    def _probe_kernels(self) -> list[tuple[int, Callable[[int], int]]]:
        """Items of the probes with their kernels."""
        probe_offsets = list_probe_items(self._packed, self.forces.elements)
        kernels = self._packed.kernels
        return [
            (offset, self._machine.bind_kernel(str(kernels[offset + ITEM.LAW]), self._y, self._f))
            for offset in probe_offsets
        ]

    def compute_constraint_slopes(self, t: float, x: Array) -> tuple[Array, Array]:
        """Compute the derivatives of the constraint errors by the state and the parameters.

        Args:
            t: time, s.
            x: state (x,).

        Returns:
            Derivatives of the position errors (m, x + p), in m and rad, and of the speed errors (k,
            x + p), in m/s and rad/s.
        """
        s = self._machine.program.ints
        w = self._machine.w
        y = self._y
        size = len(x)
        h = s[s[MODEL.CONSTRAINED] :]
        freedoms = int(s[MODEL.DOFS])
        count = int(h[CONSTRAINED.EQUATIONS])
        directions = np.eye(size + len(self.p))
        positions = np.zeros((count, len(directions)))
        speeds = np.zeros((count, len(directions)))

        def store_errors(direction_slice: slice, column_slice: slice) -> None:
            rows, errors, rates = (
                w[h[work_offset] :][: count * row_size]
                for work_offset, row_size in (
                    (CONSTRAINED.WORK_ROWS, freedoms),
                    (CONSTRAINED.WORK_ERRORS, 1),
                    (CONSTRAINED.WORK_RATES, 1),
                )
            )
            rows = rows.reshape(count, freedoms, -1)
            u = y[freedoms : 2 * freedoms]
            positions[:, direction_slice] = errors[:, column_slice]
            # The errors of the speeds are G u - rates: the product rule gives dG u + G du.
            speed_changes = (
                np.einsum("ijk,j->ik", rows[:, :, column_slice], u[:, 0])
                + rows[:, :, 0] @ u[:, column_slice]
            )
            speeds[:, direction_slice] = speed_changes - rates[:, column_slice]

        self.differentiate_along(
            t, x, self.u, directions[:size], None, directions[size:], after_evaluation=store_errors
        )
        # Only some equations restrict positions; the others restrict speeds alone.
        position_rows = [
            row
            for work_offset in s[h[CONSTRAINED.CONSTRAINT_AT] :][: h[CONSTRAINED.CONSTRAINTS]]
            for row in range(
                s[work_offset + CONSTRAINT.FIRST_EQUATION], s[work_offset + CONSTRAINT.END_POSITION]
            )
        ]
        return positions[position_rows], speeds

    def linear(
        self, t: float, x: Array, u: Array, p: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Compute the rates and their derivatives by state and controls.

        Args:
            t: time, s.
            x: state (x,).
            u: controls (u,).
            p: parameters (p,); those set before if None.

        Returns:
            Rates (x,), derivatives by the state (x, x), and by the controls (x, u).
        """
        size = len(x)
        directions = np.eye(size + len(u))
        if p is not None:
            self.take(p)
        rates, slopes = self.differentiate_along(t, x, u, directions[:size], directions[size:])
        return rates, slopes[:, :size], slopes[:, size:]

    def steps(self, controls: Controls, dp: Array) -> TangentSteps:
        """Return integration steps of a controlled motion, with their derivatives.

        Args:
            controls: controls of the motion.
            dp: directions of the parameters (p, m).

        Returns:
            Steps with derivatives along these directions and those of the start.
        """
        packed = pack(
            self.mechanism,
            replace(self.forces, controls=controls),
            keep_fixed_bodies=self._keep_fixed_bodies,
        )
        result = TangentSteps(packed, self.forces, self.state_indices)
        numbers = packed.numbers.copy()
        changes = np.zeros((len(numbers), dp.shape[1]))
        self.fill_numbers(numbers)
        self.fill_derivatives(dp, changes)
        result.take(numbers, changes)
        return result


class DualWorkspace:
    """Read access to the vectors of an evaluation as dual numbers.

    Args:
        model: structure.
        reals: numbers (k, 1 + DIRECTIONS).
        data: work vector (k, 1 + DIRECTIONS).
    """

    wrap = staticmethod(make_dual)

    def __init__(self, model: Any, reals: Array, data: Array) -> None:
        self.model = model
        self.reals = DualVector(reals)
        self.data = DualVector(data)

    def mask_failures(self, numbers: Sequence[Any]) -> list[Any]:
        """Return numbers unchanged: after a failed evaluation they are not read.

        Args:
            numbers: dual numbers or floats.
        """
        return [*numbers]


class TangentSteps:
    """Steps of Merson's method with derivatives of their end by their start and by numbers of the model.

    They work on blocks (b, x, 1 + DIRECTIONS) of states and their derivatives in the packed order,
    one block for each group of directions.

    Args:
        packed: packed model with the controls of the motion.
        forces: forces of the model.
        state_indices: index in the packed order of each state of the model.
    """

    def __init__(self, packed: PackedModel, forces: Forces, state_indices: Sequence[int]) -> None:
        size = len(state_indices)
        self.state_indices = state_indices
        method = int(packed.structure[MODEL.WORK_SIZE])
        first_offset = int(packed.structure[MODEL.WORK_STATE])
        # With constraints no error is small enough, so that the kernel never projects the end of a step.
        self._accepted = -1.0 if packed.structure[MODEL.CONSTRAINED] else np.inf
        self._machine = machine = DualMachine(
            packed, forces, ("evaluate", MERSON), merson.HEAD + merson.STATES * size
        )
        self._start, self._end = (np.zeros((2 * size, 1 + DIRECTIONS)) for _ in range(2))
        self._errors = machine.w[first_offset + ERRORS * size :][:size]
        self._h = machine.w[method:, 0]
        self._evaluate = machine.bind_kernel("evaluate", self._start, self._start[size:])
        self._step: Callable[[], int] = partial(
            machine.bind_kernel(MERSON, self._start, self._end), method
        )

    def take(self, numbers: Array, changes: Array) -> None:
        """Set the numbers of the model and their derivatives.

        Args:
            numbers: numbers of the model (k,).
            changes: derivatives of the numbers along all directions (k, m).
        """
        self._count = changes.shape[1]
        self._number = -1
        self._numbers = [np.zeros(self._machine.x.shape) for _ in split_directions(self._count)]
        for (direction_slice, column_slice), block in zip(
            split_directions(self._count), self._numbers, strict=True
        ):
            # Each block holds the numbers for DIRECTIONS directions, as parameters differ by
            # direction.
            block[:, 0] = numbers
            block[:, column_slice] = changes[:, direction_slice]

    def blocks(self, y: Array, slopes: Array) -> Array:
        """Return the blocks of a state with the derivatives of the state.

        Args:
            y: state (x,) in the order of the model.
            slopes: derivatives of the state along all directions (x, m).

        Returns:
            Blocks of at most DIRECTIONS directions each (b, x, 1 + DIRECTIONS).
        """
        result = np.zeros((len(self._numbers), len(y), 1 + DIRECTIONS))
        result[:, self.state_indices, 0] = y
        for block, (direction_slice, column_slice) in zip(
            result, split_directions(slopes.shape[1]), strict=True
        ):
            block[self.state_indices, column_slice] = slopes[:, direction_slice]
        return result

    def slopes(self, blocks: Array) -> Array:
        """Return the derivatives in blocks.

        Args:
            blocks: blocks (b, x, 1 + DIRECTIONS).

        Returns:
            Derivatives (x, m) in the order of the model.
        """
        columns = [
            block[self.state_indices, column_slice]
            for block, (_, column_slice) in zip(blocks, split_directions(self._count), strict=True)
        ]
        return np.hstack(columns)

    def step(self, t0: float, t1: float, start: Array) -> tuple[Array, Array]:
        """Compute a step; values that do not exist are NaN.

        Args:
            t0: start of the step, s.
            t1: end of the step, s.
            start: blocks at the start.

        Returns:
            Blocks at the end, and blocks of the error estimate.
        """
        end = np.empty(start.shape)
        error = np.empty(start.shape)
        machine = self._machine
        size = start.shape[1]
        for number, block in enumerate(start):
            # Copying the numbers is costly, and a model with few directions has one block only.
            if self._number != number:
                self._number = number
                machine.x[:] = self._numbers[number]
            machine.begin(t0)
            h = self._h
            h[METHOD_WORK.REACHED] = t0
            h[METHOD_WORK.LAST_TIME] = t1
            h[METHOD_WORK.NEXT_STEP] = t1 - t0
            h[METHOD_WORK.ACCEPTED] = self._accepted
            self._start[:size] = block
            # A step that fails leaves NaN, since the kernel then does not write its end.
            self._end[0] = np.nan
            if self._evaluate(STAGE.ACCELERATION) == OUTCOME.OK:
                self._step()
            end[number] = self._end[:size]
            error[number] = self._errors
        if machine.program.failures:
            raise machine.program.failures.pop()
        return end, error


def split_directions(count: int) -> Iterator[tuple[slice, slice]]:
    """Yield the directions that are computed together.

    Args:
        count: number of directions.

    Yields:
        Slice of the directions, and slice of their columns in a row of dual numbers. Without
        directions there is one empty slice, so that the values are computed.
    """
    for start in range(0, max(count, 1), DIRECTIONS):
        size = min(DIRECTIONS, max(count - start, 0))
        yield slice(start, start + size), slice(1, 1 + size)


@cache
def load_tangent_code() -> Tangents:
    """Return the machine code for `DIRECTIONS` directions."""
    return Tangents(DIRECTIONS)
