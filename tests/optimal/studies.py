"""Studies of Moco's own, as OpenSim printed them, with what it found."""

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
    """The study, unpacked into a folder."""
    path = folder / f"{name}.omoco"
    path.write_bytes(_text(f"{name}.omoco"))
    return path


def study(folder, name, **solver):
    """The study, with other properties of its solver."""
    result = osimlite.read_document(study_file(folder, name))
    for key, value in solver.items():
        setattr(result.solver, key, value)
    return result


def moco_said(name):
    """Objective, iterations and so on."""
    return json.loads(_text(f"{name}.json"))


def moco_found(folder, name):
    """Moco's solution file, unpacked into a folder."""
    path = folder / f"{name}.sto"
    path.write_bytes(_text(f"{name}.sto"))
    return path
