"""Compare unusual time ranges in each tool with a live OpenSim.

The ranges are empty, reversed, outside of the data, or not numbers.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.lint import validate
from tests.oracle.ranged_tools import TOOLS, Tool

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

RANGES = {
    "IK": "wider:same infinite:same empty:same one:same comma:same reversed:both before:both after:both NaN:both last:both",
    "ID": "wider:same empty:ours infinite:both comma:same three:same reversed:both before:ours after:ours NaN:both one:both",
    "scale": "wider:same missing:same before:same after:same infinite:both comma:same three:same reversed:both empty:both",
    "IMU": "wider:same infinite:same empty:same NaN:same comma:same reversed:both before:both last:both",
    "analyze": "wider:same infinite:same last:same comma:same reversed:ours before:ours after:ours NaN:ours empty:both",
    "states": "wider:same infinite:same last:same before:same after:same reversed:ours NaN:ours empty:both",
    "RRA": "reversed:both before:both NaN:both last:ours empty:both",
    "CMC": "reversed:both before:both last:ours empty:both",
    "forward": "wider:same reversed:both before:both NaN:both last:ours empty:both",
}
"""Time ranges of each tool, and how both programs treat them.

``same``: both run, with the same numbers. ``both``: both reject the range. ``ours``: OpenSim writes
a useless table, without rows or with the row nearest to the range, and only osimlite rejects it.
"""
CASES = [(tool, *case.split(":")) for tool, cases in RANGES.items() for case in cases.split()]


def change_times(tool: Tool, folder: Path, case: str) -> None:
    """Write the time range of a case into the setup of a tool."""
    first, last = tool.times
    times = {
        "wider": ("-5", "500"),
        "infinite": ("-Inf", "Inf"),
        "reversed": (last, first),
        "before": ("-5", "-4"),
        "after": ("500", "600"),
        "NaN": ("NaN", last),
        "last": (first, "NaN"),
        "comma": (f"{first},", last),
        "one": (first, ""),
        "three": (first, f"{last} 0.9"),
    }.get(case, ("", ""))
    text = (folder / tool.setup).read_text()
    if "<time_range>" in text:
        new = "" if case == "missing" else f"<time_range>{' '.join(times).strip()}</time_range>"
        text = re.sub("<time_range>.*?</time_range>", new, text, count=1)
    else:
        for tag, time in zip(("initial_time", "final_time"), times, strict=True):
            text = re.sub(f"<{tag}>.*?</{tag}>", f"<{tag}>{time}</{tag}>", text, count=1)
    (folder / tool.setup).write_text(text)


@pytest.mark.parametrize(("name", "case", "fate"), CASES)
def test_a_time_range(
    tmp_path: Path, run_live: Callable[..., dict[str, Any]], name: str, case: str, fate: str
) -> None:
    tool = TOOLS[name]
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    for folder in (ours, theirs):
        folder.mkdir()
        tool.lay_out(folder)
        change_times(tool, folder, case)
    live = run_live(theirs, tool.name, tool.setup)
    assert (live["end"] == "done") == (fate != "both"), live
    if fate != "same":
        with pytest.raises(osimlite.OsimliteError) as refused:
            osimlite.run(ours / tool.setup)
        if fate == "ours":
            # No message may say that OpenSim rejects what it runs.
            errors = [item.message for item in validate(str(ours / tool.setup)).errors]
            for message in [*errors, refused.value.message]:
                assert not re.search("OpenSim (fails|rejects|crashes)", message)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert osimlite.run(ours / tool.setup).done
    if tool.table.endswith(".xml"):
        # OpenSim writes six digits.
        ratios, expected = (
            [
                float(word)
                for item in re.findall("<scales>(.*?)<", path.read_text())
                for word in item.split()
            ]
            for path in (ours / tool.table, theirs / tool.table)
        )
        assert ratios == pytest.approx(expected, rel=1e-5)
        return
    mine, known = read_sto(ours / tool.table), read_sto(theirs / tool.table)
    assert mine.columns == known.columns
    assert mine.times == pytest.approx(known.times, abs=1e-8)
    # OpenSim stops fitting markers at its accuracy, osimlite at the minimum.
    assert np.abs(mine.rows - known.rows).max() < (0.2 if name == "IK" else 1e-4)
