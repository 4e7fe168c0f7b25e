"""The search for walkers that keep on walking: which start, with which numbers of the model, repeats itself.

1. Random starts of random models: each walker stands with a foot at rest on the ground. Kept are
   those that make two steps, the ones first whose second step ended most like the first.
2. From the best of them, the start and the numbers are moved together until the step ends where it
   began (least squares by a trust region, then Newton's method), which is a cycle.
3. The numbers of the best cycle are led on, from cycle to cycle, to where its largest multiplier is
   small, and then to where most of the walkers that start near it walk
   (`osimlite.studies.gait.stability`).
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
from osimlite.simulation.batches import BatchEngine, run_many
from osimlite.studies.gait.basin import sample_perturbed_starts, walks_from
from osimlite.studies.gait.cycle import CONVERGED, MOST_STEPS, Cycle, find_cycle, step_matrix
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.starts import move_along_neutral_directions, plant_feet
from osimlite.studies.gait.stepmap import TIGHT, StepMap
from osimlite.studies.gait.steps import Walk, walk_many
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.variables import Floats, Start, refuse_counts
from osimlite.studies.sweep.variants import Variant, Variants

ROUGH, FINE = 1e-7, 1e-9
"""Accuracy of the integrator where a walker is far from its cycle, and where it is near."""

NEAR = 1e-6
"""While numbers are searched, a cycle is found when the map moves it by less than this."""

DIFFERENCE, SHIFT = 1e-4, 1e-4
"""By how much reduced states, and numbers as parts of their ranges, are moved to differentiate the step map."""

SLOWER = 0.25
"""Weight of speeds beside values (s) where states are compared."""

KEPT = 4
"""So many step maps are kept at a time."""

LOST = 10.0
"""What is missed, in each direction, by a walker that makes no step."""

MOST_MOVES, CLOSE = 30, 3e-3
"""So many moves bring a candidate so near to a cycle, or it is given up."""

PATIENCE = 8
"""After so many moves that did not halve what is missed, a candidate is given up."""

NUMBERS_REACH = 0.1
"""So much of their ranges the numbers are moved as readily as reduced states by 1."""

MIDWAY = 0.4
"""Part of a step after the heel strike at which walkers start near a cycle."""

STARTS, STEPS = 60, 20
"""So many walkers start near a cycle, and after so many steps they walk."""

SCUFFED = 1.0
"""What a scuff in a cycle costs."""

FIRST_SECONDS = 3.0
"""So long random walkers walk."""

AT_ONCE, ALIKE = 1024, 64
"""So many random walkers are tried together, and so many of them are the same model."""

MOST_TRIES = 3000
"""Steps that the integrator may try for one of them; what takes more rattles."""

Progress = Callable[[float, float], object]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A walker whose second step ended nearly as the first."""

    fractions: Floats  # where the numbers of its model lie in their ranges (k,)
    state: Floats  # at the end of the first step, written for the first foot (y,)
    miss: float  # by how much the second ended otherwise


@dataclass(frozen=True, eq=False)
class Found:
    """A model with its cycle."""

    fractions: Floats  # where its numbers lie in their ranges (k,)
    numbers: dict[str, float]  # by the names of the variables
    cycle: Cycle  # that it walks in
    walking: float  # which part of the walkers that start near it walk; 0 where nobody asked
    # the less, the better: the largest multiplier, and below what is stable enough, less by
    # `walking`
    cost: float


class CycleSearch:
    """Looks for cycles of the models of a plan.

    Args:
        plan: what is varied: starts, from which the walkers are drawn, and numbers of the model,
            which are searched.
        feet: contacts of each foot; found by the structure of the model if left out.
        stable: largest multiplier that is small enough; below it, what counts is how many walk from
            near the cycle.
        perturb: how near: every value and speed is changed by this part at most.
        threads: how many work.

    Attributes:
        footing: the feet.

    Raises:
        OsimliteError: the model cannot be simulated, or has no two feet that are alike.
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
        self.plan, self.stable, self.perturb, self.threads = plan, stable, perturb, threads
        refuse_counts(plan.variables)
        self.variants = Variants(plan)
        free = [(place, item) for place, item in enumerate(plan.variables) if not item.is_fixed]
        self._starts = [place for place, item in free if isinstance(item.target, Start)]
        self._numbers = [place for place, item in free if not isinstance(item.target, Start)]
        if not self._starts:
            raise SettingError(
                "walkers are drawn at random; vary some values and speeds of coordinates at the start"
            )
        self._least = [item.low for item in plan.variables]
        given: Any = self.variants.given.engine
        self.footing: FootContacts = find_footing(given, feet)
        if len(self.footing.feet) != 2:
            raise SettingError(
                f"a cycle is looked for on two feet; '{given.mechanism.name}' has another number of them"
            )
        self._first: StepMap | None = None

    # ---------------------------------------------------------------------------------------- models
    @property
    def names(self) -> list[str]:
        """Of the numbers that are searched."""
        return [self.plan.variables[place].name for place in self._numbers]

    def values(self, fractions: Floats) -> list[float]:
        """A sample of the plan with the model's numbers at fractions (k,) of their ranges."""
        row = list(self._least)
        for place, fraction in zip(self._numbers, fractions, strict=True):
            # Without the noise of the last bits, a number that was rounded stays so.
            row[place] = float(f"{self.plan.variables[place].at(np.array(fraction)):.14g}")
        return row

    def numbers(self, fractions: Floats) -> dict[str, float]:
        """The model's numbers by name."""
        row = self.values(fractions)
        return {self.plan.variables[place].name: row[place] for place in self._numbers}

    def fractions(self, numbers: Mapping[str, float]) -> Floats:
        """Where numbers, by name, lie in their ranges (k,)."""
        items = {item.name: item for item in self.plan.variables}
        return np.array([items[name].fraction(numbers[name]) for name in self.names])

    def round_fractions(self, fractions: Floats, digits: int) -> Floats:
        """Where the numbers lie when they have so many digits (k,)."""
        numbers = {
            name: float(f"{number:.{digits}g}") for name, number in self.numbers(fractions).items()
        }
        return self.fractions(numbers)

    def model(self, fractions: Floats, start: Mapping[str, tuple[float, float]]) -> Model:
        """The model with these numbers, and with values and speeds of coordinates as their defaults."""
        self.variants.apply_sample(self.values(fractions))
        model = self.variants.model
        for coordinate in model.components(Coordinate):
            if coordinate.name in start:
                coordinate.default_value, coordinate.default_speed_value = start[coordinate.name]
        return model

    def engine(self, fractions: Floats) -> BatchEngine:
        """Of the model with these numbers.

        Raises:
            OsimliteError: there is no such model, or it is of another structure.
        """
        variant = self.variants.variant(self.values(fractions))
        if variant.structure != self.variants.given.structure:
            raise OsimliteError("the numbers change the structure of the model; vary others")
        return variant.engine

    # ---------------------------------------------------------------------------------------- random starts
    def find_candidates(
        self, count: int, seed: int, progress: Progress | None = None
    ) -> list[Candidate]:
        """Draw walkers, and keep those that make two steps without a scuff between, the most alike first.

        Args:
            count: how many are drawn.
            seed: of the random numbers.
            progress: called with how many have walked, and of how many.
        """
        rng, result = np.random.default_rng(seed), []
        for first in range(0, count, AT_ONCE):
            size = min(AT_ONCE, count - first)
            result += self._draw_samples(rng, size)
            if progress is not None:
                progress(first + size, count)
        return sorted(result, key=lambda candidate: candidate.miss)

    def _draw_samples(self, rng: np.random.Generator, count: int) -> list[Candidate]:
        engine: Any = self.variants.given.engine
        models = rng.random((-(-count // ALIKE), len(self._numbers)))
        starts = rng.random((count, len(self._starts)))
        fractions = np.repeat(models, ALIKE, axis=0)[:count]
        states, vectors = (
            np.zeros((count, engine.state.size)),
            np.zeros((count, len(engine.numbers))),
        )
        variants: list[Variant] = []
        made = np.ones(count, dtype=bool)
        for row in range(count):
            sample = self.values(fractions[row])
            for place, fraction in zip(self._starts, starts[row], strict=True):
                sample[place] = float(self.plan.variables[place].at(np.array(fraction)))
            try:
                variant = self.variants.variant(sample)
            except OsimliteError:
                made[row] = False
                continue
            made[row] = variant.structure == self.variants.given.structure
            if made[row]:
                states[row], vectors[row] = self.variants.start(variant, sample), variant.numbers
                variants.append(variant)
        states, vectors, fractions = states[made], vectors[made], fractions[made]
        if not len(states):
            return []
        states = self.variants.prepare_states(
            engine, variants, plant_feet(engine, self.footing, states, numbers=vectors)
        )
        walks = walk_many(
            engine,
            states,
            FIRST_SECONDS,
            footing=self.footing,
            numbers=vectors,
            accuracy=1e-3,
            most_tries=MOST_TRIES,
            threads=self.threads,
        )
        pairs = (
            self._find_similar_strikes(walk, row)
            for walk, row in zip(walks, fractions, strict=True)
        )
        return [pair for pair in pairs if pair is not None]

    def _find_similar_strikes(self, walk: Walk, fractions: Floats) -> Candidate | None:
        """The heel strikes of a walk that are most alike, one step apart, or one stride if the legs differ."""
        if len(walk.steps) < 2:
            return None
        if self._first is None:
            engine = self.engine(fractions)
            self._first = StepMap(
                engine,
                walk.steps[0].state,
                footing=self.footing,
                accuracy=ROUGH,
                threads=self.threads,
            )
        swap, best = self._first.exchange, None
        strikes = [
            (step.time, step.state if step.foot == 0 or swap is None else step.state[swap])
            for step in walk.steps
            if step.foot == 0 or swap is not None
        ]
        for (start, one), (end, two) in pairwise(strikes):
            miss = self._compute_distance(self._first, one, two)
            if (best is None or miss < best.miss) and not any(
                start < scuff.time < end for scuff in walk.scuffs
            ):
                best = Candidate(fractions, one.copy(), miss)
        return best

    @staticmethod
    def _compute_distance(step_map: StepMap, one: Floats, two: Floats) -> float:
        difference = step_map.basis @ step_map.reduce(two - one)
        n = len(step_map.engine.order)
        others = *difference[:n], *difference[2 * n :]
        return float(
            np.hypot(np.linalg.norm(others), SLOWER * np.linalg.norm(difference[n : 2 * n]))
        )

    # ---------------------------------------------------------------------------------------- cycles
    def close_cycle(self, candidate: Candidate) -> Found | None:
        """Move a candidate's start and numbers together until it walks in a cycle; None if it does not come to one."""
        optimize = require("scipy.optimize", extra="sweep", purpose="the search for cycles")
        try:
            problem = _Closing(self, candidate)
            solved = optimize.least_squares(
                problem.compute_residual,
                problem.start,
                problem.differentiate_residual,
                method="dogbox",
                bounds=problem.bounds,
                x_scale=problem.scale,
                max_nfev=MOST_MOVES,
                xtol=1e-8,
                ftol=1e-8,
                gtol=1e-14,
                callback=problem.watch,
            )
            if np.linalg.norm(solved.fun) > CLOSE:
                return None
            fractions, _, state = problem.at(solved.x)
            return self.find_cycle(fractions, state)
        except (OsimliteError, np.linalg.LinAlgError):
            return None

    def find_cycle(self, fractions: Floats, state: Floats, *, fine: bool = False) -> Found:
        """The cycle of the model with these numbers that is near a state, which is a heel strike of the first foot.

        Args:
            fractions: of the numbers (k,).
            state: where to begin (y,).
            fine: whether it is wanted to the last digits.

        Raises:
            OsimliteError: there is none near, or no such model.
        """
        step_map = self.step_map(fractions, state, TIGHT if fine else FINE)
        result = find_cycle(
            step_map,
            state,
            converged=CONVERGED if fine else NEAR,
            most_steps=MOST_STEPS if fine else 8,
        )
        cost, walking = result.largest + SCUFFED * result.scuffs, 0.0
        if cost < self.stable or fine:
            walking = self._measure_basin(step_map, result)
        if cost < self.stable:
            cost = self.stable - walking
        return Found(np.array(fractions), self.numbers(fractions), result, walking, cost)

    def _measure_basin(self, step_map: StepMap, cycle: Cycle) -> float:
        """Which part of the walkers that start near a cycle walk."""
        (state,) = sample_states_of_step(step_map, cycle, (MIDWAY,))
        starts = sample_perturbed_starts(step_map, state, self.perturb, STARTS, 0)
        walks = walks_from(step_map, cycle, starts, STEPS)
        return sum(len(walk.steps) >= STEPS for walk in walks) / STARTS

    def step_map(self, fractions: Floats, state: Floats, accuracy: float) -> StepMap:
        """The step map of the model with these numbers, whose reduced states are alike for all numbers.

        Raises:
            OsimliteError: there is no such model.
        """
        engine = self.engine(fractions)
        if self._first is None:
            self._first = StepMap(engine, state, footing=self.footing, threads=self.threads)
        return self._first.with_model(engine, state, accuracy)


def sample_states_of_step(step_map: StepMap, cycle: Cycle, parts: Sequence[float]) -> Floats:
    """States (k, y) at parts of a step after the heel strike of a cycle; the parts increase.

    The walker is at the origin, its trunk as it was built, as far as neither matters.
    """
    times = [part * cycle.period for part in parts]
    runs = run_many(
        step_map.engine,
        cycle.state[None],
        cycle.period,
        report_times=times,
        accuracy=TIGHT,
        threads=step_map.threads,
    )
    return move_along_neutral_directions(runs.reports[0], step_map.neutral)


class _Closing:
    """The unknowns that close a cycle: reduced state, then fractions of the numbers."""

    def __init__(self, search: CycleSearch, candidate: Candidate) -> None:
        self._search = search
        self._maps: dict[bytes, StepMap] = {}
        self._sizes: list[float] = []
        self._given = self._map(candidate.fractions, candidate.state)
        reduced = self._given.reduce(candidate.state)
        self._size = len(reduced)
        inside = np.clip(candidate.fractions, 1e-3, 1.0 - 1e-3)
        self.start = np.concatenate((reduced, inside))
        many = np.full(self._size, np.inf)
        self.bounds = (
            np.concatenate((-many, 0.0 * inside)),
            np.concatenate((many, 1.0 + 0.0 * inside)),
        )
        self.scale = np.concatenate((np.ones(self._size), np.full(len(inside), NUMBERS_REACH)))

    def _map(self, fractions: Floats, state: Floats) -> StepMap:
        key = fractions.tobytes()
        if key not in self._maps:
            # Only the last are asked for again.
            self._maps = dict(list(self._maps.items())[-KEPT:])
            self._maps[key] = self._search.step_map(fractions, state, ROUGH)
        return self._maps[key]

    def at(self, unknowns: Floats) -> tuple[Floats, StepMap, Floats]:
        """Fractions of the numbers, the step map of the model with them, and the state."""
        reduced, fractions = np.split(unknowns, [self._size])
        step_map = self._map(fractions, self._given.expand(reduced))
        return fractions, step_map, step_map.expand(reduced)

    def compute_residual(self, unknowns: Floats) -> Floats:
        """How far the map moves the reduced state."""
        try:
            _, step_map, state = self.at(unknowns)
        except OsimliteError:
            return np.full(self._size, LOST)
        moved = step_map.reduce(step_map(state[None]).states[0]) - unknowns[: self._size]
        return moved if np.isfinite(moved).all() else np.full(self._size, LOST)

    def watch(self, intermediate_result: Any) -> None:
        """End where Newton's method can go on, and where nothing has been gained for a while."""
        self._sizes.append(float(np.linalg.norm(intermediate_result.fun)))
        here, before = self._sizes[-1], self._sizes[-1 - PATIENCE :][0]
        if here < CLOSE or (len(self._sizes) > PATIENCE and here > 0.5 * before):
            raise StopIteration

    def differentiate_residual(self, unknowns: Floats) -> Floats:
        """Of the miss; of what makes no step, zero."""
        _, step_map, state = self.at(unknowns)
        columns = [step_matrix(step_map, state, DIFFERENCE) - np.eye(self._size)]
        here = self.compute_residual(unknowns)
        for index in range(self._size, len(unknowns)):
            column = np.full(self._size, np.nan)
            for shift in (SHIFT, -SHIFT):
                moved = unknowns.copy()
                moved[index] += shift
                if (
                    0.0 <= moved[index] <= 1.0
                    and (there := self.compute_residual(moved))[0] != LOST
                ):
                    column = (there - here) / shift
                    break
            columns.append(column[:, None])
        return np.nan_to_num(np.hstack(columns), nan=0.0)
