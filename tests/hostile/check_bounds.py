"""Check that a Moco study with bounds that admit no value is an error before the optimizer starts."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.errors import OsimliteError

pytest.importorskip("casadi", reason="needs casadi (extra 'casadi')")


@pytest.mark.parametrize("bounds", ["-inf", "-inf -inf", "inf", "inf inf"])
def test_infinite_bounds_leave_no_value(bounds: str, fixtures: Path, tmp_path: Path) -> None:
    for name in ("slide.osim", "slide_guess.sto", "slide_states.sto"):
        (tmp_path / name).write_bytes((fixtures / "setups" / name).read_bytes())
    text = (fixtures / "setups" / "slide.omoco").read_text()
    text = text.replace(
        "<initial_bounds>0</initial_bounds>", f"<initial_bounds>{bounds}</initial_bounds>", 1
    )
    (tmp_path / "slide.omoco").write_text(text)
    with pytest.raises(OsimliteError):
        osimlite.moco.solve(tmp_path / "slide.omoco")
