"""Check that OpenSim's print of corpus files survives reading and printing byte for byte, except for comments.

There is no exception among the files of the corpus that OpenSim can print.
"""

from __future__ import annotations

import gzip
import re

import pytest

from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_text
from tests.conftest import CorpusModel

COMMENT_LINE = re.compile(r"[ \t]*<!--.*?-->\n", re.DOTALL)


def opensims_print(corpus_model: CorpusModel) -> str:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    return gzip.decompress(corpus_model.converted.read_bytes()).decode()


def test_the_text_comes_back_byte_for_byte(corpus_model: CorpusModel) -> None:
    text = opensims_print(corpus_model)
    assert to_text(read_text(text), numbers="opensim") == COMMENT_LINE.sub("", text)


def test_the_shortest_numbers_lose_nothing(corpus_model: CorpusModel) -> None:
    model = read_text(opensims_print(corpus_model))
    short = to_text(model)
    again = read_text(short)
    assert again == model
    assert to_text(again) == short
    assert to_text(again, numbers="opensim") == to_text(model, numbers="opensim")
