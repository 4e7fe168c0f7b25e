"""A motion that is given exactly: only actuators are left to be found, as with OpenSim's PositionMotion.

What the motion takes, what each actuator pushes and how long its path is are numbers over time
then, from the kernels. The laws of the actuators become formulas on a test bench: a model in which
each pulls a carriage of its own, whose place stands for the length of its path.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.derivatives.functions import casadi as functions_of
from osimlite.derivatives.symbols import casadi
from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.schema_functions import numeric
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.dynamics import Dynamics
from osimlite.optimal.point import Formula, Point, TimeFunction
from osimlite.optimal.tables import sample_function
from osimlite.schema.actuators import (
    ActivationCoordinateActuator,
    Actuator,
    CoordinateActuator,
    ScalarActuator,
)
from osimlite.schema.frames import Body
from osimlite.schema.joints import SliderJoint
from osimlite.schema.model import Model
from osimlite.schema.motions import PositionMotion
from osimlite.schema.muscles import Muscle
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.static_optimization import StaticOptimization, ideal

if TYPE_CHECKING:
    from pathlib import Path

    from osimlite.optimal.problem import Problem

Motion = Callable[[Array], Array]
"""At times (n,) values, rates and their rates (3, n, coordinates) of all coordinates of a mechanism."""
RELATIVE_ZERO = 1e-13
"""Part of the largest number that is none."""


def read_position_motion(part: PositionMotion, model: Model) -> Motion | str:
    """The motion of all coordinates of a model; the path of the first one without a function if there is one."""
    functions: dict[str, Any] = {item.name: item for item in part.functions.objects}
    paths = [info.path for info in build_mechanism(model).coordinates]
    missing = next((path for path in paths if path not in functions), None)
    if missing is not None:
        return missing
    own = [numeric(functions[path], 1, f"the function of '{path}'") for path in paths]

    def motion(times: Array) -> Array:
        return np.stack([sample_function(item, times) for item in own], axis=2)

    return motion


class PrescribedMotion:
    """What :class:`~osimlite.derivatives.functions.CasadiModel` is for a model that moves by itself, along a given motion.

    Args:
        model: without the motion.
        motion: of all its coordinates.
        folder: of the model's file.

    Attributes:
        mechanism: of the model.
        states: the auxiliary states alone, the only ones that are to be found.
        controls: of the actuators.
        bench: the functions of the test bench.
    """

    coordinates: tuple[str, ...] = ()

    def __init__(self, model: Model, motion: Motion, folder: Path) -> None:
        self.mechanism = build_mechanism(model, opensim_derivatives=True)
        self._motion = motion
        choices: dict[str, Any] = {"folder": folder}
        self._pushing = StaticOptimization(model, self.mechanism, muscles="isometric", **choices)
        self._pulling = StaticOptimization(model, self.mechanism, **choices)
        tree = model.tree()
        actuators = [item for item in model.components(Actuator) if item.appliesForce]
        self._paths = [tree.path_of(item) or "" for item in actuators]
        own = [_name_on_bench(k) for k in range(len(actuators))]
        self.bench = functions_of(build_test_bench(actuators, own))
        size = len(self.bench.coordinates)
        known = dict(zip(own, self._paths, strict=True))
        self.states = self.in_system = tuple(
            _rename_to_model(name, known) for name in self.bench.states[2 * size :]
        )
        self.controls = tuple(_rename_to_model(name, known) for name in self.bench.controls)
        # The carriages have an order of their own.
        names = [path.rpartition("/")[2] for path in self.bench.coordinates]
        self.carriages = [names.index(name) for name in own]
        self.path_names = tuple(self._paths)
        self.is_muscle = [isinstance(item, Muscle) for item in actuators]
        self.moving = self._pushing.moving
        self.constraints_kept = self._pushing.equation_count
        self.numbers = _cache_last(self._numbers)
        self._known, self._model, self._folder = known, model, folder

    def list_forces(self) -> list[tuple[str, Any]]:
        """The forces on the bench, by the paths of the model."""
        return [
            (_rename_to_model(item.path, self._known), item) for item in self.bench.forces.elements
        ]

    @property
    def outputs(self) -> Any:
        """None.

        Raises:
            UnsupportedError: always.
        """
        raise UnsupportedError(
            "goals of poses, outputs or markers are not computed where the motion is given"
        )

    frames = outputs

    def _numbers(self, times: Array) -> Array:
        """What is known at times (t,), one row each: lengths and speeds of m paths, what n
        coordinates need, what each of the paths gives each of them by 1 N, and the equations of the
        constraints.
        """
        values, speeds, accelerations = self._motion(times)
        needed, *matrices = self._pushing.balance(times, values, speeds, accelerations)
        lengths, rates = self._pulling.path_lengths(times, values, speeds)
        return np.hstack(
            [lengths, rates, needed, *(item.reshape(len(times), -1) for item in matrices)]
        )

    @cached_property
    def whole(self) -> Any:
        """Functions of the model, whose actuators push with as many N or N m as their controls say."""
        model = self._model.copy_deep()
        forces: Any = model.force_set.objects
        for place, item in enumerate(forces):
            if isinstance(item, ScalarActuator) and item.appliesForce:
                forces[place] = ideal(item, 1.0) or item
        return functions_of(model, folder=self._folder)

    def compute_linear_response(self, function: Callable[..., Any], times: Array) -> Array:
        """What depends on forces in a motion, at times (t,).

        Args: function: ``function(t, x, xdot, u, p, multipliers) -> (k, t)`` of `whole`, that has
            no squares of forces. times: s.

        Returns: One row each (t, (1 + a + c) k): without them, and what 1 N of each actuator and 1
            of each multiplier add.
        """
        whole, infos = self.whole, [info.path for info in self.mechanism.coordinates]
        order = [infos.index(path) for path in whole.coordinates]
        values, speeds, accelerations = (part[:, order].T for part in self._motion(times))
        x = np.tile(whole.x[:, None], len(times))
        x[: 2 * len(order)] = np.vstack([values, speeds])
        xdot = np.zeros_like(x)
        xdot[: 2 * len(order)] = np.vstack([speeds, accelerations])
        places, count = [whole.controls.index(path) for path in self._paths], len(self._paths)
        found = []
        for unit in np.eye(1 + count + self.constraints_kept):
            u = np.zeros(len(whole.controls))
            u[places] = unit[1 : 1 + count]
            found.append(np.array(function(times[None], x, xdot, u, [], unit[1 + count :])))
        found[1:] = [item - found[0] for item in found[1:]]
        return np.vstack(found).T

    def tabulate_states(self, times: Array) -> dict[str, Array]:
        """Values and speeds of all coordinates over time, by paths of states."""
        values, speeds, _ = self._motion(times)
        infos = self.mechanism.coordinates
        own = (
            (f"{info.path}/{what}", rows[:, k])
            for k, info in enumerate(infos)
            for what, rows in (("value", values), ("speed", speeds))
        )
        return dict(own)


class PrescribedDynamics(Dynamics):
    """The equations at a point of a motion that is given."""

    functions: Any

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.is_implicit, self._first_rate = False, 0
        if any(low != high for low, high in problem.times):
            raise problem.unsupported_error(
                problem.phase, "where the motion is given, initial and final time must be fixed"
            )
        given: PrescribedMotion = self.functions
        start, end = problem.times[0][0], problem.times[1][0]
        self._times = start + problem.grid.fractions * (end - start)
        self._entries = self._series(given.numbers)

    def _series(self, numbers: Callable[[Array], Array]) -> list[TimeFunction | None]:
        """Of numbers (t, m) at times (t,) those that are not zero: most actuators push few coordinates."""
        found = numbers(self._times)
        matters = np.abs(found).max(axis=0) > RELATIVE_ZERO * np.abs(found).max()
        return [
            self.problem.add_time_function(partial(_sample_column, numbers, k)) if own else None
            for k, own in enumerate(matters)
        ]

    def list_forces(self) -> list[tuple[str, Any]]:
        """The actuators, by their paths in the model."""
        return self.functions.list_forces()

    def compute_path_lengths(self, point: Point) -> tuple[Formula, Formula]:
        """As given."""
        count = len(self.functions.path_names)
        return self._known(point, 0, count), self._known(point, count, count)

    def _known(self, point: Point, first: int, count: int) -> Formula:
        return _stack_series(point, self._entries[first : first + count])

    def _residual(self, point: Point) -> Formula:
        """Of the bench, at rest but for its auxiliary states: what pulls its carriages, and the rates of the states."""
        bench = self.functions.bench
        lengths, speeds = self.compute_path_lengths(point)
        places = np.argsort(self.functions.carriages)
        x = casadi.vertcat(lengths[places.tolist()], speeds[places.tolist()], point.x)
        return bench.residual(
            point.t,
            x,
            casadi.SX.zeros(len(bench.states)),
            point.u,
            casadi.SX(0, 1),
            casadi.SX(0, 1),
        )

    def compute_rates(self, point: Point) -> Formula:
        """Of the auxiliary states."""
        count = len(self.functions.path_names)
        return self._insert_tendon_rates(point, -self._residual(point)[2 * count :])

    def compute_residuals(self, point: Point) -> tuple[list[str], Formula]:
        """What the motion takes and actuators and constraints do not give, and what tendons and fibers do not share."""
        names, errors = self.tendons.compute_residuals(point, point.derivatives)
        count, moving = len(self.functions.path_names), self.functions.moving
        first, size = 2 * count + len(moving), count * len(moving)
        needed = self._known(point, 2 * count, len(moving))
        pushes = casadi.reshape(self._known(point, first, size), count, -1).T
        bound = casadi.reshape(
            self._known(point, first + size, point.multipliers.numel() * len(moving)),
            len(moving),
            -1,
        )
        rows = needed - pushes @ self._forces(point) + bound @ point.multipliers
        return [*(f"{name} residual" for name in moving), *names], casadi.vertcat(rows, errors)

    def make_joint_load(self, path: str, side: str, frame: str) -> Callable[[Point], Formula]:
        """As the motion, the actuators and the constraints make it."""
        load = self.functions.whole.joint_load(path, side)
        turned = self.functions.whole.frames([frame])

        def function(t: Any, x: Any, xdot: Any, u: Any, p: Any, multipliers: Any) -> Any:
            turn = np.array(turned(t, x, p)[1]).T.reshape(-1, 3, 3)
            force, moment = (np.array(part) for part in load(t, x, xdot, u, p, multipliers))
            # Matrices stand column by column.
            return np.vstack([np.einsum("tij,jt->it", turn, part) for part in (moment, force)])

        return self._linear(function, 6)

    def make_generalized_forces(
        self, pushing: Sequence[str], coordinates: Sequence[str]
    ) -> Callable[[Point], Formula]:
        """As the motion and the actuators make them."""
        missing = self.functions.whole.generalized_forces(pushing)
        rows = [self.functions.whole.coordinates.index(path) for path in coordinates]
        return self._linear(lambda *given: np.array(missing(*given[:-1]))[rows], len(rows))

    def _linear(self, function: Callable[..., Array], size: int) -> Callable[[Point], Formula]:
        """Formulas (size, 1) of what forces make in the motion."""
        entries = self._series(
            _cache_last(partial(self.functions.compute_linear_response, function))
        )

        def formula(point: Point) -> Formula:
            given = casadi.vertcat(1.0, self._forces(point), point.multipliers)
            return casadi.reshape(_stack_series(point, entries), size, -1) @ given

        return formula

    def _forces(self, point: Point) -> Formula:
        """Of the actuators (m, 1), N or N m."""
        count = len(self.functions.path_names)
        pull = -self._residual(point)[count : 2 * count][self.functions.carriages]
        # Muscles shorten what they pull at.
        return casadi.vertcat(
            *(-pull[k] if muscle else pull[k] for k, muscle in enumerate(self.functions.is_muscle))
        )


def _stack_series(point: Point, entries: Sequence[TimeFunction | None]) -> Formula:
    """The numbers of series, of which those that are None are zero."""
    return casadi.vertcat(
        *(casadi.SX(1, 1) if entry is None else point.evaluate(entry) for entry in entries)
    )


def _cache_last(numbers: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """The same function of times, which keeps what it found last."""
    kept: list[Array] = []

    def known(times: Array) -> Array:
        if not kept or not np.array_equal(kept[0], times):
            kept[:] = times.copy(), numbers(times)
        return kept[1]

    return known


def _sample_column(numbers: Callable[[Array], Array], number: int, times: Array) -> Array:
    """One of the numbers of a motion, which is not asked for at other times than these."""
    found = numbers(times)[:, number]
    return np.stack([found, np.zeros_like(found), np.zeros_like(found)])


def build_test_bench(actuators: Sequence[Any], names: Sequence[str]) -> Model:
    """A model without gravity in which each actuator pulls at a carriage of its own.

    Args: actuators: muscles, and others whose force is proportional to their control or their
        activation. names: of each on the bench, of its carriage and of the coordinate.
    """
    model = Model(name="bench", gravity=(0.0, 0.0, 0.0))
    for item, name in zip(actuators, names, strict=True):
        body = Body(
            name=name, mass=1.0, mass_center=(0.0, 0.0, 0.0), inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
        )
        model.add(body)
        slider = SliderJoint(
            name=f"{name}_slider", socket_parent_frame=model.ground, socket_child_frame=body
        )
        slider.coordinates[0].name, slider.coordinates[0].default_value = name, 1.0
        model.add(slider)
        if isinstance(item, Muscle):
            own: Any = item.copy_deep()
            own.geometry_path = GeometryPath(name="path")
            for end, frame in enumerate(("/ground", f"/bodyset/{name}")):
                own.geometry_path.path_point_set.objects.append(
                    PathPoint(name=f"p{end}", socket_parent_frame=frame)
                )
        elif isinstance(item, ActivationCoordinateActuator):
            own = item.copy_deep()
            own.coordinate = name
        else:
            own = CoordinateActuator(coordinate=name, optimal_force=item.optimal_force)
        own.name = name
        model.add(own)
    return model


def _name_on_bench(number: int) -> str:
    return f"bench{number}"


def _rename_to_model(path: str, known: Mapping[str, str]) -> str:
    """A path on the bench as one of the model."""
    _, _, name, *rest = path.split("/")
    return "/".join([known[name], *rest])
