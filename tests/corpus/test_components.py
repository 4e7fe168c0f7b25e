"""Compare the component trees of corpus models with OpenSim's: every path and class, in the same order."""

from __future__ import annotations

import gzip
import json

import pytest

from osimlite.io.document.reader import read_text
from tests.conftest import CorpusModel


def test_paths_and_classes_are_opensims(corpus_model: CorpusModel) -> None:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    model = read_text(gzip.decompress(corpus_model.converted.read_bytes()))
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))
    ours = [[component.path, type(component).__name__] for component in model.components()]
    assert ours[0] == ["/", "Model"]
    assert ours[1:] == truth["components"]
