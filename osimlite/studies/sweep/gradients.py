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
from osimlite.errors import SettingError
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
        """Refuse access to the events of a run.

        Raises:
            SettingError: always, because events have no derivatives.
        """
        raise SettingError(
            "events of a run have no derivatives; choose another measure, or another method"
        )

    __iter__ = __len__ = __getitem__ = __contains__ = _refuse


class Gradients:
    """Derivatives of the first measure of a plan.

    Args:
        plan: plan of the runs.

    Raises:
        SettingError: the plan has another integrator than Merson's, a controller, or levels that
            end runs, or the measure depends on events.
    """

    def __init__(self, plan: Plan) -> None:
        if plan.engine != "compiled" or plan.integrator != MERSON:
            raise SettingError(
                "the method 'gradient' needs the compiled engine and the integrator 'merson', the defaults; "
                "leave out the other engine or integrator"
            )
        if plan.controller is not None:
            raise SettingError(
                "the method 'gradient' does not support controllers, whose controls have no derivatives; choose another method"
            )
        if plan.stops:
            raise SettingError(
                "the method 'gradient' needs runs that last until their end time; "
                "remove the levels that end runs (--stop-below, --stop-above)"
            )
        self._plan, self._variants = plan, Variants(plan)
        base_variant = self._variants.base_variant
        self._measure = make_measure(plan.measures[0], base_variant.engine, plan.feet)
        if self._measure.watches:
            raise SettingError(
                f"'{self._measure.name}' depends on events, which have no derivatives; "
                "choose another measure, or another method"
            )
        self._times = (
            [0.0, plan.to]
            if plan.interval is None
            else compute_report_times(plan.to, plan.interval)
        )
        self._steps: tuple[bytes, TangentSteps] | None = None

    def evaluate(self, values: Sequence[float], free_indices: Sequence[int]) -> Array:
        """Return the derivatives by some variables (f,).

        Args:
            values: values of all variables (d,).
            free_indices: indices of the variables (f,).

        Raises:
            SettingError: models with other values have other equations, or the measure has no
                derivative with respect to a variable.
            OsimliteError: there is no run with these values.
        """
        center = self._make_neighbour(list(values))
        sizes = [
            DIFFERENCE_PART * (self._plan.variables[index].high - self._plan.variables[index].low)
            for index in free_indices
        ]
        changes = np.array([shift for size in sizes for shift in (size, -size)])
        # Two neighbours per variable, above and below.
        neighbours_of_center = [
            self._make_neighbour([x + shift * (number == index) for number, x in enumerate(values)])
            for shift, index in zip(
                changes.tolist(), np.repeat(free_indices, 2).tolist(), strict=True
            )
        ]
        if any(
            neighbour.variant.structure != center.variant.structure
            for neighbour in neighbours_of_center
        ):
            raise SettingError(
                "models with other values have other equations, and no derivatives between them; "
                "choose other variables, or another method"
            )

        def differentiate(rows: Sequence[Array] | Array) -> Array:
            """Return central differences (f, n) of values of the neighbours (2 f, n)."""
            value_pairs = np.reshape(rows, (len(free_indices), 2, -1))
            result: Array = (value_pairs[:, 0] - value_pairs[:, 1]) / (
                2.0 * np.array(sizes)[:, None]
            )
            return result

        dy = differentiate([neighbour.start for neighbour in neighbours_of_center]).T
        dx = differentiate([neighbour.variant.numbers for neighbour in neighbours_of_center]).T
        runs = self._simulate_neighbour(center)
        steps, (times, states) = (
            self._get_tangent_steps(center.variant),
            self._record_motion(center),
        )
        steps.take(center.variant.numbers, dx)
        # Exact derivatives of the states at the report times, given those of the initial state and
        # the numbers.
        sensitivities = integrate_sensitivities(
            steps, times, states, dy, self._times, self._plan.accuracy, center.variant.state.names
        )
        count = len(neighbours_of_center)
        shift = np.repeat(np.arange(len(free_indices)), 2)
        reports = np.repeat(runs.reports, count, axis=0)
        if self._plan.interval is not None:
            reports += changes[:, None, None] * sensitivities[:, :, shift].transpose(2, 0, 1)
        # Neighbouring runs are extrapolated linearly, so that any measure of states can be evaluated.
        end_states = runs.states + changes[:, None] * sensitivities[-1][:, shift].T
        neighbours = Runs(
            np.repeat(runs.times, count),
            end_states,
            np.repeat(runs.endings, count),
            np.repeat(runs.counts, count, axis=0),
            reports,
            [_UnknownEvents() for _ in neighbours_of_center],
            # Largest contact forces have no derivatives.
            np.full((count, *runs.peaks.shape[1:]), np.nan),
        )
        batch = Batch(
            center.variant.engine,
            lambda number: neighbours_of_center[number].variant.engine,
            np.stack([neighbour.variant.numbers for neighbour in neighbours_of_center]),
            np.stack([neighbour.start for neighbour in neighbours_of_center]),
            neighbours,
            np.array([neighbour.values for neighbour in neighbours_of_center]),
            [neighbour.name for neighbour in self._plan.variables],
            np.array(self._times if self._plan.interval is not None else []),
        )
        result: Array = differentiate(
            np.asarray(self._measure.compute(batch), dtype=float)[:, None]
        )[:, 0]
        # Largest contact forces are NaN above; measures of them end here.
        if not np.isfinite(result).all():
            variable_name = self._plan.variables[
                free_indices[int(np.argmin(np.isfinite(result)))]
            ].name
            raise SettingError(
                f"'{self._measure.name}' has no derivative with respect to '{variable_name}'; it may depend "
                "on more than the states. Choose another measure, or another method"
            )
        return result

    def _make_neighbour(self, values: list[float]) -> _Neighbour:
        """Return the model and the initial state for some values of the variables."""
        variant = self._variants.make_variant(values)
        start = self._variants.make_start(variant, values)
        return _Neighbour(
            values,
            variant,
            self._variants.make_initial_states(variant.engine, [variant], start[None])[0],
        )

    def _simulate_neighbour(self, neighbour: _Neighbour) -> Runs:
        """Return the run of one model from its initial state."""
        plan = self._plan
        return run_many(
            neighbour.variant.engine,
            neighbour.start[None],
            plan.to,
            **plan.integration_choices(),
            report_times=self._times if plan.interval is not None else [],
            most_tries=MAX_INTEGRATOR_STEPS,
            threads=1,
        )

    def _record_motion(self, neighbour: _Neighbour) -> tuple[list[float], Array]:
        """Return times (s,) and states (s, y) at the ends of all integrator steps of a run."""
        times = [0.0]
        states = [neighbour.start.tolist()]

        def note(t: float, y: list[float]) -> None:
            times.append(t)
            states.append(y)

        stepper = neighbour.variant.engine.make_stepper(
            0.0, neighbour.start.tolist(), EngineSettings(**self._plan.integration_choices()), note
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
