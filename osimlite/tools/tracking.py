"""What RRA and CMC follow: a measured motion as splines, tasks, and the actuator forces that do them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import SampledCurves, derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tools.tracking import CMC_Joint, CMC_TaskSet, CMCTool, RRATool
from osimlite.simulation.lowpass import continued, lowpassed_by_sinc
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.simulation.run import Simulation
from osimlite.simulation.static_optimization import least_effort
from osimlite.tools.dynamics_setup import build_static_optimization, satisfy_constraints
from osimlite.tools.job import Job, NotRunnable
from osimlite.tools.outcome import Outcome

PADDING, ORDER = 60, 50
"""Rows that OpenSim adds at both ends of the motion, and the order of its filter."""
SOFTNESS = 0.1
"""Of the `limit` of a task: how far from it the weight of the forces begins to fall."""
CLOSE = 1e-9
"""Part of the accelerations that forces give, which may be missing of what they are to give together."""
LEAST_SHARE = 1e-6
"""The forces count by no less, so that one answer is the best."""
WEAK = 1e-9
"""Part of its greatest force that a muscle can give at least, if it is to be asked for any."""
AGREEMENT = 1e-6
"""How far (rad or m) a desired motion may be from a lock before this is worth a message."""
RANK = 1e-10
"""Of the largest eigenvalue: what is below is none."""


@dataclass(frozen=True, eq=False)
class Desired:
    """A motion that is followed, as OpenSim has it: splines of fifth degree through values, speeds and their rates.

    Attributes:
        start, end: of what was measured, s.
        times: of the padded and filtered rows (t,), s.
        values: of all coordinates (t, n), rad and m, where the constraints hold.
        speeds: (t, n).
        accelerations: (t, n).
    """

    start: float
    end: float
    times: Array
    values: Array
    speeds: Array
    accelerations: Array

    @classmethod
    def of(cls, job: Job, outcome: Outcome, simulation: Simulation, model: Model) -> Desired:
        """The motion that a setup names.

        Raises:
            OsimliteError: it cannot be read or followed.
        """
        setup: RRATool | CMCTool = job.setup
        if job.path("desired_points_file") is not None:
            raise job.unable(
                "desired_points_file is given, and points cannot be followed yet; leave it empty"
            )
        mechanism = simulation.mechanism
        recorded = RecordedMotion.read(mechanism, job.needed("desired_kinematics_file"))
        if recorded.missing:
            places = [
                k for k, info in enumerate(mechanism.coordinates) if info.name in recorded.missing
            ]
            recorded.values[:, places] = 0.0
            outcome.tell(
                "not in the file", f"{join_words(recorded.missing)}: 0 is taken, as in OpenSim"
            )
        start, end = float(recorded.times[0]), float(recorded.times[-1])
        times, values = continued(recorded.times, PADDING), continued(recorded.values, PADDING)
        if setup.lowpass_cutoff_frequency >= 0.0:
            times, values = lowpassed_by_sinc(times, values, setup.lowpass_cutoff_frequency, ORDER)
        _follow_locks(outcome, mechanism, recorded, values)
        padded = replace(recorded, times=times, values=values)
        # OpenSim takes the rates of coordinates for the speeds, as they are before the constraints
        # change the values.
        values, speeds = satisfy_constraints(padded, padded.rates[0], simulation, model)
        # OpenSim assembles every row of the desired motion at the time 0: its functions say one
        # value for all rows.
        for place, info in enumerate(mechanism.coordinates):
            if info.prescribed is not None:
                values[:, place] = info.prescribed.evaluate((0.0,))[0]
        (accelerations,) = derivatives_of_samples(times, speeds, times, (1,))
        return cls(start, end, times, values, speeds, accelerations)

    @cached_property
    def _curves(self) -> tuple[SampledCurves, SampledCurves]:
        size = self.values.shape[1]
        return SampledCurves(self.times, self.values), SampledCurves(
            self.times, np.hstack([self.speeds, self.accelerations]).reshape(-1, 2 * size)
        )

    def poses(self, times: Sequence[float]) -> tuple[Array, Array]:
        """Values (k, n) and their rates (k, n) at some times, s."""
        q, rates = self._curves[0].derivatives(times, (0, 1))
        return q, rates

    def pose(self, t: float) -> tuple[Array, Array]:
        """Values (n,) and their rates (n,) at a time, s."""
        q, rates = self.poses([t])
        return q[0], rates[0]

    def at(self, times: Array | float) -> Array:
        """Values, their rates, speeds and accelerations (k, 4, n) at some times (k,), s."""
        moments = np.atleast_1d(times)
        q, rates = self._curves[0].derivatives(moments, (0, 1))
        (others,) = self._curves[1].derivatives(moments, (0,))
        return np.stack([q, rates, *np.split(others, 2, axis=1)], axis=1)


def _follow_locks(
    outcome: Outcome, mechanism: Mechanism, recorded: RecordedMotion, values: Array
) -> None:
    """Let locks win over a desired motion, as in OpenSim; say where they differ.

    Args:
        outcome: that says so.
        mechanism: whose coordinates move.
        recorded: the motion of the file.
        values: of the padded rows (t, n), changed in place.
    """
    for place, info in enumerate(mechanism.coordinates):
        if not info.locked:
            continue
        values[:, place] = info.default_value
        apart = float(np.abs(info.default_value - recorded.values[:, place]).max())
        if info.name not in recorded.missing and apart > AGREEMENT:
            unit = "rad" if info.motion_type == "rotational" else "m"
            outcome.tell(
                info.name,
                f"locked at {info.default_value:g} {unit}; the desired motion is up to {apart:.3g} {unit} away from "
                "that: as in OpenSim, the lock wins, and a task of this coordinate has nothing to do",
            )


class Task(NamedTuple):
    """A coordinate that is followed.

    Attributes:
        name: of the task.
        coordinate: number of the coordinate that is to follow.
        wanted: number of that whose motion it follows.
        weight, kp, kv, ka: how closely.
        limit: deviation beyond which forces do not count; 0 for none.
    """

    name: str
    coordinate: int
    wanted: int
    weight: float
    kp: float
    kv: float
    ka: float
    limit: float


@dataclass(frozen=True)
class Tasks:
    """All tasks that are active."""

    tasks: tuple[Task, ...]

    @classmethod
    def of(cls, job: Job, mechanism: Mechanism) -> Tasks:
        """The tasks of a setup.

        Raises:
            NotRunnable: one is of another class than CMC_Joint.
            DocumentError: there are none, or one names no coordinate.
        """
        path = job.needed("task_set_file")
        result = []
        names = mechanism.coordinate_names
        for item in job.read(path, CMC_TaskSet).objects:
            if type(item) is not CMC_Joint:
                message = f"the task '{item.name}' is a {type(item).__name__}, which cannot be followed yet"
                raise NotRunnable(message, file=str(path))
            for tag in ("active", "weight", "kp", "kv", "ka"):
                if not getattr(item, tag):
                    raise job.error(
                        f"the task '{item.name}' of '{path}' has an empty '{tag}'; give it a value"
                    )
            # As in OpenSim, `on` means nothing.
            if not item.active[0]:
                continue
            for name in (item.name, str(item.coordinate)):
                if name not in names:
                    near = suggest_name(name, names)
                    raise job.error(
                        f"the task '{item.name}' of '{path}' follows no coordinate: '{name}'{near}"
                    )
            weight, kp, kv, ka = (
                float(getattr(item, tag)[0]) for tag in ("weight", "kp", "kv", "ka")
            )
            own, wanted = names.index(str(item.coordinate)), names.index(item.name)
            result.append(Task(item.name, own, wanted, weight, kp, kv, ka, item.limit))
        if not result:
            raise job.error(f"no task of '{path}' is active; set the first of its 'active' to true")
        return cls(tuple(result))

    @property
    def coordinates(self) -> list[int]:
        """Numbers of the coordinates that follow."""
        return [task.coordinate for task in self.tasks]

    @property
    def weights(self) -> Array:
        """Of all tasks."""
        return np.array([task.weight for task in self.tasks])

    def errors(self, wanted: Array, q: Array, u: Array) -> tuple[Array, Array]:
        """How far values and speeds are behind what is wanted (4, n)."""
        own, other = self.coordinates, [task.wanted for task in self.tasks]
        return wanted[0, other] - q[own], wanted[2, other] - u[own]

    def accelerations(self, errors: tuple[Array, Array], ahead: Array) -> Array:
        """Those that make up for errors, given what is wanted (4, n) at the end of the window."""
        kp, kv, ka = np.array([(task.kp, task.kv, task.ka) for task in self.tasks]).T
        ends: Array = ka * ahead[3, [task.wanted for task in self.tasks]]
        return ends + kv * errors[1] + kp * errors[0]

    def force_weight(self, errors: Array) -> float:
        """How much the forces count while errors come near to the limits of their tasks."""
        result = 1.0
        for task, error in zip(self.tasks, np.abs(errors).tolist(), strict=True):
            if task.limit:
                distance = (error - task.limit) / (SOFTNESS * task.limit)
                result = min(result, 1.0 - 1.0 / (1.0 + math.exp(-max(distance, -700.0))))
        return result


class Sharing:
    """Which forces of the actuators give the accelerations of the tasks.

    Args: job: the setup. model: of it. mechanism: of the model. tasks: what is followed. exact:
        whether accelerations must be met exactly, so that only the forces count; else both do,
        squared.
    """

    def __init__(
        self, job: Job, model: Model, mechanism: Mechanism, tasks: Tasks, exact: bool
    ) -> None:
        self.tasks, self.exact, self.mechanism = tasks, exact, mechanism
        self._unit = build_static_optimization(job, model, mechanism, muscles="isometric")
        self._strong = build_static_optimization(job, model, mechanism) if exact else None
        self.names = self._unit.names
        self.optimal = self._unit.optimal_forces
        if not self.optimal.all():
            lame = [name for name, force in zip(self.names, self.optimal, strict=True) if not force]
            raise job.error(
                f"{join_words(lame)} can have no force: the optimal force is 0; give another"
            )

    def accelerations(self, t: float, q: Array, u: Array) -> tuple[Array, Array, Array]:
        """Of all coordinates: without forces of actuators (n,), by each force (n, a) and by each
        generalized force (n, n) of 1 N or N m.
        """
        times, values, speeds = np.array([t]), q[None], u[None]
        return self._unit.responses(times, values, speeds)

    def forces(
        self,
        t: float,
        q: Array,
        u: Array,
        wanted: Array,
        errors: Array,
        bounds: tuple[Array, Array],
    ) -> tuple[Array, str]:
        """Forces (a,) within bounds that give the tasks' wanted accelerations, and what is lacking, if anything."""
        still, each, lightness = self.accelerations(t, q, u)
        own = self.tasks.coordinates
        columns, rest = each[own], wanted - still[own]
        if self.exact:
            return self._least(t, q, u, columns, rest, lightness[np.ix_(own, own)], bounds)
        weights = np.sqrt(self.tasks.weights)
        share = math.sqrt(self.tasks.force_weight(errors))
        # What is left of the accelerations is an unknown too, whose square is to be small as those
        # of the others.
        size, scale = len(own), self.optimal / max(share, LEAST_SHARE)
        given = np.hstack([weights[:, None] * columns * scale, np.eye(size)])
        free = np.full(size, np.inf)
        ends = np.hstack([np.sort(np.array(bounds) / scale, axis=0), [-free, free]])
        found, _, _ = least_effort(given.T[None], (weights * rest)[None], 2.0, ends)
        return found[0, : len(scale)] * scale, ""

    def _least(
        self,
        t: float,
        q: Array,
        u: Array,
        columns: Array,
        rest: Array,
        lightness: Array,
        bounds: tuple[Array, Array],
    ) -> tuple[Array, str]:
        assert self._strong is not None
        strengths = self._strong.strengths(np.array([t]), q[None], u[None])
        # The forces of muscles whose fibers can give none count without end: they are as small as
        # they can be.
        able = np.abs(strengths) > WEAK * np.abs(self.optimal)
        forces = np.clip(0.0, *bounds)
        # A locked coordinate has no acceleration that forces could change.
        infos = [self.mechanism.coordinates[k] for k in self.tasks.coordinates]
        counted = (self.tasks.weights != 0.0) & ~np.array([info.locked for info in infos])
        each, left = columns[counted][:, able], (rest - columns[:, ~able] @ forces[~able])[counted]
        scale = strengths[able]
        scaled = np.sort(np.array(bounds)[:, able] / scale, axis=0)
        # Accelerations of feet and of the pelvis differ by orders of magnitude, and every force
        # moves all of them: as equations of the generalized forces that the tasks take, the least
        # of reserves counts, beside full muscles.
        mass = np.linalg.pinv(lightness[np.ix_(counted, counted)], RANK, hermitian=True)
        rows = np.ascontiguousarray((mass @ (each * scale)).T)
        result, _, solved = least_effort(rows[None], (mass @ left)[None], 2.0, scaled)
        forces[able] = result[0] * scale
        lacking = left - each @ forces[able]
        if solved[0] and (np.abs(lacking) <= CLOSE * (np.abs(each) @ np.abs(forces[able]))).all():
            return forces, ""
        names = [
            task.name if info.prescribed is None else f"{task.name} (which is prescribed)"
            for task, info, counts in zip(self.tasks.tasks, infos, counted, strict=True)
            if counts
        ]
        off = np.abs(lacking)
        worst = [
            f"{lacking[k]:.4g} at {names[k]}" for k in np.argsort(-off) if off[k] > 0.1 * off.max()
        ]
        return forces, join_words(worst, most=3)


def require_no_controllers(job: Job, model: Model) -> None:
    """Refuse controllers of the model, which would add to the controls that are computed.

    Raises:
        SettingError: one is enabled.
    """
    for controller in model.controller_set.objects:
        if getattr(controller, "enabled", True):
            message = f"'{controller.name}' would add to the controls that the tool computes; take it out of the model"
            raise SettingError(message, file=str(job.file))
