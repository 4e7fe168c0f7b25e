"""Check with OpenSim the verdicts on old documents that `tests/lint/old_documents.py` records.

`tests/lint/test_old_formats.py` compares the linter with the same verdicts without OpenSim.
"""

from __future__ import annotations

import pytest

from osimlite.lint import validate
from tests.lint.old_documents import CASES, SOUND, TAKEN, make_document

pytestmark = pytest.mark.oracle


@pytest.mark.parametrize("case", CASES)
def test_the_verdict_on_an_old_document_is_that_of_opensim(case, opensim_says, tmp_path):
    path = tmp_path / "old.osim"
    path.write_text(make_document(case), encoding="utf-8")
    assert (opensim_says(path) is None) == (case in TAKEN)


@pytest.mark.parametrize("text", SOUND, ids=["old", "years between", "30501"])
def test_the_documents_that_are_changed_are_taken(text, opensim_says, tmp_path):
    path = tmp_path / "old.osim"
    path.write_text(text, encoding="utf-8")
    assert opensim_says(path) is None
    assert not validate(path).errors
