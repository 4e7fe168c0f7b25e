"""Check that a damaged file is either read, or rejected with one sentence and a line."""

from __future__ import annotations

import time
from pathlib import Path
from random import Random

import pytest

from osimlite.errors import DocumentError
from osimlite.io.document.printer import to_text
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.base import Object
from osimlite.schema.model import Model
from tests.conftest import ROOT, corpus_models
from tests.io.document.damage import damaged

LARGEST = 120_000
"""Largest size (bytes) of files to be damaged; larger ones add time but no further cases."""


def files() -> list[Path]:
    """Return small and old fixtures, and corpus files if they are available."""
    ours = [
        path
        for name in ("versions", "walker", "documents")
        for path in (ROOT / "fixtures" / name).glob("*.*")
    ]
    real = [model.path for model in corpus_models()]
    return sorted(path for path in [*ours, *real] if 0 < path.stat().st_size < LARGEST)


def fate(data: bytes) -> str:
    """Read a damaged file and return ``read`` or ``refused``.

    The test fails if any other exception is raised.
    """
    try:
        document = read_document(Source(data, "damaged.osim"), expected_class=Object)
    except DocumentError as refused:
        assert refused.line is not None and refused.line >= 1, refused.message
        assert refused.message and "\n" not in refused.message, refused.message
        return "refused"
    top = document.top
    # A document that was read must allow access and printing, and its print must be read again
    # without a change.
    if isinstance(top, Model):
        tree = top.tree()
        for use in tree.uses():
            tree.resolve(use)
    for note in document.notes:
        document.source.locate_tag(note.number)
    text = to_text(top)
    again = read_document(Source(text.encode("utf-8", "surrogatepass")), expected_class=Object)
    assert (again.fault, again.changes) == (None, [])
    assert to_text(again.top) == text
    return "read"


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_file_is_read_or_refused(seed: int) -> None:
    random = Random(seed)
    paths = files()
    fates: dict[str, int] = {"read": 0, "refused": 0}
    for _ in range(30):
        path = random.choice(paths)
        start = time.process_time()
        fates[fate(damaged(path.read_bytes(), random))] += 1
        assert time.process_time() - start < 5, path
    assert min(fates.values()) > 0
