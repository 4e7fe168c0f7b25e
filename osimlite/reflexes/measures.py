"""What a walk is judged by: SCONE's measures, of all candidates at once.

Each class of measures is one class here, found by its name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.multibody.spatial import Array
from osimlite.reflexes.settings import Node
from osimlite.reflexes.walkers import SIDES, Felt, Walkers
from osimlite.text import or_known

Mask = NDArray[np.bool_]
LIGHT = 299792458.0
QUARTER = np.pi / 2.0
AT_REST = 1.51
"""Power of a body at rest, W/kg (J. M. Wang et al., ACM Trans. Graph. 31, 2012)."""


class Mean:
    """The integral over time of numbers (w,), on lines between samples, as long as each candidate goes on."""

    def __init__(self, count: int) -> None:
        self.total, self.highest, self.lowest = (np.zeros(count) for _ in range(3))
        self._time, self._value, self._begun = 0.0, np.zeros(count), False
        self.span = np.zeros(count)

    def add(self, t: float, value: Array, going: Mask) -> None:
        """A sample of those that are going (w,)."""
        if self._begun:
            dt = t - self._time
            self.total += np.where(going, 0.5 * dt * (self._value + value), 0.0)
            self.span += np.where(going, dt, 0.0)
            self.highest = np.where(going, np.maximum(self.highest, value), self.highest)
            self.lowest = np.where(going, np.minimum(self.lowest, value), self.lowest)
        else:
            self.highest, self.lowest = value.copy(), value.copy()
        self._time, self._value, self._begun = t, value, True

    @property
    def average(self) -> Array:
        """Over the time (w,)."""
        return np.divide(self.total, self.span, out=self._value.copy(), where=self.span > 0.0)


class Measure(ABC):
    """One measure.

    Args:
        node: of it.
        walkers: that are judged.
        side: ending of the names of what it is about, if it is about one side.

    Attributes:
        name: of it.
        failed: which candidates it has ended (w,).
        report: what it says besides.
        terms: what it and those that it is made of add, by their names.
    """

    def __init__(self, node: Node, walkers: Walkers, side: str = "") -> None:
        self.node, self.walkers, self.side, self.count = node, walkers, side, walkers.count
        self.name = node.text("name", "") or self.default_name()
        self.weight = node.number("weight", 1.0)
        threshold, soft = node.get("threshold"), node.get("soft_threshold")
        self.offset = node.number("result_offset", 0.0)
        self.threshold = None if threshold is None else node.number("threshold")
        if soft is not None:
            self.offset, self.threshold = -node.number("soft_threshold"), 0.0
        self.transition = node.number("threshold_transition", 0.0)
        self.start, self.stop = node.number("start_time", 0.0), node.number("stop_time", 0.0)
        node.get("signature"), node.get("signature_postfix")
        if not node.flag("minimize", True):
            raise node.error("measures that are to be large are not done here")
        self.failed = np.zeros(self.count, dtype=bool)
        self.report: dict[str, Array] = {}
        self.terms: dict[str, Array] = {}
        self.read(node)
        node.expect_all_asked(f"a {type(self).__name__}", tuple(MEASURES))

    def default_name(self) -> str:
        """Of one that has none."""
        return type(self).__name__

    @abstractmethod
    def read(self, node: Node) -> None:
        """Read what the class adds."""

    def begin(self, felt: Felt) -> None:
        """At the start."""
        self.failed[:] = False

    @abstractmethod
    def note(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """At the end of a control step (s), of those that are going (w,)."""

    @abstractmethod
    def result(self, times: Array, duration: float) -> Array:
        """The measure (w,), of walks that ended at times (w,) before or at a duration, s."""

    def counted(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """As `note`, if the measure is on."""
        if t >= self.start and (self.stop == 0.0 or t < self.stop):
            self.note(t, felt, excitations, going)

    def weighted(self, times: Array, duration: float) -> Array:
        """What it adds to the sum (w,), noted in `terms`."""
        value = self.result(times, duration) + self.offset
        if self.threshold is not None:
            least, over = self.threshold, self.transition
            between = value * (value - least) / over if over > 0.0 else value
            value = np.where(value < least, 0.0, np.where(value < least + over, between, value))
        found: Array = self.weight * value
        # One that is made of others has theirs.
        self.terms = self.terms or {self.name: found}
        return found


class GaitMeasure(Measure):
    """How far steps are from a speed; a walker whose mass centre sinks has fallen."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        self.least_height = node.number("termination_height", 0.5)
        self.low, self.high = node.number("min_velocity", 0.0), node.number("max_velocity", LIGHT)
        self.load = node.number("load_threshold", 0.1)
        self.shortest = node.number("min_step_duration", 0.1)
        self.first_steps = int(node.number("initiation_steps", 2.0))
        self.least_speed = node.number("min_norm_velocity", 0.1)
        self.always = node.flag("always_apply_early_termination_penalty", False)
        for key in ("use_height_wrt_feet", "use_initial_heading"):
            if node.flag(key, False):
                raise node.error(f"{key} is not done here")
        for key in ("continue_after_fall", "base_bodies", "direction"):
            if node.get(key) is not None:
                raise node.error(f"{key} is not done here")

    def _distance(self, felt: Felt) -> Array:
        self.walkers.expect_legs()
        feet = [felt.bodies[:, leg.foot, 0] for leg in self.walkers.legs]
        least = np.sort(np.column_stack([felt.centre[:, 0], *feet]), axis=1)[:, :2]
        result: Array = least.mean(axis=1)
        return result

    def begin(self, felt: Felt) -> None:
        """As `Measure` says."""
        self._before = self._distance(felt)
        self._height = felt.centre[:, 1].copy()
        self._touched: Mask | None = None
        self._steps: list[list[tuple[float, float]]] = [[] for _ in range(self.count)]
        self._here = self._before.copy()

    def note(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """As `Measure` says."""
        self._here = np.where(going, self._distance(felt), self._here)
        self.failed |= going & (felt.centre[:, 1] < self.least_height * self._height)
        touches = felt.loads >= self.load
        if self._touched is not None:
            for k in np.flatnonzero(going & ~self.failed & (touches & ~self._touched).any(axis=1)).tolist():
                own = self._steps[k]
                if t - (own[-1][0] if own else 0.0) > self.shortest:
                    self._add(k, t)
        self._touched = touches

    def _add(self, k: int, t: float) -> None:
        self._steps[k].append((t, float(self._here[k] - self._before[k])))
        self._before[k] = self._here[k]

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        result, speeds = np.ones(self.count), np.zeros(self.count)
        wanted = max(min(abs(self.low), abs(self.high)), self.least_speed)
        for k in range(self.count):
            self._add(k, float(times[k]))
            steps = self._steps[k]
            first = min(max(len(steps) - self.first_steps, 0), self.first_steps)
            good = time = length = 0.0
            for number, (t, far) in enumerate(steps):
                dt = t - (steps[number - 1][0] if number else 0.0)
                if number < first or dt <= 0.0:
                    continue
                speed = far / dt
                off = speed - self.low if speed < self.low else speed - self.high if speed > self.high else 0.0
                good += dt * min(max(1.0 - abs(off) / wanted, -1.0), 1.0)
                time, length = time + dt, length + far
            if times[k] < duration and (self.failed[k] or self.always):
                time += duration - float(times[k])
            result[k], speeds[k] = 1.0 - good / time if time else 1.0, length / time if time else 0.0
        self.report = {"speed": speeds, "steps": np.array([len(steps) for steps in self._steps], dtype=float)}
        return result


class EffortMeasure(Measure):
    """What muscles take."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        kinds: dict[str, Callable[[Felt, Array], Array]] = {
            "Wang2012": self._wang,
            "TotalForce": lambda felt, _: 1.0 + (felt.forces * self.walkers.strengths).sum(axis=1),
            "MuscleActivation": lambda felt, _: self._powers(felt, 1),
            "SquaredMuscleActivation": lambda felt, _: self._powers(felt, 2),
            "CubedMuscleActivation": lambda felt, _: self._powers(felt, 3),
        }
        kind = node.text("measure_type")
        if kind not in kinds:
            raise node.error(f"effort of the type '{kind}' is not done here{or_known(kind, kinds)}")
        self._effort_of = kinds[kind]
        self.by_distance = node.flag("use_cost_of_transport", False)
        self.least_distance = node.number("min_distance", 1.0)
        self.by_muscle = node.flag("use_average_per_muscle", False)
        tension, density = node.number("specific_tension", 0.25e6), node.number("muscle_density", 1059.7)
        self.slow = node.number("default_muscle_slow_twitch_ratio", 0.5)
        self.masses = self.walkers.strengths / tension * density * self.walkers.optimal
        for key in ("use_symmetric_fiber_ratios", "store_individual_muscle_efforts"):
            node.get(key)
        if node.get("name") is None:
            self.name = kind

    def begin(self, felt: Felt) -> None:
        """As `Measure` says."""
        self._mean, self._start = Mean(self.count), felt.centre[:, 0].copy()
        self._here = self._start

    def note(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """As `Measure` says."""
        self._here = np.where(going, felt.centre[:, 0], self._here)
        self._mean.add(t, self._effort_of(felt, excitations), going)

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        if self.by_distance:
            far = np.maximum(self.least_distance, np.abs(self._here - self._start))
            self.report = {"effort": self._mean.total, "distance": far}
            found = self._mean.total / (self.walkers.mass * far)
        else:
            found = self._mean.average
        return found / len(self.walkers.names) if self.by_muscle else found

    def _powers(self, felt: Felt, power: int) -> Array:
        result: Array = (felt.states[:, self.walkers.activations] ** power).sum(axis=1)
        return result

    def _wang(self, felt: Felt, excitations: Array) -> Array:
        """Power, W (J. M. Wang et al., ACM Trans. Graph. 31, 2012, after F. C. Anderson's thesis of 1999)."""
        u, a, slow = excitations, felt.states[:, self.walkers.activations], self.slow
        of_activation = 40.0 * slow * np.sin(QUARTER * u) + 133.0 * (1.0 - slow) * (1.0 - np.cos(QUARTER * u))
        of_maintenance = 74.0 * slow * np.sin(QUARTER * a) + 111.0 * (1.0 - slow) * (1.0 - np.cos(QUARTER * a))
        n = felt.lengths
        shape = np.where(n < 0.5, 0.5, np.where(n < 1.0, n, np.where(n < 1.5, 3.0 - 2.0 * n, 0.0)))
        shortens = -felt.velocities * self.walkers.optimal
        heat = np.maximum(0.0, 0.25 * felt.forces * self.walkers.strengths * shortens)
        work = np.maximum(0.0, felt.active * shortens)
        each = self.masses * (of_activation + shape * of_maintenance) + heat + work
        result: Array = AT_REST * self.walkers.mass + each.sum(axis=1)
        return result


class Penalty:
    """How far numbers are beyond a range, over time."""

    def __init__(self, node: Node, count: int) -> None:
        self.low, self.high = node.number("min", -np.inf), node.number("max", np.inf)
        self.linear = node.number("abs_penalty", node.number("abs_range_penalty", 0.0))
        self.squared = node.number("squared_penalty", node.number("squared_range_penalty", 0.0))
        self.mode = node.text("mode", "average")
        if self.mode not in ("average", "highest", "lowest", "sum"):
            raise node.error(f"penalties have no mode '{self.mode}'")
        self.mean = Mean(count)

    def add(self, t: float, value: Array, going: Mask) -> None:
        """A sample (w,)."""
        off = np.maximum(self.low - value, 0.0) + np.maximum(value - self.high, 0.0)
        self.mean.add(t, self.linear * off + self.squared * off**2, going)

    @property
    def result(self) -> Array:
        """(w,)."""
        mean = self.mean
        return {"average": mean.average, "sum": mean.total, "highest": mean.highest, "lowest": mean.lowest}[self.mode]


class DofMeasure(Measure):
    """A coordinate beyond a range, or the force of its limit."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        name = node.text("dof")
        names = self.walkers.coordinates
        if name not in names and name + self.side in names:
            name += self.side
        if name not in names:
            raise node.error(f"the model has no coordinate '{name}'{or_known(name, names)}")
        self._place = names.index(name)
        infos = {info.name: info for info in self.walkers.mechanism.coordinates}
        degrees = node.flag("in_degrees", infos[name].unit == "rad")
        self._factor = 180.0 / np.pi if degrees else 1.0
        self._penalties: list[tuple[str, Penalty]] = []
        for what in ("position", "velocity", "force", "limit_torque"):
            part = node.get(what)
            if part is not None:
                self._penalties.append((what, Penalty(part, self.count)))
                part.expect_all_asked(f"a {what}")

    def default_name(self) -> str:
        """As `Measure` says."""
        return self.node.text("dof") + self.side

    def note(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """As `Measure` says."""
        size = len(self.walkers.coordinates)
        values = {
            "position": self._factor * felt.states[:, self._place],
            "velocity": self._factor * felt.states[:, size + self._place],
        }
        for what, penalty in self._penalties:
            penalty.add(t, values.get(what, felt.moments[:, self._place]), going)

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        return sum((penalty.result for _, penalty in self._penalties), np.zeros(self.count))


class ReactionForceMeasure(Measure):
    """Forces on the feet beyond a range, over the weight."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        self._penalty, self._per_leg = Penalty(node, self.count), node.flag("use_force_per_leg", False)

    def note(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """As `Measure` says."""
        self._penalty.add(t, felt.loads.max(axis=1) if self._per_leg else felt.loads.sum(axis=1), going)

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        return self._penalty.result


class CompositeMeasure(Measure):
    """The sum of others."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        if node.flag("use_first_non_zero_result", False):
            raise node.error("use_first_non_zero_result is not done here")
        both = node.flag("dual_sided", node.flag("symmetric", False))
        blocks = [node, *(block for _, block in node.all_of("Measures"))]
        self.parts: list[Measure] = [
            MEASURES[name](part, self.walkers, side)
            for block in blocks
            for name, part in block.all_of(*MEASURES)
            for side in (SIDES if both else (self.side,))
        ]

    def begin(self, felt: Felt) -> None:
        """As `Measure` says."""
        for part in self.parts:
            part.begin(felt)

    def note(self, t: float, felt: Felt, excitations: Array, going: Mask) -> None:
        """As `Measure` says."""
        for part in self.parts:
            part.counted(t, felt, excitations, going)
            self.failed |= part.failed

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        total = sum((part.weighted(times, duration) for part in self.parts), np.zeros(self.count))
        for part in self.parts:
            self.terms |= part.terms
            self.report |= part.report
        return total


MEASURES: dict[str, Any] = {
    cls.__name__: cls for cls in (GaitMeasure, EffortMeasure, DofMeasure, ReactionForceMeasure, CompositeMeasure)
}
"""By the names that scenarios have for them."""
