"""Fixtures: the walker, OpenSim's converged motion of it, and osimlite's motion at high accuracy."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from osimlite.schema.model import Model
from tests.simple_models import read_walker

Table = dict[str, "np.ndarray[Any, Any]"]


@pytest.fixture(scope="session")
def walker() -> Model:
    """Return the dynamic walker as OpenSim wrote it; no test of this folder changes it."""
    return read_walker()


@pytest.fixture(scope="session")
def reference(fixtures: Path) -> Callable[[str], Table]:
    """Return a function that reads the columns of a reference table by their labels."""

    def table(name: str) -> Table:
        text = gzip.decompress(
            (fixtures / "walker" / f"{name}_reference.csv.gz").read_bytes()
        ).decode()
        rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
        numbers = np.array(rows[1:], dtype=float)
        return {label: numbers[:, index] for index, label in enumerate(rows[0])}

    return table


@pytest.fixture(scope="session")
def simulation(walker: Model) -> Iterator[Any]:
    """Yield a simulation of the walker by the default engine, which is the compiled one."""
    from osimlite.simulation import Simulation

    with Simulation(walker) as ready:
        yield ready


@pytest.fixture(scope="session")
def precise(simulation: Any) -> Any:
    """Return the first two seconds of the walker at accuracy 1e-9, with a row every millisecond."""
    return simulation.run(2.0, accuracy=1e-9, report_interval=1e-3)
