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

from osimlite.base.text import add_article, suggest_or_list
from osimlite.mechanics.kernels.criteria import (
    CRITERION,
    CRITERION_TYPE,
    GAIT_WORK,
    JUMP_PHASE,
    JUMP_WORK,
    SAMPLE_WORK,
)
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.sensors import SENSOR_PLAN
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

    def add(self, criterion_type: int, index: int, measure: Measure, *numbers: float) -> int:
        """Request a criterion for the time in which a measure is active.

        Args:
            criterion_type: kind of criterion, such as `CRITERION_TYPE.GAIT` of the kernels.
            index: index in the sensor row, or a power of activations.
            measure: measure that needs it.
            numbers: numbers of the criterion, see `CRITERION_NUMBERS` of the kernels.

        Returns:
            Offset of the criterion in the workspace.
        """
        offset = self.size
        self._ints += criterion_type, index, len(self._numbers), offset
        self._numbers += measure.start, measure.stop, *numbers
        self.size += (
            GAIT_WORK.STEPS + 2 * self.max_steps
            if criterion_type == CRITERION_TYPE.GAIT
            else SAMPLE_WORK.SIZE
        )
        return offset

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
        criteria: criteria of the scenario, to which the measure adds those that it needs.
        parent: composite measure that this one is a part of; None if there is none.
        side: ending of names of one side, or "" for a measure of both.

    Attributes:
        name: name in the table of results.
        weight: factor of the measure in the total score.
        start: time from which the measure is active (s).
        stop: time until which it is active (s).
        report: further quantities of each candidate (w,), by name: power per mass ("power", W/kg)
            and cost of transport ("transport", J/(kg m)) of efforts.
        terms: weighted results of the measure and of its parts by name (w,).
        minimize: whether the measure is to be minimized; the attribute of the class is the default.
    """

    minimize = True

    def __init__(
        self,
        node: SettingNode,
        walkers: Walkers,
        criteria: Criteria,
        parent: Measure | None = None,
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
        soft_threshold = node.get("soft_threshold")
        self.offset = node.number("result_offset", 0.0)
        self.threshold = None if threshold is None else node.number("threshold")
        # SCONE's soft threshold subtracts the threshold from the value, then cuts at zero. SCONE lets
        # it replace the two others without a word.
        if soft_threshold is not None:
            for key in ("result_offset", "threshold"):
                excluded = node.get(key)
                if excluded is not None:
                    raise excluded.error(
                        f"'{key}' and 'soft_threshold' exclude each other; keep one"
                    )
            self.offset = -node.number("soft_threshold")
            self.threshold = 0.0
        self.transition = node.number("threshold_transition", 0.0)
        self.start = node.number("start_time", 0.0)
        # SCONE's default of 0 means no end.
        self.stop = node.number("stop_time", 0.0) or inf
        if parent is not None:
            self.start = max(self.start, parent.start)
            self.stop = min(self.stop, parent.stop)
        self.minimize = node.flag("minimize", self.minimize)
        self.report: dict[str, Array] = {}
        self.terms: dict[str, Array] = {}
        self.read(node)
        node.refuse_unread_parts(add_article(type(self).__name__), tuple(MEASURES))

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
            threshold, transition = self.threshold, self.transition
            # In the transition the value rises from 0 at the threshold to its full size at the end.
            blended_value = value * (value - threshold) / transition if transition > 0.0 else value
            value = np.where(
                value < threshold,
                0.0,
                np.where(value < threshold + transition, blended_value, value),
            )
        weighted_value: Array = self.weight * value
        # A composite measure has collected the terms of its parts, its own would count them twice.
        self.terms = self.terms or {self.name: weighted_value}
        return weighted_value

    def read_recorded(self, offset: int, index: int) -> Array:
        """Return a number of a criterion from the workspaces of the candidates (w,).

        Args:
            offset: offset of the criterion, see `Criteria.add`.
            index: index within the criterion.
        """
        recorded: Array = self.walkers.criteria_work[:, offset + index]
        return recorded

    def average_over_time(self, offset: int) -> Array:
        """Return the time average of a criterion (w,).

        A criterion that was active for no time has its last value.
        """
        total, duration, last_value = (
            self.read_recorded(offset, index)
            for index in (SAMPLE_WORK.TOTAL, SAMPLE_WORK.SPAN, SAMPLE_WORK.VALUE)
        )
        return np.divide(total, duration, out=last_value.copy(), where=duration > 0.0)


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
        node.refuse_flags("a GaitMeasure", ("use_height_wrt_feet", "use_initial_heading"))
        node.refuse_parts("a GaitMeasure", ("continue_after_fall", "base_bodies", "direction"))
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
        for candidate, recorded in enumerate(self.walkers.criteria_work[:, self._first :]):
            row = recorded[: GAIT_WORK.STEPS + 2 * int(recorded[GAIT_WORK.COUNT])].tolist()
            numbers = row[GAIT_WORK.STEPS :]
            # The kernels note completed steps; the unfinished last one ends with the walk.
            last_step = float(times[candidate]), row[GAIT_WORK.HERE] - row[GAIT_WORK.BEFORE]
            steps = [*zip(numbers[::2], numbers[1::2], strict=True), last_step]
            # SCONE ignores the first steps, but fewer of them if there are hardly more.
            first_counted = min(max(len(steps) - self.first_steps, 0), self.first_steps)
            total_score = time = length = 0.0
            for number, (t, step_length) in enumerate(steps):
                dt = t - (steps[number - 1][0] if number else 0.0)
                if number < first_counted or dt <= 0.0:
                    continue
                speed = step_length / dt
                if speed < self.low:
                    speed_deviation = speed - self.low
                elif speed > self.high:
                    speed_deviation = speed - self.high
                else:
                    speed_deviation = 0.0
                total_score += dt * min(max(1.0 - abs(speed_deviation) / target, -1.0), 1.0)
                time, length = time + dt, length + step_length
            # The time after a fall counts as time without progress, so that longer walks score
            # better.
            if times[candidate] < duration and (row[GAIT_WORK.FALLEN] or self.always):
                time += duration - float(times[candidate])
            result[candidate] = 1.0 - total_score / time if time else 1.0
            speeds[candidate] = length / time if time else 0.0
            counts[candidate] = len(steps)
        self.report = {"speed": speeds, "steps": counts}
        return result


class JumpMeasure(Measure):
    """Height of a jump of the mass centre (cm), to be maximized by default."""

    minimize = False

    def read(self, node: SettingNode) -> None:
        """Read when a jump starts and ends."""
        node.refuse_parts(
            "a JumpMeasure",
            ("jump_type", "jump_angle", "body", "target_body", "offset", "recover_time"),
        )
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
        """Return the peak height minus the rise during preparation (w,) (cm), negative if `negates`.

        For a jumper that never leaves the preparation, the mean rise is extrapolated to one second,
        so that an optimizer sees which of two failures is nearer to a jump.

        Args:
            times: times at which the jumps ended (w,) (s).
            duration: longest duration (s).
        """
        start, height, peak, prepared, phase = (
            self.read_recorded(self._first, getattr(JUMP_WORK, name))
            for name in ("START", "HERE", "PEAK", "PREPARED", "PHASE")
        )
        # Rising before the take-off is subtracted: otherwise standing up would count as a jump.
        early = 100.0 * np.maximum(prepared - start, 0.0)
        self.report = {"jump height": 100.0 * peak, "early rise": early}
        jump_height = np.where(
            phase == JUMP_PHASE.PREPARES,
            100.0 * (start + (height - start) / times),
            100.0 * peak - early,
        )
        return -jump_height if self.negates else jump_height


class EffortMeasure(Measure):
    """Effort of the muscles: metabolic power, total force, or a sum of powers of activations."""

    def read(self, node: SettingNode) -> None:
        """Read the type of effort, and compute the masses of the muscles.

        The mass is F_max / specific tension * density * optimal fiber length.
        """
        effort_type = node.text("measure_type")
        walkers = self.walkers
        if effort_type not in EFFORTS:
            raise node.error(
                f"osimlite does not support the effort type '{effort_type}'{suggest_or_list(effort_type, EFFORTS)}"
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
            self.name = effort_type
        self._criterion, power = EFFORTS[effort_type]
        self._first = self.criteria.add(self._criterion, power, self, slow, *masses)

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the mean effort, or the effort per mass and distance (w,).

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """
        total, start, position = (
            self.read_recorded(self._first, k)
            for k in (SAMPLE_WORK.TOTAL, SAMPLE_WORK.START, SAMPLE_WORK.HERE)
        )
        # A smallest distance keeps walkers that fall at once from having an infinite cost of
        # transport.
        distance = np.maximum(self.least_distance, np.abs(position - start))
        if self._criterion == CRITERION_TYPE.WANG:
            mass = self.walkers.mass
            self.report = {
                "power": self.average_over_time(self._first) / mass,
                "transport": total / (mass * distance),
            }
        effort = (
            total / (self.walkers.mass * distance)
            if self.by_distance
            else self.average_over_time(self._first)
        )
        return effort / len(self.walkers.names) if self.by_muscle else effort


class Penalty(Measure):
    """Penalty of values outside a range, accumulated over time: the base of measures of ranges."""

    _statistics: tuple[tuple[str, int], ...] = ()
    """Mode (average, highest, lowest or sum) and offset in the workspace of each criterion."""

    def penalize(
        self, node: SettingNode, criterion_type: int, index: int = 0, factor: float = 1.0
    ) -> None:
        """Request a criterion for the excess of a number beyond a range.

        Args:
            node: node with the range and the penalties.
            criterion_type: kind of criterion of the kernels.
            index: index of the number in the sensor row.
            factor: factor of the number before the comparison, for example 180/pi for degrees.

        Raises:
            DocumentError: the range is empty, or the mode is unknown.
        """
        numbers = [factor, node.number("min", -inf), node.number("max", inf)]
        if numbers[1] > numbers[2]:
            raise node.error(
                f"the range has a minimum of {numbers[1]:g} above its maximum of {numbers[2]:g}"
            )
        numbers.append(node.number("abs_penalty", node.number("abs_range_penalty", 0.0)))
        numbers.append(node.number("squared_penalty", node.number("squared_range_penalty", 0.0)))
        mode = node.text("mode", "average")
        if mode not in ("average", "highest", "lowest", "sum"):
            raise node.error(f"penalties have no mode '{mode}'")
        self._statistics = (
            *self._statistics,
            (mode, self.criteria.add(criterion_type, index, self, *numbers)),
        )

    def compute_result(self, times: Array, duration: float) -> Array:
        """Return the sum of the statistics of all criteria (w,).

        Args:
            times: times at which the walks ended (w,) (s).
            duration: longest duration (s).
        """
        index_by_mode = {
            "sum": SAMPLE_WORK.TOTAL,
            "highest": SAMPLE_WORK.HIGHEST,
            "lowest": SAMPLE_WORK.LOWEST,
        }
        total = np.zeros(self.count)
        for mode, offset in self._statistics:
            total += (
                self.read_recorded(offset, index_by_mode[mode])
                if mode in index_by_mode
                else self.average_over_time(offset)
            )
        return total


class DofMeasure(Penalty):
    """Penalty of a coordinate, its speed, or the force of its limit outside a range."""

    def read(self, node: SettingNode) -> None:
        """Read the coordinate and the ranges; rotations are in degrees unless `in_degrees` is false."""
        name = node.text("dof")
        sensor_plan = self.walkers.sensor_plan
        names = self.walkers.coordinates
        # In a dual-sided composite the side completes the name of the coordinate.
        if name not in names and name + self.side in names:
            name += self.side
        if name not in names:
            raise node.error(f"the model has no coordinate '{name}'{suggest_or_list(name, names)}")
        infos = {info.name: info for info in self.walkers.mechanism.coordinates}
        # Ranges of rotations are in degrees by default, the sensor row is in radians.
        factor = 180.0 / np.pi if node.flag("in_degrees", infos[name].unit == "rad") else 1.0
        for quantity, first_sensor, scale in (
            ("position", SENSOR_PLAN.VALUES, factor),
            ("velocity", SENSOR_PLAN.SPEEDS, factor),
            ("force", SENSOR_PLAN.MOMENTS, 1.0),
            ("limit_torque", SENSOR_PLAN.MOMENTS, 1.0),
        ):
            range_node = node.get(quantity)
            if range_node is not None:
                self.penalize(
                    range_node,
                    CRITERION_TYPE.NUMBER,
                    int(sensor_plan[first_sensor]) + names.index(name),
                    scale,
                )
                range_node.refuse_unread_parts(f"a {quantity}")

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
            else CRITERION_TYPE.TOTAL_LOAD,
        )


class CompositeMeasure(Measure):
    """Sum of measures."""

    def read(self, node: SettingNode) -> None:
        """Read the parts; with `dual_sided` or `symmetric` there is one of each part for either side."""
        node.refuse_flags("a CompositeMeasure", ("use_first_non_zero_result",))
        # `symmetric` applies where `dual_sided` is not set.
        is_dual_sided = node.flag("dual_sided", node.flag("symmetric", False))
        blocks = [node, *(block for _, block in node.select_all("Measures"))]
        self.parts: list[Measure] = [
            MEASURES[name](measure_node, self.walkers, self.criteria, self, side)
            for block in blocks
            for name, measure_node in block.select_all(*MEASURES)
            for side in (SIDES if is_dual_sided else (self.side,))
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
            (measure.add_weighted(times, duration) for measure in self.parts), np.zeros(self.count)
        )
        for measure in self.parts:
            self.terms |= measure.terms
            self.report |= measure.report
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
