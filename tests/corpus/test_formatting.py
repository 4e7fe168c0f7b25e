"""Check that formatting corpus files of all versions keeps their meaning.

The comparison is made with osimlite's reader and with OpenSim.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from osimlite.errors import DocumentError
from osimlite.io.document.printer import format_document, to_text
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from tests.conftest import CorpusModel


def layout(corpus_model: CorpusModel) -> str:
    """Return a corpus file in osimlite's layout; skip the test if the file holds no model."""
    try:
        return format_document(Source.from_file(corpus_model.path))
    except DocumentError as fault:
        assert "file is empty" in fault.message or "not a <Model>" in fault.message
        pytest.skip("the file holds no model")


def words(source: Source) -> tuple[int, str]:
    """Read a document for a comparison of its content.

    White space is normalised, because classes of plug-ins keep theirs.

    Returns:
        The version and the printed content.
    """
    document = read_document(source, expected_class=Object)
    return document.version, re.sub(
        r"\s+", " ", re.sub(r"\s*([<>])\s*", r"\1", to_text(document.top))
    )


def test_the_same_is_said_and_nothing_changes_twice(corpus_model: CorpusModel) -> None:
    text = layout(corpus_model)
    # Name the source like the file, so that included files are found in its folder.
    again = Source(text.encode(), str(corpus_model.path))
    assert words(again) == words(Source.from_file(corpus_model.path))
    assert format_document(again) == text


@pytest.mark.oracle
def test_opensim_reads_the_same(corpus_model: CorpusModel, tmp_path: Path) -> None:
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("Off")
    text = layout(corpus_model)
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    place = tmp_path / corpus_model.path.name
    for beside in corpus_model.path.parent.iterdir():
        shutil.copyfile(beside, tmp_path / beside.name)
    prints = []
    for content in (corpus_model.path.read_bytes(), text.encode()):
        place.write_bytes(content)
        model = opensim.Model(str(place))
        try:
            model.printToXML(str(tmp_path / "printed"))
            prints.append((tmp_path / "printed").read_bytes())
        except RuntimeError as error:
            # OpenSim can load but not print one of the models. Then the errors must agree.
            prints.append(str(error).encode())
    assert prints[0] == prints[1]
