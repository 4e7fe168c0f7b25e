"""Runge-Kutta-Merson in machine code."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import TYPE_CHECKING, Any

from osimlite.errors import SimulationError
from osimlite.simulation.engines.batch import Batch
from osimlite.simulation.integrators import RungeKuttaMerson, shortest_step
from osimlite.simulation.kernels import merson
from osimlite.simulation.kernels.pointers import Floats
from osimlite.simulation.many import BatchOptions
from osimlite.simulation.stepper import Observer, Progress

if TYPE_CHECKING:
    from osimlite.simulation.engines.base import KernelEngine

FIRST_STEPS, LOGGED_STEPS = 8, 512
"""So many steps are taken in the first call of a motion that is watched, and in any other at most."""

CALL_SECONDS = 0.1
"""About so long a call may take: nothing is told, and Ctrl-C is not heard, before it ends."""


class CompiledMerson(RungeKuttaMerson):
    """The same steps as its base, many of them in one call of machine code where reports are asked for.

    Args:
        engine: whose mechanism.
        t: initial time, s.
        y: initial state.
        accuracy: as OpenSim understands it.
        observe: called with (time, state) for each step, once somebody wants to know.
        names: what the entries of y are called in messages.
    """

    @property
    def name(self) -> str:
        """Of the method: the steps are its, whoever computes them."""
        return RungeKuttaMerson.__name__

    def __init__(
        self,
        engine: KernelEngine,
        t: float,
        y: Sequence[float],
        accuracy: float,
        observe: Observer,
        names: Sequence[str],
    ) -> None:
        self._engine = engine
        count = len(engine.mechanism.coordinates)
        spare = sum(not body.mobilizer.speeds_are_rates for body in engine.mechanism.bodies)
        super().__init__(
            engine.derivative,
            t,
            y,
            len(engine.order),
            nu=len(engine.order),
            accuracy=accuracy,
            count_q=count + spare,
            count_u=count,
            observe=observe,
            names=names,
            projection=engine.constrained if engine.constrained.names else None,
        )
        self._put_off: list[tuple[Floats, Floats]] = []
        self._seen: tuple[float, list[float], Sequence[float]] = (self.time, self.state, self.derivative)

    def reports(self, times: Sequence[float]) -> Iterator[tuple[float, list[float]]]:
        """Yield (time, state) at times that do not decrease, s; the steps are those of the base."""
        batch, done = self._batch(times), 0
        for _ in self._calls(batch):
            reached = bisect_right(times, self.time)
            yield from zip(times[done:reached], batch.reports[0, done:reached].tolist(), strict=True)
            done = reached

    def table(self, times: Sequence[float], progress: Progress | None = None) -> Sequence[Any]:
        """The same as of the base as an array."""
        batch = self._batch(times)
        try:
            for step in self._calls(batch):
                if progress is not None:
                    progress(self.time, step)
        except KeyboardInterrupt:
            self.interrupted = True
        table: Any = batch.reports[0, : bisect_right(times, self.time)]
        return table  # type: ignore[no-any-return]

    def _batch(self, times: Sequence[float]) -> Batch:
        """What goes on from the present state, with reports at these times, s."""
        if times and times[0] < self.time:
            raise ValueError(f"t = {times[0]:.9g} s is before the present {self.time:.9g} s")
        batch = Batch(
            self._engine,
            [self.state],
            BatchOptions(to=times[-1], accuracy=self._accuracy, report_times=times),
            start=self.time,
            next_step=self._next_step,
            most_logged=LOGGED_STEPS,
            start_holds=True,
        )
        batch.counts[0, : merson.REPORTED] = self.taken, self.attempted, self.evaluations
        batch.reports[0, : bisect_right(times, self.time)] = self.state
        return batch

    def _calls(self, batch: Batch) -> Iterator[float]:
        """Call machine code until the last report is made; yields the mean length of the steps of each call, s."""
        (count,) = batch.counts
        ending, room = merson.FULL, min(FIRST_STEPS, LOGGED_STEPS)
        while ending == merson.FULL:
            count[merson.LOGGED] = 0
            batch.allow(room)
            started = perf_counter()
            batch.run()
            room = min(max(1, int(room * min(8.0, CALL_SECONDS / (perf_counter() - started)))), LOGGED_STEPS)
            (ending,), logged, before = batch.endings.tolist(), int(count[merson.LOGGED]), self.time
            log = batch.log[:logged].copy(), batch.forces[:logged].copy()
            clock, state, counts = batch.clocks[0].tolist(), batch.states[0].tolist(), count[: merson.REPORTED].tolist()
            # Ctrl-C comes between calls of functions: with none here, all of these are set or none is.
            self._put_off += (log,)
            (self.time, self._next_step), self.state = clock, state
            self.taken, self.attempted, self.evaluations = counts
            if ending == merson.FAILED:
                self._explain()
            yield (self.time - before) / max(logged, 1)

    def catch_up(self) -> None:
        """Call `observe` for all steps that it was not called for."""
        waiting, self._put_off = self._put_off, []
        engine, size, end = self._engine, len(self.state), self.state
        now = self.time
        for log, forces in waiting:
            for row, pushes in zip(log.tolist(), forces, strict=True):
                t, y, f = row[0], row[1 : 1 + size], row[1 + size :]
                self._previous = self._seen
                self.time, self.state, self.derivative = self._seen = t, y, f
                engine.note_loads(pushes)
                if self._observe is not None:
                    self._observe(t, y)
        self.time, self.state = now, end

    def _explain(self) -> None:
        """Raise the error that the steps in Python end with, from where the compiled ones ended."""
        self.derivative = self._evaluate(self.time, self.state)
        # A step that failed has made the next one shorter than the shortest, and the time might not move with it.
        self._next_step = max(self._next_step, shortest_step(self.time))
        for _ in range(100):
            super().step()
        raise SimulationError(f"the motion cannot be computed beyond t = {self.time:.9g} s; ask for more accuracy")
