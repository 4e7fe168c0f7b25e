"""Compare OpenSim 4.6's print of setup files and other documents with osimlite's."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from tests.conftest import ROOT
from tests.oracle.support import COMMENT_LINE
from tests.scripts import run_script

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

DOCUMENTS = sorted((ROOT / "fixtures" / "documents").iterdir())
OLD = {"one_trial": "InverseKinematicsTool", "inverse_dynamics": "InverseDynamicsTool"}
OLD |= {"force_files": "CMCTool", "replaced_forces": "AnalyzeTool"}
"""Documents of old versions, and the class with which OpenSim reads each."""


# Script that prints documents with OpenSim.
PRINT = """
import os, sys, opensim
opensim.Logger.setLevelString("off")
for path in sys.argv[2:]:
    target = os.path.join(sys.argv[1], os.path.basename(path))
    opensim.OpenSimObject.makeObjectFromFile(path).printToXML(target)
"""


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the documents as OpenSim prints them."""
    folder = tmp_path_factory.mktemp("printed")
    # OpenSim runs in another process. The document with `<defaults>` comes last, because OpenSim
    # applies its defaults to everything that it reads later.
    paths = sorted(DOCUMENTS, key=lambda path: path.stem == "defaults")
    run_script(PRINT, folder, *paths)
    return folder


def without_comments(text: str) -> str:
    return COMMENT_LINE.sub("", text)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_opensim_prints_the_same(path: Path, printed: Path) -> None:
    target = printed / path.name
    result = read_document(Source.from_file(path), expected_class=Object)
    lines = osimlite.to_text(result.top, numbers="opensim", comments=False).splitlines(
        keepends=True
    )
    # OpenSim drops unknown elements; osimlite retains them.
    unknown = [note.word for note in result.notes if note.kind == "unknown-tag"]
    ours = "".join(
        line for line in lines if not any(line.strip().startswith(f"<{tag}>") for tag in unknown)
    )
    theirs = target.read_text()
    assert ours == without_comments(theirs)
    assert osimlite.to_text(osimlite.read_document(target), numbers="opensim") == without_comments(
        theirs
    )


@pytest.mark.parametrize("name", OLD)
def test_opensim_upgrades_alike(name: str, tmp_path: Path) -> None:
    opensim.Logger.setLevelString("off")
    # OpenSim writes a file beside the old one, therefore use a copy.
    copy = tmp_path / f"{name}.xml"
    copy.write_bytes((ROOT / "fixtures" / "versions" / copy.name).read_bytes())
    cls = getattr(opensim, OLD[name])
    tool = cls(str(copy), False) if name in ("force_files", "replaced_forces") else cls(str(copy))
    tool.printToXML(str(tmp_path / "theirs.xml"))
    ours = osimlite.to_text(osimlite.read_document(copy), numbers="opensim", comments=False)
    assert ours == without_comments((tmp_path / "theirs.xml").read_text())
