"""Problem of RRA and CMC: motion to follow, tasks, and distribution of forces over actuators."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.base.text import add_article, join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import SampledCurves, derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tools.tracking import CMC_Joint, CMC_TaskSet, CMCTool, RRATool
from osimlite.simulation.lowpass import extend_ends, filter_lowpass_by_sinc
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.simulation.run import Simulation
from osimlite.simulation.static_optimization import minimize_effort
from osimlite.tools.dynamics_setup import build_static_optimization, satisfy_constraints
from osimlite.tools.job import Job, NotRunnable
from osimlite.tools.outcome import Outcome

PADDING_ROWS = 60
"""Number of rows that OpenSim adds at each end of the motion."""
FILTER_ORDER = 50
"""Order of OpenSim's filter."""
LIMIT_WIDTH = 0.1
"""Fraction of a task's `limit` over which the weight of the forces falls."""
ACCELERATION_TOLERANCE = 1e-9
"""Largest missing part of the accelerations, relative to the accelerations of all forces."""
MIN_FORCE_WEIGHT = 1e-6
"""Smallest weight of the forces; a positive one makes the solution unique."""
MIN_STRENGTH = 1e-9
"""Smallest strength, relative to the greatest force, of a muscle that takes part."""
LOCK_TOLERANCE = 1e-6
"""Difference (rad or m) between a lock and a desired motion above which a message is due."""
RANK_TOLERANCE = 1e-10
"""Smallest eigenvalue, relative to the largest, that counts as positive."""


@dataclass(frozen=True, eq=False)
class DesiredMotion:
    """Motion to follow, as in OpenSim: splines of degree five.

    Attributes:
        start: first measured time, s.
        end: last measured time, s.
        times: times of the padded and filtered rows (t,), s.
        values: values of all coordinates (t, n), rad and m, which satisfy the constraints.
        speeds: generalized speeds (t, n).
        accelerations: derivatives of the speeds (t, n).
    """

    start: float
    end: float
    times: Array
    values: Array
    speeds: Array
    accelerations: Array

    @classmethod
    def read(
        cls, job: Job, outcome: Outcome, simulation: Simulation, model: Model
    ) -> DesiredMotion:
        """Return the motion that a setup names, padded and filtered.

        Args:
            job: setup of the tool, with the paths of its files.
            outcome: outcome to which messages are added.
            simulation: simulation of the model.
            model: model of the simulation.

        Raises:
            OsimliteError: osimlite cannot read or follow the motion.
        """
        setup: RRATool | CMCTool = job.setup
        if job.find_path("desired_points_file") is not None:
            raise job.create_unsupported_error(
                "osimlite cannot track points yet; leave desired_points_file empty"
            )
        mechanism = simulation.mechanism
        recorded = RecordedMotion.read(mechanism, job.require_path("desired_kinematics_file"))
        if recorded.missing:
            indices = [
                k for k, info in enumerate(mechanism.coordinates) if info.name in recorded.missing
            ]
            recorded.values[:, indices] = 0.0
            outcome.add_message(
                "not in the file", f"{join_words(recorded.missing)}: 0 is used, as in OpenSim"
            )
        start = float(recorded.times[0])
        end = float(recorded.times[-1])
        # OpenSim pads by reflection, so that the filter has no transient at the ends.
        times = extend_ends(recorded.times, PADDING_ROWS)
        values = extend_ends(recorded.values, PADDING_ROWS)
        if setup.lowpass_cutoff_frequency >= 0.0:
            times, values = filter_lowpass_by_sinc(
                times, values, setup.lowpass_cutoff_frequency, FILTER_ORDER
            )
        _apply_locks(outcome, mechanism, recorded, values)
        padded = replace(recorded, times=times, values=values)
        # OpenSim uses the rates of the coordinates as speeds, before the constraints change the
        # values.
        values, speeds = satisfy_constraints(padded, padded.rates[0], simulation, model)
        # OpenSim assembles every row of the desired motion at time 0, so a prescribed coordinate
        # has one value in all rows.
        for index, info in enumerate(mechanism.coordinates):
            if info.prescribed is not None:
                values[:, index] = info.prescribed.evaluate((0.0,))[0]
        (accelerations,) = derivatives_of_samples(times, speeds, times, (1,))
        return cls(start, end, times, values, speeds, accelerations)

    @cached_property
    def _curves(self) -> tuple[SampledCurves, SampledCurves]:
        """Splines through the values, and through speeds and accelerations."""
        size = self.values.shape[1]
        return SampledCurves(self.times, self.values), SampledCurves(
            self.times, np.hstack([self.speeds, self.accelerations]).reshape(-1, 2 * size)
        )

    def evaluate_poses(self, times: Sequence[float]) -> tuple[Array, Array]:
        """Evaluate the coordinates at some times.

        Args:
            times: k times, s.

        Returns:
            Values (k, n) and their rates (k, n).
        """
        q, rates = self._curves[0].derivatives(times, (0, 1))
        return q, rates

    def evaluate(self, times: Array | float) -> Array:
        """Return values, rates, speeds and accelerations (k, 4, n) at some times (k,) in s."""
        moments = np.atleast_1d(times)
        q, rates = self._curves[0].derivatives(moments, (0, 1))
        (derivatives,) = self._curves[1].derivatives(moments, (0,))
        return np.stack([q, rates, *np.split(derivatives, 2, axis=1)], axis=1)


def _apply_locks(
    outcome: Outcome, mechanism: Mechanism, recorded: RecordedMotion, values: Array
) -> None:
    """Replace the desired motion of locked coordinates, as in OpenSim, and report differences.

    Args:
        outcome: outcome to which messages are added.
        mechanism: mechanism of the model.
        recorded: motion of the file.
        values: values of the padded rows (t, n), changed in place.
    """
    for index, info in enumerate(mechanism.coordinates):
        if not info.locked:
            continue
        values[:, index] = info.default_value
        deviation = float(np.abs(info.default_value - recorded.values[:, index]).max())
        if info.name not in recorded.missing and deviation > LOCK_TOLERANCE:
            unit = "rad" if info.motion_type == "rotational" else "m"
            outcome.add_message(
                info.name,
                f"locked at {info.default_value:g} {unit}, up to {deviation:.3g} {unit} from the "
                "desired motion; as in OpenSim, the coordinate stays locked, and a task for it "
                "has no effect",
            )


class CoordinateTask(NamedTuple):
    """Coordinate that follows a desired coordinate.

    Attributes:
        name: name of the task.
        coordinate: index of the coordinate that follows.
        reference_index: index of the coordinate whose desired motion it follows.
        weight: weight of the task.
        kp: gain of the position error, 1/s².
        kv: gain of the speed error, 1/s.
        ka: factor of the desired acceleration.
        limit: error above which forces do not count; 0 for no limit.
    """

    name: str
    coordinate: int
    reference_index: int
    weight: float
    kp: float
    kv: float
    ka: float
    limit: float


@dataclass(frozen=True)
class TrackingTasks:
    """All active tasks."""

    tasks: tuple[CoordinateTask, ...]

    @classmethod
    def read(cls, job: Job, mechanism: Mechanism) -> TrackingTasks:
        """Return the tasks of a setup.

        Args:
            job: setup of the tool, with the paths of its files.
            mechanism: mechanism of the model.

        Raises:
            NotRunnable: a task is of another class than CMC_Joint.
            DocumentError: no task is active, or one names no coordinate or lacks a property.
        """
        path = job.require_path("task_set_file")
        result = []
        names = mechanism.coordinate_names
        for task in job.read_object(path, CMC_TaskSet).objects:
            # Subclasses would be tracked by other rules.
            if type(task) is not CMC_Joint:
                message = f"the task '{task.name}' is {add_article(type(task).__name__)}, which osimlite cannot track yet"
                raise NotRunnable(message, file=str(path))
            for property_name in ("active", "weight", "kp", "kv", "ka"):
                if not getattr(task, property_name):
                    raise job.create_error(
                        f"the task '{task.name}' of '{path}' has an empty '{property_name}'; set a value"
                    )
            # The name of a task selects the desired motion, `coordinate` the coordinate that follows it.
            for property_name, name in (("name", task.name), ("coordinate", str(task.coordinate))):
                if name not in names:
                    raise job.create_error(
                        f"the {property_name} of the task '{task.name}' of '{path}' must be that of a "
                        f"coordinate; there is no coordinate '{name}'{suggest_name(name, names)}"
                    )
            # As in OpenSim, `on` has no effect.
            if not task.active[0]:
                continue
            weight, kp, kv, ka = (
                float(getattr(task, property_name)[0])
                for property_name in ("weight", "kp", "kv", "ka")
            )
            index = names.index(str(task.coordinate))
            desired_index = names.index(task.name)
            result.append(
                CoordinateTask(task.name, index, desired_index, weight, kp, kv, ka, task.limit)
            )
        if not result:
            raise job.create_error(
                f"no task of '{path}' is active; set the first of its 'active' to true"
            )
        return cls(tuple(result))

    @property
    def coordinates(self) -> list[int]:
        """Indices of the coordinates that follow."""
        return [task.coordinate for task in self.tasks]

    @property
    def weights(self) -> Array:
        """Weights of all tasks (k,)."""
        return np.array([task.weight for task in self.tasks])

    def compute_errors(self, desired: Array, q: Array, u: Array) -> tuple[Array, Array]:
        """Compute how far values and speeds are behind the desired motion.

        Args:
            desired: values, rates, speeds and accelerations of the desired motion (4, n).
            q: values of the coordinates (n,), rad or m.
            u: generalized speeds (n,).

        Returns:
            Errors of the values and of the speeds, each (k,) for k tasks.
        """
        followers = self.coordinates
        desired_indices = [task.reference_index for task in self.tasks]
        return desired[0, desired_indices] - q[followers], desired[2, desired_indices] - u[
            followers
        ]

    def compute_accelerations(self, errors: tuple[Array, Array], desired: Array) -> Array:
        """Return the accelerations (k,) that correct errors: ka u̇ + kv ėrr + kp err.

        Args:
            errors: errors of values and speeds.
            desired: desired motion (4, n) at the end of the window.
        """
        kp, kv, ka = np.array([(task.kp, task.kv, task.ka) for task in self.tasks]).T
        accelerations: Array = ka * desired[3, [task.reference_index for task in self.tasks]]
        return accelerations + kv * errors[1] + kp * errors[0]

    def compute_force_weight(self, errors: Array) -> float:
        """Return the weight of the forces, which falls as errors approach the limits of tasks."""
        result = 1.0
        for task, error in zip(self.tasks, np.abs(errors).tolist(), strict=True):
            if task.limit:
                distance = (error - task.limit) / (LIMIT_WIDTH * task.limit)
                # A logistic function of the distance to the limit; exp overflows beyond 709.
                result = min(result, 1.0 - 1.0 / (1.0 + math.exp(-max(distance, -700.0))))
        return result


class ForceDistribution:
    """Distribution of the tasks' accelerations over the forces of actuators.

    Args:
        job: setup of the tool, with the paths of its files.
        model: model of the setup.
        mechanism: mechanism of the model.
        tasks: tasks to fulfil.
        exact: whether the accelerations are constraints and the squared forces the objective;
            otherwise the squares of both are minimized.
    """

    def __init__(
        self, job: Job, model: Model, mechanism: Mechanism, tasks: TrackingTasks, exact: bool
    ) -> None:
        self.tasks = tasks
        self.exact = exact
        self.mechanism = mechanism
        # Only the tasks are to be fulfilled: as in OpenSim, there may be more coordinates than
        # actuators, such as those of a loop that constraints close.
        self._unit = build_static_optimization(
            job, model, mechanism, muscles="isometric", underactuated=True
        )
        self._strong = (
            build_static_optimization(job, model, mechanism, underactuated=True) if exact else None
        )
        self.names = self._unit.names
        self.optimal = self._unit.optimal_forces
        if not self.optimal.all():
            lame = [name for name, force in zip(self.names, self.optimal, strict=True) if not force]
            raise job.create_error(
                f"{join_words(lame)}: an actuator with an optimal force of 0 has no force; set a "
                "positive optimal force"
            )

    def compute_responses(self, t: float, q: Array, u: Array) -> tuple[Array, Array, Array]:
        """Compute the accelerations of all coordinates at a state.

        Args:
            t: time, s.
            q: values of the coordinates (n,), rad or m.
            u: generalized speeds (n,).

        Returns:
            Accelerations without actuator forces (n,), by each actuator force (n, a), and by each
            generalized force (n, n) of 1 N or N m.
        """
        times = np.array([t])
        values = q[None]
        speeds = u[None]
        return self._unit.compute_responses(times, values, speeds)

    def compute_forces(
        self,
        t: float,
        q: Array,
        u: Array,
        requested: Array,
        errors: Array,
        bounds: tuple[Array, Array],
    ) -> tuple[Array, str]:
        """Compute actuator forces within bounds that give the requested accelerations of the tasks.

        Args:
            t: time, s.
            q: values of the coordinates (n,), rad or m.
            u: generalized speeds (n,).
            requested: requested accelerations (k,).
            errors: errors of the tasks (k,).
            bounds: lower and upper bounds of the forces (a,).

        Returns:
            Forces (a,), and the missing accelerations in words; "" if none is missing.
        """
        free_accelerations, responses, lightness = self.compute_responses(t, q, u)
        followers = self.tasks.coordinates
        columns = responses[followers]
        missing_accelerations = requested - free_accelerations[followers]
        if self.exact:
            return self._compute_exact_forces(
                t,
                q,
                u,
                columns,
                missing_accelerations,
                lightness[np.ix_(followers, followers)],
                bounds,
            )
        # Squares of errors and of forces are minimized together, so weights enter by their roots.
        weights = np.sqrt(self.tasks.weights)
        force_weight = math.sqrt(self.tasks.compute_force_weight(errors))
        # The acceleration errors are unknowns as well, and their squares are minimized together with
        # those of the forces.
        size = len(followers)
        scale = self.optimal / max(force_weight, MIN_FORCE_WEIGHT)
        matrix = np.hstack([weights[:, None] * columns * scale, np.eye(size)])
        unbounded = np.full(size, np.inf)
        scaled_bounds = np.hstack(
            [np.sort(np.array(bounds) / scale, axis=0), [-unbounded, unbounded]]
        )
        solution, _, _ = minimize_effort(
            matrix.T[None], (weights * missing_accelerations)[None], 2.0, scaled_bounds
        )
        return solution[0, : len(scale)] * scale, ""

    def _compute_exact_forces(
        self,
        t: float,
        q: Array,
        u: Array,
        columns: Array,
        accelerations: Array,
        lightness: Array,
        bounds: tuple[Array, Array],
    ) -> tuple[Array, str]:
        """Compute the smallest forces that give the accelerations exactly.

        Args:
            t: time, s.
            q: values of the coordinates (n,), rad or m.
            u: generalized speeds (n,).
            columns: accelerations of the tasks by each force (k, a).
            accelerations: accelerations that the forces must give (k,).
            lightness: accelerations of the tasks by each generalized force (k, k).
            bounds: lower and upper bounds of the forces (a,).

        Returns:
            Forces (a,), and the missing accelerations in words; "" if none is missing.
        """
        assert self._strong is not None
        strengths = self._strong.compute_strengths(np.array([t]), q[None], u[None])
        # Forces of muscles whose fibers have no strength have infinite cost: they are as small as
        # their bounds allow.
        able = np.abs(strengths) > MIN_STRENGTH * np.abs(self.optimal)
        forces = np.clip(0.0, *bounds)
        # Forces cannot change the acceleration of a locked coordinate.
        infos = [self.mechanism.coordinates[k] for k in self.tasks.coordinates]
        has_target = (self.tasks.weights != 0.0) & ~np.array([info.locked for info in infos])
        responses = columns[has_target][:, able]
        target = (accelerations - columns[:, ~able] @ forces[~able])[has_target]
        scale = strengths[able]
        scaled = np.sort(np.array(bounds)[:, able] / scale, axis=0)
        # Accelerations of feet and of the pelvis differ by orders of magnitude, and every force
        # changes all of them. Multiplied by the mass matrix of the tasks, they become generalized
        # forces, so that small reserves count beside strong muscles.
        mass = np.linalg.pinv(
            lightness[np.ix_(has_target, has_target)], RANK_TOLERANCE, hermitian=True
        )
        rows = np.ascontiguousarray((mass @ (responses * scale)).T)
        result, _, solved = minimize_effort(rows[None], (mass @ target)[None], 2.0, scaled)
        forces[able] = result[0] * scale
        deficits = target - responses @ forces[able]
        if (
            solved[0]
            and (
                np.abs(deficits)
                <= ACCELERATION_TOLERANCE * (np.abs(responses) @ np.abs(forces[able]))
            ).all()
        ):
            return forces, ""
        names = [
            task.name if info.prescribed is None else f"{task.name} (which is prescribed)"
            for task, info, counts in zip(self.tasks.tasks, infos, has_target, strict=True)
            if counts
        ]
        deficit_sizes = np.abs(deficits)
        # Small deficits beside the largest one are noise.
        largest_deficits = [
            f"{deficits[k]:.4g} at {names[k]}"
            for k in np.argsort(-deficit_sizes)
            if deficit_sizes[k] > 0.1 * deficit_sizes.max()
        ]
        return forces, join_words(largest_deficits, max_count=3)


def refuse_controllers(job: Job, model: Model) -> None:
    """Raise an error for enabled controllers, which would add to the computed controls.

    Raises:
        SettingError: a controller of the model is enabled.
    """
    for controller in model.controller_set.objects:
        # Controllers of unknown classes may lack the property.
        if getattr(controller, "enabled", True):
            message = (
                f"the controller '{controller.name}' would add to the controls that the tool computes; "
                "remove it from the model"
            )
            raise SettingError(message, file=str(job.file))
