"""Steps whose error is controlled, the usual way to follow a motion."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from math import inf, isfinite
from time import perf_counter
from typing import TYPE_CHECKING, Any, NoReturn
from weakref import WeakKeyDictionary

from osimlite.errors import SettingError, SimulationError
from osimlite.mechanics.kernels import record
from osimlite.mechanics.kernels.error_control import error_weight, shortest_step
from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.pointers import Floats, interpolate_cubic
from osimlite.simulation.batches import BatchOptions
from osimlite.simulation.engines.batch import Batch
from osimlite.simulation.options import (
    DEFAULT_ACCURACY,
    INITIAL_STEP,
    INTEGRATORS,
    MERSON,
    NO_BOUNDS,
)
from osimlite.simulation.stepper import IntegrationError, Observer, Progress, Stepper

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import HeldRuns
    from osimlite.simulation.engines.base import KernelEngine

FIRST_STEPS, LOGGED_STEPS = 8, 512
"""So many steps are taken in the first call of an engine's first motion, and in any other at most."""

CALL_SECONDS = 0.1
"""About so long a call may take: nothing is told, and Ctrl-C is not heard, before it ends."""

_at_once: WeakKeyDictionary[KernelEngine, int] = WeakKeyDictionary()
"""So many steps the next call of an engine takes, as the last one went."""


class ControlledSteps(Stepper):
    """Simbody's RungeKuttaMerson, the default integrator of OpenSim, or a method for stiff motion.

    Merson's method propagates a fourth-order solution and estimates its error from an embedded
    third-order one (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
    table 4.1). A step is taken if the norm of the error is at most `accuracy`, and repeated smaller
    if not. With the same derivatives, the steps are OpenSim's to the last bit. The kernels take
    them (:mod:`osimlite.mechanics.kernels.runs`), many in one call where a table of states is asked
    for.

    The methods for stiff motion, :mod:`osimlite.mechanics.kernels.multistep` and `rosenbrock`, keep
    the same norm of the error that they estimate below `accuracy`.

    Args: engine: whose mechanism. t: initial time, s. y: initial state. accuracy: as OpenSim
        understands it. observe: called with (time, state) for each step; of those that a table
        takes, once somebody wants to know. integrator: which of `INTEGRATORS`. step_bounds:
        shortest and longest step of Merson's method, s. held: of a controller.

    Attributes:
        attempted: steps tried so far, of which `taken` were accepted.
    """

    attempted = 0

    def __init__(
        self,
        engine: KernelEngine,
        t: float,
        y: Sequence[float],
        accuracy: float = DEFAULT_ACCURACY,
        observe: Observer | None = None,
        integrator: str = MERSON,
        *,
        step_bounds: tuple[float, float] = NO_BOUNDS,
        held: HeldRuns | None = None,
    ) -> None:
        if not 0.0 < accuracy < 1.0:
            raise SettingError(f"The accuracy must lie between 0 and 1; {accuracy} does not.")
        super().__init__(engine.derivative, t, y, observe, engine.state.names)
        self._engine, self._accuracy, self._integrator, self._step_bounds = (
            engine,
            accuracy,
            integrator,
            step_bounds,
        )
        self._held = held
        self.next_step = (
            min(max(INITIAL_STEP, step_bounds[0]), step_bounds[1])
            if held is None
            else held.next_step
        )
        self._room: Floats | None = None
        self._put_off: list[tuple[Floats, Floats]] = []
        self._seen: tuple[float, list[float], Sequence[float]] = (
            self.time,
            self.state,
            self.derivative,
        )

    @property
    def name(self) -> str:
        """Of the method."""
        return INTEGRATORS[self._integrator]

    def step(self, limit: float = inf) -> None:
        """Take one step of the size that the error allows, and choose the next one."""
        self._require_room(limit)
        self._call(self._batch((), limit), 1)
        self.catch_up()

    def interpolant(self) -> Callable[[float], list[float]]:
        """The cubic Hermite polynomial through the ends of the last step, to where the constraints hold."""
        ends, size = (*self.previous, self.time, self.state, self.derivative), len(self.state)
        engine, tolerance = self._engine, self._accuracy / 10.0

        def held(t: float) -> list[float]:
            y: Any = [0.0] * size
            interpolate_cubic(size, *ends, t, y)  # type: ignore[arg-type]
            return engine.projected(t, y, tolerance) or y

        return held

    def table(self, times: Sequence[float], progress: Progress | None = None) -> Sequence[Any]:
        """The same as of the base as an array."""
        batch = self._batch(times, times[-1])
        try:
            # Whoever looks on is told soon, and often at first.
            first = FIRST_STEPS if progress is not None else _at_once.get(self._engine, FIRST_STEPS)
            for step in self._calls(batch, first):
                if progress is not None:
                    progress(self.time, step)
        except (KeyboardInterrupt, SimulationError) as ended:
            self.ended = ended
        table: Any = batch.reports[0, : bisect_right(times, self.time)]
        return table

    def catch_up(self) -> None:
        """Call `observe` for all steps that it was not called for."""
        waiting, self._put_off = self._put_off, []
        size, end, now = len(self.state), self.state, self.time
        for log, forces in waiting:
            for row, pushes in zip(log.tolist(), forces, strict=True):
                t, y, f = row[0], row[1 : 1 + size], row[1 + size :]
                self.previous = self._seen
                self.time, self.state, self.derivative = self._seen = t, y, f
                self._engine.note_loads(pushes)
                if self._observe is not None:
                    self._observe(t, y)
        self.time, self.state = now, end

    # --------------------------------------------------------------------------------------------- helpers
    def _batch(self, times: Sequence[float], to: float) -> Batch:
        """What goes on from the present state up to a time, with reports at some times, s."""
        if times and times[0] < self.time:
            raise ValueError(f"t = {times[0]:.9g} s is before the present {self.time:.9g} s")
        batch = Batch(
            self._engine,
            [self.state],
            BatchOptions(
                to=to,
                accuracy=self._accuracy,
                integrator=self._integrator,
                report_times=times,
                step_bounds=self._step_bounds,
            ),
            start=self.time,
            next_step=self.next_step,
            most_logged=LOGGED_STEPS,
            start_holds=True,
            held=self._held,
        )
        batch.counts[0, : record.REPORTED] = self.taken, self.attempted, self.evaluations
        batch.reports[0, : bisect_right(times, self.time)] = self.state
        return batch

    def _calls(self, batch: Batch, steps: int) -> Iterator[float]:
        """Take steps until the last report is made, so many first; yields their mean length in each call, s."""
        ending = record.FULL
        while ending == record.FULL:
            started, before, taken = perf_counter(), self.time, self.taken
            ending = self._call(batch, steps)
            # As many as the time allows, but not many more than were tried.
            more = min(
                8.0 * steps, (self.taken - taken) * CALL_SECONDS / (perf_counter() - started)
            )
            steps = _at_once[self._engine] = min(max(1, int(more)), LOGGED_STEPS)
            yield (self.time - before) / max(self.taken - taken, 1)

    def _call(self, batch: Batch, steps: int) -> int:
        """Take so many steps at most; returns how that ended."""
        (count,) = batch.counts
        count[record.LOGGED] = 0
        batch.allow(steps)
        if self._room is None:
            self._room = batch.room()
        batch.run(self._room)
        (ending,), logged = batch.endings.tolist(), int(count[record.LOGGED])
        log = batch.log[:logged].copy(), batch.forces[:logged].copy()
        clock, state, counts = (
            batch.clocks[0].tolist(),
            batch.states[0].tolist(),
            count[: record.REPORTED].tolist(),
        )
        # Ctrl-C comes between calls of functions: with none here, all of these are set or none is.
        self._put_off += (log,)
        (self.time, self.next_step), self.state = clock, state
        self.taken, self.attempted, self.evaluations = counts
        if ending == record.FAILED:
            self._explain(batch.errors.tolist())
        return int(ending)

    def _explain(self, errors: Sequence[float]) -> NoReturn:
        """Raise the error that tells why no step leads on.

        Args:
            errors: of the last step that was tried (y,).
        """
        t0, y0 = self.time, self.state
        h = max(shortest_step(self.time, self.attempted), self._step_bounds[0])
        f0, size = self._evaluate(t0, y0), len(self._engine.order)
        # It may cease to exist behind this state.
        self._evaluate(t0 + h, [y + h * f for y, f in zip(y0, f0, strict=True)])
        off = [
            abs(e) * (error_weight(y) if k >= size else 1.0)
            for k, (e, y) in enumerate(zip(errors, y0, strict=True))
        ]
        index = max(range(len(off)), key=lambda k: off[k] if isfinite(off[k]) else inf)
        if not isfinite(off[index]):
            what = f"leaves the range of numbers in {self._name(index)}"
        elif off[index] > self._accuracy:
            what = f"misses the accuracy {off[index] / self._accuracy:.3g} times, most of all in {self._name(index)}"
        elif self._engine.structure[MODEL.CONSTRAINED]:
            what = "ends too far from where the constraints hold"
        else:
            what = "has no end that can be computed"
        # Where steps may err by centimetres, fibers of muscles run away.
        other = "more" if self._accuracy > DEFAULT_ACCURACY else "less"
        raise IntegrationError(
            f"The integrator cannot go on at t = {t0:.9g} s: even its shortest step of {h:.3g} s {what}. "
            "Something changes too abruptly there, such as a very stiff contact or a sharp limit: soften it, or "
            f"ask for {other} accuracy.",
            t0,
            index,
        )
