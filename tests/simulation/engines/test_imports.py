"""Tests of the imports of commands that simulate: neither numba nor scipy, which take half a second.

If the library contains all kernels, no compiler is started either.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.engines.kernel_library import load_library
from tests.simulation.elements.muscle_rows import hung, muscle

SETUP = (
    "<OpenSimDocument Version='40600'><InverseDynamicsTool><model_file>walker.osim</model_file>"
    "<coordinates_file>walker.mot</coordinates_file></InverseDynamicsTool></OpenSimDocument>"
)
SCRIPT = """
import sys, osimlite.cli
try:
    osimlite.cli.main(sys.argv[1:])
finally:
    print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a walker with a motion and a setup, and an arm with a muscle; return the folder."""
    folder = tmp_path_factory.mktemp("commands")
    osimlite.write(dynamic_walker(), folder / "walker.osim")
    arm = hung(muscle("thelen_default"))
    arm.find("/jointset/slide/x").range = (0.3, 0.36)
    arm.find("/jointset/slide/x").default_value = 0.33
    osimlite.write(arm, folder / "arm.osim")
    rows = "".join(f"0.{k} 0\n" for k in range(9))
    (folder / "walker.mot").write_text(
        f"m\nversion=1\nnRows=9\nnColumns=2\nendheader\ntime Pelvis_tx\n{rows}"
    )
    (folder / "setup.xml").write_text(SETUP)
    return folder


@pytest.mark.parametrize(
    "words",
    [
        "simulate walker.osim --to 0.1 -o motion",
        "simulate arm.osim --to 0.01 --equilibrate -o arm",
        "validate walker.osim --no-cache",
        "validate arm.osim --no-cache",
        "muscles arm.osim -o curves.csv",
        "view walker.osim --html page.html",
        "run setup.xml",
    ],
)
def test_neither_numba_nor_scipy_is_imported(folder: Path, words: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *words.split()], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(os.path.abspath, filter(None, sys.path)))},
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    modules = set(done.stderr.split())
    assert not modules & {"numba", "llvmlite", "scipy"}
    assert load_library() is None or "subprocess" not in modules
