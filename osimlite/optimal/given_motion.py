"""A motion that is given exactly: only actuators are left to be found, as with OpenSim's PositionMotion.

What the motion takes, what each actuator pushes and how long its path is are numbers over time then, from the kernels.
The laws of the actuators become formulas on a test bench: a model in which each pulls a carriage of its own, whose
place stands for the length of its path.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.backends.functions import casadi as functions_of
from osimlite.backends.symbols import casadi
from osimlite.errors import UnsupportedError
from osimlite.multibody import build_mechanism
from osimlite.multibody.schema_functions import numeric
from osimlite.multibody.spatial import Array
from osimlite.optimal.dynamics import Dynamics
from osimlite.optimal.point import Formula, Point
from osimlite.optimal.tables import over_time
from osimlite.schema.actuators import ActivationCoordinateActuator, Actuator, CoordinateActuator
from osimlite.schema.frames import Body
from osimlite.schema.joints import SliderJoint
from osimlite.schema.model import Model
from osimlite.schema.motions import PositionMotion
from osimlite.schema.muscles import Muscle
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.static_optimization import StaticOptimization

if TYPE_CHECKING:
    from pathlib import Path

    from osimlite.optimal.problem import Problem

Motion = Callable[[Array], Array]
"""At times (n,) values, rates and their rates (3, n, coordinates) of all coordinates of a mechanism."""
NOTHING = 1e-13
"""Part of the largest number that is none."""


def motion_of(part: PositionMotion, model: Model) -> Motion | str:
    """The motion of all coordinates of a model; the path of the first one without a function if there is one."""
    functions: dict[str, Any] = {item.name: item for item in part.functions.objects}
    paths = [info.path for info in build_mechanism(model).coordinates]
    missing = next((path for path in paths if path not in functions), None)
    if missing is not None:
        return missing
    own = [numeric(functions[path], 1, f"the function of '{path}'") for path in paths]

    def motion(times: Array) -> Array:
        return np.stack([over_time(item, times) for item in own], axis=2)

    return motion


class GivenMotion:
    """What :class:`~osimlite.backends.functions.CasadiModel` is for a model that moves by itself, along a given motion.

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
    constraints_kept = 0

    def __init__(self, model: Model, motion: Motion, folder: Path) -> None:
        self.mechanism = build_mechanism(model, opensim_derivatives=True)
        self._motion = motion
        choices: dict[str, Any] = {"folder": folder}
        self._pushing = StaticOptimization(model, self.mechanism, muscles="isometric", **choices)
        self._pulling = StaticOptimization(model, self.mechanism, **choices)
        tree = model.tree()
        actuators = [item for item in model.components(Actuator) if item.appliesForce]
        self._paths = [tree.path_of(item) or "" for item in actuators]
        own = [_name(k) for k in range(len(actuators))]
        self.bench = functions_of(bench_of(actuators, own))
        size = len(self.bench.coordinates)
        known = dict(zip(own, self._paths, strict=True))
        self.states = self.in_system = tuple(_renamed(name, known) for name in self.bench.states[2 * size :])
        self.controls = tuple(_renamed(name, known) for name in self.bench.controls)
        # The carriages have an order of their own.
        names = [path.rpartition("/")[2] for path in self.bench.coordinates]
        self.carriages = [names.index(name) for name in own]
        self.path_names = tuple(self._paths)
        self.is_muscle = [isinstance(item, Muscle) for item in actuators]
        self.balanced = tuple(self._pushing.coordinates)
        self._found: tuple[Array, Array] | None = None
        self._known = known

    def elements(self) -> list[tuple[str, Any]]:
        """The forces on the bench, by the paths of the model."""
        return [(_renamed(item.path, self._known), item) for item in self.bench.forces.elements]

    @property
    def outputs(self) -> Any:
        """None.

        Raises:
            UnsupportedError: always.
        """
        raise UnsupportedError("goals of poses, forces or markers are not computed where the motion is given")

    frames = joint_load = generalized_forces = outputs

    def numbers(self, times: Array) -> Array:
        """What is known at times (t,), one row each: lengths and speeds of m paths, what n coordinates need, and what
        each of the paths gives each of them by 1 N."""
        if self._found is None or not np.array_equal(self._found[0], times):
            self._found = times.copy(), self._numbers(times)
        return self._found[1]

    def _numbers(self, times: Array) -> Array:
        values, speeds, accelerations = self._motion(times)
        needed, pushes = self._pushing.balance(times, values, speeds, accelerations)
        lengths, rates = self._pulling.path_lengths(times, values, speeds)
        return np.hstack([lengths, rates, needed, pushes.reshape(len(times), -1)])

    def inserted(self, times: Array) -> dict[str, Array]:
        """Values and speeds of all coordinates over time, by paths of states."""
        values, speeds, _ = self._motion(times)
        infos = self.mechanism.coordinates
        own = ((f"{info.path}/{what}", rows[:, k]) for k, info in enumerate(infos)
               for what, rows in (("value", values), ("speed", speeds)))  # fmt: skip
        return dict(own)


class GivenDynamics(Dynamics):
    """The equations at a point of a motion that is given."""

    functions: Any

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.is_implicit, self._first_rate = False, 0
        if any(low != high for low, high in problem.times):
            raise problem.refused(problem.phase, "where the motion is given, initial and final time must be fixed")
        given: GivenMotion = self.functions
        start, end = problem.times[0][0], problem.times[1][0]
        found = given.numbers(start + problem.grid.places * (end - start))
        # Most actuators push few coordinates.
        matters = np.abs(found).max(axis=0) > NOTHING * np.abs(found).max()
        self._entries = [
            problem.given(partial(_column, given, number)) if matters[number] else None
            for number in range(found.shape[1])
        ]

    def elements(self) -> list[tuple[str, Any]]:
        """The actuators, by their paths in the model."""
        return self.functions.elements()

    def path_lengths(self, point: Point) -> tuple[Formula, Formula]:
        """As given."""
        count = len(self.functions.path_names)
        return self._known(point, 0, count), self._known(point, count, count)

    def _known(self, point: Point, first: int, count: int) -> Formula:
        entries = self._entries[first : first + count]
        return casadi.vertcat(*(casadi.SX(1, 1) if entry is None else point.at(entry) for entry in entries))

    def _residual(self, point: Point) -> Formula:
        """Of the bench, at rest but for its auxiliary states: what pulls its carriages, and the rates of the states."""
        bench = self.functions.bench
        lengths, speeds = self.path_lengths(point)
        places = np.argsort(self.functions.carriages)
        x = casadi.vertcat(lengths[places.tolist()], speeds[places.tolist()], point.x)
        return bench.residual(point.t, x, casadi.SX.zeros(len(bench.states)), point.u, casadi.SX(0, 1), casadi.SX(0, 1))

    def rates(self, point: Point) -> Formula:
        """Of the auxiliary states."""
        count = len(self.functions.path_names)
        return self._with_rates(point, -self._residual(point)[2 * count :])

    def residuals(self, point: Point) -> tuple[list[str], Formula]:
        """What the motion takes and the actuators do not give, and what tendons and fibers do not share."""
        names, errors = self.tendons.residuals(point, point.derivatives)
        count, balanced = len(self.functions.path_names), self.functions.balanced
        pull = -self._residual(point)[count : 2 * count][self.functions.carriages]
        # Muscles shorten what they pull at.
        forces = casadi.vertcat(*(-pull[k] if muscle else pull[k] for k, muscle in enumerate(self.functions.is_muscle)))
        needed = self._known(point, 2 * count, len(balanced))
        pushes = casadi.reshape(self._known(point, 2 * count + len(balanced), count * len(balanced)), count, -1).T
        rows = needed - pushes @ forces
        return [*(f"{name} residual" for name in balanced), *names], casadi.vertcat(rows, errors)


def _column(given: GivenMotion, number: int, times: Array) -> Array:
    """One of the numbers of a motion, which is not asked for at other times than these."""
    found = given.numbers(times)[:, number]
    return np.stack([found, np.zeros_like(found), np.zeros_like(found)])


def bench_of(actuators: Sequence[Any], names: Sequence[str]) -> Model:
    """A model without gravity in which each actuator pulls at a carriage of its own.

    Args:
        actuators: muscles, and others whose force is proportional to their control or their activation.
        names: of each on the bench, of its carriage and of the coordinate.
    """
    model = Model(name="bench", gravity=(0.0, 0.0, 0.0))
    for item, name in zip(actuators, names, strict=True):
        body = Body(name=name, mass=1.0, mass_center=(0.0, 0.0, 0.0), inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
        model.add(body)
        slider = SliderJoint(name=f"{name}_slider", socket_parent_frame=model.ground, socket_child_frame=body)
        slider.coordinates[0].name, slider.coordinates[0].default_value = name, 1.0
        model.add(slider)
        if isinstance(item, Muscle):
            own: Any = item.copy_deep()
            own.geometry_path = GeometryPath(name="path")
            for end, frame in enumerate(("/ground", f"/bodyset/{name}")):
                own.geometry_path.path_point_set.objects.append(PathPoint(name=f"p{end}", socket_parent_frame=frame))
        elif isinstance(item, ActivationCoordinateActuator):
            own = item.copy_deep()
            own.coordinate = name
        else:
            own = CoordinateActuator(coordinate=name, optimal_force=item.optimal_force)
        own.name = name
        model.add(own)
    return model


def _name(number: int) -> str:
    return f"bench{number}"


def _renamed(path: str, known: Mapping[str, str]) -> str:
    """A path on the bench as one of the model."""
    _, _, name, *rest = path.split("/")
    return "/".join([known[name], *rest])
