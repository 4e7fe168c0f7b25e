"""Compare motions whose columns are named by paths with a live OpenSim, in each tool."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from tests.labs import change, copy_lab
from tests.oracle.ranged_tools import TOOLS, Tool, lay_out_loop, lay_out_scaling

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Task of a coordinate that follows a file.
TASK = """<IKCoordinateTask name="knee_angle"><apply>true</apply><weight>10</weight>
<value_type>from_file</value_type></IKCoordinateTask></objects></IKTaskSet>
<coordinate_file>walk.mot</coordinate_file>"""
# Formats of column labels for the name, path and joint of a coordinate.
SPELLINGS = {"plain": "{0}", "value": "{1}/value", "path": "{1}", "old": "{2}/{0}/value"}


def lay_out_task(folder: Path) -> None:
    """Write a setup of inverse kinematics with markers and a coordinate that follows a file."""
    copy_lab("locked", folder)
    motion = (folder / "walk.mot").read_bytes()
    copy_lab("unseen", folder)
    (folder / "walk.mot").write_bytes(motion)
    change(folder / "ik.xml", ("</objects></IKTaskSet>", TASK))


def lay_out_placer(folder: Path) -> None:
    """Write a setup that places markers in a pose with a coordinate that follows a file."""
    copy_lab("locked", folder)
    motion = (folder / "walk.mot").read_bytes()
    lay_out_scaling(folder)
    (folder / "walk.mot").write_bytes(motion)
    change(folder / "scale.xml", ("</objects></IKTaskSet>", TASK))


# Tools that read a motion of coordinates.
USERS = {
    "IK": TOOLS["IK"]._replace(lay_out=lay_out_task),
    "placer": TOOLS["scale"]._replace(lay_out=lay_out_placer, table="subj_static.mot"),
    "ID": TOOLS["ID"],
    "analyze": TOOLS["analyze"],
    "SO": Tool(lay_out_loop, "so.xml", "AnalyzeTool", ("", ""), "so_StaticOptimization_force.sto"),
    "RRA": TOOLS["RRA"],
    "CMC": TOOLS["CMC"],
}
# Consequence of each spelling. `same`: both programs compute the motion. `both`: both reject it.
# `ours`: OpenSim computes with other values, and osimlite reports this.
FATES = {
    "IK": "plain:same value:both path:both old:both",
    "placer": "plain:same value:both path:both old:both",
    "ID": "plain:same value:ours path:ours old:ours",
    "analyze": "plain:same value:same path:ours old:same",
    "SO": "plain:same value:same path:ours old:same",
    "RRA": "plain:same value:same path:ours",
    "CMC": "value:same",
}
CASES = [(name, *case.split(":")) for name, cases in FATES.items() for case in cases.split()]


def spell_columns(folder: Path, spelling: str) -> None:
    """Name the columns of the motion of a lab in one of the spellings."""
    (model,) = folder.glob("*.osim")
    mechanism = osimlite.mechanism(osimlite.read(model))
    lines = (folder / "walk.mot").read_text().splitlines()
    number = next(number for number, line in enumerate(lines) if line.startswith("time\t"))
    names = {
        info.name: SPELLINGS[spelling].format(info.name, info.path, info.path.split("/")[-2])
        for info in mechanism.coordinates
    }
    lines[number] = "\t".join(names.get(word, word) for word in lines[number].split("\t"))
    (folder / "walk.mot").write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(("name", "spelling", "fate"), CASES)
def test_columns_that_are_paths(
    tmp_path: Path, run_live: Callable[..., dict[str, Any]], name: str, spelling: str, fate: str
) -> None:
    tool = USERS[name]
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    for folder in (ours, theirs):
        folder.mkdir()
        tool.lay_out(folder)
        spell_columns(folder, spelling)
    live = run_live(theirs, tool.name, tool.setup)
    assert (live["end"] == "done") == (fate != "both"), live
    if fate == "both":
        with pytest.raises(osimlite.OsimliteError, match="has no column 'knee_angle'"):
            osimlite.run(ours / tool.setup)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = osimlite.run(ours / tool.setup)
    assert result.done
    told = [item.message for item in result.warnings if item.code == "OSIM842"]
    assert any("by paths" in message for message in told) == (fate == "ours")
    mine, known = read_sto(ours / tool.table), read_sto(theirs / tool.table)
    assert mine.columns == known.columns
    apart = np.abs(mine.rows - known.rows).max()
    if fate == "ours":
        assert apart > 1e-3
    else:
        # OpenSim stops fitting markers at its accuracy, osimlite at the minimum.
        assert apart < (0.2 if name in ("IK", "placer") else 1e-4)
