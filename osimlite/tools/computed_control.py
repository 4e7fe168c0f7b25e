"""Control that follows a motion window by window, for RRATool and CMCTool.

At the start of each window the tasks give accelerations that correct the errors. The actuator
forces for these accelerations are computed in the predicted pose at the end of the window, within
the forces that the actuators can reach by then. Root finding gives the controls that lead to these
forces. With them the model is integrated to the end of the window.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, nextafter
from typing import Any

import numpy as np

from osimlite.base.progress import report_progress
from osimlite.base.records import dataclass, field
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.mechanics.multibody.functions import PiecewiseConstant, SmoothFunction
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.control_sets import ControlLinear, ControlLinearNode, ControlSet
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.control_sets import EXCITATION, make_node_curve
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.run import Simulation
from osimlite.simulation.system import System
from osimlite.tools.job import Job
from osimlite.tools.root_solver import find_roots
from osimlite.tools.tracking import DesiredMotion, ForceDistribution, TrackingTasks

UNBOUNDED_CONTROL = 10_000.0
"""Bound of the controls of actuators without bounds."""
MIN_MUSCLE_BOUND = 0.02
"""Smallest lower bound of a muscle's control."""
MIN_MUSCLE_UPPER_BOUND = 1.0
"""Smallest upper bound of a muscle's control."""
CONTROL_TOLERANCE = 4e-3
"""Tolerance of the controls."""
MIN_FORCE_RANGE = 1.0
"""Smallest range of an actuator's force (N or N m); below it, the control is the lower bound."""
PREDICTION_TOLERANCE = 5e-8
"""Error of one step in the predicted states of actuators.

OpenSim's is 5e-6. With that, short fibers at small activations do not converge, and a muscle that is
longer by 1e-9 m gets another force by 5 N in the first window.
"""
MAX_PREDICTION_STEP_S = 1e-3
"""Longest step of the prediction, s."""
FIRST_WINDOW_S = 1e-8
"""First window of a model whose actuators have no states, s."""
SETTLING_TIME_S = 0.200
"""Time in which muscles settle in a fixed pose, s."""
FIRST_MUSCLE_WINDOW_S = 0.030
"""First window of a model with muscles, s."""
ASSEMBLY_TOLERANCE = 1e-10
"""Largest violation of the constraints in a predicted pose."""
SETTLING_CONTROL = 0.01
"""Control with which muscles settle before the motion."""


@dataclass(eq=False)
class ActuatorControl:
    """Control of an actuator: nodes over time, and bounds."""

    name: str
    is_step: bool
    low: Callable[[float], float]
    high: Callable[[float], float]
    default: tuple[float, float]
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    bounds: tuple[list[ControlLinearNode], list[ControlLinearNode]] = ((), ())  # type: ignore[assignment]

    @classmethod
    def create(cls, actuator: Any, bounds_set: ControlSet | None) -> ActuatorControl:
        """Return the control of an actuator.

        Args:
            actuator: actuator of the model.
            bounds_set: bounds from a document, by the name of the actuator; None without a document.
        """
        controls = (
            []
            if bounds_set is None
            else [control for control in bounds_set.objects if isinstance(control, ControlLinear)]
        )
        # Controls are named like the actuator, with or without the suffix of excitations.
        for name in (actuator.name + EXCITATION, actuator.name):
            bounds = next((control for control in controls if control.name == name), None)
            if bounds is not None:
                return cls._create_from_bounds(bounds)
        lower = (
            max(actuator.min_control, -UNBOUNDED_CONTROL)
            if actuator.min_control == -inf
            else actuator.min_control
        )
        upper = (
            min(actuator.max_control, UNBOUNDED_CONTROL)
            if actuator.max_control == inf
            else actuator.max_control
        )
        is_muscle = isinstance(actuator, Muscle)
        # The bounds of muscles are raised, so that no muscle is switched off.
        if is_muscle:
            lower, upper = max(lower, MIN_MUSCLE_BOUND), max(upper, MIN_MUSCLE_UPPER_BOUND)
        return cls(
            actuator.name + EXCITATION, is_muscle, lambda t: lower, lambda t: upper, (lower, upper)
        )

    @classmethod
    def _create_from_bounds(cls, control: ControlLinear) -> ActuatorControl:
        """Return the control of an actuator with the bounds of a document."""
        default = control.default_min, control.default_max
        # As in OpenSim, upper bounds have an effect only together with lower ones.
        curves = [
            make_node_curve(control, nodes) if nodes and control.min_nodes else None
            for nodes in (control.min_nodes, control.max_nodes)
        ]

        def create_bound(number: int) -> Callable[[float], float]:
            curve = curves[number]
            if curve is None:
                return lambda t: default[number]
            return lambda t: float(curve.evaluate(np.array([t]))[0])

        nodes = list(control.min_nodes), list(control.max_nodes)
        return cls(
            control.name, control.use_steps, create_bound(0), create_bound(1), default, bounds=nodes
        )

    def create_function(self) -> SmoothFunction:
        """Return the control as a function of time through all nodes."""
        if self.is_step:
            # A value holds up to and including its time.
            return PiecewiseConstant(
                (self.times[0], *(nextafter(t, inf) for t in self.times[:-1])), tuple(self.values)
            )
        t, v = np.array(self.times), np.array(self.values)
        # After the last node the control keeps its value.
        slopes = np.append(np.diff(v) / np.diff(t), 0.0)
        return PiecewisePolynomial(
            np.append(t[0], t), np.column_stack([np.append(v[0], v), np.append(0.0, slopes)])
        )

    def create_window_function(self, start: float, end: float, value: float) -> SmoothFunction:
        """Return the control as a function of time in one window.

        Args:
            start: start of the window, s; there the control has its last value.
            end: end of the window, s.
            value: control at the end of the window.
        """
        last_value = self.values[-1] if self.values else value
        if self.is_step:
            return PiecewiseConstant((start, nextafter(start, inf)), (last_value, value))
        last_time = self.times[-1] if self.times else start
        slope = (value - last_value) / (end - last_time) if self.times else 0.0
        return PiecewisePolynomial(np.array([last_time]), np.array([[last_value, slope]]))

    def create_document(self) -> ControlLinear:
        """Return the control as the object that OpenSim writes."""
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
class TrackedMotion:
    """Motion of a model that follows another motion.

    Attributes:
        times: start and the ends of all steps (t,), s.
        states: states (t, y).
        errors: errors of the tasks by the start of each window, s.
        failure: reason why the motion ended early; empty if it did not.
    """

    times: list[float] = field(default_factory=list)
    states: list[list[float]] = field(default_factory=list)
    errors: dict[float, Array] = field(default_factory=dict)
    failure: str = ""


class ComputedControl:
    """Controls of a model that follows a motion.

    Args:
        job: setup of the tool, with the paths of its files.
        simulation: simulation of the model of the setup.
        desired: motion to follow.
        tasks: weights and gains of the coordinates.
        sharing: distribution of forces over the actuators.
        controls: controls of all actuators.
        window: length of a window, s.
    """

    def __init__(
        self,
        job: Job,
        simulation: Simulation,
        desired: DesiredMotion,
        tasks: TrackingTasks,
        sharing: ForceDistribution,
        controls: Sequence[ActuatorControl],
        window: float,
    ) -> None:
        self.simulation = simulation
        self.desired = desired
        self.tasks = tasks
        self.sharing = sharing
        self.controls = list(controls)
        self.window = window
        self._job = job
        assert isinstance(simulation.engine, System)
        self.engine: Any = simulation.engine
        self._first = 2 * len(self.engine.order)
        names = simulation.forces.controls.names
        paths = {path.rpartition("/")[2]: path for path in names}
        self._paths = [paths[name] for name in sharing.names]
        self._actuation_offsets = [
            self.engine.find_offsets(path, ("actuation",))[0] for path in self._paths
        ]
        self._corrections = np.zeros((2, len(simulation.mechanism.coordinates)))
        self._poses: dict[float, list[float]] = {}
        self.has_states = self.engine.state.size > self._first

    def follow_motion(
        self, start: float, y: list[float], end: float, settings: EngineSettings
    ) -> TrackedMotion:
        """Return the motion from a state to a time, computed window by window.

        If the motion cannot be continued, the result ends early and names the reason in `failure`.

        Args:
            start: initial time, s.
            y: initial state, which may violate the constraints.
            end: final time, s.
            settings: tolerance and step sizes of the integrator.

        Raises:
            KeyboardInterrupt: the user stops the integration.
        """
        result = TrackedMotion()
        if not self.has_states:
            self.compute_controls(start, start + FIRST_WINDOW_S, y, result)
            if result.failure:
                return result
        y = self._project_state(start, y)
        result.times.append(start)
        result.states.append(list(y))

        def record_state(t: float, state: list[float]) -> None:
            result.times.append(t)
            result.states.append(state)

        t = start
        stepper = None
        while t < end:
            report_progress("tracking the motion", t - start, end - start, " s")
            target = t + self.window
            self.compute_controls(t, target, y, result)
            if result.failure:
                return result
            stop = min(target, end)
            try:
                # The integrator keeps its step size from window to window.
                if stepper is None:
                    stepper = self.engine.make_stepper(t, list(y), settings, record_state)
                stepper.tabulate([stop])
                stepper.catch_up()
            except SimulationError as error:
                result.failure = error.message
                return result
            if stepper.ended is not None:
                # A stop by the user is no failure of the motion.
                if isinstance(stepper.ended, KeyboardInterrupt):
                    raise stepper.ended
                result.failure = stepper.ended.message
                return result
            t, y = stepper.time, stepper.state
        return result

    def _project_state(self, t: float, y: Sequence[float]) -> list[float]:
        """Return the nearest state (y,) that satisfies the constraints."""
        if not self.simulation.constraints:
            return list(y)
        state = self.engine.state
        mechanism = self.simulation.mechanism
        q = mechanism.assemble(np.array(state.values(y)), t)
        u = mechanism.project_speeds(q, np.array(state.speeds(y)), t)
        result: list[float] = state.pack(q.tolist(), u.tolist(), y[self._first :])
        return result

    def compute_controls(
        self, t: float, target: float, y: Sequence[float], result: TrackedMotion
    ) -> Array:
        """Compute the controls of a window, and drive the model with them.

        Args:
            t: start of the window, s.
            target: end of the window, s.
            y: state (y,) at the start of the window.
            result: record to which errors and the reason of a failure are added.

        Returns:
            Controls (a,) at the end of the window.
        """
        state = self.engine.state
        q = np.array(state.values(y))
        u = np.array(state.speeds(y))
        desired_now, desired_ahead = self.desired.evaluate(np.array([t, target]))
        # The prediction adds the present deviation to the desired pose at the end of the window.
        self._corrections = np.stack([q - desired_now[0], u - desired_now[1]])
        errors = self.tasks.compute_errors(desired_now, q, u)
        result.errors[t] = errors[0]
        requested = self.tasks.compute_accelerations(errors, desired_ahead)
        lower, upper = (
            np.array([getattr(control, name)(t) for control in self.controls])
            for name in ("low", "high")
        )
        z = np.array(y[self._first :])
        self._poses.clear()
        # Forces that the actuators can reach by the end of the window.
        forces_at_lower = self._predict_forces(t, target, z, lower)
        forces_at_upper = self._predict_forces(t, target, z, upper)
        # The pose at the end of the window is predicted, not computed: it depends on the forces
        # sought.
        end = self._predict_state(target, z)
        # A control that hardly changes its force has no unique value: keep the lower bound.
        upper = np.where(forces_at_upper - forces_at_lower < MIN_FORCE_RANGE, lower, upper)
        q_end = np.array(state.values(end))
        u_end = np.array(state.speeds(end))
        bounds = (
            np.minimum(forces_at_lower, forces_at_upper),
            np.maximum(forces_at_lower, forces_at_upper),
        )
        forces, missing_accelerations = self.sharing.compute_forces(
            target, q_end, u_end, requested, errors[0], bounds
        )
        # The failure ends the tool; the motion so far is still written.
        if missing_accelerations:
            result.failure = (
                f"the actuators cannot produce the accelerations that the tasks need at {t:g} s; "
                f"missing: {missing_accelerations} (rad/s², m/s²). Append reserve actuators, widen "
                "the bounds of the controls, or lower the weights"
            )
            return lower
        if self.has_states:
            values = find_roots(
                lambda trial_controls: self._predict_forces(t, target, z, trial_controls) - forces,
                lower,
                upper,
                CONTROL_TOLERANCE,
            )
        else:
            # Without states the forces are proportional to the controls.
            values = forces / self.sharing.optimal
        self._drive_window(t, target, values)
        for control, value in zip(self.controls, values.tolist(), strict=True):
            # A window that is computed again replaces its earlier result.
            if control.times and control.times[-1] == target:
                del control.times[-1], control.values[-1]
            control.times.append(target)
            control.values.append(value)
        return values

    def _drive_window(self, t: float, target: float, values: Array) -> None:
        """Drive the model with controls of one window."""
        pairs = zip(self.controls, values.tolist(), strict=True)
        self._drive_functions(
            [control.create_window_function(t, target, value) for control, value in pairs]
        )

    def _drive_functions(self, functions: Sequence[SmoothFunction]) -> None:
        """Drive the model with a function of time for each actuator."""
        controls = self.simulation.forces.controls
        # Controls of the tool are added to those of the model's own controllers.
        self.engine.set_controls(
            controls.add_functions(dict(zip(self._paths, functions, strict=True)))
        )

    def drive_all_windows(self) -> None:
        """Drive the model with the computed controls of all windows."""
        self._drive_functions([control.create_function() for control in self.controls])

    def _predict_forces(self, t: float, target: float, z: Array, controls: Array) -> Array:
        """Predict the forces of the actuators at the end of a window.

        Args:
            t: start of the window, s.
            target: end of the window, s.
            z: auxiliary states at the start.
            controls: controls (a,) at the end.

        Returns:
            Forces (a,), N or N m.
        """
        if not self.has_states:
            return controls * self.sharing.optimal
        moment = [
            target,
            *self._predict_state(target, self._predict_auxiliary_states(t, target, z, controls)),
        ]
        return self.engine.evaluate_moments(
            np.array([moment]), self._actuation_offsets, STAGE.FORCE
        )[0]

    def _predict_state(self, t: float, z: Array) -> list[float]:
        """Return the predicted state (y,) at a time, with given auxiliary states."""
        if t not in self._poses:
            self._predict_poses([t], z)
        return [*self._poses[t], *z.tolist()]

    def _predict_poses(self, times: Sequence[float], z: Array) -> None:
        """Predict the poses at some times that are not in the cache.

        Evaluating the splines at several times takes as long as at one.

        Args:
            times: times, s.
            z: auxiliary states.
        """
        unknown = [t for t in times if t not in self._poses]
        if not unknown:
            return
        values, speeds = self.desired.evaluate_poses(unknown)
        for t, *pose in zip(unknown, values, speeds, strict=True):
            q, u = np.add(pose, self._corrections)
            y: list[float] = self.engine.state.pack(q.tolist(), u.tolist(), z.tolist())
            if self.simulation.constraints:
                y = self.engine.project_state(t, y, ASSEMBLY_TOLERANCE) or y
            self._poses[t] = y[: self._first]

    def _predict_auxiliary_states(
        self, t: float, target: float, z: Array, controls: Array, *, is_pose_fixed: bool = False
    ) -> Array:
        """Integrate the auxiliary states over a window along predicted poses, by Kutta-Merson's method.

        Only these states are integrated, since the task controller prescribes the accelerations.

        Args:
            t: start of the window, s.
            target: end of the window, s.
            z: auxiliary states at the start.
            controls: controls at the end.
            is_pose_fixed: whether the pose stays as at the start, while the muscles settle.

        Returns:
            Auxiliary states at the end.
        """
        self._drive_window(t, target, controls)
        count = len(z)

        def compute_rate(time: float, z: Array) -> Array:
            y = self._predict_state(t if is_pose_fixed else time, z)
            status = self.engine.realize(time, y, STAGE.FORCE)
            if status:
                raise self.engine.make_evaluation_error(status, time, y)
            return np.array(self.engine.get_derivative()[self._first :])

        step = min(MAX_PREDICTION_STEP_S, target - t)
        time = t
        while time < target:
            h = min(step, target - time)
            if not is_pose_fixed:
                self._predict_poses((time, time + h / 3, time + h / 2, time + h), z)
            # Stages of Kutta-Merson, with an error estimate from the embedded method.
            k1 = compute_rate(time, z)
            k2 = compute_rate(time + h / 3, z + h / 3 * k1)
            k3 = compute_rate(time + h / 3, z + h / 6 * (k1 + k2))
            k4 = compute_rate(time + h / 2, z + h / 8 * (k1 + 3 * k3))
            k5 = compute_rate(time + h, z + h / 2 * (k1 - 3 * k3 + 4 * k4))
            next_z = z + h / 6 * (k1 + 4 * k4 + k5)
            error_estimate = h * np.abs(2 * k1 - 9 * k3 + 8 * k4 - k5) / 30
            error = float(np.sqrt(np.sum(error_estimate**2) / count))
            # A step below 1 ns is accepted in any case, so that the prediction ends.
            if error <= PREDICTION_TOLERANCE or h < 1e-9:
                time = target if h == target - time else time + h
                z = next_z
            # Step control of a fourth-order method, with the usual limits of growth.
            factor = 0.9 * (PREDICTION_TOLERANCE / error) ** 0.25 if error else 5.0
            step = min(MAX_PREDICTION_STEP_S, h * min(5.0, max(0.1, factor)))
        return z

    def settle_muscles(
        self, start: float, y: list[float], result: TrackedMotion
    ) -> tuple[float, list[float]]:
        """Let muscles settle before the motion, and return its initial time and state.

        They settle twice at a small control, then at the control of the first window. The motion
        begins at the end of that window.

        Args:
            start: start of the motion to follow, s.
            y: initial state (y,).
            result: record to which errors and the reason of a failure are added.

        Returns:
            Time in s, and state (y,).
        """
        self._corrections[:] = 0.0
        self._poses.clear()
        z = np.array(y[self._first :])
        # Two rounds bring the states close to equilibrium at this control.
        small = np.full(len(self.controls), SETTLING_CONTROL)
        for _ in range(2):
            z = self._predict_auxiliary_states(
                start, start + SETTLING_TIME_S, z, small, is_pose_fixed=True
            )
        target = start + FIRST_MUSCLE_WINDOW_S
        for is_last in (False, True):
            for control in self.controls:
                control.times.clear()
                control.values.clear()
            values = self.compute_controls(start, target, [*y[: self._first], *z.tolist()], result)
            for control in self.controls:
                control.times.clear()
                control.values.clear()
            if result.failure:
                return start, y
            if not is_last:
                z = self._predict_auxiliary_states(
                    start, start + SETTLING_TIME_S, z, values, is_pose_fixed=True
                )
        y = self._predict_state(target, self._predict_auxiliary_states(start, target, z, values))
        for control, value in zip(self.controls, values.tolist(), strict=True):
            control.times, control.values = [target], [value]
        return target, y
