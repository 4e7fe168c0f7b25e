"""Problems with a prescribed motion, in which only actuators vary, as with OpenSim's PositionMotion.

The generalized forces that the motion needs, the moment arms of the actuators and the lengths of
their paths are numbers over time, which the kernels compute. The laws of the actuators become
CasADi formulas on a test bench: a model in which each actuator moves its own carriage, whose
coordinate is the length of the actuator's path.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.derivatives.functions import casadi as make_casadi_model
from osimlite.derivatives.symbols import casadi
from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.dynamics import Dynamics
from osimlite.optimal.point import Formula, PointSymbols, TimeFunction
from osimlite.optimal.point_functions import cache_last
from osimlite.optimal.tables import sample_function
from osimlite.schema.actuators import ActivationCoordinateActuator, CoordinateActuator
from osimlite.schema.forces import Actuator, ScalarActuator
from osimlite.schema.frames import Body
from osimlite.schema.joints import SliderJoint
from osimlite.schema.model import Model
from osimlite.schema.motions import PositionMotion
from osimlite.schema.muscles import Muscle
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.ideal_actuators import make_ideal_actuator
from osimlite.simulation.static_optimization import StaticOptimization

if TYPE_CHECKING:
    from pathlib import Path

    from osimlite.optimal.problem import Problem

Motion = Callable[[Array], Array]
"""Function of times (n,) that returns values, speeds and accelerations (3, n, coordinates) of a mechanism."""
RELATIVE_ZERO = 1e-13
"""Fraction of the largest number below which a number counts as zero."""


def read_position_motion(position_motion: PositionMotion, model: Model) -> Motion | str:
    """Return the motion of all coordinates of a PositionMotion.

    Args:
        position_motion: PositionMotion of the model.
        model: model whose coordinates the motion prescribes.

    Returns:
        The motion; instead the path of the first coordinate without a function if one has none.
    """
    functions: dict[str, Any] = {item.name: item for item in position_motion.functions.objects}
    paths = [info.path for info in build_mechanism(model).coordinates]
    missing = next((path for path in paths if path not in functions), None)
    if missing is not None:
        return missing
    coordinate_functions = [
        convert_function(functions[path], 1, f"the function of '{path}'") for path in paths
    ]

    def motion(times: Array) -> Array:
        return np.stack([sample_function(item, times) for item in coordinate_functions], axis=2)

    return motion


class PrescribedMotion:
    """Model along a prescribed motion, instead of a :class:`~osimlite.derivatives.functions.CasadiModel`.

    Args:
        model: model without the PositionMotion.
        motion: motion of all coordinates of the model.
        folder: folder of the model's file.

    Attributes:
        mechanism: mechanism of the model.
        coordinates: empty, as no coordinate varies.
        states: paths of the auxiliary states, the only ones that vary.
        system_states: paths of the auxiliary states in OpenSim's order.
        controls: paths of the controls of the actuators.
        bench: CasADi functions of the test bench.
        carriages: index of each actuator's carriage among the coordinates of the bench.
        path_names: paths of the actuators.
        is_muscle: whether each actuator is a muscle.
        moving: names of the coordinates that can move.
        constraint_count: number of equations of the model's constraints.
        numbers: function `_tabulate_numbers`, which caches the result for the last times.
    """

    coordinates: tuple[str, ...] = ()

    def __init__(self, model: Model, motion: Motion, folder: Path) -> None:
        self.mechanism = build_mechanism(model, opensim_derivatives=True)
        self._motion = motion
        options: dict[str, Any] = {"folder": folder}
        # Two systems: with isometric muscles a force is the tension along the path, and only the
        # complete muscles have path lengths.
        self._force_balance = StaticOptimization(
            model, self.mechanism, muscles="isometric", **options
        )
        self._path_geometry = StaticOptimization(model, self.mechanism, **options)
        tree = model.tree()
        actuators = [actuator for actuator in model.components(Actuator) if actuator.appliesForce]
        self._paths = [tree.path_of(actuator) or "" for actuator in actuators]
        bench_names = [_name_on_bench(k) for k in range(len(actuators))]
        # Paths of the model contain slashes and may repeat names, so that the bench has names of
        # its own.
        self.bench = make_casadi_model(build_test_bench(actuators, bench_names))
        size = len(self.bench.coordinates)
        model_path_by_name = dict(zip(bench_names, self._paths, strict=True))
        self.states = self.system_states = tuple(
            _rename_to_model(name, model_path_by_name) for name in self.bench.states[2 * size :]
        )
        self.controls = tuple(
            _rename_to_model(name, model_path_by_name) for name in self.bench.controls
        )
        # The coordinates of the bench may have another order than the actuators.
        names = [path.rpartition("/")[2] for path in self.bench.coordinates]
        self.carriages = [names.index(name) for name in bench_names]
        self.path_names = tuple(self._paths)
        self.is_muscle = [isinstance(actuator, Muscle) for actuator in actuators]
        self.moving = self._force_balance.moving
        self.constraint_count = self._force_balance.equation_count
        self.numbers = cache_last(self._tabulate_numbers)
        self._model_paths = model_path_by_name
        self._model = model
        self._folder = folder

    def list_forces(self) -> list[tuple[str, Any]]:
        """Return the forces on the bench with their paths in the model."""
        return [
            (_rename_to_model(element.path, self._model_paths), element)
            for element in self.bench.forces.elements
        ]

    @property
    def outputs(self) -> Any:
        """Raise the error that outputs are not available.

        Raises:
            UnsupportedError: always.
        """
        raise UnsupportedError(
            "goals on poses, outputs or markers are not supported with a prescribed motion"
        )

    frames = outputs

    def _tabulate_numbers(self, times: Array) -> Array:
        """Compute the numbers of the motion at times (t,), one row each.

        A row holds lengths (m) and speeds (m/s) of m paths, the generalized forces that n
        coordinates need, the generalized forces (n, m) of the actuators with 1 N each, and the
        Jacobian G (c, n) of the constraints; matrices row by row.

        Returns:
            Numbers (t, k).
        """
        values, speeds, accelerations = self._motion(times)
        required_forces, *matrices = self._force_balance.compute_balance(
            times, values, speeds, accelerations
        )
        lengths, rates = self._path_geometry.compute_path_lengths(times, values, speeds)
        return np.hstack(
            [
                lengths,
                rates,
                required_forces,
                *(matrix.reshape(len(times), -1) for matrix in matrices),
            ]
        )

    @cached_property
    def force_model(self) -> Any:
        """CasADi functions of the model in which the control of each actuator is its force, N or N m."""
        model = self._model.copy_deep()
        forces: Any = model.force_set.objects
        for index, force in enumerate(forces):
            if isinstance(force, ScalarActuator) and force.appliesForce:
                forces[index] = make_ideal_actuator(force, 1.0) or force
        return make_casadi_model(model, folder=self._folder)

    def compute_linear_response(self, function: Callable[..., Any], times: Array) -> Array:
        """Compute the linear dependence of a function on forces along the motion.

        Args:
            function: ``function(t, x, xdot, u, p, multipliers) -> (k, t)`` of `force_model`, linear
                in the forces.
            times: times (t,), s.

        Returns:
            One row per time (t, (1 + a + c) k): the value without forces, and the change by 1 N of
            each of a actuators and by 1 of each of c multipliers.
        """
        force_model = self.force_model
        infos = [info.path for info in self.mechanism.coordinates]
        order = [infos.index(path) for path in force_model.coordinates]
        values, speeds, accelerations = (
            motion_values[:, order].T for motion_values in self._motion(times)
        )
        x = np.tile(force_model.x[:, None], len(times))
        x[: 2 * len(order)] = np.vstack([values, speeds])
        xdot = np.zeros_like(x)
        xdot[: 2 * len(order)] = np.vstack([speeds, accelerations])
        indices = [force_model.controls.index(path) for path in self._paths]
        count = len(self._paths)
        responses = []
        # A linear function is known by its value without forces and with each force alone.
        for unit in np.eye(1 + count + self.constraint_count):
            u = np.zeros(len(force_model.controls))
            u[indices] = unit[1 : 1 + count]
            responses.append(np.array(function(times[None], x, xdot, u, [], unit[1 + count :])))
        # Less the value without forces, which every row contains.
        responses[1:] = [response - responses[0] for response in responses[1:]]
        return np.vstack(responses).T

    def tabulate_states(self, times: Array) -> dict[str, Array]:
        """Tabulate values and speeds of all coordinates.

        Args:
            times: times (t,), s.

        Returns:
            Values (t,) by the path of the state; m, rad, m/s, rad/s.
        """
        values, speeds, _ = self._motion(times)
        infos = self.mechanism.coordinates
        columns = (
            (f"{info.path}/{quantity}", rows[:, k])
            for k, info in enumerate(infos)
            for quantity, rows in (("value", values), ("speed", speeds))
        )
        return dict(columns)


class PrescribedDynamics(Dynamics):
    """Equations at a point of a prescribed motion.

    Args:
        problem: problem with a prescribed motion.

    Raises:
        UnsupportedError: the initial or the final time varies.
    """

    functions: Any

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        # No accelerations vary, whatever multibody_dynamics_mode says, as in Moco.
        self.is_implicit, self._first_rate = False, 0
        # The numbers of the motion are tabulated once, at the times of the grid.
        if any(lower != upper for lower, upper in problem.times):
            raise problem.make_unsupported_error(
                problem.phase, "initial and final time must be fixed with a prescribed motion"
            )
        prescribed_motion: PrescribedMotion = self.functions
        start = problem.times[0][0]
        end = problem.times[1][0]
        self._times = start + problem.grid.fractions * (end - start)
        self._entries = self._add_series(prescribed_motion.numbers)

    def _add_series(self, numbers: Callable[[Array], Array]) -> list[TimeFunction | None]:
        """Add functions of time for numbers that change along the motion.

        Most actuators act on few coordinates, so that most numbers are zero at all times.

        Args:
            numbers: function of times (t,) that returns numbers (t, m).

        Returns:
            Function of time for each number; None for one that is zero at all times.
        """
        motion_numbers = numbers(self._times)
        significant = (
            np.abs(motion_numbers).max(axis=0) > RELATIVE_ZERO * np.abs(motion_numbers).max()
        )
        return [
            self.problem.add_time_function(partial(_sample_column, numbers, k))
            if is_significant
            else None
            for k, is_significant in enumerate(significant)
        ]

    def list_forces(self) -> list[tuple[str, Any]]:
        """Return the actuators with their paths in the model."""
        return self.functions.list_forces()

    def compute_path_lengths(self, point: PointSymbols) -> tuple[Formula, Formula]:
        """Return the prescribed lengths and speeds of the actuators' paths.

        Args:
            point: point of the grid.

        Returns:
            Lengths (m, 1), m, and lengthening speeds (m, 1), m/s.
        """
        count = len(self.functions.path_names)
        return self._select_entries(point, 0, count), self._select_entries(point, count, count)

    def _select_entries(self, point: PointSymbols, first_index: int, count: int) -> Formula:
        """Return the column of `count` numbers of the motion from the index `first_index` on."""
        return _stack_series(point, self._entries[first_index : first_index + count])

    def _compute_bench_residual(self, point: PointSymbols) -> Formula:
        """Compute the residual of the test bench with all rates at zero.

        Returns:
            Residuals (n, 1) in the order of the bench's states: those of the carriages' speeds are
            the forces on the carriages, and those of the auxiliary states their rates, both with
            the negative sign.
        """
        bench = self.functions.bench
        lengths, speeds = self.compute_path_lengths(point)
        # From the order of the actuators to that of the bench's coordinates.
        indices = np.argsort(self.functions.carriages)
        x = casadi.vertcat(lengths[indices.tolist()], speeds[indices.tolist()], point.x)
        return bench.residual(
            point.t,
            x,
            casadi.SX.zeros(len(bench.states)),
            point.u,
            casadi.SX(0, 1),
            casadi.SX(0, 1),
        )

    def compute_rates(self, point: PointSymbols) -> Formula:
        """Compute the rates of the auxiliary states (n, 1), the only states.

        Returns:
            Formula of the rates.
        """
        count = len(self.functions.path_names)
        return self._insert_tendon_rates(point, -self._compute_bench_residual(point)[2 * count :])

    def compute_residuals(self, point: PointSymbols) -> tuple[list[str], Formula]:
        """Compute the generalized forces that actuators and constraints leave missing, and tendon residuals.

        Args:
            point: point of the grid.

        Returns:
            Names of the residuals, and the residuals (k, 1).
        """
        names, errors = self.tendons.compute_residuals(point, point.derivatives)
        count = len(self.functions.path_names)
        free_coordinates = self.functions.moving
        first_entry = 2 * count + len(free_coordinates)
        size = count * len(free_coordinates)
        required_forces = self._select_entries(point, 2 * count, len(free_coordinates))
        # CasADi fills matrices column by column, so that rows of the table become columns; hence
        # the transpose.
        actuator_matrix = casadi.reshape(
            self._select_entries(point, first_entry, size), count, -1
        ).T
        constraint_jacobian = casadi.reshape(
            self._select_entries(
                point, first_entry + size, point.multipliers.numel() * len(free_coordinates)
            ),
            len(free_coordinates),
            -1,
        )
        # Multipliers push with -Gᵀ multipliers here, as in StaticOptimization.
        rows = (
            required_forces
            - actuator_matrix @ self._compute_actuator_forces(point)
            + constraint_jacobian @ point.multipliers
        )
        return [*(f"{name} residual" for name in free_coordinates), *names], casadi.vertcat(
            rows, errors
        )

    def make_joint_load(
        self, path: str, side: str, frame: str
    ) -> Callable[[PointSymbols], Formula]:
        """Return the function of a point for the load of a joint in the motion, (6, 1).

        Args:
            path: path of the joint.
            side: "parent" or "child", the body on which the load acts.
            frame: path of the frame along whose axes the load is expressed.
        """
        load = self.functions.force_model.joint_load(path, side)
        compute_frame = self.functions.force_model.frames([frame])

        def function(t: Any, x: Any, xdot: Any, u: Any, p: Any, multipliers: Any) -> Any:
            rotation = np.array(compute_frame(t, x, p)[1]).T.reshape(-1, 3, 3)
            force, moment = (np.array(vectors) for vectors in load(t, x, xdot, u, p, multipliers))
            # CasADi flattens matrices column by column.
            return np.vstack(
                [np.einsum("tij,jt->it", rotation, vectors) for vectors in (moment, force)]
            )

        return self._make_linear_formula(function, 6)

    def make_generalized_forces(
        self, pushing: Sequence[str], coordinates: Sequence[str]
    ) -> Callable[[PointSymbols], Formula]:
        """Return the function of a point for the generalized forces that the motion needs, (k, 1).

        Args:
            pushing: paths of the forces that act; gravity acts as well.
            coordinates: paths of the coordinates.
        """
        compute_forces = self.functions.force_model.generalized_forces(pushing)
        rows = [self.functions.force_model.coordinates.index(path) for path in coordinates]
        return self._make_linear_formula(
            lambda *arguments: np.array(compute_forces(*arguments[:-1]))[rows], len(rows)
        )

    def _make_linear_formula(
        self, function: Callable[..., Array], size: int
    ) -> Callable[[PointSymbols], Formula]:
        """Return the function of a point for a column (size, 1) that depends linearly on forces.

        Args:
            function: function for :meth:`PrescribedMotion.compute_linear_response`.
            size: number k of results of the function.
        """
        entries = self._add_series(
            cache_last(partial(self.functions.compute_linear_response, function))
        )

        def formula(point: PointSymbols) -> Formula:
            # 1 multiplies the value without forces.
            forces_and_multipliers = casadi.vertcat(
                1.0, self._compute_actuator_forces(point), point.multipliers
            )
            return casadi.reshape(_stack_series(point, entries), size, -1) @ forces_and_multipliers

        return formula

    def _compute_actuator_forces(self, point: PointSymbols) -> Formula:
        """Compute the forces of the actuators (m, 1), N or N m; tensions of muscles are positive.

        Returns:
            Formula of the forces.
        """
        count = len(self.functions.path_names)
        force = -self._compute_bench_residual(point)[count : 2 * count][self.functions.carriages]
        # Muscles pull the carriage back, so that a positive force has the other sign.
        return casadi.vertcat(
            *(
                -force[k] if muscle else force[k]
                for k, muscle in enumerate(self.functions.is_muscle)
            )
        )


def _stack_series(point: PointSymbols, entries: Sequence[TimeFunction | None]) -> Formula:
    """Return the column of values of functions of time; None stands for zero."""
    return casadi.vertcat(
        *(casadi.SX(1, 1) if entry is None else point.evaluate(entry) for entry in entries)
    )


def _sample_column(numbers: Callable[[Array], Array], number: int, times: Array) -> Array:
    """Return value and derivatives (3, n) of one number of the motion.

    The derivatives are zero: the times of a prescribed motion are fixed, and no others are
    evaluated.
    """
    column = numbers(times)[:, number]
    return np.stack([column, np.zeros_like(column), np.zeros_like(column)])


def build_test_bench(actuators: Sequence[Any], names: Sequence[str]) -> Model:
    """Build a model without gravity in which each actuator moves its own carriage.

    Args:
        actuators: muscles, and actuators with a force proportional to their control or activation.
        names: name of each actuator on the bench, of its carriage and of the coordinate.

    Returns:
        The model; body, coordinate and force of each actuator have its name.
    """
    model = Model(name="bench", gravity=(0.0, 0.0, 0.0))
    for actuator, name in zip(actuators, names, strict=True):
        body = Body(
            name=name, mass=1.0, mass_center=(0.0, 0.0, 0.0), inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
        )
        model.add(body)
        slider = SliderJoint(
            name=f"{name}_slider", socket_parent_frame=model.ground, socket_child_frame=body
        )
        slider.coordinates[0].name = name
        # A path of length zero would have no direction.
        slider.coordinates[0].default_value = 1.0
        model.add(slider)
        if isinstance(actuator, Muscle):
            bench_force: Any = actuator.copy_deep()
            bench_force.geometry_path = GeometryPath(name="path")
            for end, frame in enumerate(("/ground", f"/bodyset/{name}")):
                bench_force.geometry_path.path_point_set.objects.append(
                    PathPoint(name=f"p{end}", socket_parent_frame=frame)
                )
        elif isinstance(actuator, ActivationCoordinateActuator):
            bench_force = actuator.copy_deep()
            bench_force.coordinate = name
        else:
            bench_force = CoordinateActuator(coordinate=name, optimal_force=actuator.optimal_force)
        bench_force.name = name
        model.add(bench_force)
    return model


def _name_on_bench(number: int) -> str:
    """Return the name of an actuator on the bench."""
    return f"bench{number}"


def _rename_to_model(path: str, model_path_by_name: Mapping[str, str]) -> str:
    """Return a path on the bench as a path of the model."""
    _, _, name, *suffix_names = path.split("/")
    return "/".join([model_path_by_name[name], *suffix_names])
