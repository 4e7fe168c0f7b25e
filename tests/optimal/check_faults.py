"""Tests of Moco studies with one random fault: each causes a finding, or an error of one line that names the file.

No fault may cause a traceback or pass silently. The full suite tries 102 faults, the quick suite 9;
``OSIMLITE_FAULTS=1000 OSIMLITE_SEED=7`` asks for others.
"""

from __future__ import annotations

import os
import random
from itertools import islice
from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import merge_reports
from osimlite.moco import solve
from osimlite.tools.running import FaultySetup
from osimlite.tools.running import run as run_setup
from tests.optimal.study_faults import faults, project
from tests.suite import choose

WANTED = int(os.environ.get("OSIMLITE_FAULTS", choose("9", "102")))
SEED = int(os.environ.get("OSIMLITE_SEED", "1"))
STUDIES = "followed", "placed", "pushed"


def said_of(study):
    """Solve a study, or examine it if `solve` refuses nothing.

    Returns:
        Error message of `solve`, and findings of `run`.
    """
    refusal, found = "", []
    try:
        solve(study)
    except OsimliteError as error:
        refusal = str(error)
        assert error.file is not None, refusal
        assert "\n" not in refusal
        # An error in the study itself has a line.
        if Path(error.file) == study and "is not a number at the guess" not in refusal:
            assert error.line is not None, refusal
    else:
        try:
            found = run_setup(study, study.parent / "out").warnings
        except FaultySetup as error:
            found = merge_reports([error.report]).findings
    return refusal, found


@pytest.mark.parametrize("kind", STUDIES)
def test_a_fault_is_told(kind, tmp_path):
    whole = project(kind, tmp_path)
    study = tmp_path / "study.omoco"
    assert said_of(study) == ("", [])
    untold = []
    for number, (group, change) in enumerate(
        islice(faults(whole, random.Random(SEED)), WANTED // len(STUDIES))
    ):
        file = tmp_path / change.file
        if change.text is None:
            file.unlink()
        else:
            file.write_bytes(change.text.encode())
            # Set distinct times: files of equal length that are written within one tick of the
            # clock look unchanged.
            os.utime(file, (10 * number, 10 * number))
        try:
            told = any(said_of(study))
        except Exception as error:
            raise AssertionError(f"{group}: {change.file}: {change.what}") from error
        if change.sure and not told:
            untold.append(f"{group}: {change.file}: {change.what}")
        file.write_bytes(whole.texts[change.file].encode())
        os.utime(file, (10 * number + 5, 10 * number + 5))
    assert not untold, "\n".join(untold)
