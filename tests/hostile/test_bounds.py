"""Bounds of studies that leave no value are told before the optimizer is asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError, SimulationError


@pytest.mark.parametrize("bounds", ["-inf", "-inf -inf", "inf", "inf inf"])
def test_infinite_bounds_leave_no_value(bounds: str, fixtures: Path, tmp_path: Path) -> None:
    pytest.importorskip("casadi", reason="needs casadi (extra 'casadi')")
    import osimlite

    for name in ("slide.osim", "slide_guess.sto", "slide_states.sto"):
        (tmp_path / name).write_bytes((fixtures / "setups" / name).read_bytes())
    text = (fixtures / "setups" / "slide.omoco").read_text()
    text = text.replace("<initial_bounds>0</initial_bounds>", f"<initial_bounds>{bounds}</initial_bounds>", 1)
    (tmp_path / "slide.omoco").write_text(text)
    with pytest.raises(OsimliteError):
        osimlite.moco.solve(tmp_path / "slide.omoco")


def test_forces_that_are_no_numbers_are_no_result(fixtures: Path) -> None:
    """The library refuses them as the command does."""
    model = osimlite.read(fixtures / "pipelines" / "pendulum" / "model.osim")
    motion = {
        coordinate.name: [0.01 * k * k for k in range(12)] for coordinate in model.components(osimlite.Coordinate)
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
