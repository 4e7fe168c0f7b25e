"""Static optimization: distribution of the generalized forces of a motion over muscles and other actuators.

As in OpenSim's StaticOptimization, each time is solved by itself: of all activations x that give
the accelerations of the motion, those with the least sum of |x|ᵖ. A muscle pulls with x times the
force of its fully active fibers, with a rigid tendon and without passive force; other actuators
push with x times their optimal force. Locked, prescribed and dependent coordinates move as the
constraints prescribe.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from osimlite.base.progress import divide_rows
from osimlite.base.text import format_count, join_words, suggest_or_list
from osimlite.errors import ModelError, SettingError, UnsupportedError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.kernels.effort import effort_size
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, STAGE
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements import Forces, force_elements
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.simulation.engines.linking import select_code
from osimlite.simulation.ideal_actuators import replace_by_ideal_actuators
from osimlite.simulation.shared_forces import SharedForces
from osimlite.simulation.system import System
from osimlite.simulation.trajectory import label_as_opensim

if TYPE_CHECKING:
    from osimlite.schema.prescribed import ExternalLoads

RATE_TOLERANCE = 1e-9
"""Rates of coordinates that differ by no more are equal."""
MUSCLES = ("active", "isometric")
"""Models of muscle force: fully active fibers along a rigid tendon, or max_isometric_force."""

FORCES_TITLE = "ModelForces"
"""OpenSim's name of the table of forces."""


class StaticOptimization:
    """Solver that distributes the generalized forces of motions over the actuators of a model.

    Args:
        model: model with the actuators.
        mechanism: mechanism of the model.
        exponent: p, greater than 1.
        muscles: force of a muscle at an activation of 1, one of `MUSCLES`.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        external_loads: measured loads or their file; None for none.
        folder: folder of the model's file; the current folder if None.
        early_return: whether Simbody's defect in contacts of several surfaces is reproduced.
        underactuated: whether there may be fewer actuators than coordinates to accelerate, as for
            tools that need not balance every coordinate.

    Raises:
        SettingError: the exponent is not greater than 1, or there is no such muscle force.
        ModelError: there are no actuators, or fewer than coordinates to accelerate.
        UnsupportedError: an actuator's force is not proportional to its control, or cannot be
            computed.
    """

    def __init__(
        self,
        model: Model,
        mechanism: Mechanism,
        *,
        exponent: float = 2.0,
        muscles: str = "active",
        wrapping: str = OPENSIM,
        external_loads: str | Path | ExternalLoads | None = None,
        folder: str | Path | None = None,
        early_return: bool = False,
        underactuated: bool = False,
    ) -> None:
        if not 1.0 < exponent < np.inf:
            raise SettingError(
                f"an exponent of {exponent:g} does not determine the activations; set a number above 1, such as 2"
            )
        if muscles not in MUSCLES:
            raise SettingError(
                f"unknown muscle force '{muscles}'{suggest_or_list(muscles, MUSCLES)}"
            )
        self.mechanism, self._exponent = mechanism, exponent
        model = model.copy_deep()
        # Controls are the unknowns.
        model.controller_set.objects.clear()
        # Probes are not reported here, and those of muscles would refer to muscles that are
        # replaced below.
        model.probe_set.objects.clear()
        self._actuators = replace_by_ideal_actuators(model, muscles != "isometric")
        tree = model.tree()
        self._paths = [tree.path_of(item) or "" for item in self._actuators]
        self._forces = force_elements(
            model,
            mechanism,
            simbody_early_return=early_return,
            wrapping=wrapping,
            external_loads=external_loads,
            folder=folder,
            rigid_tendons=True,
        )
        # Coordinates that constraints determine need no balance of their own: their forces act on
        # the free ones by `directions`.
        dependent = {item.dependent for item in mechanism.constraints if isinstance(item, Coupler)}
        self._free_indices = [
            index
            for index, info in enumerate(mechanism.coordinates)
            if not (info.locked or info.prescribed is not None or index in dependent)
            and not tree.find(info.path).is_free_to_satisfy_constraints
        ]
        self.names = tuple(item.name for item in self._actuators)
        free_coordinates = [mechanism.coordinates[index] for index in self._free_indices]
        self.coordinates = tuple(coordinate.name for coordinate in free_coordinates)
        self.units = tuple(
            "N m" if coordinate.motion_type == "rotational" else "N"
            for coordinate in free_coordinates
        )
        # Fewer unknowns than equations have no solution but by chance.
        if len(self.names) < len(self.coordinates) and not underactuated:
            raise ModelError(
                f"'{model.name}' has {format_count(len(self.names), 'actuator')} for "
                f"{format_count(len(self.coordinates), 'coordinate')}; append reserve actuators, or lock coordinates"
            )
        self._bounds = np.array(
            [(item.min_control, item.max_control) for item in self._actuators], dtype=float
        ).T
        for item, low, high in zip(self._actuators, *self._bounds, strict=True):
            if not low <= high:
                raise ModelError(
                    f"'{item.name}' has a min_control of {low:g} above its max_control of {high:g}"
                )
            if not (low < np.inf and high > -np.inf):
                raise ModelError(
                    f"'{item.name}' has only infinite controls, from {low:g} to {high:g}; set a finite min_control or max_control"
                )

    @cached_property
    def _system(self) -> System:
        return System(self.mechanism, self._forces)

    def solve_motion(
        self, times: Array, values: Array, speeds: Array, accelerations: Array
    ) -> SharedForces:
        """Distribute the generalized forces of a motion over the actuators.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n), rad and m.
            speeds: generalized speeds (t, n).
            accelerations: derivatives of the generalized speeds (t, n); those of constrained
                coordinates are ignored.

        Returns:
            The distribution, with the missing generalized forces at times without a solution.

        Raises:
            SimulationError: the forces cannot be computed at one of the states.
            UnsupportedError: constrained coordinates can move while all others rest.
        """
        allowed, directions = self._project_accelerations(times, values, speeds, accelerations)
        required_forces, unit_forces, strengths = self._compute_requirements(
            times, values, speeds, allowed, directions
        )
        result, lacking, solved = self._minimize_effort(unit_forces, required_forces)
        result[~solved] = np.nan
        return SharedForces(
            times,
            self.names,
            result,
            strengths * self.optimal_forces,
            self.coordinates,
            self.units,
            lacking,
            solved,
        )

    def _compute_requirements(
        self, times: Array, values: Array, speeds: Array, accelerations: Array, directions: Array
    ) -> tuple[Array, Array, Array]:
        """Compute the linear equations of the distribution.

        Generalized forces f on all coordinates count along the directions D of the free ones, as Dᵀ
        f: the forces of constraints do not appear, because they do no work along these.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).
            accelerations: derivatives of the generalized speeds (t, n), which fulfil the
                constraints.
            directions: motion D of all coordinates with each free one (t, n, m).

        Returns:
            Required generalized forces (t, m), contributions of each actuator at a control of 1 (t,
            a, m), and forces of muscles (t, a), which are 1 for other actuators.
        """
        system = self._system
        order = list(self._system.order)
        moments = np.column_stack([times, system.state.pack_rows(values, speeds)])
        required_forces, unit_forces, strengths = system.compute_unit_forces(
            moments, np.ascontiguousarray(accelerations[:, order]), self._paths
        )
        moving_directions = directions[:, order]
        return (
            (required_forces[:, None, :] @ moving_directions)[:, 0],
            unit_forces @ moving_directions,
            strengths,
        )

    def _minimize_effort(
        self, columns: Array, needed: Array
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        return minimize_effort(columns, needed, self._exponent, self._bounds)

    @property
    def optimal_forces(self) -> Array:
        """Force of each actuator at a control of 1 (a,), N or N m; 1 for muscles with fibers."""
        fibers = [isinstance(item, Muscle) for item in self._actuators]
        return np.array(
            [
                1.0 if has_fibers else item.optimal_force
                for has_fibers, item in zip(fibers, self._actuators, strict=True)
            ]
        )

    def compute_strengths(self, times: Array, values: Array, speeds: Array) -> Array:
        """Return the force of each actuator at a control of 1 in one pose.

        Args:
            times: time (1,), s.
            values: values of all coordinates (1, n).
            speeds: generalized speeds (1, n).

        Returns:
            Forces (a,), N or N m.
        """
        moments = np.column_stack([times, self._system.state.pack_rows(values, speeds)])
        at_rest = np.zeros((len(times), len(self._system.order)))
        _, _, strengths = self._system.compute_unit_forces(moments, at_rest, self._paths)
        return (strengths * self.optimal_forces)[0]

    def balance_accelerations(
        self, times: Array, values: Array, speeds: Array, accelerations: Array
    ) -> Array:
        """Return the forces that give accelerations with the least squares of controls, without bounds.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).
            accelerations: derivatives of the generalized speeds (t, n).

        Returns:
            Forces (t, a), N or N m.
        """
        allowed, directions = self._project_accelerations(times, values, speeds, accelerations)
        required_forces, unit_forces, _ = self._compute_requirements(
            times, values, speeds, allowed, directions
        )
        # The pseudoinverse gives the solution with the least sum of squares, without bounds.
        shared = np.linalg.pinv(unit_forces.transpose(0, 2, 1)) @ required_forces[:, :, None]
        result: Array = shared[..., 0] * self.optimal_forces
        return result

    def compute_balance(
        self, times: Array, values: Array, speeds: Array, accelerations: Array
    ) -> tuple[Array, Array, Array]:
        """Compute the force balance of a motion for the f coordinates that can move.

        Whether the constraints allow the accelerations is not checked.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).
            accelerations: derivatives of the generalized speeds (t, n).

        Returns:
            Required generalized forces (t, f), contributions of each actuator per 1 N (t, f, a),
            and rows G of the constraint equations (t, c, f); multipliers λ push with -Gᵀ λ.
        """
        order = list(self._system.order)
        directions = np.broadcast_to(
            np.eye(values.shape[1])[:, order], (len(times), values.shape[1], len(order))
        )
        required_forces, unit_forces, _ = self._compute_requirements(
            times, values, speeds, accelerations, directions
        )
        equations, _ = self._compute_equations(times, values, speeds)
        return (
            required_forces,
            (unit_forces / self.optimal_forces[:, None]).transpose(0, 2, 1),
            equations[:, :, order],
        )

    @cached_property
    def equation_count(self) -> int:
        """Number of equations of the constraints."""
        record_offset = int(self._system.structure[MODEL.CONSTRAINED])
        return (
            int(self._system.structure[record_offset + CONSTRAINED.EQUATIONS])
            if record_offset
            else 0
        )

    @property
    def moving(self) -> list[str]:
        """Names of the coordinates that can move, in the order of `compute_balance`."""
        return [self.mechanism.coordinates[index].name for index in self._system.order]

    def compute_path_lengths(
        self, times: Array, values: Array, speeds: Array
    ) -> tuple[Array, Array]:
        """Compute the lengths and speeds of the muscles' paths.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).

        Returns:
            Lengths (m) and lengthening speeds (m/s), (t, a) each; 1 and 0 for other actuators.
        """
        system = self._system
        moments = np.column_stack([times, system.state.pack_rows(values, speeds)])
        result = np.ones((len(times), len(self._paths))), np.zeros((len(times), len(self._paths)))
        muscle_columns = [k for k, item in enumerate(self._actuators) if isinstance(item, Muscle)]
        for rows, name in zip(result, ("length", "rate"), strict=True):
            offsets = [
                offset
                for k in muscle_columns
                for offset in system.find_offsets(self._paths[k], (name,))
            ]
            rows[:, muscle_columns] = system.evaluate_moments(moments, offsets)
        return result

    def compute_responses(
        self, times: Array, values: Array, speeds: Array
    ) -> tuple[Array, Array, Array]:
        """Compute the accelerations of all coordinates in one pose as a linear function of forces.

        Args:
            times: time (1,), s.
            values: values of all coordinates (1, n).
            speeds: generalized speeds (1, n).

        Returns:
            Accelerations without actuators (n,), by a force of 1 of each actuator (n, a), and by a
            generalized force of 1 of each coordinate (n, n).
        """
        system = self._system
        order = list(self._system.order)
        udot, directions = self._project_accelerations(times, values, speeds, np.zeros_like(values))
        moments = np.column_stack([times, system.state.pack_rows(values, speeds)])
        required_forces, unit_forces, _ = system.compute_unit_forces(
            moments, np.ascontiguousarray(udot[:, order]), self._paths
        )
        size = len(order)
        # The forces for a unit acceleration of one coordinate, less those for none, are a column of
        # the mass matrix.
        trial_accelerations = np.vstack([np.zeros(size), np.eye(size)])
        trial_forces = system.compute_required_forces(
            np.repeat(moments, size + 1, axis=0), trial_accelerations
        )
        # With kinematic loops, `directions` has more columns than there are degrees of freedom. An
        # orthonormal basis of their span has the same motions and an invertible mass matrix.
        basis = find_column_basis(directions[0])
        mass = basis[order].T @ (trial_forces[1:] - trial_forces[0]).T @ basis[order]
        rhs = np.column_stack(
            [-required_forces[0], (unit_forces[0] / self.optimal_forces[:, None]).T]
        )
        responses = basis @ np.linalg.solve(mass, np.hstack([basis[order].T @ rhs, basis.T]))
        count = 1 + len(self.names)
        return udot[0] + responses[:, 0], responses[:, 1:count], responses[:, count:]

    def _project_accelerations(
        self, times: Array, values: Array, speeds: Array, target_accelerations: Array
    ) -> tuple[Array, Array]:
        """Return the accelerations that the constraints allow, and the directions of motion.

        With the constraints G udot = b, the coordinates are split into free ones (f) and held ones
        (h): udot_h = G_h⁺ (b - G_f udot_f). Where the constraints do not allow the given
        accelerations of free coordinates, the nearest ones are used.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).
            target_accelerations: requested accelerations (t, n); those of the free coordinates are used.

        Returns:
            Accelerations (t, n), and the motion of all coordinates with each free one (t, n, m).
        """
        size = len(self.mechanism.coordinates)
        free = self._free_indices
        directions = np.zeros((len(times), size, len(free)))
        directions[:, free, range(len(free))] = 1.0
        udot = target_accelerations.copy()
        if not self.mechanism.constraints:
            return udot, directions
        constraint_rows, drifts = self._compute_equations(times, values, speeds)
        # Locked coordinates belong neither to the state nor to the equations of the kernels.
        immobile = [index for index in range(size) if index not in self._system.order]
        immobile_rows = np.broadcast_to(np.eye(size)[immobile], (len(times), len(immobile), size))
        equations = np.concatenate([constraint_rows, immobile_rows], axis=1)
        targets = np.hstack([drifts, np.zeros((len(times), len(immobile)))])
        dependent = [index for index in range(size) if index not in free]
        # Redundant equations (closed loops) have no inverse.
        inverse = np.linalg.pinv(equations[:, :, dependent])
        # From G_held u_held + G_free u_free = 0: how the held coordinates follow each free one.
        directions[:, dependent] = -inverse @ equations[:, :, free]
        residuals = targets[..., None] - equations[:, :, free] @ target_accelerations[:, free, None]
        udot[:, dependent] = (inverse @ residuals)[..., 0]
        is_violated = np.abs(equations @ directions).max(axis=(1, 2), initial=0.0) > RATE_TOLERANCE
        is_fixed = np.linalg.matrix_rank(equations[:, :, dependent]) == len(dependent)
        # Frames in which the split does not work are rare (kinematic loops, singular poses) and are
        # solved singly.
        for row in np.flatnonzero(is_violated | ~is_fixed):
            udot[row], directions[row] = self._project_one(
                equations[row], targets[row], target_accelerations[row]
            )
        return udot, directions

    def _compute_equations(self, times: Array, values: Array, speeds: Array) -> tuple[Array, Array]:
        """Return the constraint equations at the level of accelerations.

        Args:
            times: times (t,), s.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).

        Returns:
            Rows G (t, c, n), and the required values b of G udot (t, c).
        """
        # Without forces, which the equations do not need.
        system = System(self.mechanism, Forces(()))
        size = values.shape[1]
        order = list(system.order)
        record_offset = int(system.structure[MODEL.CONSTRAINED])
        count = self.equation_count
        equations = np.zeros((len(times), count, size))
        if not count:
            return equations, np.zeros((len(times), 0))
        rows, drifts = (
            int(system.structure[record_offset + field])
            for field in (CONSTRAINED.WORK_ROWS, CONSTRAINED.WORK_DRIFTS)
        )
        moments = np.column_stack([times, system.state.pack_rows(values, speeds)])
        offsets = [*range(rows, rows + count * len(order)), *range(drifts, drifts + count)]
        results = system.evaluate_moments(moments, offsets, STAGE.ACCELERATION)
        equations[:, :, order] = results[:, :-count].reshape(len(times), count, -1)
        return equations, results[:, -count:]

    def _project_one(
        self, equations: Array, targets: Array, target_accelerations: Array
    ) -> tuple[Array, Array]:
        """Project the accelerations at one time onto the constraints by a singular value decomposition.

        It is for times at which the constrained coordinates do not follow from the free ones alone.

        Args:
            equations: rows G (c, n).
            targets: required values of G udot (c,).
            target_accelerations: requested accelerations (n,).

        Returns:
            Accelerations (n,), and the motion of all coordinates with each free one (n, m).

        Raises:
            UnsupportedError: some coordinates can move while all free ones rest.
        """
        _, singular_values, right_vectors = np.linalg.svd(equations)
        # Singular values are sorted, the largest first.
        rank = (
            int(np.sum(singular_values > RATE_TOLERANCE * singular_values[0]))
            if len(singular_values)
            else 0
        )
        # The null space of G: all motions that the constraints allow.
        directions = right_vectors[rank:].T
        free = directions[self._free_indices]
        if np.linalg.matrix_rank(free) < directions.shape[1]:
            names = [
                info.name
                for index, info in enumerate(self.mechanism.coordinates)
                if index not in self._free_indices
            ]
            raise UnsupportedError(
                f"the constraints leave {join_words(names)} undetermined while all other coordinates rest; "
                "lock or couple such coordinates"
            )
        # A particular solution of G udot = target, to which motions of the null space are added.
        start = np.linalg.pinv(equations) @ targets
        free_inverse = np.linalg.pinv(free)
        return start + directions @ (
            free_inverse @ (target_accelerations - start)[self._free_indices]
        ), directions @ free_inverse

    def report_forces(self, shared: SharedForces, values: Array, speeds: Array) -> StoTable:
        """Return the force records with the distributed actuator forces.

        Args:
            shared: the distribution.
            values: values of all coordinates (t, n).
            speeds: generalized speeds (t, n).

        Returns:
            The columns of OpenSim's ForceReporter, SI units.
        """
        elements, system = self._forces.elements, self._system
        labels = [label for item in elements for label in item.columns]
        owners = [item.path for item in elements for _ in item.columns]
        rows = np.zeros((len(shared.times), len(labels)))
        # Other forces than actuators, such as contacts, are computed from the states.
        if not {*owners} <= {*self._paths}:
            rows[:] = system.force_table(shared.times, system.state.pack_rows(values, speeds))
        actuator_of_path = {path: k for k, path in enumerate(self._paths)}
        actuator_columns = [
            column for column, path in enumerate(owners) if path in actuator_of_path
        ]
        rows[:, actuator_columns] = shared.forces[
            :, [actuator_of_path[owners[column]] for column in actuator_columns]
        ]
        return StoTable(FORCES_TITLE, shared.times, tuple(label_as_opensim(labels)), rows)


def find_column_basis(columns: Array) -> Array:
    """Return an orthonormal basis of the space that columns span.

    Args:
        columns: columns (n, m).

    Returns:
        Basis (n, r), r being the rank.
    """
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    result: Array = basis[:, sizes > RATE_TOLERANCE * sizes.max(initial=0.0)]
    return result


def minimize_effort(
    columns: Array, needed: Array, exponent: float, bounds: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Minimize the sum of |x|ᵖ subject to linear equations and bounds, for each frame.

    Args:
        columns: contribution of each entry of x (t, a, m).
        needed: required sums (t, m).
        exponent: p.
        bounds: lower and upper bounds of x (2, a).

    Returns:
        x (t, a), missing amounts (t, m), and whether nothing is missing (t,).
    """
    frames, count, size = columns.shape
    code = select_code()
    code.make_ready(("least_effort",))
    sizes = np.array([0, size, count, *[0] * (count * (size + 1))], dtype=np.int64)
    numbers = np.array([exponent, *bounds.ravel()])
    inputs = np.ascontiguousarray(np.hstack([columns.reshape(frames, -1), needed]))
    result = np.zeros((frames, count + size + 1))
    entry = code.get_entry("least_effort")
    work = np.zeros(effort_size(size, count))
    for rows in divide_rows("sharing forces between muscles", frames):
        sizes[0] = rows.stop - rows.start
        entry(sizes, numbers, inputs[rows], result[rows], work)
    return result[:, :count], result[:, count:-1], result[:, -1] == 1.0
