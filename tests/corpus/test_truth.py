"""Compare corpus files, read in the version in which they were published, with OpenSim's values."""

from __future__ import annotations

import gzip
import json
from typing import Any

import pytest

from osimlite.io.document.reader import read
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.model import Model
from osimlite.schema.tree import is_a
from tests.conftest import CorpusModel

# The reference data have 12 significant digits. OpenSim's upgrade of old files rounds some values
# to 6 digits.
DIGITS = 1e-11
ROUNDED = 1e-5


@pytest.fixture
def file(corpus_model: CorpusModel) -> tuple[Model, dict[str, Any], float]:
    """Read a corpus file as published.

    Returns:
        The model, OpenSim's values, and the relative tolerance between them.
    """
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    if corpus_model.id == "m0356":
        pytest.skip("the file holds a ScaleSet, which is no model")
    model = read(corpus_model.path)
    truth = json.loads(gzip.decompress(corpus_model.truth.read_bytes()))
    return model, truth, ROUNDED if model.document_version < 40000 else DIGITS


def close(ours: Any, theirs: Any, digits: float) -> bool:
    return bool(ours == pytest.approx(theirs, rel=digits, abs=1e-12, nan_ok=True))


def test_coordinates(file: tuple[Model, dict[str, Any], float]) -> None:
    model, truth, digits = file
    ours = {c.path: c for c in model.components(Coordinate)}
    assert set(ours) == {c["path"] for c in truth["coordinates"]}
    for theirs in truth["coordinates"]:
        coordinate = ours[theirs["path"]]
        assert (coordinate.name, coordinate.locked, coordinate.clamped) == (
            theirs["name"], theirs["locked"], theirs["clamped"],
        )  # fmt: skip
        assert close(coordinate.default_value, theirs["default"], digits)
        assert close(coordinate.range, theirs["range"], digits)


def test_masses(file: tuple[Model, dict[str, Any], float]) -> None:
    model, truth, digits = file
    bodies = model.body_set.objects
    assert [body.path for body in bodies] == [body["path"] for body in truth["bodies"]]
    for body, theirs in zip(bodies, truth["bodies"], strict=True):
        assert close(body.mass, theirs["mass"], digits)
        assert close(body.mass_center, theirs["com"], digits)
        assert close(body.inertia, theirs["inertia"], digits)


def test_muscles(file: tuple[Model, dict[str, Any], float]) -> None:
    model, truth, digits = file
    muscles: list[Any] = [force for force in model.force_set.objects if is_a(force, "Muscle")]
    assert [(m.name, type(m).__name__) for m in muscles] == [
        (m["name"], m["cls"]) for m in truth["muscles"]
    ]
    for muscle, theirs in zip(muscles, truth["muscles"], strict=True):
        ours = (
            muscle.max_isometric_force,
            muscle.optimal_fiber_length,
            muscle.tendon_slack_length,
            muscle.pennation_angle_at_optimal,
        )
        assert close(ours, tuple(theirs[key] for key in ("fmax", "lopt", "lts", "penn")), digits)


def test_contact_geometry(file: tuple[Model, dict[str, Any], float]) -> None:
    model, truth, _ = file
    ours = [(c.name, type(c).__name__) for c in model.components(ContactGeometry)]
    assert ours == [(c["name"], c["cls"]) for c in truth["contact_geometry"]]
