"""Check that faults which the linter finds by geometry change OpenSim's results without a message."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.lint.setup_faults import FAULTS, TEXTS, Fault, put_in
from tests.scripts import run_script

pytest.importorskip("opensim")
pytestmark = pytest.mark.oracle

# Setup file of each tool and the table that it writes.
RESULTS = {
    "InverseDynamicsTool": ("id.xml", "Results/subject01_walk_ID.sto"),
    "InverseKinematicsTool": ("ik.xml", "ik_out.mot"),
}
CONTROL = Fault("control", "ik.xml", "", "")
# Smallest difference of the results for each fault, in N m or degrees.
SILENT = {
    144: ("InverseDynamicsTool", 50.0),
    "feet swapped": ("InverseDynamicsTool", 50.0),
    "points of ground": ("InverseDynamicsTool", 50.0),
    "forces of ground": ("InverseDynamicsTool", 20.0),
    "sides swapped": ("InverseKinematicsTool", 2.0),
    56: ("InverseKinematicsTool", 10.0),
    283: ("InverseKinematicsTool", 10.0),
}


def results(folder: Path, fault: Fault, tool: str) -> list[list[float]]:
    """Return the rows of the table that an OpenSim tool writes for a pipeline with a fault."""
    folder.mkdir()
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    put_in(folder, fault)
    setup, file = RESULTS[tool]
    program = f"import opensim; opensim.Logger.setLevelString('off'); assert opensim.{tool}('{setup}').run()"
    run_script(program, folder=folder)
    rows = (folder / file).read_text().split("endheader")[1].split("\n")[2:]
    return [list(map(float, row.split())) for row in rows if row.strip()]


@pytest.fixture(scope="module")
def control(tmp_path_factory):
    """Return the results of the tools without a fault."""
    return {
        tool: results(tmp_path_factory.mktemp("control") / tool, CONTROL, tool) for tool in RESULTS
    }


@pytest.mark.parametrize("number", SILENT, ids=str)
def test_opensim_computes_something_else(tmp_path, control, number):
    tool, least = SILENT[number]
    fault = next(fault for fault in FAULTS if fault.number == number)
    result = results(tmp_path / "faulty", fault, tool)
    assert len(result) == len(control[tool])
    largest = max(
        abs(a - b)
        for one, other in zip(result, control[tool], strict=True)
        for a, b in zip(one, other, strict=True)
    )
    assert largest > least
