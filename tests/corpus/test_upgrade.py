"""Compare upgraded corpus files of old versions with OpenSim's conversion: every component and property.

Where the two differ, OpenSim loses something or adds what it only computes; `comparison.excepted`
lists every such case.
"""

from __future__ import annotations

import gzip
import json

import pytest

from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import Document, read_document, read_text
from osimlite.io.document.source import Source
from osimlite.schema.model import CURRENT_VERSION, Model
from tests.conftest import CorpusModel
from tests.io.document.upgrade.comparison import differences


def old(corpus_model: CorpusModel) -> Document:
    """Return the document of a corpus file; skip the test if it has the current version."""
    text = corpus_model.path.read_bytes()
    if b"<OpenSimDocument" not in text or b'Version="40600"' in text[:500]:
        pytest.skip("not an older version")
    return read_document(Source.from_file(corpus_model.path))


def conversion(corpus_model: CorpusModel) -> Model:
    """Return OpenSim's conversion of a corpus file; skip the test if OpenSim cannot load it."""
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    return read_text(gzip.decompress(corpus_model.converted.read_bytes()))


def test_components_are_opensims(corpus_model: CorpusModel) -> None:
    document = old(corpus_model)
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))
    ours = [[component.path, type(component).__name__] for component in document.model.components()]
    assert ours[1:] == truth["components"]


def test_properties_are_opensims(corpus_model: CorpusModel) -> None:
    converted = conversion(corpus_model)
    model = old(corpus_model).model
    assert differences(model, converted) == []


def test_a_file_upgraded_is_read_again_equal(corpus_model: CorpusModel) -> None:
    document = old(corpus_model)
    text = to_text(document.model)
    again = read_document(Source(text.encode(), str(corpus_model.path)))
    assert (again.version, again.changes) == (CURRENT_VERSION, [])
    assert again.model == document.model
    assert to_text(again.model) == text


def test_references_lead_where_opensim_finds_them(corpus_model: CorpusModel) -> None:
    """No reference is broken after the upgrade.

    Files since version 40000, which need hardly any upgrade, are skipped if OpenSim cannot connect
    them.
    """
    document = old(corpus_model)
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))
    tree = document.model.tree()
    broken = [
        use for use in tree.uses() if tree.resolve(use).failure and use.spec.name != "members"
    ]
    if document.version >= 40000 and not str(truth["load"]["stage"]).startswith("ok"):
        pytest.skip("OpenSim cannot connect this file either")
    assert [(use.holder.name, use.spec.name, use.value) for use in broken] == []
