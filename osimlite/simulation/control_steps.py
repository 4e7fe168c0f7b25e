"""Controls that are computed at control steps and held between: what a run is given of a controller, and keeps of it.

What a controller knows of what was (its sensors over as long as they are delayed, states of legs,
the controls that are held, the step that the integrator would try next) is recorded at each control
step, in a table: a run that goes on from the table and the state at a control step goes on to the
last bit as if it had not ended.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import floor, inf
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self
from zlib import crc32

import numpy as np

from osimlite.base.records import dataclass
from osimlite.errors import SettingError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.reflexes import EARLY_STANCE, REFLEXES, UNKNOWN
from osimlite.mechanics.kernels.sensors import SENSES
from osimlite.mechanics.kernels.walks import COUNTS, FRAMES, LEGS, STEPS
from osimlite.mechanics.multibody.functions import Constant, Function, PiecewiseConstant
from osimlite.simulation.options import INITIAL_STEP
from osimlite.simulation.run_controls import places_of

if TYPE_CHECKING:
    from osimlite.schema.model import Model
    from osimlite.simulation.elements.controls import Controls

NEAR = 1e-9
"""A time that is so near to the start of a control step, as part of one, is that."""


class Gain(NamedTuple):
    """A number of a controller that can be varied."""

    name: str
    value: float
    low: float  # bounds
    high: float

    @property
    def path(self) -> str:
        """The name again: it is no part of a model."""
        return self.name


class Controller(Protocol):
    """What drives actuators by what it feels, such as :class:`osimlite.Feedback`."""

    @property
    def digest(self) -> str:
        """Of all that it is."""

    def gains(self, model: Model, engine: Any) -> list[Gain]:
        """What can be varied of it, for a model with its engine."""

    def with_values(self, values: Mapping[str, float]) -> Self:
        """The same with other values of some gains."""

    def par(self) -> str:
        """The values of gains that are given, as a file (.par)."""

    def compile_for(self, model: Model, engine: Any) -> Held:
        """What the kernels go by, for a model with its engine."""


@dataclass(frozen=True, eq=False)
class Held:
    """A controller of a model, as the kernels have it (:mod:`osimlite.mechanics.kernels.walks`)."""

    paths: tuple[str, ...]  # of the controls, in the order that it has them
    step: float  # for which they are held, s
    sensors: tuple[str, ...]  # what is remembered of a control step
    senses: Ints  # see :mod:`osimlite.mechanics.kernels.sensors`
    known: Floats  # its numbers
    plan: Ints  # see :mod:`osimlite.mechanics.kernels.reflexes`
    numbers: Floats  # its numbers
    gains: Mapping[str, float]  # what these are made of, by the names that it has for them

    @property
    def header(self) -> dict[str, str]:
        """By what the table tells that it is of this very controller: gains, and a sum over all else that counts."""
        others = crc32(self.plan.tobytes() + self.numbers.tobytes())
        return {
            "gains": json.dumps({**self.gains, "fixed_control_step_size": self.step}),
            "reflexes": str(others),
        }

    @property
    def columns(self) -> tuple[str, ...]:
        """Of the table of what is recorded."""
        legs = "leg_l.state", "leg_r.state"
        return (*self.sensors, *legs, *self.paths, "next_step")

    def steps_in(self, time: float) -> int:
        """How many control steps there are up to a time, s."""
        return floor(time / self.step + NEAR)

    def nearest(self, time: float) -> float:
        """The very time of the control step that begins at a time, s, if one does."""
        nearest = round(time / self.step) * self.step
        return nearest if abs(nearest - time) < NEAR * self.step else time

    def open_to(self, controls: Controls) -> Controls:
        """Controls to which the controller adds.

        Raises:
            SettingError: one is a function of Python, beside which no machine code adds anything.
        """
        result = controls.add_functions({path: Constant(0.0) for path in self.paths})
        if not isinstance(result.make_record()[2], str):
            raise SettingError(
                "beside a controller, controls are numbers or tables, not functions of Python"
            )
        return result

    def require_known(self, before: StoTable | None, end: float) -> None:
        """Refuse what was recorded of another controller, or not up to the end of a run (s).

        Raises:
            SettingError: it is so.
        """
        if before is None:
            raise SettingError(
                "the run that this one goes on from has left no controller.sto, and so had no controller"
            )
        if before.columns != self.columns:
            raise SettingError(
                "the run that this one goes on from had a controller with other sensors or actuators"
            )
        theirs, ours = (
            json.loads(header.get("gains", "{}")) for header in (before.header, self.header)
        )
        for name in {**theirs, **ours}:
            if theirs.get(name) != ours.get(name):
                one, other = (
                    f"{each[name]:g}" if name in each else "none" for each in (theirs, ours)
                )
                raise SettingError(
                    f"the run that this one goes on from had '{name}' {one}, and this has {other}; go on with the same"
                )
        if before.header.get("reflexes") != self.header["reflexes"]:
            raise SettingError(
                "the run that this one goes on from had other reflexes, states of legs or noise"
            )
        if not 0.0 <= end - before.times[-1] < self.step * (1.0 + NEAR):
            raise SettingError(
                f"what is known of the controller ends at {before.times[-1]:g} s, the states at {end:g} s"
            )

    def runs(
        self,
        engine: Any,
        controls: Controls,
        to: float = 0.0,
        before: StoTable | None = None,
        others: Sequence[Held] = (),
    ) -> HeldRuns:
        """A run of the model, and of others; see `HeldRuns`."""
        return HeldRuns((self, *others), engine, controls, to, before)


class HeldRuns:
    """Runs by a controller.

    Args: helds: of the models of all runs, which differ in numbers only. engine: of one of the
        models, which is driven by `controls`. controls: in which each of the controller's has a
        number of its own, see :meth:`Held.open_to`. to: time at which a single run ends, which is
        recorded, s. before: what was recorded of the run that a single one goes on from.

    Attributes:
        next_step: that the integrator tries first, s.
        parts: what `run_by_reflexes` takes besides.
    """

    def __init__(
        self,
        helds: Sequence[Held],
        engine: Any,
        controls: Controls,
        to: float,
        before: StoTable | None,
    ) -> None:
        held, count = helds[0], len(helds)
        self.held, self._before, self.next_step = held, before, INITIAL_STEP
        plan, senses = held.plan.copy(), held.senses
        # The longest delay of all tells what each has room for.
        plan[REFLEXES.KEPT] = max(each.plan[REFLEXES.KEPT] for each in helds)
        plan[REFLEXES.ROOM] = max(each.plan[REFLEXES.ROOM] for each in helds)
        driven = places_of(engine, controls)[[controls.names.index(path) for path in held.paths]]
        self._room, rows = (
            np.zeros((count, plan[REFLEXES.ROOM])),
            np.zeros((count, senses[SENSES.SIZE])),
        )
        self._room[:, :LEGS] = UNKNOWN if plan[REFLEXES.HAS_STATES] else EARLY_STANCE
        self._excitations = np.zeros((count, len(held.paths)))
        self._progress: Ints = np.zeros((count, COUNTS), dtype=np.int64)
        if before is not None:
            self._go_on(plan, before)
        if to > 0.0:
            plan[REFLEXES.ROWS] = held.steps_in(to) + 2 - plan[REFLEXES.FIRST]
        self._record, self._plan = np.empty((plan[REFLEXES.ROWS], len(held.columns))), plan
        known, numbers = (
            np.stack([each.known for each in helds]),
            np.concatenate([each.numbers for each in helds]),
        )
        self.parts = (
            *(senses, known, driven, plan, numbers),
            *(self._room, rows, self._excitations, self._record, self._progress),
        )

    def _go_on(self, plan: Ints, before: StoTable) -> None:
        """Know what was."""
        frames = self.held.steps_in(before.times[-1]) + 1
        kept, sensors = int(plan[REFLEXES.KEPT]), len(self.held.sensors)
        history = self._room[0, LEGS : LEGS + kept * sensors].reshape(kept, sensors)
        for back, row in enumerate(before.rows[: -1 - kept : -1]):
            history[(frames - 1 - back) % kept] = row[:sensors]
        last = before.rows[-1, sensors:]
        self._room[0, :LEGS], self._excitations[0], self.next_step = (
            last[:LEGS],
            last[LEGS:-1],
            float(last[-1]),
        )
        self._progress[0, [STEPS, FRAMES]] = plan[REFLEXES.FIRST] = frames

    def table(self, end: float = inf) -> StoTable:
        """What was recorded of a single run, after the last rows of the one before that a further one would need.

        Args: end: of the motion, s; that of one which was interrupted may lie before the last
            control steps.
        """
        new = int(self._progress[0, STEPS] - self._plan[REFLEXES.FIRST])
        times = self.held.step * np.arange(
            self._progress[0, STEPS] - new, self._progress[0, STEPS], dtype=np.float64
        )
        rows = self._record[:new].copy()
        if self._before is not None:
            kept = int(self._plan[REFLEXES.KEPT])
            times = np.concatenate([self._before.times[-kept:], times])
            rows = np.concatenate([self._before.rows[-kept:], rows])
        count = int(np.searchsorted(times, end + NEAR * self.held.step, side="right"))
        return StoTable(
            "controller", times[:count], self.held.columns, rows[:count], header=self.held.header
        )

    def added_to(self, controls: Controls) -> Controls:
        """Controls with what the controller has added in a single run, as functions of time."""
        table = self.table()
        times = tuple(table.times.tolist())
        added: Mapping[str, Function] = {
            path: PiecewiseConstant(times, tuple(table[path].tolist())) for path in self.held.paths
        }
        return controls.add_functions(added)
