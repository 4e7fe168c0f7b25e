"""Samples of a sweep: grids, random numbers, Sobol sequences and Latin hypercubes.

Sample i depends on the settings and on i only. A sweep of any length therefore needs memory for one
block only, and continues where it was interrupted.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass, field
from osimlite.base.require import require
from osimlite.base.text import format_count, join_words, suggest_or_list
from osimlite.errors import SettingError
from osimlite.studies.sweep.variables import Floats, Variable

Counts = NDArray[np.uint64]
"""Array of whole numbers of 64 bits."""

SAMPLERS = ("grid", "random", "sobol", "lhs")
"""Names of the samplers: every combination, independent uniform numbers, scrambled Sobol sequence,
Latin hypercube (one sample in every layer of each variable).
"""

MAX_SOBOL_POINTS = 2**30
"""Number of points of scipy's Sobol sequence."""


@dataclass(frozen=True)
class Samples:
    """Samples of a sweep.

    Attributes:
        variables: variables (d).
        sampler: one of `SAMPLERS`.
        count: number of samples N.
        seed: seed of the random numbers.
        memory: generator that continues from the last block; for one thread only.
    """

    variables: tuple[Variable, ...]
    sampler: str
    count: int
    seed: int = 0
    memory: dict[str, Sobol] = field(default_factory=dict, init=False, repr=False, compare=False)

    def make_block(self, first: int, count: int) -> Floats:
        """Return consecutive samples (k, d) in the units of the variables.

        Args:
            first: index of the first sample.
            count: number of samples; fewer are returned at the end.
        """
        end = min(first + count, self.count)
        fractions = np.zeros((max(end - first, 0), len(self.variables)))
        varied_indices = [
            index for index, variable in enumerate(self.variables) if not variable.is_fixed
        ]
        if len(fractions) and varied_indices:
            fractions[:, varied_indices] = self._compute_fractions(first, end, varied_indices)
        columns = [
            variable.interpolate(fractions[:, index])
            for index, variable in enumerate(self.variables)
        ]
        return np.stack(columns, axis=1) if columns else fractions

    def _compute_fractions(self, first: int, end: int, varied_indices: Sequence[int]) -> Floats:
        """Return samples as fractions of the ranges (last - first, d), by the selected method."""
        if self.sampler == "grid":
            return self._compute_grid(first, end, varied_indices)
        if self.sampler == "sobol":
            return self.memory.setdefault(
                "sobol", Sobol(self.seed, len(varied_indices))
            ).draw_points(first, end)
        numbers = _draw_uniform(self.seed, first, end, len(varied_indices))
        if self.sampler == "random":
            return numbers
        # Latin hypercube: each column visits its N layers in a random order of its own.
        layers = [
            _permute_indices(first, end, self.count, self.seed, column)
            for column in range(len(varied_indices))
        ]
        # A uniform offset within the layer.
        return (np.stack(layers, axis=1) + numbers) / self.count

    def _compute_grid(self, first: int, end: int, varied_indices: Sequence[int]) -> Floats:
        """Return fractions of a grid, in which the last variable changes fastest."""
        counts = [self.variables[grid_index].count or 1 for grid_index in varied_indices]
        grid_indices = np.unravel_index(np.arange(first, end), counts)
        return np.stack(
            [
                grid_index / (count - 1)
                for grid_index, count in zip(grid_indices, counts, strict=True)
            ],
            axis=1,
        )


def choose_samples(
    variables: Sequence[Variable],
    sampler: str | None = None,
    count: int | None = None,
    seed: int = 0,
) -> Samples:
    """Return the samples of a sweep.

    Args:
        variables: variables.
        sampler: one of `SAMPLERS`. The default is a grid if every variable has a number of values
            and there is no `count`, else Sobol.
        count: number of samples; None for a grid, whose ranges determine it.
        seed: seed of random samples.

    Raises:
        SettingError: the arguments contradict each other, or one is missing.
    """
    varied_variables = [variable for variable in variables if not variable.is_fixed]
    with_values = [variable.name for variable in varied_variables if variable.count]
    # Both would fix the number of runs, in different ways.
    if sampler is None and count is not None and with_values:
        raise SettingError(
            "the number of samples sets the number of runs of a random sampler, and the COUNT in the range of "
            f"{join_words(with_values)} the size of a grid; leave out one of the two, or select a sampler"
        )
    if sampler is None:
        sampler = (
            "grid"
            if count is None and all(variable.count for variable in varied_variables)
            else "sobol"
        )
    if sampler not in SAMPLERS:
        raise SettingError(f"there is no sampler '{sampler}'{suggest_or_list(sampler, SAMPLERS)}")
    if seed < 0:
        raise SettingError(f"the seed must be a whole number of at least 0, not {seed}")
    if sampler == "grid":
        uncounted = [variable.name for variable in varied_variables if variable.count is None]
        if uncounted:
            raise SettingError(
                f"a grid needs the number of values of {join_words(uncounted)}, as in "
                f"{uncounted[0]}=LOW:HIGH:COUNT"
            )
        grid_size = prod(variable.count or 1 for variable in varied_variables)
        if count not in (None, grid_size):
            raise SettingError(
                f"the grid has {format_count(grid_size, 'point')}, not {count}; leave out the number of samples"
            )
        return Samples(tuple(variables), sampler, grid_size, seed)
    if count is None:
        raise SettingError(
            "the number of samples is missing; add it, as in --samples 1000 (count=1000)"
        )
    if count < 1:
        raise SettingError(f"the number of samples must be at least 1, not {count}")
    if sampler == "sobol" and count > MAX_SOBOL_POINTS:
        raise SettingError(
            f"Sobol's sequence has only {MAX_SOBOL_POINTS} points; use the sampler 'random' for more samples"
        )
    return Samples(tuple(variables), sampler, count, seed)


class Sobol:
    """Scrambled Sobol sequence.

    Points that follow the last ones are cheap; for earlier ones the sequence starts again.

    Args:
        seed: seed of the scrambling.
        width: number of dimensions.
    """

    def __init__(self, seed: int, width: int) -> None:
        self._seed, self._width = seed, width
        self._points: Any = None
        self._next = 0

    def draw_points(self, first: int, last: int) -> Floats:
        """Return the points first ... last - 1 in the unit cube (last - first, width).

        Args:
            first: index of the first point.
            last: index after the last point.
        """
        first_point = np.zeros((0, self._width))
        if self._points is None or first < self._next:
            qmc: Any = require("scipy.stats.qmc", extra="sweep", purpose="Sobol's sequence")
            self._points = qmc.Sobol(
                self._width, scramble=True, rng=np.random.default_rng(self._seed)
            )
            # scipy warns if the first request is not a power of two, so request one point.
            start, self._next = self._points.random(1), 1
            first_point = start if first == 0 else first_point
        first = max(first, 1) if len(first_point) else first
        if first > self._next:
            # Skipping points is much cheaper than drawing them.
            self._points.fast_forward(first - self._next)
        result: Floats = np.concatenate((first_point, self._points.random(last - first)))
        self._next = last
        return result


def _draw_uniform(seed: int, first: int, last: int, width: int) -> Floats:
    """Return rows first ... last - 1 of independent numbers in [0, 1) (last - first, width)."""
    # Each counter of Philox gives four numbers; a row starts at a new counter, so that it can be
    # reached directly.
    states = -(-width // 4)
    source = np.random.Philox(seed)
    source.advance(first * states)
    rows = np.random.Generator(source).random((last - first, 4 * states))
    return rows[:, :width]


def _permute_indices(first: int, last: int, count: int, seed: int, column: int) -> Floats:
    """Return entries first ... last - 1 of a random permutation of 0 ... count - 1.

    The other entries are not computed.

    A Feistel network permutes the numbers of 2k bits. Results that are not below `count` pass
    through it again until they are (cycle walking).
    """
    # Both halves of a Feistel network have the same number of bits.
    half_bits = max(1, -(-(count - 1).bit_length() // 2))
    mask = np.uint64((1 << half_bits) - 1)
    # Six rounds mix the bits well enough for a shuffle.
    keys = np.random.default_rng((seed, column)).integers(0, 2**64, 6, dtype=np.uint64)
    result: Counts = np.arange(first, last, dtype=np.uint64)
    is_beyond = np.ones(len(result), dtype=bool)
    while is_beyond.any():
        left = result[is_beyond] >> np.uint64(half_bits)
        right = result[is_beyond] & mask
        for key in keys:
            left, right = right, left ^ (_mix_bits(right + key) & mask)
        result[is_beyond] = (left << np.uint64(half_bits)) | right
        is_beyond = result >= count
    return result.astype(np.float64)


def _mix_bits(x: Counts) -> Counts:
    """Return numbers in which each bit depends on every bit of x (finalizer of SplitMix64)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))
