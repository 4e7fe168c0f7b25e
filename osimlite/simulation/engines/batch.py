"""Several motions of the compiled engine: the arrays that they read and write, and the call that computes them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.mechanics import kernels
from osimlite.mechanics.kernels import record
from osimlite.mechanics.kernels.condensation import condensation_size
from osimlite.mechanics.kernels.error_control import ERRORS
from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.table import LAW_MODULES
from osimlite.simulation.batches import BatchOptions
from osimlite.simulation.options import INITIAL_STEP

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import HeldRuns
    from osimlite.simulation.engines.base import KernelEngine

NO_KINDS, NO_LEVELS = np.zeros((0, 3), dtype=np.int64), np.zeros((0, 7))


class Batch:
    """Runs that differ in their starts or in their numbers.

    Args: engine: whose mechanism. states: where the runs start (W, y). options: how they go;
        watches are given as `kinds` and `levels`. start: time from which they go on, s. next_step:
        that is tried first, s. vectors: numbers, one row for all or one for each run. kinds: of the
        watches (k, 3). levels: of the watches (k, 7). most_logged: room for steps in the log, which
        all runs share. start_holds: the constraints hold where the runs start; otherwise they start
        from the nearest such states. held: of a controller that they go by, which writes into the
        numbers of each.

    Attributes:
        clocks: time and next step of each run, s (W, 2).
        counts: see :mod:`osimlite.mechanics.kernels.record` (W, 6).
        states: at the end (W, y).
        endings: of the runs (W,).
        reports: states at the times (W, r, y), not a number after the end of a run.
        events: time, number, 1 for a beginning, and the state if it is kept (W, e, 3 or 3 + y).
        peaks: largest force of each contact and its time (W, P, 2).
        log: of each step time, state and derivative.
        forces: of each step the force of each contact.
        errors: of the step that was tried last (y,).
    """

    def __init__(
        self,
        engine: KernelEngine,
        states: ArrayLike,
        options: BatchOptions,
        *,
        start: float = 0.0,
        next_step: float = INITIAL_STEP,
        vectors: Floats | None = None,
        kinds: Ints = NO_KINDS,
        levels: Floats = NO_LEVELS,
        most_logged: int = 0,
        start_holds: bool = False,
        held: HeldRuns | None = None,
    ) -> None:
        self.states = engine.state.table(states)
        (count, size), pairs = self.states.shape, len(engine.contacts)
        self._engine, self._kinds, self._levels, self._held = engine, kinds, levels, held
        self._vectors = engine.numbers[None] if vectors is None else vectors
        self._times = np.array(options.report_times, dtype=np.float64)
        self._settings = options.to, options.accuracy, *engine.counted, *options.step_bounds
        s, event, program = engine.structure, 3 + size * options.event_states, engine.program
        method = import_module(f"{kernels.__name__}.{LAW_MODULES[options.integrator]}")
        self._method_at = int(s[MODEL.WORK_SIZE]) + 3 * (pairs + len(kinds))
        self._room = self._method_at + method.HEAD + method.STATES * size
        if method.IS_IMPLICIT:
            program.link_responses(options.integrator)
            self._room += condensation_size(int(s[MODEL.DOFS]), int(s[MODEL.RESPONSES]))
        sizes = (
            options.most_tries,
            len(self._times),
            options.most_events,
            event,
            len(kinds),
            most_logged,
        )
        address = program.code.address(options.integrator)
        self._sizes = np.array((*sizes, start_holds, address, self._method_at), dtype=np.int64)
        self.clocks = np.empty((count, 2))
        self.clocks[:] = start, next_step
        self.counts, self.endings = (
            np.zeros((count, record.COUNTED), dtype=np.int64),
            np.zeros(count, dtype=np.int64),
        )
        self.reports = np.full((count, len(self._times), size), np.nan)
        self.events, self.peaks = (
            np.zeros((count, options.most_events, event)),
            np.zeros((count, pairs, 2)),
        )
        self.log, self.forces = (
            np.empty((most_logged, 1 + 2 * size)),
            np.empty((most_logged, pairs, 3)),
        )

    def allow(self, steps: int) -> None:
        """Let the next call end after so many steps, or when the log is full."""
        self._sizes[record.MOST_LOGGED] = min(steps, len(self.log))

    def room(self) -> Floats:
        """What a call of `run` works on; a method goes on from what it has left there."""
        return np.zeros(self._room)

    def run(self, room: Floats, first: int = 0, last: int | None = None) -> None:
        """Compute the runs from `first` up to `last`; other threads compute others in rooms of theirs."""
        size = self.states.shape[1]
        first_error = int(self._engine.structure[MODEL.WORK_STATE]) + ERRORS * size
        self.errors = room[first_error : first_error + size]
        vectors = self._vectors
        each = vectors.shape[1] if len(vectors) > 1 else 0
        own = self._sizes, self.clocks, self.counts, self.states
        records = self._times, self.reports, self.log, self.forces, self.events, self.peaks
        law, more = (
            ("run_several", ()) if self._held is None else ("run_by_reflexes", self._held.parts)
        )
        parts = *records, self._kinds, self._levels, self.endings, *more
        self._call(
            law,
            vectors,
            room,
            each,
            *own,
            *parts,
            first,
            len(self.states) if last is None else last,
        )

    def hold(self, law: str, room: Floats, numbers: Floats, *parts: Any) -> int:
        """Compute by a law of :mod:`osimlite.mechanics.kernels.walks`, with what it takes besides.

        Args:
            law: its name.
            room: as of `run`.
            numbers: of the model (x,), which are changed.
            parts: as said.
        """
        return self._call(
            law,
            numbers,
            room,
            self._sizes,
            self.clocks,
            self.counts,
            self.states,
            self.peaks,
            *parts,
        )

    def _call(self, law: str, numbers: Floats, room: Floats, *parts: Any) -> int:
        room[self._method_at :][: len(self._settings)] = self._settings
        program = self._engine.program
        return program.run(program.code.entry(law), program.ints, numbers, room, *parts)
