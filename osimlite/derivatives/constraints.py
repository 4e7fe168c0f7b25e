"""Formulas of accelerations under constraints.

Formulas cannot choose pivots by size, so redundant equations are removed once, when the functions
are made.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.derivatives.symbolic import make_symbolic
from osimlite.derivatives.symbols import RecordedVector, casadi
from osimlite.mechanics.kernels.constrained_dynamics import (
    evaluate_constraints,
    solve_factor,
    solve_transposed_factor,
)
from osimlite.mechanics.kernels.dynamics import evaluate, solve_accelerations
from osimlite.mechanics.kernels.layout import CONSTRAINED, CONSTRAINT, DOF, MODEL, OUTCOME, STAGE
from osimlite.mechanics.kernels.linear_algebra import REDUNDANCY_TOLERANCE
from osimlite.mechanics.kernels.pointers import Law
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.constrained import find_consistent_state
from osimlite.simulation.engines.linking import PYTHON_CODE, Program
from osimlite.simulation.pack import PackedModel
from osimlite.simulation.states import StateLayout

TESTED_POSES = 3
"""Number of poses in which redundant equations are identified."""


def list_position_equations(structure: Sequence[int]) -> list[int]:
    """Return the indices of the position equations, in the order of their errors.

    Args:
        structure: integers of the packed model.

    Returns:
        Indices among all equations.
    """
    h = structure[structure[MODEL.CONSTRAINED] :]
    records = structure[h[CONSTRAINED.CONSTRAINT_AT] :][: h[CONSTRAINED.CONSTRAINTS]]
    ranges = (
        (
            structure[record + CONSTRAINT.FIRST_EQUATION],
            structure[record + CONSTRAINT.END_POSITION],
            index,
        )
        for index, record in enumerate(records)
    )
    return [row for first_row, end_row, _ in ranges for row in range(first_row, end_row)]


def find_independent_equations(
    mechanism: Mechanism, packed: PackedModel, state: StateLayout
) -> list[int]:
    """Find the largest set of independent constraint equations.

    It is searched in poses that fulfil the constraints.

    Args:
        mechanism: mechanism of the model.
        packed: packed model.
        state: layout of the state.

    Returns:
        Increasing indices of the equations.

    Raises:
        SimulationError: no pose fulfils the constraints.
    """
    ints = Program(packed, PYTHON_CODE).ints
    size = len(packed.order)
    # Controllers may be Python functions, which this does not need.
    ints[MODEL.CONTROLS] = 0
    count = int(ints[ints[MODEL.CONSTRAINED] + CONSTRAINED.EQUATIONS])
    at_rows = int(ints[ints[MODEL.CONSTRAINED] + CONSTRAINED.WORK_ROWS])
    largest_set: list[int] = []
    # A fixed seed makes the functions reproducible.
    rng = np.random.default_rng(0)
    infos = mechanism.coordinates
    start = np.array([info.default_value for info in infos])
    for number in range(TESTED_POSES):
        # In the default pose equations may be dependent by chance, for example in a stretched
        # chain. Random poses near it show the generic rank.
        # A step of 0.05 (rad, m) leaves such a pose but stays in the range of usual joints.
        q = start + (0.05 * rng.normal(size=len(start)) if number else 0.0)
        values, speeds = find_consistent_state(mechanism, q.tolist(), [0.0] * len(infos), (), ())
        y = np.array(state.pack(values.tolist(), speeds.tolist()))
        w = np.zeros(int(ints[MODEL.WORK_SIZE]))
        f = np.zeros(len(y))
        # The equations need poses and velocities of the links, but no forces.
        evaluate(ints, packed.numbers, w, y, f, STAGE.VELOCITY)
        evaluate_constraints(ints, packed.numbers, w, y, f)
        rows = _select_independent_rows(w[at_rows : at_rows + count * size].reshape(count, size))
        largest_set = max(largest_set, rows, key=len)
    return sorted(largest_set)


def _select_independent_rows(rows: Array) -> list[int]:
    """Select independent rows of normalized equations by pivoting.

    The row with the largest remainder comes first (Gram-Schmidt with pivoting, Golub and Van Loan,
    ch. 5.4).

    Args:
        rows: equations (c, n).

    Returns:
        Indices of the selected rows, in the order of the selection.
    """
    lengths = np.linalg.norm(rows, axis=1)
    remainders = (
        rows
        / np.where(
            lengths > REDUNDANCY_TOLERANCE * max(lengths.max(initial=0.0), 1.0), lengths, np.inf
        )[:, None]
    )
    selected: list[int] = []
    for _ in range(min(rows.shape)):
        remaining_lengths = np.linalg.norm(remainders, axis=1)
        pivot = int(np.argmax(remaining_lengths))
        if remaining_lengths[pivot] < REDUNDANCY_TOLERANCE:
            break
        selected.append(pivot)
        direction = remainders[pivot] / remaining_lengths[pivot]
        # Gram-Schmidt with pivots: what is left of each row is normal to all chosen rows.
        remainders = remainders - np.outer(remainders @ direction, direction)
    return selected


def make_constrained_dynamics(equations: Sequence[int]) -> Law:
    """Return the law of accelerations that fulfil the given independent equations.

    As in the kernel `solve_by_multipliers`, the tree's factorization of the mass matrix gives the
    accelerations by each equation's force.
    """

    def solve_dynamics(
        model: RecordedVector,
        reals: RecordedVector,
        data: RecordedVector,
        y: RecordedVector,
        f: RecordedVector,
        unused: int,
    ) -> int:
        """Return OK after storing the accelerations under all constraints in the derivative `f`."""
        h = model.get_tail(model[MODEL.CONSTRAINED])
        size = model[MODEL.DOFS]
        right_side = f.get_tail(size)
        freedoms = model.get_tail(model[MODEL.DOF_AT])
        make_symbolic(evaluate_constraints)(model, reals, data, y, f)
        make_symbolic(solve_accelerations)(model, data, right_side)
        # M = Lᵀ D L; the diagonal of D stands first in each row of the stored factors.
        inverse = [1.0 / data[freedoms[DOF.SIZE * k + DOF.ROW]] for k in range(size)]
        rows = []
        missing = []
        for number in equations:
            row = [data[h[CONSTRAINED.WORK_ROWS] + size * number + k] for k in range(size)]
            missing.append(
                data[h[CONSTRAINED.WORK_DRIFTS] + number]
                - sum(a * right_side[k] for k, a in enumerate(row))
            )
            transformed_row = RecordedVector(row)
            # G M⁻¹ Gᵀ = (G L⁻¹) D⁻¹ (G L⁻¹)ᵀ: half of a solution per row suffices, and the product
            # is symmetric by its form.
            make_symbolic(solve_transposed_factor)(model, data, transformed_row)
            rows.append(casadi.horzcat(*transformed_row.cells))
        jacobian = casadi.sparsify(casadi.SX(casadi.vertcat(*rows)))
        scaled = jacobian @ casadi.diag(casadi.vertcat(*inverse))
        multipliers = casadi.ldl_solve(
            casadi.SX(casadi.vertcat(*missing)), *casadi.ldl(scaled @ jacobian.T)
        )
        constraint_accelerations = RecordedVector(
            casadi.vertsplit(casadi.densify(scaled.T @ multipliers))
        )
        make_symbolic(solve_factor)(model, data, constraint_accelerations)
        for k in range(size):
            right_side[k] += constraint_accelerations[k]
        return OUTCOME.OK

    return solve_dynamics  # type: ignore[return-value]
