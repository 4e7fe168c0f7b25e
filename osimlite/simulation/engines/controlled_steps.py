"""Stepper with error control, the default way to integrate a motion."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from math import inf, isfinite
from time import perf_counter
from typing import TYPE_CHECKING, Any, NoReturn
from weakref import WeakKeyDictionary

from osimlite.errors import SimulationError
from osimlite.mechanics.kernels import record
from osimlite.mechanics.kernels.error_control import error_weight, shortest_step
from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.pointers import Floats, interpolate_cubic
from osimlite.simulation.batches import BatchOptions
from osimlite.simulation.engines.batch import BatchWorkspace
from osimlite.simulation.options import (
    DEFAULT_ACCURACY,
    INTEGRATORS,
    IntegrationOptions,
)
from osimlite.simulation.stepper import IntegrationError, Observer, Progress, Stepper

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import ControllerRuns
    from osimlite.simulation.engines.base import KernelEngine

FIRST_STEPS = 8
"""Number of steps in the first call of the kernels for an engine."""

LOGGED_STEPS = 512
"""Largest number of steps in one call of the kernels."""

MAX_CALL_S = 0.1
"""Approximate duration of a call of the kernels, s; progress and Ctrl-C wait for its end."""

_steps_per_call: WeakKeyDictionary[KernelEngine, int] = WeakKeyDictionary()
"""Number of steps of the next call for each engine, from the duration of the last call."""


class ControlledSteps(Stepper):
    """Stepper with error control, by one of `INTEGRATORS`.

    The default is Simbody's RungeKuttaMerson, as in OpenSim. Merson's method propagates a
    fourth-order solution and estimates its error with an embedded third-order one (Hairer, Norsett,
    Wanner, Solving Ordinary Differential Equations I, table 4.1). A step is accepted if the norm of
    the error is at most `accuracy`, else repeated with a smaller length. With equal derivatives the
    steps equal OpenSim's to the last bit. The kernels take the steps
    (:mod:`osimlite.mechanics.kernels.runs`), many in one call where a table of states is requested.

    The methods for stiff motions (:mod:`osimlite.mechanics.kernels.multistep` and `rosenbrock`)
    keep the same norm of their estimated error below `accuracy`.

    Args:
        engine: the engine.
        t: initial time, s.
        y: initial state.
        options: accuracy, integrator and other options of the integration.
        observe: function that is called with time and state after each step. For the steps of a
            table it is called only when a result needs them.
        controller_runs: controller of the run; None without a controller.

    Attributes:
        attempted: number of attempted steps so far; `accepted` counts the accepted ones.

    Raises:
        SettingError: an option has no meaning.
    """

    attempted = 0

    def __init__(
        self,
        engine: KernelEngine,
        t: float,
        y: Sequence[float],
        options: IntegrationOptions,
        observe: Observer | None = None,
        *,
        controller_runs: ControllerRuns | None = None,
    ) -> None:
        options.check_integration()
        super().__init__(engine.compute_derivative, t, y, observe, engine.state.names)
        self._engine = engine
        self._options = options
        self._accuracy = options.accuracy
        self._controller_runs = controller_runs
        # A resumed controller continues with the step of the earlier run, so that both together
        # equal one run.
        resumed_step = controller_runs.next_step if controller_runs is not None else None
        self.next_step = options.initial_step if resumed_step is None else resumed_step
        self._workspace: Floats | None = None
        self._put_off: list[tuple[Floats, Floats]] = []
        self._last_observed: tuple[float, list[float], Sequence[float]] = (
            self.time,
            self.state,
            self.derivative,
        )

    @property
    def name(self) -> str:
        """Name of the method, as in Simbody."""
        return INTEGRATORS[self._options.integrator]

    def step(self, limit: float = inf) -> None:
        """Take one step of the length that the error allows, and choose the next length.

        Args:
            limit: latest end of the step, s.

        Raises:
            IntegrationError: no step is small enough.
        """
        self._require_later(limit)
        self._call_kernels(self._make_batch((), limit), 1)
        self.catch_up()

    def make_interpolant(self) -> Callable[[float], list[float]]:
        """Return the interpolation of the last step.

        It is the cubic Hermite polynomial through both ends of the step with their derivatives,
        projected onto the constraints to a tenth of the accuracy.

        Returns:
            Function of time (s) that gives the state (y,).
        """
        ends = (*self.previous, self.time, self.state, self.derivative)
        size = len(self.state)
        engine = self._engine
        tolerance = self._accuracy / 10.0

        def interpolate(t: float) -> list[float]:
            y: Any = [0.0] * size
            interpolate_cubic(size, *ends, t, y)  # type: ignore[arg-type]
            # Without a near state that fulfils the constraints, the interpolated one is still the
            # best guess.
            return engine.project_state(t, y, tolerance) or y

        return interpolate

    def tabulate(self, times: Sequence[float], progress: Progress | None = None) -> Sequence[Any]:
        """Return the states at times as an array; see :meth:`Stepper.tabulate`."""
        batch = self._make_batch(times, times[-1])
        try:
            # With a progress callback the first calls are short, so that it is called soon.
            first = (
                FIRST_STEPS
                if progress is not None
                else _steps_per_call.get(self._engine, FIRST_STEPS)
            )
            for step in self._call_repeatedly(batch, first):
                if progress is not None:
                    progress(self.time, step)
        except (KeyboardInterrupt, SimulationError) as ended:
            self.ended = ended
        table: Any = batch.reports[0, : bisect_right(times, self.time)]
        return table

    def catch_up(self) -> None:
        """Call `observe` for all steps for which it was not called yet."""
        waiting, self._put_off = self._put_off, []
        size = len(self.state)
        end = self.state
        now = self.time
        for log, forces in waiting:
            for row, contact_loads in zip(log.tolist(), forces, strict=True):
                t = row[0]
                y = row[1 : 1 + size]
                f = row[1 + size :]
                self.previous = self._last_observed
                self.time, self.state, self.derivative = self._last_observed = t, y, f
                self._engine.store_contact_loads(contact_loads)
                if self._observe is not None:
                    self._observe(t, y)
        self.time, self.state = now, end

    # --------------------------------------------------------------------------------------------- helpers
    def _make_batch(self, times: Sequence[float], to: float) -> BatchWorkspace:
        """Return a batch of one run that continues from the present state.

        Args:
            times: times of reports, s.
            to: end of the run, s.

        Raises:
            ValueError: the first time of reports is before the current time.
        """
        if times and times[0] < self.time:
            raise ValueError(f"t = {times[0]:.9g} s is before the current time, {self.time:.9g} s")
        batch = BatchWorkspace(
            self._engine,
            [self.state],
            BatchOptions(to=to, report_times=times, **self._options.integration_choices()),
            start=self.time,
            next_step=self.next_step,
            most_logged=LOGGED_STEPS,
            start_holds=True,
            controller_runs=self._controller_runs,
        )
        batch.counts[0, : record.COUNTS.REPORTED] = self.accepted, self.attempted, self.evaluations
        batch.reports[0, : bisect_right(times, self.time)] = self.state
        return batch

    def _call_repeatedly(self, batch: BatchWorkspace, steps: int) -> Iterator[float]:
        """Take steps until the last report.

        Args:
            batch: batch of this run.
            steps: number of steps in the first call.

        Yields:
            Mean length of the steps of each call, s.
        """
        ending = record.ENDING.FULL
        while ending == record.ENDING.FULL:
            started = perf_counter()
            time_before = self.time
            steps_before = self.accepted
            ending = self._call_kernels(batch, steps)
            # The number of steps follows the allowed time, but grows at most eightfold.
            next_steps = min(
                8.0 * steps,
                (self.accepted - steps_before) * MAX_CALL_S / (perf_counter() - started),
            )
            steps = _steps_per_call[self._engine] = min(max(1, int(next_steps)), LOGGED_STEPS)
            yield (self.time - time_before) / max(self.accepted - steps_before, 1)

    def _call_kernels(self, batch: BatchWorkspace, steps: int) -> int:
        """Take some steps in one call of the kernels.

        Args:
            batch: batch of this run.
            steps: largest number of steps.

        Returns:
            Reason why the call ended, one of :class:`osimlite.mechanics.kernels.record.ENDING`.

        Raises:
            IntegrationError: no step is small enough.
        """
        (count,) = batch.counts
        # The log of the last call was copied, so it starts anew.
        count[record.COUNTS.LOGGED] = 0
        batch.limit_steps(steps)
        if self._workspace is None:
            self._workspace = batch.make_workspace()
        batch.run(self._workspace)
        (ending,), logged = batch.endings.tolist(), int(count[record.COUNTS.LOGGED])
        log = batch.log[:logged].copy(), batch.forces[:logged].copy()
        clock = batch.clocks[0].tolist()
        state = batch.states[0].tolist()
        counts = count[: record.COUNTS.REPORTED].tolist()
        # Python handles Ctrl-C between calls of functions. These lines call none, so an
        # interruption finds all of them set, or none of them.
        self._put_off += (log,)
        (self.time, self.next_step), self.state = clock, state
        self.accepted, self.attempted, self.evaluations = counts
        if ending == record.ENDING.FAILED:
            self._raise_failure(batch.errors.tolist())
        return int(ending)

    def _raise_failure(self, errors: Sequence[float]) -> NoReturn:
        """Raise the error that explains why no further step is possible.

        Args:
            errors: errors of the last attempted step (y,).

        Raises:
            IntegrationError: always; its message says why the shortest step fails.
        """
        t0, y0 = self.time, self.state
        h = max(shortest_step(self.time, self.attempted), self._options.step_bounds[0])
        # These evaluations raise a clearer error than the one below if the derivative is not
        # finite.
        f0 = self._evaluate(t0, y0)
        size = len(self._engine.order)
        # The derivative may not exist after this state.
        self._evaluate(t0 + h, [y + h * f for y, f in zip(y0, f0, strict=True)])
        relative_errors = [
            # As in the kernels, errors of values count absolutely, and those of other states
            # relative to their size.
            abs(e) * (error_weight(y) if k >= size else 1.0)
            for k, (e, y) in enumerate(zip(errors, y0, strict=True))
        ]
        index = max(
            range(len(relative_errors)),
            key=lambda k: relative_errors[k] if isfinite(relative_errors[k]) else inf,
        )
        if not isfinite(relative_errors[index]):
            fault = f"makes a number infinite or NaN: {self._get_state_name(index)}"
        elif relative_errors[index] > self._accuracy:
            fault = (
                f"has an error of {relative_errors[index] / self._accuracy:.3g} times the accuracy, "
                f"mainly in {self._get_state_name(index)}"
            )
        elif self._engine.structure[MODEL.CONSTRAINED]:
            fault = "ends in a state that violates the constraints"
        else:
            fault = "ends in a state that cannot be computed"
        # With loose accuracy, muscle fibers diverge; with a strict one, stiff forces are the usual
        # cause.
        other = "smaller" if self._accuracy > DEFAULT_ACCURACY else "larger"
        raise IntegrationError(
            f"The integrator cannot continue at t = {t0:.9g} s: even a step of {h:.3g} s, the shortest, {fault}. "
            "A force changes too abruptly there, for example in a very stiff contact or at a sharp limit: soften it, or "
            f"use a {other} accuracy value.",
            t0,
            index,
        )
