"""Check that OpenSim rejects Moco studies with faults that the linter reports as errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from osimlite.lint import validate
from tests.lint.setup_faults import FAULTS, SETUPS, STUDIES, Fault, put_in
from tests.scripts import run_script
from tests.suite import choose

pytest.importorskip("opensim")
pytestmark = pytest.mark.oracle

CASES = [fault for fault in [*FAULTS, *STUDIES] if "slide" in fault.file]
# OpenSim solves these studies, but other problems than the file describes.
SOLVED = {310, 313, 317, 324}
# The optimizer does not end for this study.
ENDLESS = {322}
PROGRAM = """
import json, os, sys, opensim
opensim.Logger.setLevelString("off")
for folder in sys.argv[1:]:
    os.chdir(folder)
    try:
        said = opensim.MocoStudy("slide.omoco").solve().success()
    except RuntimeError as error:
        said = str(error)
    print("\\n" + json.dumps([folder, said]))
"""


def test_opensim_refuses_the_studies_with_errors(tmp_path: Path) -> None:
    tried = [fault for fault in CASES if fault.number not in ENDLESS]
    asked = [Fault("control", "slide.omoco", "", ""), *tried[:: choose(8, 1)]]
    for fault in asked:
        folder = tmp_path / str(fault.number)
        folder.mkdir()
        for file in SETUPS.glob("slide*"):
            (folder / file.name).write_bytes(file.read_bytes())
        put_in(folder, fault)
    folders = [str(tmp_path / str(fault.number)) for fault in asked]
    run = run_script(PROGRAM, *folders)
    said = dict(
        json.loads(line) for line in run.stdout.splitlines() if line.startswith(f'["{tmp_path}')
    )
    assert said.keys() == set(folders)
    for fault, path in zip(asked, folders, strict=True):
        assert (said[path] is True) == (fault.number in SOLVED | {"control"}), (
            f"{fault.number}: {said[path]}"
        )
        assert bool(validate(path, ignore="OSIM111").findings) == (fault.number != "control"), (
            fault.number
        )
