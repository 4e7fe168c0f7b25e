"""Tests of the search for a cable over its obstacles while a model is built."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from osimlite import read
from osimlite.mechanics.multibody.build import build_mechanism
from osimlite.schema.path_forces import PathSpring
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.geometries.paths import scholz2015_geometry_path as cables
from osimlite.simulation.engines import linking, machine_code
from tests.conftest import ROOT

MODEL = ROOT / "fixtures" / "lint" / "OSIM534" / "pass-example.osim"


def find_contacts():
    """Return the initial contacts of all cables of a model with their obstacles."""
    model = read(MODEL)
    builder = ElementBuilder(model, build_mechanism(model), Path())
    owners = [item for item in model.walk() if isinstance(item, PathSpring)]
    return [
        element.begin
        for owner in owners
        for element in cables.read_cable(builder, owner).elements
        if element.is_obstacle
    ]


@pytest.mark.skipif(
    not machine_code.is_ready("cable_path"), reason="needs the compiled library of kernels"
)
def test_compiled_search_gives_the_bits_of_python(monkeypatch):
    calls = []
    monkeypatch.setattr(
        type(linking.PYTHON_CODE), "get_entry", lambda code, name: calls.append(name)
    )
    compiled = find_contacts()
    assert compiled
    assert calls == []
    monkeypatch.undo()
    monkeypatch.setattr(linking, "READY_CODE", linking.PYTHON_CODE)
    assert np.array_equal(np.concatenate(compiled), np.concatenate(find_contacts()))
