"""Check that forces which are not finite are an error instead of a result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import SimulationError


def test_forces_that_are_no_numbers_are_no_result(fixtures: Path) -> None:
    """The library raises an error as the command does."""
    model = osimlite.read(fixtures / "pipelines" / "pendulum" / "model.osim")
    motion = {
        coordinate.name: [0.01 * k * k for k in range(12)]
        for coordinate in model.components(osimlite.Coordinate)
    }
    times = [0.1 * k for k in range(12)]
    osimlite.inverse_dynamics(model, motion, times=times)
    for body in model.components(osimlite.Body):
        body.mass_center = (1e308, 0.0, 0.0)
    with (
        np.errstate(all="ignore"),
        pytest.raises(SimulationError, match=r"Generalized Forces is (nan|inf|-inf)"),
    ):
        osimlite.inverse_dynamics(model, motion, times=times)
