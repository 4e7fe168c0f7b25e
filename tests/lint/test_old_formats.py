"""Check that an old document has an error exactly where OpenSim's own upgrade fails."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.lint import validate
from tests.lint.old_documents import CASES, SOUND, TAKEN, make_document
from tests.oracle.support import claims_refusal


@pytest.mark.parametrize("case", CASES)
def test_the_verdict_on_an_old_document_is_that_of_opensim(case: str, tmp_path: Path) -> None:
    path = tmp_path / "old.osim"
    path.write_text(make_document(case), encoding="utf-8")
    errors = validate(path).errors
    if case in TAKEN:
        assert not any(map(claims_refusal, errors))
    else:
        assert errors


@pytest.mark.parametrize("text", SOUND, ids=["old", "years between", "30501"])
def test_the_documents_that_are_changed_have_no_error(text: str, tmp_path: Path) -> None:
    path = tmp_path / "old.osim"
    path.write_text(text, encoding="utf-8")
    assert not validate(path).errors
