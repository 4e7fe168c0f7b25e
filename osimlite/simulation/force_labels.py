"""Labels of force records in the files that OpenSim writes."""

from __future__ import annotations

from collections.abc import Iterable

ENERGY = "PotentialEnergy"
"""The label of the energy of every CoordinateLimitForce, however many there are in one file."""


def label_as_opensim(labels: Iterable[str]) -> list[str]:
    """Return labels of force records as OpenSim's ForceReporter and StaticOptimization write them.

    Args: labels: of the force elements, in which the energy of a limit force carries the name of
        that force.
    """
    return [ENERGY if label.endswith(f".{ENERGY}") else label for label in labels]
