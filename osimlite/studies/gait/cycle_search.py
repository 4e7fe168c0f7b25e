"""Search for gait cycles: which initial state, with which numbers of the model, repeats itself.

1. Random initial states of random models, each with one foot at rest on the ground. Walkers that
   make two steps are candidates, ordered by how much the states at the end of the two steps differ.
2. The initial state and the numbers of the best candidates are changed together until the state at
   the end of a step equals that at its start (least squares in a trust region, then Newton's
   method), which is a cycle.
3. The numbers of the best cycle are changed from cycle to cycle until its largest multiplier is
   small, and then until most of the walkers that start near it walk
   (:mod:`osimlite.studies.gait.stability`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.require import require
from osimlite.errors import OsimliteError, SettingError
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.model import Model
from osimlite.simulation.batches import BatchEngine
from osimlite.studies.gait.basin import sample_perturbed_starts, simulate_walks
from osimlite.studies.gait.cycle import (
    CYCLE_TOLERANCE,
    MAX_NEWTON_STEPS,
    Cycle,
    differentiate_step_map,
    find_cycle,
    sample_states_of_step,
)
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.starts import plant_feet
from osimlite.studies.gait.stepmap import TIGHT_ACCURACY, StepMap
from osimlite.studies.gait.steps import WalkerSteps, walk_many
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.variables import Floats, Start, reject_grid_ranges
from osimlite.studies.sweep.variants import Variant, Variants

ROUGH_ACCURACY = 1e-7
"""Accuracy of the integrator while a walker is far from its cycle."""

FINE_ACCURACY = 1e-9
"""Accuracy of the integrator near a cycle; finite differences of the step map need it."""

SEARCH_TOLERANCE = 1e-6
"""Norm of the residual of cycles during the search; the final cycle has `CYCLE_TOLERANCE`."""

STATE_DIFFERENCE = 1e-4
"""Change of reduced states (rad, m, rad/s, m/s) in differences; large, because `ROUGH_ACCURACY` is."""

FRACTION_DIFFERENCE = 1e-4
"""Change of a number, as a part of its range, in differences."""

SPEED_WEIGHT_S = 0.25
"""Weight of speeds relative to values (s) in the distance of two states."""

CACHED_STEP_MAPS = 4
"""Number of step maps in the cache; the least-squares solver evaluates a few models at a time."""

FALL_RESIDUAL = 10.0
"""Residual in each direction of a walker that makes no step; far larger than that of any step."""

MAX_EVALUATIONS = 30
"""Most evaluations of the least-squares solver for a candidate."""

NEWTON_RANGE = 3e-3
"""Norm of the residual below which Newton's method takes over; candidates above it are dropped."""

MAX_STALLED_ITERATIONS = 8
"""A candidate is dropped if this many iterations have not halved the residual."""

FRACTION_SCALE = 0.1
"""Part of its range by which a number changes as readily as a reduced state by 1 (scale of variables)."""

BASIN_PHASE = 0.4
"""Part of a step after touch-down at which walkers start near a cycle; a foot is then in single
support.
"""

BASIN_STARTS = 60
"""Walkers that start near a cycle to measure how attractive it is."""

BASIN_STEPS = 20
"""Number of steps after which such a walker counts as walking."""

SCUFF_COST = 1.0
"""Cost of a scuff in a cycle, as much as a multiplier at the limit of stability."""

RANDOM_WALK_S = 3.0
"""Duration of the walks of random walkers (s), enough for two steps."""

WALKERS_PER_CALL = 1024
"""Random walkers that are simulated in one call."""

STARTS_PER_MODEL = 64
"""Random initial states of the same random model; making a model takes longer than a walk."""

MAX_INTEGRATOR_STEPS = 3000
"""Most steps of the integrator for a random walker; one that needs more rattles on the ground."""

Progress = Callable[[float, float], object]
"""Callback with the amount of work done, and of all work."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Walker whose two steps end in similar states.

    Attributes:
        fractions: numbers of the walker's model, as fractions of their ranges (k,).
        state: state at the end of the first step, exchanged to the first foot (y,).
        miss: distance between the states at the ends of the two steps.
    """

    fractions: Floats
    state: Floats
    miss: float


@dataclass(frozen=True, eq=False)
class ModelCycle:
    """Numbers of a model with a gait cycle of the model.

    Attributes:
        fractions: numbers as fractions of their ranges (k,).
        numbers: numbers by the names of the variables.
        cycle: gait cycle of the model with these numbers.
        walking: part of the walkers started near the cycle that walk; 0 if it was not measured.
        cost: objective of the search, smaller is better: largest multiplier plus `SCUFF_COST` per
            scuff, or `stable` minus `walking` once that is below `stable`.
    """

    fractions: Floats
    numbers: dict[str, float]
    cycle: Cycle
    walking: float
    cost: float


class CycleSearch:
    """Search for gait cycles of the models of a plan.

    Args:
        plan: variables: initial values and speeds, from which random walkers are drawn, and numbers
            of the model, which are searched.
        feet: contacts of each foot; found from the structure of the model by default.
        stable: largest multiplier that is small enough; below it, the part of perturbed walkers
            that walk counts.
        perturb: largest relative change of values and speeds of the perturbed walkers.
        threads: number of threads; by default one per core.

    Attributes:
        footing: contacts of the feet, and contacts that are falls.

    Raises:
        OsimliteError: the model cannot be simulated, or does not have two feet.
        SettingError: the plan varies no initial state.
    """

    def __init__(
        self,
        plan: Plan,
        feet: Sequence[str] | None = None,
        *,
        stable: float = 0.6,
        perturb: float = 0.1,
        threads: int | None = None,
    ) -> None:
        self.plan = plan
        self.stable = stable
        self.perturb = perturb
        self.threads = threads
        reject_grid_ranges(plan.variables)
        self.variants = Variants(plan)
        free_variables = [
            (index, variable)
            for index, variable in enumerate(plan.variables)
            if not variable.is_fixed
        ]
        self._starts = [
            index for index, variable in free_variables if isinstance(variable.target, Start)
        ]
        self._numbers = [
            index for index, variable in free_variables if not isinstance(variable.target, Start)
        ]
        # Without varied initial values all random walkers of a model would be the same.
        if not self._starts:
            raise SettingError(
                "the search draws random initial states; vary the initial values or speeds of some coordinates, "
                "with --vary (vary=)"
            )
        self._least = [variable.low for variable in plan.variables]
        engine: Any = self.variants.base_variant.engine
        self.footing: FootContacts = find_footing(engine, feet)
        if len(self.footing.feet) != 2:
            raise SettingError(
                f"the search for cycles needs two feet, but '{engine.mechanism.name}' has "
                f"{len(self.footing.feet)}; name two with --foot (feet=)"
            )
        self._first: StepMap | None = None

    # ---------------------------------------------------------------------------------------- models
    @property
    def names(self) -> list[str]:
        """Names of the numbers that are searched."""
        return [self.plan.variables[index].name for index in self._numbers]

    def make_sample(self, fractions: Floats) -> list[float]:
        """Return a sample of the plan in which the numbers lie at fractions (k,) of their ranges."""
        row = list(self._least)
        for index, fraction in zip(self._numbers, fractions, strict=True):
            # Fourteen digits drop the rounding errors of the fraction, so that rounded numbers stay
            # rounded.
            row[index] = float(f"{self.plan.variables[index].interpolate(np.array(fraction)):.14g}")
        return row

    def get_numbers(self, fractions: Floats) -> dict[str, float]:
        """Return the numbers at fractions (k,) of their ranges.

        Returns:
            Numbers by name.
        """
        row = self.make_sample(fractions)
        return {self.plan.variables[index].name: row[index] for index in self._numbers}

    def compute_fractions(self, numbers: Mapping[str, float]) -> Floats:
        """Return the fractions of their ranges (k,) at which numbers, by name, lie."""
        variables = {variable.name: variable for variable in self.plan.variables}
        return np.array([variables[name].compute_fraction(numbers[name]) for name in self.names])

    def round_fractions(self, fractions: Floats, digits: int) -> Floats:
        """Return the fractions (k,) of numbers that are rounded to significant digits.

        Args:
            fractions: fractions of the numbers (k,).
            digits: number of significant digits.
        """
        numbers = {
            name: float(f"{number:.{digits}g}")
            for name, number in self.get_numbers(fractions).items()
        }
        return self.compute_fractions(numbers)

    def make_model(self, fractions: Floats, start: Mapping[str, tuple[float, float]]) -> Model:
        """Return the model with some numbers and with an initial state as its defaults.

        Args:
            fractions: fractions of the numbers (k,).
            start: value and speed by the names of coordinates.
        """
        self.variants.apply_sample(self.make_sample(fractions))
        model = self.variants.model
        for coordinate in model.components(Coordinate):
            if coordinate.name in start:
                coordinate.default_value, coordinate.default_speed_value = start[coordinate.name]
        return model

    def make_engine(self, fractions: Floats) -> BatchEngine:
        """Return the engine of the model with numbers at fractions (k,) of their ranges.

        Raises:
            OsimliteError: the model is invalid, or has another structure.
        """
        variant = self.variants.make_variant(self.make_sample(fractions))
        # Step maps of models with other coordinates or contacts cannot be compared.
        if variant.structure != self.variants.base_variant.structure:
            raise OsimliteError(
                "the varied parameters change the structure of the model; vary other parameters"
            )
        return variant.engine

    # ---------------------------------------------------------------------------------------- random starts
    def find_candidates(
        self, count: int, seed: int, progress: Progress | None = None
    ) -> list[Candidate]:
        """Simulate random walkers, and select those that make two steps.

        A walker with a scuff between the two steps is no candidate.

        Args:
            count: number of random walkers.
            seed: seed of the random numbers.
            progress: callback after each part of the walkers.

        Returns:
            Walkers that make two steps, those with the most similar steps first.
        """
        rng = np.random.default_rng(seed)
        result = []
        for first_walker in range(0, count, WALKERS_PER_CALL):
            size = min(WALKERS_PER_CALL, count - first_walker)
            result += self._draw_samples(rng, size)
            if progress is not None:
                progress(first_walker + size, count)
        return sorted(result, key=lambda candidate: candidate.miss)

    def _draw_samples(self, rng: np.random.Generator, count: int) -> list[Candidate]:
        """Simulate random walkers in one call, and select those that make two steps.

        Returns:
            Walkers that make two steps, in the order of the samples.
        """
        engine: Any = self.variants.base_variant.engine
        models = rng.random((-(-count // STARTS_PER_MODEL), len(self._numbers)))
        starts = rng.random((count, len(self._starts)))
        fractions = np.repeat(models, STARTS_PER_MODEL, axis=0)[:count]
        states = np.zeros((count, engine.state.size))
        vectors = np.zeros((count, len(engine.numbers)))
        variants: list[Variant] = []
        is_valid = np.ones(count, dtype=bool)
        for row in range(count):
            sample = self.make_sample(fractions[row])
            for index, fraction in zip(self._starts, starts[row], strict=True):
                sample[index] = float(self.plan.variables[index].interpolate(np.array(fraction)))
            try:
                variant = self.variants.make_variant(sample)
            except OsimliteError:
                is_valid[row] = False
                continue
            # Walkers of one call share the structure of the engine.
            is_valid[row] = variant.structure == self.variants.base_variant.structure
            if is_valid[row]:
                states[row], vectors[row] = (
                    self.variants.make_start(variant, sample),
                    variant.numbers,
                )
                variants.append(variant)
        states = states[is_valid]
        vectors = vectors[is_valid]
        fractions = fractions[is_valid]
        if not len(states):
            return []
        states = self.variants.prepare_states(
            # A walker that starts above or in the ground falls or bounces at once.
            engine,
            variants,
            plant_feet(engine, self.footing, states, numbers=vectors),
        )
        walks = walk_many(
            engine,
            states,
            RANDOM_WALK_S,
            footing=self.footing,
            numbers=vectors,
            accuracy=1e-3,
            most_tries=MAX_INTEGRATOR_STEPS,
            threads=self.threads,
        )
        candidates = (
            self._find_similar_strikes(walk, row)
            for walk, row in zip(walks, fractions, strict=True)
        )
        return [candidate for candidate in candidates if candidate is not None]

    def _find_similar_strikes(self, walk: WalkerSteps, fractions: Floats) -> Candidate | None:
        """Find the most similar touch-downs of a walk, one step or one stride apart.

        They are a stride apart if the legs differ.

        Returns:
            Candidate at the first of these touch-downs; None for a walk without a clean step.
        """
        if len(walk.steps) < 2:
            return None
        if self._first is None:
            engine = self.make_engine(fractions)
            self._first = StepMap(
                engine,
                walk.steps[0].state,
                footing=self.footing,
                accuracy=ROUGH_ACCURACY,
                threads=self.threads,
            )
        swap, closest = self._first.exchange, None
        strikes = [
            (step.time, step.state if step.foot == 0 or swap is None else step.state[swap])
            for step in walk.steps
            if step.foot == 0 or swap is not None
        ]
        for (start, first_state), (end, second_state) in pairwise(strikes):
            distance = self._compute_distance(self._first, first_state, second_state)
            # A step with a scuff is not a smooth function of the state.
            if (closest is None or distance < closest.miss) and not any(
                start < scuff.time < end for scuff in walk.scuffs
            ):
                closest = Candidate(fractions, first_state.copy(), distance)
        return closest

    @staticmethod
    def _compute_distance(step_map: StepMap, first_state: Floats, second_state: Floats) -> float:
        """Return the distance of two states without their neutral directions.

        Speeds have the weight `SPEED_WEIGHT_S`.
        """
        difference = step_map.basis @ step_map.reduce(second_state - first_state)
        dof_count = len(step_map.engine.order)
        other_entries = *difference[:dof_count], *difference[2 * dof_count :]
        return float(
            np.hypot(
                np.linalg.norm(other_entries),
                SPEED_WEIGHT_S * np.linalg.norm(difference[dof_count : 2 * dof_count]),
            )
        )

    # ---------------------------------------------------------------------------------------- cycles
    def close_cycle(self, candidate: Candidate) -> ModelCycle | None:
        """Change initial state and numbers of a candidate together until it walks in a cycle.

        Args:
            candidate: walker to start from.

        Returns:
            The cycle with its model, or None if the solver does not come near one.
        """
        optimize = require("scipy.optimize", extra="sweep", purpose="the search for cycles")
        try:
            problem = _ClosingProblem(self, candidate)
            solution = optimize.least_squares(
                problem.compute_residual,
                problem.start,
                problem.differentiate_residual,
                # Rectangular trust regions handle the bounds of the fractions well.
                method="dogbox",
                bounds=problem.bounds,
                x_scale=problem.scale,
                max_nfev=MAX_EVALUATIONS,
                xtol=1e-8,
                ftol=1e-8,
                gtol=1e-14,
                callback=problem.check_progress,
            )
            # Too far from a cycle for Newton's method, which would diverge.
            if np.linalg.norm(solution.fun) > NEWTON_RANGE:
                return None
            fractions, _, state = problem.unpack(solution.x)
            return self.find_cycle(fractions, state)
        # A candidate that leads nowhere is normal; the next one is tried.
        except (OsimliteError, np.linalg.LinAlgError):
            return None

    def find_cycle(self, fractions: Floats, state: Floats, *, fine: bool = False) -> ModelCycle:
        """Return the cycle of the model with given numbers that is near a state.

        Args:
            fractions: fractions of the numbers (k,).
            state: initial guess (y,), at a touch-down of the first foot.
            fine: whether to compute the cycle with full accuracy.

        Raises:
            OsimliteError: there is no cycle near, or the model is invalid.
        """
        step_map = self.make_step_map(fractions, state, TIGHT_ACCURACY if fine else FINE_ACCURACY)
        result = find_cycle(
            step_map,
            state,
            tolerance=CYCLE_TOLERANCE if fine else SEARCH_TOLERANCE,
            max_steps=MAX_NEWTON_STEPS if fine else 8,
        )
        cost = result.largest + SCUFF_COST * result.scuffs
        walking = 0.0
        # The basin takes as long as many cycles; it is measured only where it counts.
        if cost < self.stable or fine:
            walking = self._measure_basin(step_map, result)
        # Below `stable` the cost measures robustness, so that it remains below all costs of less
        # stable cycles.
        if cost < self.stable:
            cost = self.stable - walking
        return ModelCycle(np.array(fractions), self.get_numbers(fractions), result, walking, cost)

    def _measure_basin(self, step_map: StepMap, cycle: Cycle) -> float:
        """Return the part of the walkers started near a cycle that walk."""
        (state,) = sample_states_of_step(step_map, cycle, (BASIN_PHASE,))
        starts = sample_perturbed_starts(step_map, state, self.perturb, BASIN_STARTS, 0)
        walks = simulate_walks(step_map, cycle, starts, BASIN_STEPS)
        return sum(len(walk.steps) >= BASIN_STEPS for walk in walks) / BASIN_STARTS

    def make_step_map(self, fractions: Floats, state: Floats, accuracy: float) -> StepMap:
        """Return the step map of the model with given numbers.

        Reduced states of all models are comparable.

        Args:
            fractions: fractions of the numbers (k,).
            state: state at a touch-down of the first foot (y,).
            accuracy: accuracy of the integrator.

        Raises:
            OsimliteError: the model is invalid.
        """
        engine = self.make_engine(fractions)
        if self._first is None:
            self._first = StepMap(engine, state, footing=self.footing, threads=self.threads)
        return self._first.rebuild_for_model(engine, state, accuracy)


class _ClosingProblem:
    """Least-squares problem whose unknowns are a reduced state and fractions of the numbers.

    Args:
        search: search with the plan.
        candidate: walker to start from.
    """

    def __init__(self, search: CycleSearch, candidate: Candidate) -> None:
        self._search = search
        self._maps: dict[bytes, StepMap] = {}
        self._sizes: list[float] = []
        self._candidate_map = self._get_step_map(candidate.fractions, candidate.state)
        reduced = self._candidate_map.reduce(candidate.state)
        self._size = len(reduced)
        # The solver needs a start in the interior of the bounds.
        inner_fractions = np.clip(candidate.fractions, 1e-3, 1.0 - 1e-3)
        self.start = np.concatenate((reduced, inner_fractions))
        unbounded = np.full(self._size, np.inf)
        self.bounds = (
            np.concatenate((-unbounded, 0.0 * inner_fractions)),
            np.concatenate((unbounded, 1.0 + 0.0 * inner_fractions)),
        )
        self.scale = np.concatenate(
            (np.ones(self._size), np.full(len(inner_fractions), FRACTION_SCALE))
        )

    def _get_step_map(self, fractions: Floats, state: Floats) -> StepMap:
        """Return the step map of the model at some fractions; the latest ones are cached."""
        key = fractions.tobytes()
        if key not in self._maps:
            # The solver evaluates residual and Jacobian of the latest models only.
            self._maps = dict(list(self._maps.items())[-CACHED_STEP_MAPS:])
            self._maps[key] = self._search.make_step_map(fractions, state, ROUGH_ACCURACY)
        return self._maps[key]

    def unpack(self, unknowns: Floats) -> tuple[Floats, StepMap, Floats]:
        """Split the unknowns.

        Args:
            unknowns: reduced state and fractions.

        Returns:
            Fractions of the numbers, the step map of the model with these numbers, and the state.
        """
        reduced, fractions = np.split(unknowns, [self._size])
        step_map = self._get_step_map(fractions, self._candidate_map.expand(reduced))
        return fractions, step_map, step_map.expand(reduced)

    def compute_residual(self, unknowns: Floats) -> Floats:
        """Return the change of the reduced state by the step map.

        Where the walker makes no step, all entries are `FALL_RESIDUAL`.
        """
        try:
            _, step_map, state = self.unpack(unknowns)
        except OsimliteError:
            return np.full(self._size, FALL_RESIDUAL)
        change = step_map.reduce(step_map(state[None]).states[0]) - unknowns[: self._size]
        return change if np.isfinite(change).all() else np.full(self._size, FALL_RESIDUAL)

    def check_progress(self, intermediate_result: Any) -> None:
        """Stop the solver near a cycle, or where the residual no longer decreases.

        Near a cycle Newton's method takes over.

        Raises:
            StopIteration: the residual is small, or no longer decreases; scipy then stops the
                solver.
        """
        self._sizes.append(float(np.linalg.norm(intermediate_result.fun)))
        present_size = self._sizes[-1]
        earlier_size = self._sizes[-1 - MAX_STALLED_ITERATIONS :][0]
        if present_size < NEWTON_RANGE or (
            len(self._sizes) > MAX_STALLED_ITERATIONS and present_size > 0.5 * earlier_size
        ):
            raise StopIteration

    def differentiate_residual(self, unknowns: Floats) -> Floats:
        """Return the Jacobian of the residual; zeros in directions in which the walker makes no step."""
        _, step_map, state = self.unpack(unknowns)
        columns = [differentiate_step_map(step_map, state, STATE_DIFFERENCE) - np.eye(self._size)]
        residual = self.compute_residual(unknowns)
        for index in range(self._size, len(unknowns)):
            column = np.full(self._size, np.nan)
            # One-sided differences: the other side may be out of bounds, or may have no step.
            for shift in (FRACTION_DIFFERENCE, -FRACTION_DIFFERENCE):
                shifted = unknowns.copy()
                shifted[index] += shift
                if (
                    0.0 <= shifted[index] <= 1.0
                    and (shifted_residual := self.compute_residual(shifted))[0] != FALL_RESIDUAL
                ):
                    column = (shifted_residual - residual) / shift
                    break
            columns.append(column[:, None])
        return np.nan_to_num(np.hstack(columns), nan=0.0)
