"""Derivatives of a measure by the variables of a search.

The motion is differentiated exactly along the steps of the integrator, in compiled code. The
measure as a function of states, and the numbers of the model as functions of the variables, are
differentiated by central differences, which are accurate to 1e-9 where these functions are smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.derivatives.sensitivity import integrate_sensitivities
from osimlite.derivatives.tangents import TangentSteps
from osimlite.errors import SettingError, SimulationError, UnsupportedError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.batches import Runs, run_many
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.options import MERSON, compute_report_times
from osimlite.simulation.pack import pack
from osimlite.studies.sweep.measures import Batch, make_measure
from osimlite.studies.sweep.plan import MAX_INTEGRATOR_STEPS, Plan
from osimlite.studies.sweep.variants import Variant, Variants

DIFFERENCE_PART = 3e-5
"""Change of a variable in central differences, as a part of its range.

The truncation error and the rounding error are then both about 1e-9.
"""


@dataclass(frozen=True)
class _Neighbour:
    """Model with changed variables.

    Attributes:
        values: values of all variables.
        variant: model with these values.
        start: initial state (y,).
    """

    values: list[float]
    variant: Variant
    start: Array


class _UnknownEvents(list[Any]):
    """Events of a neighbouring run, which is not simulated: any access is an error."""

    def _refuse(self, *_: object) -> NoReturn:
        """Raise an error for a measure that asks for events."""
        raise UnsupportedError(
            "events of a run have no derivatives; take another measure, or another --method"
        )

    __iter__ = __len__ = __getitem__ = __contains__ = _refuse


class Gradients:
    """Derivatives of the first measure of a plan.

    Args:
        plan: plan of the runs.

    Raises:
        SettingError: the plan has another integrator than Merson's, a controller, or levels that
            end runs.
        UnsupportedError: the measure depends on events.
    """

    def __init__(self, plan: Plan) -> None:
        if plan.engine != "compiled" or plan.integrator != MERSON:
            raise SettingError(
                "--method gradient follows Merson's steps of the compiled engine; choose no others"
            )
        if plan.controller is not None:
            raise SettingError(
                "what a controller holds between its steps has no derivatives; take another --method"
            )
        if plan.stops:
            raise SettingError(
                "--method gradient is for runs that last their time; leave out --below and --above"
            )
        self._plan, self._variants = plan, Variants(plan)
        given = self._variants.given
        self._measure = make_measure(plan.measures[0], given.engine, plan.feet)
        if self._measure.watches:
            raise UnsupportedError(
                f"'{self._measure.name}' is of events; take another measure, or another --method"
            )
        self._times = (
            [0.0, plan.to]
            if plan.interval is None
            else compute_report_times(plan.to, plan.interval)
        )
        self._steps: tuple[bytes, TangentSteps] | None = None

    def evaluate(self, values: Sequence[float], free: Sequence[int]) -> Array:
        """Return the derivatives by some variables (f,).

        Args:
            values: values of all variables (d,).
            free: indices of the variables (f,).

        Raises:
            OsimliteError: there is no run with these values, or it has no derivatives.
        """
        here = self._make_neighbour(list(values))
        sizes = [
            DIFFERENCE_PART * (self._plan.variables[place].high - self._plan.variables[place].low)
            for place in free
        ]
        changes = np.array([by for size in sizes for by in (size, -size)])
        # Two neighbours per variable, above and below.
        near = [
            self._make_neighbour([x + by * (number == place) for number, x in enumerate(values)])
            for by, place in zip(changes.tolist(), np.repeat(free, 2).tolist(), strict=True)
        ]
        if any(item.variant.structure != here.variant.structure for item in near):
            raise UnsupportedError(
                "models with other values have other equations, and no derivatives between them"
            )

        def differentiate(rows: Sequence[Array] | Array) -> Array:
            """Return central differences (f, n) of values of the neighbours (2 f, n)."""
            both = np.reshape(rows, (len(free), 2, -1))
            result: Array = (both[:, 0] - both[:, 1]) / (2.0 * np.array(sizes)[:, None])
            return result

        dy = differentiate([item.start for item in near]).T
        dx = differentiate([item.variant.numbers for item in near]).T
        runs = self._run(here)
        steps, (times, states) = self._get_tangent_steps(here.variant), self._record_motion(here)
        steps.take(here.variant.numbers, dx)
        # Exact derivatives of the states at the report times, given those of the initial state and
        # the numbers.
        moved = integrate_sensitivities(
            steps, times, states, dy, self._times, self._plan.accuracy, here.variant.state.names
        )
        count = len(near)
        by = np.repeat(np.arange(len(free)), 2)
        reports = np.repeat(runs.reports, count, axis=0)
        if self._plan.interval is not None:
            reports += changes[:, None, None] * moved[:, :, by].transpose(2, 0, 1)
        # Neighbouring runs are extrapolated linearly, so that any measure of states can be evaluated.
        ends = runs.states + changes[:, None] * moved[-1][:, by].T
        neighbours = Runs(
            np.repeat(runs.times, count),
            ends,
            np.repeat(runs.endings, count),
            np.repeat(runs.counts, count, axis=0),
            reports,
            [_UnknownEvents() for _ in near],
            # Largest contact forces have no derivatives.
            np.full((count, *runs.peaks.shape[1:]), np.nan),
        )
        batch = Batch(
            here.variant.engine,
            lambda number: near[number].variant.engine,
            np.stack([item.variant.numbers for item in near]),
            np.stack([item.start for item in near]),
            neighbours,
            np.array([item.values for item in near]),
            [item.name for item in self._plan.variables],
            np.array(self._times if self._plan.interval is not None else []),
        )
        result: Array = differentiate(
            np.asarray(self._measure.compute(batch), dtype=float)[:, None]
        )[:, 0]
        # Largest contact forces are NaN above; measures of them end here.
        if not np.isfinite(result).all():
            worst = self._plan.variables[free[int(np.argmin(np.isfinite(result)))]].name
            raise SimulationError(
                f"'{self._measure.name}' has no derivative by '{worst}'; it may look at more than states: take another "
                "measure, or another --method"
            )
        return result

    def _make_neighbour(self, values: list[float]) -> _Neighbour:
        """Return the model and the initial state for some values of the variables."""
        variant = self._variants.make_variant(values)
        start = self._variants.make_start(variant, values)
        return _Neighbour(
            values, variant, self._variants.place_states(variant.engine, [variant], start[None])[0]
        )

    def _run(self, here: _Neighbour) -> Runs:
        """Simulate one model from its initial state."""
        plan = self._plan
        return run_many(
            here.variant.engine,
            here.start[None],
            plan.to,
            **plan.integration_choices(),
            report_times=self._times if plan.interval is not None else [],
            most_tries=MAX_INTEGRATOR_STEPS,
            threads=1,
        )

    def _record_motion(self, here: _Neighbour) -> tuple[list[float], Array]:
        """Return times (s,) and states (s, y) at the ends of all integrator steps of a run."""
        times, states = [0.0], [here.start.tolist()]

        def note(t: float, y: list[float]) -> None:
            times.append(t)
            states.append(y)

        stepper = here.variant.engine.make_stepper(
            0.0, here.start.tolist(), EngineSettings(**self._plan.integration_choices()), note
        )
        stepper.tabulate([self._plan.to])
        stepper.catch_up()
        if stepper.ended is not None:
            raise stepper.ended
        return times, np.array(states)

    def _get_tangent_steps(self, variant: Variant) -> TangentSteps:
        """Return the derivatives of steps for a model; those of the latest structure are kept."""
        if self._steps is None or self._steps[0] != variant.structure:
            engine = variant.engine
            packed = pack(
                engine.mechanism, replace(engine.forces, controls=engine.current_controls)
            )
            self._steps = (
                variant.structure,
                TangentSteps(packed, engine.forces, range(len(variant.state.names))),
            )
        return self._steps[1]
