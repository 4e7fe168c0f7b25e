"""The compiled engine: accelerations, steps and events in machine code.

What is compiled are the functions of :mod:`osimlite.simulation.kernels` with the force laws and the step control that
they call. The code serves every model: models and parameters are arrays.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from numpy.typing import ArrayLike

from osimlite.errors import OsimliteError, SimulationError
from osimlite.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.simulation.constrained import Constrained
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines import many
from osimlite.simulation.engines.batch import Batch
from osimlite.simulation.engines.linking import version
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.engines.renewal import NumbersOnly
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.integrators import RungeKuttaMerson
from osimlite.simulation.kernels import layout, merson
from osimlite.simulation.kernels.pointers import Floats
from osimlite.simulation.many import BatchEngine, BatchOptions
from osimlite.simulation.runs import Runs
from osimlite.simulation.stepper import Observer, Progress, Stepper
from osimlite.simulation.system import System

FIRST_STEPS, LOGGED_STEPS = 8, 512
"""So many steps are taken in the first call of a motion that is watched, and in any other at most."""

CALL_SECONDS = 0.1
"""About so long a call may take: nothing is told, and Ctrl-C is not heard, before it ends."""


def make(mechanism: Mechanism, forces: Forces, settings: Settings) -> BatchEngine:
    """Make the engine."""
    if settings.show:
        raise SimulationError("the compiled engine shows no window; take --engine bullet for --gui")
    if settings.route not in ("auto", CompiledEngine.route):
        raise OsimliteError(f"the compiled engine has no route '{settings.route}'; there is {CompiledEngine.route}")
    return CompiledEngine(mechanism, forces)


class CompiledEngine(System):
    """The accelerations of a mechanism in machine code; see the protocol for what it offers.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that it does not know.
    """

    name = "compiled"
    version = version()
    route = "composite-rigid-body"
    entries = ("evaluate", "run_several")

    def __init__(self, mechanism: Mechanism, forces: Forces) -> None:
        super().__init__(mechanism, forces)
        self.constrained = Constrained(mechanism, self.order)

    def __reduce__(self) -> Any:
        # Addresses mean nothing in another process.
        return CompiledEngine, (self.mechanism, self.forces)

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: Sequence[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        status = self.realize(t, y, layout.ACCELERATION_STAGE)
        if status != layout.OK:
            raise self.refusal(status, t, y)
        self.note_loads(self._pairs[:, :3])
        return self.found()

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates, in the mechanism's order; zero if locked."""
        udot = self.derivative(t, self.state.pack(q, u))[len(self.order) : 2 * len(self.order)]
        return self.state.spread(udot, [0.0] * len(self.mechanism.coordinates))

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(self, t: float, y: Sequence[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on: Runge-Kutta-Merson, or fixed steps of semi-implicit Euler."""
        if settings.fixed_step is not None:
            rates = None if all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies) else self._rates
            return SemiImplicitEuler(
                self.derivative,
                t,
                y,
                len(self.order),
                settings.fixed_step,
                rates=rates,
                observe=observe,
                names=self.state.names,
                projection=self.constrained,
            )
        return CompiledMerson(self, t, y, settings.accuracy, observe, self.state.names)

    def run_many(self, states: ArrayLike, options: BatchOptions, numbers: ArrayLike | None = None) -> Runs:
        """Compute a batch."""
        return many.run_many(self, states, options, numbers)

    def contact_places(
        self, states: ArrayLike, numbers: ArrayLike | None = None, rows: ArrayLike | None = None
    ) -> Floats:
        """Where the surfaces of all contacts are, in ground."""
        return many.contact_places(self, states, numbers, rows)

    def contact_radii(self, numbers: ArrayLike | None = None) -> Floats:
        """Radii of the second surfaces of all contacts, m."""
        return many.contact_radii(self, numbers)

    def renewal(self, model: Model, folder: Path) -> NumbersOnly:
        """What makes parts of the model anew."""
        return NumbersOnly(model, self, folder)

    def _rates(self, q: list[float], u: list[float]) -> list[float]:
        # They depend on nothing else.
        return self.derivative(0.0, q + u + [0.0] * len(self.state.variables))[: len(self.order)]

    def hold(self) -> None:
        """There is no window."""

    def close(self) -> None:
        """Nothing is held."""

    def __enter__(self) -> CompiledEngine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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
        engine: CompiledEngine,
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
        self._next_step = max(self._next_step, 4.0 * 2.0**-52 * max(1.0, abs(self.time)))
        for _ in range(100):
            super().step()
        raise SimulationError(f"the motion cannot be computed beyond t = {self.time:.9g} s; ask for more accuracy")
