"""Controllers that are evaluated at control steps and hold their controls in between.

The memory of a controller (delayed sensors, states of the legs, the held controls, the next step of
the integrator) is recorded at each control step in a table. A run that continues from this table
and from the state at a control step gives the same bits as a run that was never interrupted.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import floor, inf
from typing import TYPE_CHECKING, Any, Protocol, Self
from zlib import crc32

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.errors import SettingError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.reflexes import LEG_STATE, REFLEXES
from osimlite.mechanics.kernels.sensors import SENSOR_PLAN
from osimlite.mechanics.kernels.walks import LEGS, PROGRESS
from osimlite.mechanics.multibody.functions import ConstantValue, PiecewiseConstant, SmoothFunction
from osimlite.simulation.run_controls import find_constant_offsets

if TYPE_CHECKING:
    from osimlite.schema.model import Model
    from osimlite.simulation.elements.controls import Controls

TIME_TOLERANCE = 1e-9
"""Largest distance of a time from a control step, as a fraction of the step, at which both count as equal."""


class Gain(NamedTuple):
    """Number of a controller that sweeps and searches can vary.

    Attributes:
        name: name of the gain.
        value: present value of the gain.
        low: lower bound.
        high: upper bound.
    """

    name: str
    value: float
    low: float  # lower bound
    high: float

    @property
    def path(self) -> str:
        """Name of the gain, because a gain is not part of a model and has no path."""
        return self.name


class Controller(Protocol):
    """Feedback controller such as :class:`osimlite.Feedback`."""

    @property
    def digest(self) -> str:
        """Digest of everything that determines the controller."""

    def gains(self, model: Model, engine: Any) -> list[Gain]:
        """Return the gains that can be varied, for a model and its engine."""

    def replace_values(self, values: Mapping[str, float]) -> Self:
        """Return the controller with other values of some gains.

        Args:
            values: new values by the names of the gains.
        """

    def par(self) -> str:
        """Return the values of the gains as the text of a .par file."""

    def compile_for(self, model: Model, engine: Any) -> KernelController:
        """Return the controller in the form of the kernels.

        Args:
            model: model that the controller drives.
            engine: compiled engine of the model.
        """


@dataclass(frozen=True, eq=False)
class KernelController:
    """A controller of a model in the form of the kernels (:mod:`osimlite.mechanics.kernels.walks`)."""

    paths: tuple[str, ...]  # paths of the controls, in the controller's order
    step: float  # length of a control step, s
    sensors: tuple[str, ...]  # labels of the recorded sensors
    sensor_plan: Ints  # plan of the sensor row, see :mod:`osimlite.mechanics.kernels.sensors`
    sensor_numbers: Floats  # numbers of the sensor row
    plan: Ints  # integers of the reflexes, see :mod:`osimlite.mechanics.kernels.reflexes`
    numbers: Floats  # numbers of the reflexes
    gains: Mapping[str, float]  # gains by name, from which the numbers follow

    @property
    def header(self) -> dict[str, str]:
        """Header of the record, by which a continued run recognizes its controller.

        It has the gains and a checksum of everything else, as text by key.

        Returns:
            Texts by key: "gains" as JSON, "reflexes" as a checksum.
        """
        # A checksum tells whether a resumed run has the same reflexes, without writing them out.
        checksum = crc32(self.plan.tobytes() + self.numbers.tobytes())
        return {
            "gains": json.dumps({**self.gains, "fixed_control_step_size": self.step}),
            "reflexes": str(checksum),
        }

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of the record: sensors, states of the legs, controls, next step of the integrator.

        Returns:
            Labels in the order of the record.
        """
        legs = "leg_l.state", "leg_r.state"
        return (*self.sensors, *legs, *self.paths, "next_step")

    def count_steps(self, time: float) -> int:
        """Return the number of complete control steps before a time (s)."""
        return floor(time / self.step + TIME_TOLERANCE)

    def snap_to_step(self, time: float) -> float:
        """Return the exact time of a control step near a time.

        Args:
            time: time, s.

        Returns:
            The time of the control step if it is within the tolerance, else the time itself.
        """
        # 2 s given as 199.99999999 steps of 0.01 s must run 200 steps.
        nearest = round(time / self.step) * self.step
        return nearest if abs(nearest - time) < TIME_TOLERANCE * self.step else time

    def add_constants(self, controls: Controls) -> Controls:
        """Return controls with one constant more for each control of the controller.

        The kernels overwrite the constants at each control step.

        Args:
            controls: controls of the model and of the run.

        Raises:
            SettingError: a control is a Python function, to which machine code cannot add.
        """
        result = controls.add_functions({path: ConstantValue(0.0) for path in self.paths})
        if not isinstance(result.make_record()[2], str):
            raise SettingError(
                "a controller cannot be combined with controls that are Python functions; use numbers or tables"
            )
        return result

    def require_same_controller(self, earlier_record: StoTable | None, end: float) -> None:
        """Check that the record of an earlier run belongs to this controller and ends where that run ended.

        Args:
            earlier_record: record of the earlier run; None if it had no controller.
            end: end of the earlier run, s.

        Raises:
            SettingError: the record is missing, or belongs to another controller or another time.
        """
        if earlier_record is None:
            raise SettingError(
                "the earlier run has no controller.sto, so it had no controller; resume it without one"
            )
        if earlier_record.columns != self.columns:
            raise SettingError(
                "the controller of the earlier run had other sensors or actuators; resume it with the same controller"
            )
        earlier_gains, current_gains = (
            json.loads(header.get("gains", "{}")) for header in (earlier_record.header, self.header)
        )
        for name in {**earlier_gains, **current_gains}:
            if earlier_gains.get(name) != current_gains.get(name):
                earlier_value, current_value = (
                    f"{gains[name]:g}" if name in gains else "none"
                    for gains in (earlier_gains, current_gains)
                )
                raise SettingError(
                    f"the earlier run had '{name}' {earlier_value}, this one has {current_value}; resume it with the same value"
                )
        if earlier_record.header.get("reflexes") != self.header["reflexes"]:
            raise SettingError(
                "the earlier run had other reflexes, states of legs or noise; resume it with the same controller"
            )
        # The controller acts at multiples of its step, so that its last row is less than one step
        # before the last state.
        if not 0.0 <= end - earlier_record.times[-1] < self.step * (1.0 + TIME_TOLERANCE):
            raise SettingError(
                f"controller.sto ends at {earlier_record.times[-1]:g} s, "
                f"but states.sto ends at {end:g} s; use files of the same run"
            )

    def make_runs(
        self,
        engine: Any,
        controls: Controls,
        to: float = 0.0,
        earlier_record: StoTable | None = None,
        other_controllers: Sequence[KernelController] = (),
    ) -> ControllerRuns:
        """Return the workspace of a run of this model, and of further models.

        Args:
            engine: engine of one of the models, driven by `controls`.
            controls: controls with the constants of :meth:`add_constants`.
            to: end of a single run, s; 0 for runs that are not recorded.
            earlier_record: record of the earlier run that a single run continues; None if there is
                none.
            other_controllers: controllers of the models of further runs.
        """
        return ControllerRuns((self, *other_controllers), engine, controls, to, earlier_record)


class ControllerRuns:
    """Workspace and record of runs with a controller.

    Args:
        controllers: controllers of the models of all runs, which differ in numbers only.
        engine: engine of one of the models, driven by `controls`.
        controls: controls that have a constant for each control of the controller, see
            :meth:`KernelController.add_constants`.
        to: end of a single run, which is recorded, s.
        earlier_record: record of the earlier run that a single run continues.

    Attributes:
        next_step: step with which the earlier run ended, s; None without one.
        parts: further arguments of the law `run_by_reflexes`.
    """

    def __init__(
        self,
        controllers: Sequence[KernelController],
        engine: Any,
        controls: Controls,
        to: float,
        earlier_record: StoTable | None,
    ) -> None:
        first_controller = controllers[0]
        count = len(controllers)
        self.controller = first_controller
        self._before = earlier_record
        self.next_step: float | None = None
        plan = first_controller.plan.copy()
        sensor_plan = first_controller.sensor_plan
        # All runs use the memory of the longest delay.
        plan[REFLEXES.HISTORY_LENGTH] = max(
            controller.plan[REFLEXES.HISTORY_LENGTH] for controller in controllers
        )
        plan[REFLEXES.MEMORY_SIZE] = max(
            controller.plan[REFLEXES.MEMORY_SIZE] for controller in controllers
        )
        control_offsets = find_constant_offsets(engine, controls)[
            [controls.names.index(path) for path in first_controller.paths]
        ]
        self._memory = np.zeros((count, plan[REFLEXES.MEMORY_SIZE]))
        rows = np.zeros((count, sensor_plan[SENSOR_PLAN.SIZE]))
        # UNKNOWN lets the first sensors decide the state of a leg; legs without states keep 0.
        self._memory[:, :LEGS] = (
            LEG_STATE.UNKNOWN if plan[REFLEXES.HAS_STATES] else LEG_STATE.EARLY_STANCE
        )
        self._excitations = np.zeros((count, len(first_controller.paths)))
        self._progress: Ints = np.zeros((count, PROGRESS.SIZE), dtype=np.int64)
        if earlier_record is not None:
            self._restore_memory(plan, earlier_record)
        if to > 0.0:
            plan[REFLEXES.ROWS] = first_controller.count_steps(to) + 2 - plan[REFLEXES.FIRST]
        self._record = np.empty((plan[REFLEXES.ROWS], len(first_controller.columns)))
        self._plan = plan
        sensor_numbers = np.stack([controller.sensor_numbers for controller in controllers])
        numbers = np.concatenate([controller.numbers for controller in controllers])
        self.parts = (
            *(sensor_plan, sensor_numbers, control_offsets, plan, numbers),
            *(self._memory, rows, self._excitations, self._record, self._progress),
        )

    def _restore_memory(self, plan: Ints, earlier_record: StoTable) -> None:
        """Restore the memory of the controller from the record of an earlier run.

        Args:
            plan: integers of the controller, which get the first step of this run.
            earlier_record: record of the earlier run.
        """
        frame_count = self.controller.count_steps(earlier_record.times[-1]) + 1
        history_size = int(plan[REFLEXES.HISTORY_LENGTH])
        sensor_count = len(self.controller.sensors)
        history = self._memory[0, LEGS : LEGS + history_size * sensor_count].reshape(
            history_size, sensor_count
        )
        for age, row in enumerate(earlier_record.rows[: -1 - history_size : -1]):
            # The history of the sensors is a ring buffer of `history_size` frames, indexed by the number of
            # the frame.
            history[(frame_count - 1 - age) % history_size] = row[:sensor_count]
        last_row = earlier_record.rows[-1, sensor_count:]
        self._memory[0, :LEGS], self._excitations[0], self.next_step = (
            last_row[:LEGS],
            last_row[LEGS:-1],
            float(last_row[-1]),
        )
        self._progress[0, [PROGRESS.STEPS, PROGRESS.FRAMES]] = plan[REFLEXES.FIRST] = frame_count

    def table(self, end: float = inf) -> StoTable:
        """Return the record of a single run.

        It begins with the last rows of the earlier run, which a later continuation needs for its
        delays.

        Args:
            end: end of the motion, s; an interrupted motion may end before the last control steps.

        Returns:
            One row for each control step, with the columns of the controller.
        """
        new_count = int(self._progress[0, PROGRESS.STEPS] - self._plan[REFLEXES.FIRST])
        times = self.controller.step * np.arange(
            self._progress[0, PROGRESS.STEPS] - new_count,
            self._progress[0, PROGRESS.STEPS],
            dtype=np.float64,
        )
        rows = self._record[:new_count].copy()
        if self._before is not None:
            history_size = int(self._plan[REFLEXES.HISTORY_LENGTH])
            times = np.concatenate([self._before.times[-history_size:], times])
            rows = np.concatenate([self._before.rows[-history_size:], rows])
        count = int(
            np.searchsorted(times, end + TIME_TOLERANCE * self.controller.step, side="right")
        )
        return StoTable(
            "controller",
            times[:count],
            self.controller.columns,
            rows[:count],
            header=self.controller.header,
        )

    def add_record(self, controls: Controls) -> Controls:
        """Return controls with the recorded controls of a single run added, as functions of time.

        Args:
            controls: controls of the model and of the run.
        """
        table = self.table()
        times = tuple(table.times.tolist())
        added: Mapping[str, SmoothFunction] = {
            path: PiecewiseConstant(times, tuple(table[path].tolist()))
            for path in self.controller.paths
        }
        return controls.add_functions(added)
