"""Workspace of several motions of the compiled engine, and the kernel calls that compute them."""

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

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import ControllerRuns
    from osimlite.simulation.engines.base import KernelEngine

NO_WATCH_KINDS = np.zeros((0, 3), dtype=np.int64)
"""Kinds of an empty list of watches."""

NO_WATCH_LEVELS = np.zeros((0, 7))
"""Levels of an empty list of watches."""


class BatchWorkspace:
    """Workspace of runs that differ in their initial states or in their numbers.

    Args:
        engine: the engine.
        states: initial states (W, y).
        options: options; watches are given as `kinds` and `levels`.
        start: start time, s.
        next_step: first step that is tried, s; that of the options if None.
        vectors: numbers of the model, one row for all runs or one for each; None for those of the
            engine.
        kinds: kinds of the watches (k, 3).
        levels: levels of the watches (k, 7).
        most_logged: largest number of steps in the log, which all runs share.
        start_holds: whether the initial states fulfil the constraints; otherwise the runs start
            from the nearest states that do.
        controller_runs: controllers of the runs, which write into the numbers of each run; None without
            controllers.

    Attributes:
        clocks: time and next step of each run, s (W, 2).
        counts: see :mod:`osimlite.mechanics.kernels.record` (W, 6).
        states: states at the end (W, y).
        endings: reason why each run ended, one of :class:`osimlite.mechanics.kernels.record.ENDING`
            (W,).
        reports: states at the report times (W, r, y), NaN after the end of a run.
        events: time, index, 1 for a begin, and the state if it is recorded (W, e, 3 or 3 + y).
        peaks: largest force of each contact and its time (W, P, 2).
        log: time, state and derivative of each step.
        forces: contact forces of each step.
        errors: errors of the last attempted step (y,).
    """

    def __init__(
        self,
        engine: KernelEngine,
        states: ArrayLike,
        options: BatchOptions,
        *,
        start: float = 0.0,
        next_step: float | None = None,
        vectors: Floats | None = None,
        kinds: Ints = NO_WATCH_KINDS,
        levels: Floats = NO_WATCH_LEVELS,
        most_logged: int = 0,
        start_holds: bool = False,
        controller_runs: ControllerRuns | None = None,
    ) -> None:
        self.states = engine.state.to_table(states)
        (count, size), pairs = self.states.shape, len(engine.contacts)
        self._engine = engine
        self._kinds = kinds
        self._levels = levels
        self._controller_runs = controller_runs
        self._vectors = engine.numbers[None] if vectors is None else vectors
        self._times = np.array(options.report_times, dtype=np.float64)
        self._settings = options.to, options.accuracy, *engine.error_counts, *options.step_bounds
        s = engine.structure
        event = 3 + size * options.event_states
        program = engine.program
        method = import_module(f"{kernels.__name__}.{LAW_MODULES[options.integrator]}")
        # After the work vector follow the positions of contacts and watches, then the head and the
        # stages of the method.
        self._method_at = int(s[MODEL.WORK_SIZE]) + 3 * (pairs + len(kinds))
        self._workspace_size = self._method_at + method.HEAD + method.STATES * size
        # Implicit methods solve with a Jacobian, which needs the derivatives of the forces.
        if method.IS_IMPLICIT:
            program.link_responses(options.integrator)
            self._workspace_size += condensation_size(int(s[MODEL.DOFS]), int(s[MODEL.RESPONSES]))
        sizes = (
            options.most_tries,
            len(self._times),
            options.most_events,
            event,
            len(kinds),
            most_logged,
        )
        address = program.code.get_address(options.integrator)
        self._sizes = np.array((*sizes, start_holds, address, self._method_at), dtype=np.int64)
        self.clocks = np.empty((count, 2))
        self.clocks[:] = start, options.initial_step if next_step is None else next_step
        self.counts = np.zeros((count, record.COUNTS.SIZE), dtype=np.int64)
        self.endings = np.zeros(count, dtype=np.int64)
        # Rows that a run does not reach stay NaN.
        self.reports = np.full((count, len(self._times), size), np.nan)
        self.events = np.zeros((count, options.most_events, event))
        self.peaks = np.zeros((count, pairs, 2))
        self.log = np.empty((most_logged, 1 + 2 * size))
        self.forces = np.empty((most_logged, pairs, 3))

    def limit_steps(self, steps: int) -> None:
        """Let the next call end after a number of steps, or when the log is full.

        Args:
            steps: number of steps.
        """
        self._sizes[record.RUN_SIZES.MOST_LOGGED] = min(steps, len(self.log))

    def make_workspace(self) -> Floats:
        """Return a new workspace of :meth:`run`.

        A method of several steps keeps its history there, so a motion continues with the same
        workspace.
        """
        return np.zeros(self._workspace_size)

    def run(self, workspace: Floats, first: int = 0, last: int | None = None) -> None:
        """Compute some of the runs.

        Other threads may compute others at the same time, in their own workspaces.

        Args:
            workspace: the workspace.
            first: index of the first run.
            last: index after the last run; by default all that follow.
        """
        size = self.states.shape[1]
        first_error = int(self._engine.structure[MODEL.WORK_STATE]) + ERRORS * size
        self.errors = workspace[first_error : first_error + size]
        vectors = self._vectors
        # A stride of 0 lets all runs share one row of numbers.
        vector_stride = vectors.shape[1] if len(vectors) > 1 else 0
        run_arrays = self._sizes, self.clocks, self.counts, self.states
        records = self._times, self.reports, self.log, self.forces, self.events, self.peaks
        law, controller_parts = (
            ("run_several", ())
            if self._controller_runs is None
            else ("run_by_reflexes", self._controller_runs.parts)
        )
        further_arrays = *records, self._kinds, self._levels, self.endings, *controller_parts
        self._call_law(
            law,
            vectors,
            workspace,
            vector_stride,
            *run_arrays,
            *further_arrays,
            first,
            len(self.states) if last is None else last,
        )

    def run_walk_law(self, law: str, workspace: Floats, numbers: Floats, *parts: Any) -> int:
        """Call a kernel of :mod:`osimlite.mechanics.kernels.walks`.

        Args:
            law: name of the kernel.
            workspace: workspace, see :meth:`make_workspace`.
            numbers: numbers of the model (x,), which the kernel changes.
            parts: further arguments of the kernel.

        Returns:
            The result of the kernel.
        """
        return self._call_law(
            law,
            numbers,
            workspace,
            self._sizes,
            self.clocks,
            self.counts,
            self.states,
            self.peaks,
            *parts,
        )

    def _call_law(self, law: str, numbers: Floats, workspace: Floats, *parts: Any) -> int:
        workspace[self._method_at :][: len(self._settings)] = self._settings
        program = self._engine.program
        return program.run(program.code.get_entry(law), program.ints, numbers, workspace, *parts)
