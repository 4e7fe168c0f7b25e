"""Result of static optimization: which actuator supplies which part of the generalized forces of a motion.

It has the activations as OpenSim's table, the forces that belong to them, and a description of the
times at which the actuators are too weak.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass
from osimlite.base.text import format_count, join_words
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.spatial import Array

TITLE = "Static Optimization"
"""OpenSim's name of the table of activations."""


@dataclass(frozen=True, eq=False)
class SharedForces:
    """Distribution of the generalized forces of a motion over the actuators.

    Attributes:
        times: times (t,), s.
        names: names of the actuators (a,).
        activations: activations (t, a); NaN at times without a solution.
        strengths: force of each actuator at an activation of 1 (t, a), N or N m.
        coordinates: names of the coordinates to accelerate (m,).
        units: units of their generalized forces (m,), N or N m.
        lacking: generalized forces (t, m) that the actuators cannot supply, N or N m; the smallest
            possible ones at times without a solution.
        solved: whether each time has a solution (t,).
    """

    times: Array
    names: tuple[str, ...]
    activations: Array
    strengths: Array
    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    lacking: Array
    solved: NDArray[np.bool_]

    @property
    def forces(self) -> Array:
        """Forces of all actuators (t, a), N or N m."""
        return self.activations * self.strengths

    def to_table(self) -> StoTable:
        """Return the activations as a table."""
        return StoTable(TITLE, self.times, self.names, self.activations)

    def describe_missing_force(self, row: int) -> str:
        """Describe which coordinates lack force at a time without a solution.

        Args:
            row: index of the time.

        Returns:
            Phrase with the missing generalized forces of three coordinates, the largest first, and
            the number of the others; forces up to a tenth of the largest are left out.
        """
        sizes = np.abs(self.lacking[row])
        worst = [index for index in np.argsort(-sizes) if sizes[index] > 0.1 * sizes.max()]
        return join_words(
            [f"{self.lacking[row, k]:.4g} {self.units[k]} at {self.coordinates[k]}" for k in worst],
            max_count=3,
        )

    def describe_unsolved(self) -> str:
        """Describe the times without a solution and the coordinates that lack force.

        Returns:
            A phrase for a message; empty if every time has a solution.
        """
        failed = np.flatnonzero(~self.solved)
        if not len(failed):
            return ""
        worst = failed[np.argmax(np.abs(self.lacking[failed]).max(axis=1))]
        counts = f"{len(failed)} of {format_count(len(self.times), 'time')}"
        return (
            f"no solution at {counts} (first at {self.times[failed[0]]:g} s); the tables have NaN there; "
            f"at {self.times[worst]:g} s the actuators lack {self.describe_missing_force(worst)}"
        )
