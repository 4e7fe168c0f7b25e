"""Tests of mutation testing: mutants of a text, and the verdicts "killed" and "survived"."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from benchmarks.mutants import Mutant, Trials, find_mutants

TEXT = '''
LEFT_ALONE = 1 + 2

def clip(x):
    """Not 3 + 4."""
    if x < 0.5 and True:
        return x * 2
    return "é" if x in (1, 3) else -x
'''


def test_operators_constants_and_branches_change() -> None:
    mutants = set(find_mutants("m.py", TEXT))
    changes = {(mutant.line, mutant.old, mutant.new) for mutant in mutants}
    assert {
        (6, "<", "<="), (6, "0.5", "1.5"), (6, "and", "or"), (6, "True", "False"), (7, "*", "/"), (7, "2", "3"),
        (8, "in", "not in"), (8, "1", "2"), (8, "3", "4"), (8, "x in (1, 3)", "(not (x in (1, 3)))"),
    } <= changes  # fmt: skip
    assert not any(line < 6 for line, _, _ in changes)
    for mutant in mutants:
        data = TEXT.encode()
        assert data[mutant.start : mutant.end].decode() == mutant.old
        compile(data[: mutant.start] + mutant.new.encode() + data[mutant.end :], "m.py", "exec")


@pytest.mark.full
def test_tests_are_called_with_the_mutant_in_place(tmp_path: Path, repo: Path) -> None:
    shutil.copy(repo / "pyproject.toml", tmp_path)
    (tmp_path / "clipping.py").write_text("def double(x):\n    return x * 2\n")
    (tmp_path / "test_it.py").write_text(
        "from clipping import double\n\ndef test_wrong():\n    assert double(3) == 7\n\n"
        "def test_it():\n    assert double(3) == 6\n"
    )
    (mutant, *_) = (
        each
        for each in find_mutants("clipping.py", (tmp_path / "clipping.py").read_text())
        if each.old == "*"
    )
    trials = Trials(tmp_path, full=False, seconds=60)
    wrong, right = "test_it.py::test_wrong", "test_it.py::test_it"
    # A test that also fails without the mutant says nothing about the mutant.
    assert trials.try_mutant(mutant, [wrong, right]) == ("killed", right)
    harmless = Mutant("clipping.py", 2, mutant.start, mutant.end, "*", " * ")
    assert trials.try_mutant(harmless, [wrong, right]) == ("survived", "")
    assert trials.try_mutant(harmless, []) == ("untested", "")
    assert "x * 2" in (tmp_path / "clipping.py").read_text()
