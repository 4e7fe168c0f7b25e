"""Control that is computed window by window, so that a model follows a motion: what RRATool and CMCTool share.

At the start of each window the tasks say which accelerations make up for the errors. Forces of the
actuators that give these are found in the pose that is expected at its end, within what the
actuators can do by then; and the controls that bring the actuators there. The model moves by them
to the end of the window.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, nextafter
from typing import Any

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.mechanics.multibody.functions import Function, PiecewiseConstant
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.control_sets import ControlLinear, ControlLinearNode, ControlSet
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.control_sets import EXCITATION, node_curve
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.run import Simulation
from osimlite.simulation.system import System
from osimlite.tools.job import Job
from osimlite.tools.root_solver import roots
from osimlite.tools.tracking import Desired, Sharing, Tasks

WIDEST, LEAST_MUSCLE, GREATEST_MUSCLE = 10_000.0, 0.02, 1.0
"""Controls of actuators without bounds, and what the bounds of muscles may not be above and below."""
TOLERANCE = 4e-3
"""Of the controls."""
FORCE_RANGE = 1.0
"""N or N m; the control of an actuator that can change its force by less is the smallest."""
ACCURACY, LONGEST = 5e-6, 1e-3
"""Of the states of actuators that are foreseen, and their longest step, s."""
FIRST_WINDOW, HELD, EARLY = 1e-8, 0.200, 0.030
"""Windows (s): the first of actuators without states; in which states come to rest; and the first of muscles."""
ASSEMBLED = 1e-10
"""How far from the constraints a pose may be that is foreseen."""
AT_REST = 0.01
"""Control of muscles that come to rest."""


@dataclass(eq=False)
class Control:
    """The control of an actuator: its nodes, and the bounds of each."""

    name: str
    is_step: bool
    low: Callable[[float], float]
    high: Callable[[float], float]
    default: tuple[float, float]
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    bounds: tuple[list[ControlLinearNode], list[ControlLinearNode]] = ((), ())  # type: ignore[assignment]

    @classmethod
    def of(cls, actuator: Any, given: ControlSet | None) -> Control:
        """Of an actuator, and of what a document of bounds says of it."""
        own = (
            []
            if given is None
            else [item for item in given.objects if isinstance(item, ControlLinear)]
        )
        for name in (actuator.name + EXCITATION, actuator.name):
            found = next((item for item in own if item.name == name), None)
            if found is not None:
                return cls._bounded(found)
        low = (
            max(actuator.min_control, -WIDEST)
            if actuator.min_control == -inf
            else actuator.min_control
        )
        high = (
            min(actuator.max_control, WIDEST)
            if actuator.max_control == inf
            else actuator.max_control
        )
        is_muscle = isinstance(actuator, Muscle)
        if is_muscle:
            low, high = max(low, LEAST_MUSCLE), max(high, GREATEST_MUSCLE)
        return cls(
            actuator.name + EXCITATION, is_muscle, lambda t: low, lambda t: high, (low, high)
        )

    @classmethod
    def _bounded(cls, found: ControlLinear) -> Control:
        default = found.default_min, found.default_max
        # As in OpenSim, upper bounds count only where there are lower ones.
        curves = [
            node_curve(found, nodes) if nodes and found.min_nodes else None
            for nodes in (found.min_nodes, found.max_nodes)
        ]

        def bound(number: int) -> Callable[[float], float]:
            curve = curves[number]
            if curve is None:
                return lambda t: default[number]
            return lambda t: float(curve.evaluate(np.array([t]))[0])

        nodes = list(found.min_nodes), list(found.max_nodes)
        return cls(found.name, found.use_steps, bound(0), bound(1), default, bounds=nodes)

    def function(self) -> Function:
        """Of time, through all nodes."""
        if self.is_step:
            # A value holds up to its own time, that included.
            return PiecewiseConstant(
                (self.times[0], *(nextafter(t, inf) for t in self.times[:-1])), tuple(self.values)
            )
        t, v = np.array(self.times), np.array(self.values)
        slopes = np.append(np.diff(v) / np.diff(t), 0.0)
        return PiecewisePolynomial(
            np.append(t[0], t), np.column_stack([np.append(v[0], v), np.append(0.0, slopes)])
        )

    def within(self, start: float, end: float, value: float) -> Function:
        """Of time, in a window at whose end it has a value; at its start it has the last one."""
        last = self.values[-1] if self.values else value
        if self.is_step:
            return PiecewiseConstant((start, nextafter(start, inf)), (last, value))
        before = self.times[-1] if self.times else start
        slope = (value - last) / (end - before) if self.times else 0.0
        return PiecewisePolynomial(np.array([before]), np.array([[last, slope]]))

    def document(self) -> ControlLinear:
        """As OpenSim writes it."""
        return ControlLinear(
            name=self.name,
            use_steps=self.is_step,
            default_min=self.default[0],
            default_max=self.default[1],
            x_nodes=[
                ControlLinearNode(t=t, value=v)
                for t, v in zip(self.times, self.values, strict=True)
            ],
            min_nodes=list(self.bounds[0]),
            max_nodes=list(self.bounds[1]),
        )


@dataclass(eq=False)
class Followed:
    """What came out.

    Attributes:
        times: of the start and the ends of all steps (t,), s.
        states: (t, y).
        errors: start of each window (s) with the errors of the tasks.
        failure: what ended the motion before its end; empty if nothing did.
    """

    times: list[float] = field(default_factory=list)
    states: list[list[float]] = field(default_factory=list)
    errors: dict[float, Array] = field(default_factory=dict)
    failure: str = ""


class ComputedControl:
    """The controls of a model that follows a motion.

    Args:
        job: the setup.
        simulation: of its model.
        desired: the motion.
        tasks: how closely it is followed.
        sharing: which forces do it.
        controls: of all actuators.
        window: length of a window, s.
    """

    def __init__(
        self,
        job: Job,
        simulation: Simulation,
        desired: Desired,
        tasks: Tasks,
        sharing: Sharing,
        controls: Sequence[Control],
        window: float,
    ) -> None:
        self.simulation, self.desired, self.tasks, self.sharing = (
            simulation,
            desired,
            tasks,
            sharing,
        )
        self.controls, self.window, self._job = list(controls), window, job
        assert isinstance(simulation.engine, System)
        self.engine: Any = simulation.engine
        self._first = 2 * len(self.engine.order)
        names = simulation.forces.controls.names
        paths = {path.rpartition("/")[2]: path for path in names}
        self._paths = [paths[name] for name in sharing.names]
        self._places = [self.engine.places_of(path, ("actuation",))[0] for path in self._paths]
        self._corrections = np.zeros((2, len(simulation.mechanism.coordinates)))
        self._poses: dict[float, list[float]] = {}
        self.has_states = self.engine.state.size > self._first

    # ----------------------------------------------------------------------------------------------- windows
    def follow(self, start: float, y: list[float], end: float, settings: Settings) -> Followed:
        """Follow the motion from a state to a time; the state need not fulfil the constraints."""
        result = Followed()
        if not self.has_states:
            self.compute(start, start + FIRST_WINDOW, y, result)
            if result.failure:
                return result
        y = self._project(start, y)
        result.times.append(start)
        result.states.append(list(y))

        def note(t: float, state: list[float]) -> None:
            result.times.append(t)
            result.states.append(state)

        t, stepper = start, None
        while t < end:
            target = t + self.window
            self.compute(t, target, y, result)
            if result.failure:
                return result
            stop = min(target, end)
            try:
                if stepper is None:
                    stepper = self.engine.stepper(t, list(y), settings, note)
                stepper.table([stop])
                stepper.catch_up()
            except SimulationError as error:
                result.failure = error.message
                return result
            if stepper.ended is not None:
                if isinstance(stepper.ended, KeyboardInterrupt):
                    raise stepper.ended
                result.failure = stepper.ended.message
                return result
            t, y = stepper.time, stepper.state
        return result

    def _project(self, t: float, y: Sequence[float]) -> list[float]:
        """Return the nearest state (y,) that fulfils the constraints, first its values, then its speeds."""
        if not self.simulation.constraints:
            return list(y)
        state, mechanism = self.engine.state, self.simulation.mechanism
        q = mechanism.assemble(np.array(state.values(y)), t)
        u = mechanism.project_speeds(q, np.array(state.speeds(y)), t)
        result: list[float] = state.pack(q.tolist(), u.tolist(), y[self._first :])
        return result

    def compute(self, t: float, target: float, y: Sequence[float], result: Followed) -> Array:
        """The controls (a,) of a window, which its motion is driven by from now on."""
        state = self.engine.state
        q, u = np.array(state.values(y)), np.array(state.speeds(y))
        now, ahead = self.desired.at(np.array([t, target]))
        self._corrections = np.stack([q - now[0], u - now[1]])
        errors = self.tasks.errors(now, q, u)
        result.errors[t] = errors[0]
        wanted = self.tasks.accelerations(errors, ahead)
        low, high = (
            np.array([getattr(item, name)(t) for item in self.controls]) for name in ("low", "high")
        )
        z = np.array(y[self._first :])
        self._poses.clear()
        least, most = self._forces(t, target, z, low), self._forces(t, target, z, high)
        end = self._posed(target, z)
        high = np.where(most - least < FORCE_RANGE, low, high)
        q_end, u_end = np.array(state.values(end)), np.array(state.speeds(end))
        bounds = np.minimum(least, most), np.maximum(least, most)
        forces, lacking = self.sharing.forces(target, q_end, u_end, wanted, errors[0], bounds)
        if lacking:
            result.failure = (
                f"the actuators cannot give the accelerations that the tasks need at {t:g} s: they lack {lacking} "
                "(rad/s², m/s²); append reserve actuators, widen their controls, or lower the weights"
            )
            return low
        if self.has_states:
            values = roots(lambda x: self._forces(t, target, z, x) - forces, low, high, TOLERANCE)
        else:
            values = forces / self.sharing.optimal
        self._drive(t, target, values)
        for item, value in zip(self.controls, values.tolist(), strict=True):
            # What is computed again takes the place of what was computed before.
            if item.times and item.times[-1] == target:
                del item.times[-1], item.values[-1]
            item.times.append(target)
            item.values.append(value)
        return values

    def _drive(self, t: float, target: float, values: Array) -> None:
        pairs = zip(self.controls, values.tolist(), strict=True)
        self._drive_by([item.within(t, target, value) for item, value in pairs])

    def _drive_by(self, functions: Sequence[Function]) -> None:
        controls = self.simulation.forces.controls
        self.engine.drive(controls.driven(dict(zip(self._paths, functions, strict=True))))

    def drive_through(self) -> None:
        """Have the model driven by all controls that were found, at every time."""
        self._drive_by([item.function() for item in self.controls])

    # ----------------------------------------------------------------------------------------------- foresight
    def _forces(self, t: float, target: float, z: Array, controls: Array) -> Array:
        """Forces of the actuators (a,) at the end of a window with controls (a,) there, from auxiliary states z on."""
        if not self.has_states:
            return controls * self.sharing.optimal
        moment = [target, *self._posed(target, self._aged(t, target, z, controls))]
        return self.engine.looked(np.array([moment]), self._places, STAGE.FORCE)[0]

    def _posed(self, t: float, z: Array) -> list[float]:
        """The state (y,) on the way that is foreseen."""
        if t not in self._poses:
            self._foresee([t], z)
        return [*self._poses[t], *z.tolist()]

    def _foresee(self, times: Sequence[float], z: Array) -> None:
        """Find the poses of some times that are not known yet: the splines of several take as long as those of one."""
        unknown = [t for t in times if t not in self._poses]
        if not unknown:
            return
        values, speeds = self.desired.poses(unknown)
        for t, *pose in zip(unknown, values, speeds, strict=True):
            q, u = np.add(pose, self._corrections)
            y: list[float] = self.engine.state.pack(q.tolist(), u.tolist(), z.tolist())
            if self.simulation.constraints:
                y = self.engine.projected(t, y, ASSEMBLED) or y
            self._poses[t] = y[: self._first]

    def _aged(
        self, t: float, target: float, z: Array, controls: Array, *, held: bool = False
    ) -> Array:
        """Auxiliary states at the end of a window, by Merson's method on the poses that are foreseen.

        Args:
            t, target: start and end of the window, s.
            z: at its start.
            controls: at its end.
            held: whether the pose stays as it is at the start, while the muscles come to rest.
        """
        self._drive(t, target, controls)
        count = len(z)

        def rate(time: float, z: Array) -> Array:
            y = self._posed(t if held else time, z)
            status = self.engine.realize(time, y, STAGE.FORCE)
            if status:
                raise self.engine.refusal(status, time, y)
            return np.array(self.engine.found()[self._first :])

        step, time = min(LONGEST, target - t), t
        while time < target:
            h = min(step, target - time)
            if not held:
                self._foresee((time, time + h / 3, time + h / 2, time + h), z)
            k1 = rate(time, z)
            k2 = rate(time + h / 3, z + h / 3 * k1)
            k3 = rate(time + h / 3, z + h / 6 * (k1 + k2))
            k4 = rate(time + h / 2, z + h / 8 * (k1 + 3 * k3))
            k5 = rate(time + h, z + h / 2 * (k1 - 3 * k3 + 4 * k4))
            new = z + h / 6 * (k1 + 4 * k4 + k5)
            off = h * np.abs(2 * k1 - 9 * k3 + 8 * k4 - k5) / 30
            error = float(np.sqrt(np.sum(off**2) / count))
            if error <= ACCURACY or h < 1e-9:
                time, z = (target if h == target - time else time + h), new
            factor = 0.9 * (ACCURACY / error) ** 0.25 if error else 5.0
            step = min(LONGEST, h * min(5.0, max(0.1, factor)))
        return z

    def at_rest(self, start: float, y: list[float], result: Followed) -> tuple[float, list[float]]:
        """When and in which state the motion of a model with muscles begins.

        They come to rest twice at a small control, then at that of the first window; the motion
        begins at its end.
        """
        self._corrections[:] = 0.0
        self._poses.clear()
        z = np.array(y[self._first :])
        small = np.full(len(self.controls), AT_REST)
        for _ in range(2):
            z = self._aged(start, start + HELD, z, small, held=True)
        target = start + EARLY
        for last in (False, True):
            for item in self.controls:
                item.times.clear()
                item.values.clear()
            values = self.compute(start, target, [*y[: self._first], *z.tolist()], result)
            for item in self.controls:
                item.times.clear()
                item.values.clear()
            if result.failure:
                return start, y
            if not last:
                z = self._aged(start, start + HELD, z, values, held=True)
        y = self._posed(target, self._aged(start, target, z, values))
        for item, value in zip(self.controls, values.tolist(), strict=True):
            item.times, item.values = [target], [value]
        return target, y
