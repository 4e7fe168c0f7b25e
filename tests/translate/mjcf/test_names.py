"""Tests of models with hostile names: MuJoCo accepts every export, and all names are unique."""

from __future__ import annotations

import json

import mujoco
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

import osimlite
from osimlite import (
    CoordinateActuator,
)
from osimlite.errors import UnsupportedError
from tests.suite import choose
from tests.translate.mjcf.support import HOSTILE, hostile

NAMES = st.one_of(
    st.sampled_from(HOSTILE),
    st.text(st.sampled_from("aA_. /\t\n12"), max_size=4),
    st.text(max_size=6),
)


def named(text: str) -> list[tuple[str, str]]:
    """Return tag and name of every named element in the world of an MJCF, as an XML parser reads them."""
    world = etree.fromstring(text.encode()).find("worldbody")
    assert world is not None
    return [
        (str(element.tag), str(element.attrib["name"]))
        for element in world.iter()
        if "name" in element.attrib
    ]


@settings(max_examples=choose(6, 15), suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(NAMES, min_size=50, max_size=50))
def test_mujoco_takes_models_with_any_names(names: list[str]) -> None:
    try:
        mjcf = osimlite.to_mjcf(hostile(names))
    except osimlite.OsimliteError as refusal:
        # A PathWrap refers to its surface by a name without slashes, and without spaces at its
        # ends.
        assert "wrap_object" in str(refusal)
        return
    compiled = mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    of_kind: dict[str, list[str]] = {}
    for tag, name in named(mjcf.text):
        of_kind.setdefault(tag, []).append(name)
    for kind in ("body", "joint", "geom", "site"):
        assert len(set(of_kind[kind])) == len(of_kind[kind])
    assert {compiled.body(k).name for k in range(1, compiled.nbody)} == set(of_kind["body"])
    assert {compiled.joint(k).name for k in range(compiled.njnt)} == set(of_kind["joint"])


def test_what_has_another_name_is_in_the_account() -> None:
    names = [f"n{k}" for k in range(50)]
    names[1], names[2] = "world", "a\x00b"
    mjcf = osimlite.to_mjcf(hostile(names))
    renamed = json.loads(mjcf.fidelity.to_json())["renamed"]
    assert renamed["/bodyset/world"] == {"body": "world_1"}
    assert renamed["/bodyset/a\x00b"] == {"body": "a_b"}
    mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)


def test_what_keeps_its_name_is_not() -> None:
    mjcf = osimlite.to_mjcf(hostile(f"n{k}" for k in range(50)))
    assert not {
        path for path in mjcf.fidelity.renamed if path.startswith(("/bodyset", "/jointset"))
    }


def test_a_number_that_is_not_finite_is_refused_with_its_place() -> None:
    model = hostile(f"n{k}" for k in range(50))
    next(iter(model.components(CoordinateActuator))).optimal_force = float("inf")
    with pytest.raises(UnsupportedError, match=r"not finite: gear of the general 'n\d+' is Inf"):
        osimlite.to_mjcf(model)
