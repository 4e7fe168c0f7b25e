"""Copies of the small lab pipelines in `fixtures/labs`, which tests change, and comparison with OpenSim's results."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from osimlite.io.tables.storage import StoTable, read_sto
from tests.scripts import run_script

LABS = Path(__file__).parents[1] / "fixtures" / "labs"


def copy_lab(name: str, folder: Path) -> Path:
    """Copy one of the pipelines into a folder, and return the folder."""
    shutil.copytree(LABS / name, folder, dirs_exist_ok=True)
    return folder


def change(path: Path, *pairs: tuple[str, str]) -> None:
    """Replace texts in a file; each old text must occur."""
    text = path.read_text()
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text)


def run_opensim(setup: Path, results: Path) -> tuple[bool, str]:
    """Run a setup file with OpenSim in a separate process, from the folder of the setup.

    Args:
        setup: setup file.
        results: folder of the results.

    Returns:
        Whether OpenSim reports success within a minute of processor time, and its log.
    """
    results.mkdir(exist_ok=True)
    ended = run_script(_RUN, setup.name, results, folder=setup.parent, check=False)
    log = ended.stdout + ended.stderr
    return "run: True" in log, log


# Script that runs a setup by OpenSim, with a limit of 60 s of processor time.
_RUN = """
import re, resource, sys, opensim
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
opensim.Logger.removeFileSink()
setup, results = sys.argv[1:]
tag = re.search(r"<(\\w+Tool)\\b", open(setup).read())[1]
tool = getattr(opensim, tag)(setup)
if hasattr(tool, "setResultsDir"):
    tool.setResultsDir(results)
print("run:", tool.run())
"""


def difference(ours: StoTable | Path, theirs: StoTable | Path) -> float:
    """Return the largest difference between two tables with equal columns and times, where the first has no NaN."""
    one, two = (read_sto(item) if isinstance(item, Path) else item for item in (ours, theirs))
    assert one.columns == two.columns
    assert np.allclose(one.times, two.times, atol=1e-8)
    known = ~np.isnan(one.rows)
    assert known.any()
    return float(np.abs(one.rows - two.rows)[known].max())
