"""Check that OpenSim 4.6 reads a model that osimlite has written."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.io.document.printer import Numbers
from osimlite.models.dynamic_walker import dynamic_walker

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle


def printed_whole(source: Path, target: Path) -> bytes:
    """Return OpenSim's print of a file with every default value written out."""
    opensim.Logger.setLevelString("error")
    model = opensim.Model(str(source))
    model.finalizeConnections()
    opensim.OpenSimObject.setSerializeAllDefaults(True)
    try:
        model.printToXML(str(target))
    finally:
        opensim.OpenSimObject.setSerializeAllDefaults(False)
    return target.read_bytes()


@pytest.mark.parametrize("numbers", ["shortest", "opensim"])
def test_opensim_reads_the_same_model_from_our_file(
    fixtures: Path, tmp_path: Path, numbers: Numbers
) -> None:
    osimlite.write(dynamic_walker(), tmp_path / "ours.osim", numbers=numbers)
    ours = printed_whole(tmp_path / "ours.osim", tmp_path / "ours-printed.osim")
    reference = fixtures / "walker" / "DynamicWalkerModel.osim"
    assert ours == printed_whole(reference, tmp_path / "reference-printed.osim")


def test_opensim_reads_the_same_model_after_our_round_trip(fixtures: Path, tmp_path: Path) -> None:
    reference = fixtures / "walker" / "DynamicWalkerModel.osim"
    osimlite.write(osimlite.read(reference), tmp_path / "again.osim")
    assert printed_whole(tmp_path / "again.osim", tmp_path / "a") == printed_whole(
        reference, tmp_path / "b"
    )
