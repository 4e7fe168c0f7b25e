"""Measures of SCONE that score walks; all candidates are scored at once.

Each class of SCONE is one class here, which scenarios find by its name. During a simulation the
kernels update the criteria that measures have requested
(:mod:`osimlite.mechanics.kernels.criteria`); measures compute their results from these afterwards.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import inf
from typing import Any

import numpy as np

from osimlite.base.text import suggest_or_list
from osimlite.mechanics.kernels.criteria import (
    CRITERION,
    CRITERION_TYPE,
    GAIT_WORK,
    JUMP_PHASE,
    JUMP_WORK,
    SAMPLE_WORK,
)
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.sensors import SENSES
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.settings import SettingNode
from osimlite.studies.reflexes.walkers import SIDES, Walkers

SPEED_OF_LIGHT_M_S = 299792458.0
"""Upper bound (m/s) of the speed of a gait whose scenario sets none, as in SCONE."""
EFFORTS = {
    "Wang2012": (CRITERION_TYPE.WANG, 0),
    "TotalForce": (CRITERION_TYPE.TENSIONS, 0),
    "MuscleActivation": (CRITERION_TYPE.POWERS, 1),
    "SquaredMuscleActivation": (CRITERION_TYPE.POWERS, 2),
    "CubedMuscleActivation": (CRITERION_TYPE.POWERS, 3),
}
"""Kind of criterion and power of activations, by the names of effort measures in SCONE."""


class Criteria:
    """Criteria that the kernels update during a simulation.

    Args:
        max_steps: number of steps of a gait for which the workspace has space.

    Attributes:
        size: length of the workspace of all criteria.
    """

    def __init__(self, max_steps: int) -> None:
        self.max_steps, self.size = max_steps, 0
        self._ints: list[int] = []
        self._numbers: list[float] = []

    def add(self, kind: int, place: int, measure: Measure, *numbers: float) -> int:
        """Request a criterion for the time in which a measure is active.

        Args:
            kind: kind of criterion, such as `CRITERION_TYPE.GAIT` of the kernels.
            place: index in the sensor row, or a power of activations.
            measure: measure that needs it.
            numbers: numbers of the criterion, see `CRITERION_NUMBERS` of the kernels.

        Returns:
            Offset of the criterion in the workspace.
        """
        first = self.size
        self._ints += kind, place, len(self._numbers), first
        self._numbers += measure.start, measure.stop, *numbers
        self.size += (
            GAIT_WORK.STEPS + 2 * self.max_steps
            if kind == CRITERION_TYPE.GAIT
            else SAMPLE_WORK.SIZE
        )
        return first

    def pack(self) -> tuple[Ints, Array]:
        """Return the criteria as the kernels take them.

        Returns:
            Integers and numbers of all criteria.
        """
        return np.array([len(self._ints) // CRITERION.SIZE, *self._ints], dtype=np.int64), np.array(
            self._numbers
        )


class Measure(ABC):
    """Measure of a scenario: the base of all classes.

    Args:
        node: node of the measure.
        walkers: candidates to score.
        criteria: criteria to which it adds its own.
        above: composite measure that it is part of.
        side: ending of names of one side, or "" for a measure of both.

    Attributes:
        name: name in the table of results.
        weight: factor of the result.
        start: time from which the measure is active (s).
        stop: time until which it is active (s).
        report: further quantities by name (w,): of efforts the power per mass ("power", W/kg) and
            the cost of transport ("transport", J/(kg m)).
        terms: weighted results of the measure and of its parts by name (w,).
        minimize: whether the measure is to be minimized; the attribute of the class is the default.
    """

    minimize = True

    def __init__(
        self,
        node: SettingNode,
        walkers: Walkers,
        criteria: Criteria,
        above: Measure | None = None,
        side: str = "",
    ) -> None:
        self.node = node
        self.walkers = walkers
        self.criteria = criteria
        self.side = side
        self.count = walkers.count
        self.name = node.text("name", "") or self.default_name()
        self.weight = node.number("weight", 1.0)
        threshold = node.get("threshold")
        soft = node.get("soft_threshold")
        self.offset = node.number("result_offset", 0.0)
        self.threshold = None if threshold is None else node.number("threshold")
        # SCONE's soft threshold subtracts the threshold from the value, then cuts at zero. SCONE lets
        # it replace the two others without a word.
        if soft is not None:
            for key in ("result_offset", "threshold"):
                other = node.get(key)
                if other is not None:
                    raise other.error(f"'{key}' and 'soft_threshold' exclude each other; keep one")
            self.offset = -node.number("soft_threshold")
            self.threshold = 0.0
        self.transition = node.number("threshold_transition", 0.0)
        self.start = node.number("start_time", 0.0)
        # SCONE's default of 0 means no end.
        self.stop = node.number("stop_time", 0.0) or inf
        if above is not None:
            self.start = max(self.start, above.start)
            self.stop = min(self.stop, above.stop)
        self.minimize = node.flag("minimize", self.minimize)
        self.report: dict[str, Array] = {}
        self.terms: dict[str, Array] = {}
        self.read(node)
        node.refuse_unread_parts(f"a {type(self).__name__}", tuple(MEASURES))

    def default_name(self) -> str:
        """Return the name of a measure without a `name`."""
        return type(self).__name__

    @abstractmethod
    def read(self, node: SettingNode) -> None:
        """Read the settings of the class and request criteria."""

    @abstractmethod
    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the unweighted measure of each candidate (w,).

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """

    def add_weighted(self, times: Array, duration: float) -> Array:
        """Return the contribution to the total score (w,), and store it in `terms`.

        With a threshold T and a transition D, a value v counts as 0 below T, as v (v - T) / D
        between T and T + D, and as v above.

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """
        value = self.compute_result(times, duration) + self.offset
        # Thresholds apply only to measures that are minimized.
        if self.minimize and self.threshold is not None:
            least, over = self.threshold, self.transition
            # In the transition the value rises from 0 at the threshold to its full size at the end.
            between = value * (value - least) / over if over > 0.0 else value
            value = np.where(value < least, 0.0, np.where(value < least + over, between, value))
        found: Array = self.weight * value
        # A composite measure has collected the terms of its parts, its own would count them twice.
        self.terms = self.terms or {self.name: found}
        return found

    def read_recorded(self, first: int, place: int) -> Array:
        """Return a number of a criterion from the workspaces of the candidates (w,).

        Args:
            first: offset of the criterion, see `Criteria.add`.
            place: index within the criterion.
        """
        found: Array = self.walkers.criteria_work[:, first + place]
        return found

    def average_over_time(self, first: int) -> Array:
        """Return the time average of a criterion (w,).

        A criterion that was active for no time has its last value.
        """
        total, span, last = (
            self.read_recorded(first, place)
            for place in (SAMPLE_WORK.TOTAL, SAMPLE_WORK.SPAN, SAMPLE_WORK.VALUE)
        )
        return np.divide(total, span, out=last.copy(), where=span > 0.0)


class GaitMeasure(Measure):
    """Deviation of the speed of steps from a range.

    It is 0 if all steps are within the range, 1 without steps, and at most 2.

    A walker whose mass centre sinks below a part of its initial height has fallen.
    """

    def read(self, node: SettingNode) -> None:
        """Read the speed range and what counts as a step and a fall."""
        self.low = node.number("min_velocity", 0.0)
        self.high = node.number("max_velocity", SPEED_OF_LIGHT_M_S)
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
            CRITERION_TYPE.GAIT, 0, self, *(node.number(key, value) for key, value in numbers)
        )

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return 1 minus the time-weighted mean over steps of 1 - |deviation| / speed (w,).

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s); the time after a fall counts as steps of no value.
        """
        result = np.ones(self.count)
        speeds = np.zeros(self.count)
        counts = np.zeros(self.count)
        target = max(min(abs(self.low), abs(self.high)), self.least_speed)
        # Candidates differ in their number of steps, so that they are scored one by one.
        for k, room in enumerate(self.walkers.criteria_work[:, self._first :]):
            row = room[: GAIT_WORK.STEPS + 2 * int(room[GAIT_WORK.COUNT])].tolist()
            numbers = row[GAIT_WORK.STEPS :]
            # The kernels note completed steps; the unfinished last one ends with the walk.
            last = float(times[k]), row[GAIT_WORK.HERE] - row[GAIT_WORK.BEFORE]
            steps = [*zip(numbers[::2], numbers[1::2], strict=True), last]
            # SCONE ignores the first steps, but fewer of them if there are hardly more.
            first = min(max(len(steps) - self.first_steps, 0), self.first_steps)
            good = time = length = 0.0
            for number, (t, far) in enumerate(steps):
                dt = t - (steps[number - 1][0] if number else 0.0)
                if number < first or dt <= 0.0:
                    continue
                speed = far / dt
                if speed < self.low:
                    off = speed - self.low
                elif speed > self.high:
                    off = speed - self.high
                else:
                    off = 0.0
                good += dt * min(max(1.0 - abs(off) / target, -1.0), 1.0)
                time, length = time + dt, length + far
            # The time after a fall counts as time without progress, so that longer walks score
            # better.
            if times[k] < duration and (row[GAIT_WORK.FALLEN] or self.always):
                time += duration - float(times[k])
            result[k] = 1.0 - good / time if time else 1.0
            speeds[k] = length / time if time else 0.0
            counts[k] = len(steps)
        self.report = {"speed": speeds, "steps": counts}
        return result


class JumpMeasure(Measure):
    """Height of a jump of the mass centre (cm), to be maximized by default."""

    minimize = False

    def read(self, node: SettingNode) -> None:
        """Read when a jump starts and ends."""
        for key in ("jump_type", "jump_angle", "body", "target_body", "offset", "recover_time"):
            if node.get(key) is not None:
                raise node.error(f"'{key}' of a JumpMeasure is not done here")
        self.walkers.expect_legs()
        self.negates = node.flag("negate_result", False)
        at_peak = node.flag("terminate_on_peak", True)
        numbers = (
            node.number("termination_height", 0.5),
            node.number("prepare_time", 0.2),
            float(at_peak),
        )
        self._first = self.criteria.add(CRITERION_TYPE.JUMP, 0, self, *numbers)

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the peak height minus the rise during preparation (w,) (cm).

        Of a jumper that never leaves the preparation, it extrapolates the mean rise to one second.

        Args:
            times: times at which the jumps ended (w,) (s).
            duration: longest duration (s).
        """
        start, here, peak, prepared, does = (
            self.read_recorded(self._first, getattr(JUMP_WORK, name))
            for name in ("START", "HERE", "PEAK", "PREPARED", "DOES")
        )
        # Rising before the take-off is subtracted: otherwise standing up would count as a jump.
        early = 100.0 * np.maximum(prepared - start, 0.0)
        self.report = {"jump height": 100.0 * peak, "early rise": early}
        found = np.where(
            does == JUMP_PHASE.PREPARES,
            100.0 * (start + (here - start) / times),
            100.0 * peak - early,
        )
        return -found if self.negates else found


class EffortMeasure(Measure):
    """Effort of the muscles: metabolic power, total force, or a sum of powers of activations."""

    def read(self, node: SettingNode) -> None:
        """Read the type of effort, and compute the masses of the muscles.

        The mass is F_max / specific tension * density * optimal fiber length.
        """
        kind, walkers = node.text("measure_type"), self.walkers
        if kind not in EFFORTS:
            raise node.error(
                f"effort of the type '{kind}' is not done here{suggest_or_list(kind, EFFORTS)}"
            )
        self.by_distance = node.flag("use_cost_of_transport", False)
        self.least_distance = node.number("min_distance", 1.0)
        self.by_muscle = node.flag("use_average_per_muscle", False)
        tension = node.number("specific_tension", 0.25e6)
        density = node.number("muscle_density", 1059.7)
        slow = node.number("default_muscle_slow_twitch_ratio", 0.5)
        # Muscle mass from strength (N), specific tension (N/m²), density (kg/m³) and fiber length
        # (m).
        masses = walkers.strengths / tension * density * walkers.optimal
        # These change no result here: all muscles have the same ratio, and there is only a total.
        for key in ("use_symmetric_fiber_ratios", "store_individual_muscle_efforts"):
            node.get(key)
        if node.get("name") is None:
            self.name = kind
        self._kind, power = EFFORTS[kind]
        self._first = self.criteria.add(self._kind, power, self, slow, *masses)

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the mean effort, or the effort per mass and distance (w,).

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """
        total, start, here = (
            self.read_recorded(self._first, k)
            for k in (SAMPLE_WORK.TOTAL, SAMPLE_WORK.START, SAMPLE_WORK.HERE)
        )
        # A smallest distance keeps walkers that fall at once from having an infinite cost of
        # transport.
        far = np.maximum(self.least_distance, np.abs(here - start))
        if self._kind == CRITERION_TYPE.WANG:
            mass = self.walkers.mass
            self.report = {
                "power": self.average_over_time(self._first) / mass,
                "transport": total / (mass * far),
            }
        found = (
            total / (self.walkers.mass * far)
            if self.by_distance
            else self.average_over_time(self._first)
        )
        return found / len(self.walkers.names) if self.by_muscle else found


class Penalty(Measure):
    """Penalty of values outside a range, accumulated over time: the base of measures of ranges."""

    _statistics: tuple[tuple[str, int], ...] = ()
    """Per criterion its mode (average, highest, lowest or sum) and its offset in the workspace."""

    def penalize(self, node: SettingNode, kind: int, place: int = 0, factor: float = 1.0) -> None:
        """Request a criterion for the excess of a number beyond a range.

        Args:
            node: node with the range and the penalties.
            kind: kind of criterion of the kernels.
            place: index of the number in the sensor row.
            factor: factor of the number before the comparison, for example 180/pi for degrees.

        Raises:
            DocumentError: the range is empty, or the mode is unknown.
        """
        numbers = [factor, node.number("min", -inf), node.number("max", inf)]
        if numbers[1] > numbers[2]:
            raise node.error(f"from {numbers[1]:g} to {numbers[2]:g} there is no value")
        numbers.append(node.number("abs_penalty", node.number("abs_range_penalty", 0.0)))
        numbers.append(node.number("squared_penalty", node.number("squared_range_penalty", 0.0)))
        mode = node.text("mode", "average")
        if mode not in ("average", "highest", "lowest", "sum"):
            raise node.error(f"penalties have no mode '{mode}'")
        self._statistics = *self._statistics, (mode, self.criteria.add(kind, place, self, *numbers))

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the sum of the statistics of all criteria (w,).

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """
        places = {
            "sum": SAMPLE_WORK.TOTAL,
            "highest": SAMPLE_WORK.HIGHEST,
            "lowest": SAMPLE_WORK.LOWEST,
        }
        total = np.zeros(self.count)
        for mode, first in self._statistics:
            total += (
                self.read_recorded(first, places[mode])
                if mode in places
                else self.average_over_time(first)
            )
        return total


class DofMeasure(Penalty):
    """Penalty of a coordinate, its speed, or the force of its limit outside a range."""

    def read(self, node: SettingNode) -> None:
        """Read the coordinate and the ranges; rotations are in degrees unless `in_degrees` is false."""
        name = node.text("dof")
        senses = self.walkers.sensor_plan
        names = self.walkers.coordinates
        # In a dual-sided composite the side completes the name of the coordinate.
        if name not in names and name + self.side in names:
            name += self.side
        if name not in names:
            raise node.error(f"the model has no coordinate '{name}'{suggest_or_list(name, names)}")
        infos = {info.name: info for info in self.walkers.mechanism.coordinates}
        # Ranges of rotations are in degrees by default, the sensor row is in radians.
        factor = 180.0 / np.pi if node.flag("in_degrees", infos[name].unit == "rad") else 1.0
        for what, first, scale in (
            ("position", SENSES.VALUES, factor),
            ("velocity", SENSES.SPEEDS, factor),
            ("force", SENSES.MOMENTS, 1.0),
            ("limit_torque", SENSES.MOMENTS, 1.0),
        ):
            part = node.get(what)
            if part is not None:
                self.penalize(
                    part, CRITERION_TYPE.NUMBER, int(senses[first]) + names.index(name), scale
                )
                part.refuse_unread_parts(f"a {what}")

    def default_name(self) -> str:
        """Return the name of the coordinate."""
        return self.node.text("dof") + self.side


class ReactionForceMeasure(Penalty):
    """Penalty of ground reaction forces over the body weight outside a range."""

    def read(self, node: SettingNode) -> None:
        """Read the range, and whether it is for the more loaded leg or for the total."""
        self.walkers.expect_legs()
        self.penalize(
            node,
            CRITERION_TYPE.LARGEST_LOAD
            if node.flag("use_force_per_leg", False)
            else CRITERION_TYPE.WHOLE_LOAD,
        )


class CompositeMeasure(Measure):
    """Sum of measures."""

    def read(self, node: SettingNode) -> None:
        """Read the parts; with `dual_sided` or `symmetric` there is one of each part for either side."""
        if node.flag("use_first_non_zero_result", False):
            raise node.error("use_first_non_zero_result is not done here")
        # `symmetric` applies where `dual_sided` is not set.
        both = node.flag("dual_sided", node.flag("symmetric", False))
        blocks = [node, *(block for _, block in node.select_all("Measures"))]
        self.parts: list[Measure] = [
            MEASURES[name](part, self.walkers, self.criteria, self, side)
            for block in blocks
            for name, part in block.select_all(*MEASURES)
            for side in (SIDES if both else (self.side,))
        ]
        # As in SCONE, a composite follows its first part.
        self.minimize = node.flag("minimize", not self.parts or self.parts[0].minimize)

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the sum of the weighted parts (w,), and collect their terms and reports.

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """
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
"""Supported measures by SCONE's names."""
