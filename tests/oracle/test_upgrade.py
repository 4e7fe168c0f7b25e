"""Compare osimlite's upgrade of small old documents with OpenSim 4.6's."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.io.document.reader import read, read_text
from tests.conftest import ROOT
from tests.io.document.upgrade.comparison import differences

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

REFUSED = {
    "engine": "unsupported file format",
    "names": "invalid characters",
    "scale_factors": "unsupported file format",
    "set_levels": "could not find '../ground'",
    "transform_axes": "unsupported file format",
}
"""Documents that OpenSim cannot read or connect, with its message."""


@pytest.mark.parametrize(
    "example", sorted((ROOT / "fixtures" / "versions").glob("*.osim")), ids=lambda path: path.stem
)
def test_opensim_upgrades_alike(example: Path, tmp_path: Path) -> None:
    opensim.Logger.setLevelString("off")
    target = tmp_path / "converted.osim"

    def convert() -> None:
        model = opensim.Model(str(example))
        model.finalizeConnections()
        model.initSystem()
        model.printToXML(str(target))

    if example.stem in REFUSED:
        with pytest.raises(RuntimeError, match=REFUSED[example.stem]):
            convert()
        return
    convert()
    ours, theirs = read(example), read_text(target.read_bytes())
    assert [component.path for component in ours.components()] == [
        component.path for component in theirs.components()
    ]
    assert differences(ours, theirs) == []


@pytest.mark.parametrize(
    "example",
    sorted((ROOT / "fixtures" / "versions" / "upgraded").glob("*.osim")),
    ids=lambda path: path.stem,
)
def test_opensim_reads_what_we_upgraded(example: Path) -> None:
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(example))
    model.initSystem()
    ours = [component.path for component in read(example).components()]
    assert [component.getAbsolutePathString() for component in model.getComponentsList()] == ours[
        1:
    ]
