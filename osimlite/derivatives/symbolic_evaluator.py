"""Evaluation of a packed model on symbols: the kernels run on numbers and symbols."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from contextlib import nullcontext
from functools import reduce
from typing import Any

from osimlite.base.text import append_clause
from osimlite.derivatives import branches
from osimlite.derivatives.constraints import make_constrained_dynamics
from osimlite.derivatives.outputs import list_probe_items
from osimlite.derivatives.symbolic import make_symbolic, register_symbolic, replace_kernel
from osimlite.derivatives.symbols import RecordedVector, casadi, postpone_interrupts
from osimlite.errors import UnsupportedError
from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.constraint_equations import add_wrench_row
from osimlite.mechanics.kernels.dynamics import evaluate, inverse
from osimlite.mechanics.kernels.layout import CONSTRAINED, ITEM, MODEL, RUN, STAGE, WORK
from osimlite.mechanics.kernels.pointers import call, register_law
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.geometries.load import Load, evaluate_load
from osimlite.simulation.engines.linking import PYTHON_CODE, Program
from osimlite.simulation.pack import PackedModel

WRAPPED_PATH_REASON = "its path runs around surfaces; replace it by a fitted FunctionBasedPath"
"""Reason and remedy for paths around surfaces."""
MESH_REASON = "contact of meshes is not supported; use spheres and half spaces"
"""Reason and remedy for contact of meshes."""
ELLIPSOID_REASON = "contact points of ellipsoids are found by a search; use spheres"
"""Reason and remedy for contact of ellipsoids."""
EARLY_RETURN_REASON = "simbody_early_return depends on a later state; remove this option"
"""Reason and remedy for the option simbody_early_return."""
UNSUPPORTED_KERNELS = {
    "wrapped_path": WRAPPED_PATH_REASON,
    "geodesic_path": WRAPPED_PATH_REASON,
    "cable_path": WRAPPED_PATH_REASON,
    "touch_mesh": MESH_REASON,
    "elastic_foundation_force": MESH_REASON,
    "touch_ellipsoid": ELLIPSOID_REASON,
    "touch_ellipsoids": ELLIPSOID_REASON,
    "early_return": EARLY_RETURN_REASON,
}
"""Reason, and remedy, why a kernel has no formula, by its name."""


class SymbolicEvaluator:
    """Evaluator that runs the kernels on symbols instead of the numbers of a state.

    Args:
        packed: packed model.
        forces: forces of the model.
        numbers: numbers of the packed model, which may include symbols.
        t: time, s.
        y: state in the order of the packed model.
        controls: controls of the actuators.
        equations: indices of independent constraint equations, which imply the others.
        loads: values of the time-dependent loads in the order of `list_load_functions`; none to
            compute them from the time.

    Raises:
        UnsupportedError: a force has no formula; the message names it.
    """

    def __init__(
        self,
        packed: PackedModel,
        forces: Forces,
        numbers: Sequence[Any],
        t: Any,
        y: Sequence[Any],
        controls: Sequence[Any],
        equations: Sequence[int] = (),
        loads: Sequence[Any] = (),
    ) -> None:
        self._packed = packed
        self._elements = forces.elements
        self._loads = loads
        self.numbers = numbers
        self._t = t
        self._y = y
        self._controls = controls
        registered_laws: dict[int, int] = {}
        for offset, kernel in packed.kernels.items():
            if not isinstance(kernel, str) and hasattr(kernel, "takes_symbols"):
                registered_laws[offset] = register_law(kernel)  # type: ignore[arg-type]
                continue
            if offset in packed.owners and (
                not isinstance(kernel, str) or kernel in UNSUPPORTED_KERNELS
            ):
                reason = (
                    UNSUPPORTED_KERNELS[kernel]
                    if isinstance(kernel, str)
                    else "it is computed in Python"
                )
                raise UnsupportedError(
                    f"'{self._find_force_path(offset)}' has no formula for CasADi: {reason}"
                )
        self.structure: list[int] = Program(packed, PYTHON_CODE).ints.tolist()
        for offset, law_address in registered_laws.items():
            self.structure[offset + ITEM.LAW] = law_address
        # The controls are arguments, so that the model's controllers are switched off.
        self.structure[MODEL.CONTROLS] = 0
        if self.structure[MODEL.CONSTRAINED]:
            law = self.structure[self.structure[MODEL.CONSTRAINED] + CONSTRAINED.DYNAMICS]
            self.structure[MODEL.LAWS + law] = register_law(
                register_symbolic(make_constrained_dynamics(equations))
            )

    def _find_force_path(self, item: int) -> str:
        """Return the path of the force that an item belongs to."""
        return self._elements[self._packed.owners[item]].path

    def evaluate(self, stage: int) -> SymbolicWorkspace:
        """Evaluate the model up to a stage.

        Args:
            stage: one of `STAGE`.

        Returns:
            Workspace with the formulas of that stage.
        """
        return self.run(
            lambda model, reals, data, y, f: make_symbolic(evaluate)(
                model, reals, data, y, f, stage
            )
        )

    def evaluate_probes(self) -> SymbolicWorkspace:
        """Evaluate the model up to the accelerations, and its probes.

        Returns:
            Workspace with the formulas of accelerations and probes.
        """
        probe_offsets = list_probe_items(self._packed, self._elements)

        def evaluate_all(
            model: RecordedVector,
            reals: RecordedVector,
            data: RecordedVector,
            y: RecordedVector,
            f: RecordedVector,
        ) -> None:
            """Evaluate the accelerations, then each probe."""
            make_symbolic(evaluate)(model, reals, data, y, f, STAGE.ACCELERATION)
            for offset in probe_offsets:
                make_symbolic(call)(model[offset + ITEM.LAW], model, reals, data, y, f, offset)

        return self.run(evaluate_all)

    def compute_missing_forces(
        self, udot: Sequence[Any], pushing: Container[str] | None = None
    ) -> SymbolicWorkspace:
        """Compute by inverse dynamics the forces that accelerations need beyond the model's forces.

        Args:
            udot: accelerations (n,).
            pushing: paths of the forces that act; all if None.

        Returns:
            Workspace with generalized forces in place of the derivatives of the speeds.
        """
        size = self.structure[MODEL.DOFS]
        # A copy, as the items that act are rewritten for this call only.
        structure = [*self.structure]
        if pushing is not None:
            first_item = structure[MODEL.ITEM_AT]
            count = structure[MODEL.ITEMS]
            acting_items = [
                item
                for item in structure[first_item : first_item + count]
                if self._find_force_path(item) in pushing
            ]
            structure[MODEL.ITEMS] = len(acting_items)
            structure[first_item : first_item + len(acting_items)] = acting_items
            # One run without a batched kernel covers the items that are left.
            run_offset = structure[MODEL.RUN_AT]
            structure[MODEL.RUNS], structure[run_offset + RUN.LAW] = 1, 0
            structure[run_offset + RUN.FIRST] = 0
            structure[run_offset + RUN.END] = len(acting_items)

        def compute_inverse(
            model: RecordedVector,
            reals: RecordedVector,
            data: RecordedVector,
            y: RecordedVector,
            f: RecordedVector,
        ) -> None:
            for k in range(size):
                f[size + k] = udot[k]
            make_symbolic(inverse)(model, reals, data, y, f, 0)

        return self.run(compute_inverse, structure)

    def evaluate_constraints(self) -> SymbolicWorkspace:
        """Evaluate the constraint equations.

        Returns:
            Workspace whose result has the wrench of a unit multiplier, by the index of the equation
            and the link on which it acts.
        """
        rows_offset = self.structure[self.structure[MODEL.CONSTRAINED] + CONSTRAINED.WORK_ROWS]
        size = self.structure[MODEL.DOFS]

        def collect_wrenches(
            model: RecordedVector,
            reals: RecordedVector,
            data: RecordedVector,
            y: RecordedVector,
            f: RecordedVector,
        ) -> dict[tuple[int, int], list[Any]]:
            """Return the wrenches (6,) of unit multipliers by equation and link.

            Returns:
                Torque (3,) and force (3,) by the index of the equation and that of the link.
            """
            wrenches: dict[tuple[int, int], list[Any]] = {}
            kernel = make_symbolic(add_wrench_row)

            def record_wrench(
                model: RecordedVector,
                data: RecordedVector,
                link: int,
                torque: Any,
                force: Any,
                row: RecordedVector,
            ) -> None:
                """Add a wrench to a row of the equations, and record it."""
                # The place of the row in the work vector tells the equation.
                key = (row.first - rows_offset) // size, link
                present_wrench = wrenches.get(key, [0.0] * 6)
                wrenches[key] = [
                    present + added
                    for present, added in zip(present_wrench, (*torque, *force), strict=True)
                ]
                kernel(model, data, link, torque, force, row)

            make_symbolic(evaluate)(model, reals, data, y, f, STAGE.VELOCITY)
            # The kernel that adds a wrench to a row of the equations also reveals the wrench.
            with replace_kernel(add_wrench_row, record_wrench):
                make_symbolic(evaluate_constraints)(model, reals, data, y, f)
            return wrenches

        return self.run(collect_wrenches)

    def run(
        self,
        law: Callable[
            [RecordedVector, RecordedVector, RecordedVector, RecordedVector, RecordedVector], Any
        ],
        structure: list[int] | None = None,
    ) -> SymbolicWorkspace:
        """Run a function of the five vectors of the kernels.

        Args:
            law: function of structure, numbers, work vector, state and derivative.
            structure: structure of the model; that of the packed model if None.

        Returns:
            Workspace with the formulas that the function wrote.

        Raises:
            UnsupportedError: a force has no formula.
        """

        def run_branch() -> SymbolicWorkspace:
            """Return the workspace in which the function has run on new vectors."""
            # New vectors for each attempt: a rerun must not see values of the one before.
            model = RecordedVector(self.structure if structure is None else structure)
            reals = RecordedVector(list(self.numbers))
            data = RecordedVector([0.0] * self.structure[MODEL.WORK_SIZE])
            y = RecordedVector(list(self._y))
            f = RecordedVector([0.0] * len(self._y))
            data[WORK.TIME] = self._t
            for k, control in enumerate(self._controls):
                data[self.structure[MODEL.WORK_CONTROL] + k] = control
            with (
                replace_kernel(evaluate_load, self._write_load_values)
                if self._loads
                else nullcontext()
            ):
                result = law(model, reals, data, y, f)
            return SymbolicWorkspace(model, reals, data, f, result, branches.run.failures)

        try:
            with postpone_interrupts():
                return branches.run_until_mergeable(run_branch)
        except branches.NoFormula as error:
            path = next(
                (
                    self._find_force_path(item)
                    for item in error.items
                    if item in self._packed.owners
                ),
                "",
            )
            subject = f"'{path}'" if path else "the model"
            raise UnsupportedError(
                append_clause(
                    f"{subject} has no formula for CasADi: {error}",
                    "set its appliesForce to false, or use another class",
                )
            ) from error

    def _write_load_values(
        self,
        load_ints: RecordedVector,
        _reals: RecordedVector,
        values: RecordedVector,
        _time: Any,
    ) -> None:
        """Write the symbols of one load; stands in for the kernel :func:`evaluate_load`.

        The kernel evaluates the tables of the load at a time. Here the values are arguments of the
        formula, so that its tables and the time are not used.

        Args:
            load_ints: integers of the load, from which the load is recognized.
            values: receives force (N), point (m) and torque (N.m), three numbers each (9,).
        """
        # The integers of a load stand inside its record, which is therefore the last one that
        # begins before them.
        element_index = self._packed.owners[
            max(item for item in self._packed.owners if item <= load_ints.first)
        ]
        element: Any = self._elements[element_index]
        first_load = len(list_load_functions(self._elements[:element_index]))
        # The groups are force, point and torque; one that the load lacks has no functions, and
        # leaves its three values at zero.
        for group, functions in enumerate(element.location.groups):
            for k in range(len(functions)):
                values[3 * group + k] = self._loads[first_load + k]
            first_load += len(functions)


def list_load_functions(elements: Sequence[Any]) -> list[SmoothFunction]:
    """Return the functions of time of all measured and prescribed forces, points and torques.

    Args:
        elements: force elements of the model.

    Returns:
        Functions in the order of the elements.
    """
    loads = (
        element.location
        for element in elements
        if isinstance(getattr(element, "location", None), Load)
    )
    return [function for load in loads for group in load.groups for function in group]


class SymbolicWorkspace:
    """Vectors of the kernels after an evaluation on symbols.

    Args:
        model: structure.
        reals: numbers.
        data: work vector.
        f: derivative of the state, or generalized forces instead of it.
        result: value that the function returned.
        failures: conditions under which there is no result.

    Attributes:
        wrap: function that makes kernels run on symbols.
    """

    def __init__(
        self,
        model: RecordedVector,
        reals: RecordedVector,
        data: RecordedVector,
        f: RecordedVector,
        result: Any,
        failures: Sequence[Any],
    ) -> None:
        self.model = model
        self.reals = reals
        self.data = data
        self.f = f
        self.result = result
        self.wrap = make_symbolic
        self._failure = reduce(casadi.logic_or, failures) if failures else None

    def mask_failures(self, numbers: Sequence[Any]) -> Any:
        """Return numbers as one column that is NaN where the evaluation fails.

        Args:
            numbers: numbers or symbols.
        """
        column = casadi.SX(casadi.vertcat(*numbers))
        return (
            column
            if self._failure is None
            else casadi.if_else(self._failure, casadi.DM.nan(column.shape), column)
        )
