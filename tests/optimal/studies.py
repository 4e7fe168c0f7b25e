"""Moco studies as OpenSim printed them, with Moco's solutions."""

from __future__ import annotations

import gzip
import json

import pytest

import osimlite
from tests.conftest import NO_SHARED, SHARED

MOCO = SHARED / "oracle/moco"


def _text(name):
    file = MOCO / f"{name}.gz"
    if not file.is_file():
        pytest.skip(NO_SHARED)
    return gzip.decompress(file.read_bytes())


def study_file(folder, name):
    """Unpack a study into a folder, and return its path."""
    path = folder / f"{name}.omoco"
    path.write_bytes(_text(f"{name}.omoco"))
    return path


def study(folder, name, **solver):
    """Read a study, and set properties of its solver.

    Args:
        folder: folder into which the study is unpacked.
        name: name of the study.
        solver: values of properties of the solver.
    """
    result = osimlite.read_document(study_file(folder, name))
    for key, value in solver.items():
        setattr(result.solver, key, value)
    return result


def moco_said(name):
    """Return Moco's objective, terms, iterations and settings of a study."""
    return json.loads(_text(f"{name}.json"))


def moco_found(folder, name):
    """Unpack Moco's solution file into a folder, and return its path."""
    path = folder / f"{name}.sto"
    path.write_bytes(_text(f"{name}.sto"))
    return path
