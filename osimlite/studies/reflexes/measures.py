"""What a walk is judged by: SCONE's measures, of all candidates at once.

Each class of measures is one class here, found by its name. While candidates walk, the kernels note
what measures ask for (:mod:`osimlite.mechanics.kernels.criteria`); the results are made of that.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import inf
from typing import Any

import numpy as np

from osimlite.base.text import suggest_or_list
from osimlite.mechanics.kernels.criteria import (
    CRITERION,
    GAIT,
    GAIT_NOTED,
    JUMP,
    JUMP_NOTED,
    LARGEST_LOAD,
    NOTED,
    NUMBER,
    POWERS,
    PREPARES,
    TENSIONS,
    WANG,
    WHOLE_LOAD,
)
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.sensors import SENSES
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.settings import Node
from osimlite.studies.reflexes.walkers import SIDES, Walkers

LIGHT = 299792458.0
EFFORTS = {
    "Wang2012": (WANG, 0),
    "TotalForce": (TENSIONS, 0),
    "MuscleActivation": (POWERS, 1),
    "SquaredMuscleActivation": (POWERS, 2),
    "CubedMuscleActivation": (POWERS, 3),
}
"""Kinds of efforts, and powers of activations, by the names that scenarios have for them."""


class Criteria:
    """What the kernels are to note.

    Args:
        most: steps of a gait that there is room for.

    Attributes:
        room: numbers that are noted.
    """

    def __init__(self, most: int) -> None:
        self.most, self.room = most, 0
        self._ints: list[int] = []
        self._numbers: list[float] = []

    def add(self, kind: int, place: int, measure: Measure, *numbers: float) -> int:
        """Ask for something as long as a measure is on; returns where it will be noted."""
        first = self.room
        self._ints += kind, place, len(self._numbers), first
        self._numbers += measure.start, measure.stop, *numbers
        self.room += GAIT_NOTED.STEPS + 2 * self.most if kind == GAIT else NOTED.SIZE
        return first

    def pack(self) -> tuple[Ints, Array]:
        """Integers and numbers, as the kernels take them."""
        return np.array([len(self._ints) // CRITERION.SIZE, *self._ints], dtype=np.int64), np.array(
            self._numbers
        )


class Measure(ABC):
    """One measure.

    Args:
        node: of it.
        walkers: that are judged.
        criteria: to which it adds.
        above: that it is a part of.
        side: ending of the names of what it is about, if it is about one side.

    Attributes:
        name: of it. start, stop: between which it is on, s. report: what it says besides; of
            efforts by power that (W/kg), and what a way takes (J/(kg m)). terms: what it and those
            that it is made of add, by their names. minimize: whether it is to become small; of a
            class, what it is without a setting.
    """

    minimize = True

    def __init__(
        self,
        node: Node,
        walkers: Walkers,
        criteria: Criteria,
        above: Measure | None = None,
        side: str = "",
    ) -> None:
        self.node, self.walkers, self.criteria, self.side, self.count = (
            node,
            walkers,
            criteria,
            side,
            walkers.count,
        )
        self.name = node.text("name", "") or self.default_name()
        self.weight = node.number("weight", 1.0)
        threshold, soft = node.get("threshold"), node.get("soft_threshold")
        self.offset = node.number("result_offset", 0.0)
        self.threshold = None if threshold is None else node.number("threshold")
        if soft is not None:
            self.offset, self.threshold = -node.number("soft_threshold"), 0.0
        self.transition = node.number("threshold_transition", 0.0)
        self.start, self.stop = node.number("start_time", 0.0), node.number("stop_time", 0.0) or inf
        if above is not None:
            self.start, self.stop = max(self.start, above.start), min(self.stop, above.stop)
        self.minimize = node.flag("minimize", self.minimize)
        self.report: dict[str, Array] = {}
        self.terms: dict[str, Array] = {}
        self.read(node)
        node.expect_all_asked(f"a {type(self).__name__}", tuple(MEASURES))

    def default_name(self) -> str:
        """Of one that has none."""
        return type(self).__name__

    @abstractmethod
    def read(self, node: Node) -> None:
        """Read what the class adds, and ask for what it needs."""

    @abstractmethod
    def result(self, times: Array, duration: float) -> Array:
        """The measure (w,), of walks that ended at times (w,) before or at a duration, s."""

    def add_weighted(self, times: Array, duration: float) -> Array:
        """What it adds to the sum (w,), noted in `terms`."""
        value = self.result(times, duration) + self.offset
        if self.minimize and self.threshold is not None:
            least, over = self.threshold, self.transition
            between = value * (value - least) / over if over > 0.0 else value
            value = np.where(value < least, 0.0, np.where(value < least + over, between, value))
        found: Array = self.weight * value
        # One that is made of others has theirs.
        self.terms = self.terms or {self.name: found}
        return found

    def read_recorded(self, first: int, place: int) -> Array:
        """A number (w,) of what was asked for."""
        found: Array = self.walkers.noted[:, first + place]
        return found

    def average(self, first: int) -> Array:
        """Of a number over time (w,)."""
        total, span, last = (
            self.read_recorded(first, place) for place in (NOTED.TOTAL, NOTED.SPAN, NOTED.VALUE)
        )
        return np.divide(total, span, out=last.copy(), where=span > 0.0)


class GaitMeasure(Measure):
    """How far steps are from a speed; a walker whose mass centre sinks has fallen."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        self.low, self.high = node.number("min_velocity", 0.0), node.number("max_velocity", LIGHT)
        self.first_steps = int(node.number("initiation_steps", 2.0))
        self.least_speed = node.number("min_norm_velocity", 0.1)
        self.always = node.flag("always_apply_early_termination_penalty", False)
        for key in ("use_height_wrt_feet", "use_initial_heading"):
            if node.flag(key, False):
                raise node.error(f"{key} is not done here")
        for key in ("continue_after_fall", "base_bodies", "direction"):
            if node.get(key) is not None:
                raise node.error(f"{key} is not done here")
        self.walkers.expect_legs()
        numbers = (("termination_height", 0.5), ("load_threshold", 0.1), ("min_step_duration", 0.1))
        self._first = self.criteria.add(
            GAIT, 0, self, *(node.number(key, value) for key, value in numbers)
        )

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        result, speeds, counts = np.ones(self.count), np.zeros(self.count), np.zeros(self.count)
        wanted = max(min(abs(self.low), abs(self.high)), self.least_speed)
        for k, room in enumerate(self.walkers.noted[:, self._first :]):
            row = room[: GAIT_NOTED.STEPS + 2 * int(room[GAIT_NOTED.COUNT])].tolist()
            numbers = row[GAIT_NOTED.STEPS :]
            # The last step ends with the walk.
            last = float(times[k]), row[GAIT_NOTED.HERE] - row[GAIT_NOTED.BEFORE]
            steps = [*zip(numbers[::2], numbers[1::2], strict=True), last]
            first = min(max(len(steps) - self.first_steps, 0), self.first_steps)
            good = time = length = 0.0
            for number, (t, far) in enumerate(steps):
                dt = t - (steps[number - 1][0] if number else 0.0)
                if number < first or dt <= 0.0:
                    continue
                speed = far / dt
                off = (
                    speed - self.low
                    if speed < self.low
                    else speed - self.high
                    if speed > self.high
                    else 0.0
                )
                good += dt * min(max(1.0 - abs(off) / wanted, -1.0), 1.0)
                time, length = time + dt, length + far
            if times[k] < duration and (row[GAIT_NOTED.FALLEN] or self.always):
                time += duration - float(times[k])
            result[k], speeds[k] = (
                1.0 - good / time if time else 1.0,
                length / time if time else 0.0,
            )
            counts[k] = len(steps)
        self.report = {"speed": speeds, "steps": counts}
        return result


class JumpMeasure(Measure):
    """How high the mass centre comes, in cm."""

    minimize = False

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        for key in ("jump_type", "jump_angle", "body", "target_body", "offset", "recover_time"):
            if node.get(key) is not None:
                raise node.error(f"'{key}' of a JumpMeasure is not done here")
        self.walkers.expect_legs()
        self.negates, at_peak = (
            node.flag("negate_result", False),
            node.flag("terminate_on_peak", True),
        )
        numbers = (
            node.number("termination_height", 0.5),
            node.number("prepare_time", 0.2),
            float(at_peak),
        )
        self._first = self.criteria.add(JUMP, 0, self, *numbers)

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says; of one that has not taken off, where it would be after a second."""
        start, here, peak, prepared, does = (
            self.read_recorded(self._first, getattr(JUMP_NOTED, name))
            for name in ("START", "HERE", "PEAK", "PREPARED", "DOES")
        )
        early = 100.0 * np.maximum(prepared - start, 0.0)
        self.report = {"jump height": 100.0 * peak, "early rise": early}
        found = np.where(
            does == PREPARES, 100.0 * (start + (here - start) / times), 100.0 * peak - early
        )
        return -found if self.negates else found


class EffortMeasure(Measure):
    """What muscles take."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        kind, walkers = node.text("measure_type"), self.walkers
        if kind not in EFFORTS:
            raise node.error(
                f"effort of the type '{kind}' is not done here{suggest_or_list(kind, EFFORTS)}"
            )
        self.by_distance = node.flag("use_cost_of_transport", False)
        self.least_distance = node.number("min_distance", 1.0)
        self.by_muscle = node.flag("use_average_per_muscle", False)
        tension, density = (
            node.number("specific_tension", 0.25e6),
            node.number("muscle_density", 1059.7),
        )
        slow = node.number("default_muscle_slow_twitch_ratio", 0.5)
        masses = walkers.strengths / tension * density * walkers.optimal
        for key in ("use_symmetric_fiber_ratios", "store_individual_muscle_efforts"):
            node.get(key)
        if node.get("name") is None:
            self.name = kind
        self._kind, power = EFFORTS[kind]
        self._first = self.criteria.add(self._kind, power, self, slow, *masses)

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        total, start, here = (
            self.read_recorded(self._first, k) for k in (NOTED.TOTAL, NOTED.START, NOTED.HERE)
        )
        far = np.maximum(self.least_distance, np.abs(here - start))
        if self._kind == WANG:
            mass = self.walkers.mass
            self.report = {
                "power": self.average(self._first) / mass,
                "transport": total / (mass * far),
            }
        found = total / (self.walkers.mass * far) if self.by_distance else self.average(self._first)
        return found / len(self.walkers.names) if self.by_muscle else found


class Penalty(Measure):
    """How far numbers are beyond ranges, over time."""

    _asked: tuple[tuple[str, int], ...] = ()
    """Of each number the mode, and where it is noted."""

    def penalize(self, node: Node, kind: int, place: int = 0, factor: float = 1.0) -> None:
        """Ask for a number; `node` says how it is punished."""
        numbers = [factor, node.number("min", -inf), node.number("max", inf)]
        if numbers[1] > numbers[2]:
            raise node.error(f"from {numbers[1]:g} to {numbers[2]:g} there is no value")
        numbers.append(node.number("abs_penalty", node.number("abs_range_penalty", 0.0)))
        numbers.append(node.number("squared_penalty", node.number("squared_range_penalty", 0.0)))
        mode = node.text("mode", "average")
        if mode not in ("average", "highest", "lowest", "sum"):
            raise node.error(f"penalties have no mode '{mode}'")
        self._asked = *self._asked, (mode, self.criteria.add(kind, place, self, *numbers))

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        places, total = (
            {"sum": NOTED.TOTAL, "highest": NOTED.HIGHEST, "lowest": NOTED.LOWEST},
            np.zeros(self.count),
        )
        for mode, first in self._asked:
            total += (
                self.read_recorded(first, places[mode]) if mode in places else self.average(first)
            )
        return total


class DofMeasure(Penalty):
    """A coordinate beyond a range, or the force of its limit."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        name, senses = node.text("dof"), self.walkers.senses
        names = self.walkers.coordinates
        if name not in names and name + self.side in names:
            name += self.side
        if name not in names:
            raise node.error(f"the model has no coordinate '{name}'{suggest_or_list(name, names)}")
        infos = {info.name: info for info in self.walkers.mechanism.coordinates}
        factor = 180.0 / np.pi if node.flag("in_degrees", infos[name].unit == "rad") else 1.0
        for what, first, scale in (
            ("position", SENSES.VALUES, factor),
            ("velocity", SENSES.SPEEDS, factor),
            ("force", SENSES.MOMENTS, 1.0),
            ("limit_torque", SENSES.MOMENTS, 1.0),
        ):
            part = node.get(what)
            if part is not None:
                self.penalize(part, NUMBER, int(senses[first]) + names.index(name), scale)
                part.expect_all_asked(f"a {what}")

    def default_name(self) -> str:
        """As `Measure` says."""
        return self.node.text("dof") + self.side


class ReactionForceMeasure(Penalty):
    """Forces on the feet beyond a range, over the weight."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        self.walkers.expect_legs()
        self.penalize(node, LARGEST_LOAD if node.flag("use_force_per_leg", False) else WHOLE_LOAD)


class CompositeMeasure(Measure):
    """The sum of others."""

    def read(self, node: Node) -> None:
        """As `Measure` says."""
        if node.flag("use_first_non_zero_result", False):
            raise node.error("use_first_non_zero_result is not done here")
        both = node.flag("dual_sided", node.flag("symmetric", False))
        blocks = [node, *(block for _, block in node.all_of("Measures"))]
        self.parts: list[Measure] = [
            MEASURES[name](part, self.walkers, self.criteria, self, side)
            for block in blocks
            for name, part in block.all_of(*MEASURES)
            for side in (SIDES if both else (self.side,))
        ]
        self.minimize = node.flag("minimize", not self.parts or self.parts[0].minimize)

    def result(self, times: Array, duration: float) -> Array:
        """As `Measure` says."""
        total = sum(
            (part.add_weighted(times, duration) for part in self.parts), np.zeros(self.count)
        )
        for part in self.parts:
            self.terms |= part.terms
            self.report |= part.report
        return total


MEASURES: dict[str, Any] = {
    cls.__name__: cls
    for cls in (
        GaitMeasure,
        JumpMeasure,
        EffortMeasure,
        DofMeasure,
        ReactionForceMeasure,
        CompositeMeasure,
    )
}
"""By the names that scenarios have for them."""
