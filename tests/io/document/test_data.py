"""Check models as YAML and JSON: nothing is lost, and errors have their position."""

from __future__ import annotations

import gzip
import json
import math
import sys
from pathlib import Path
from typing import Any

import pytest

import osimlite
from osimlite.errors import DocumentError, MissingDependency, ModelError
from osimlite.io.document.data import from_data, read_data, to_data, to_json, to_yaml, write_data
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from tests.conftest import CorpusModel

HINGE = """
name: hinge
gravity: [0, -9.81, 0]
body_set:
- name: rod
  mass: 1
  inertia: [1e-3, 1.0e-3, 1e-3, 0, 0, 0]
  attached_geometry:
  - {class: Brick, name: look, half_lengths: [0.1, 0.2, 0.3]}
JointSet:
- class: PinJoint
  name: pin
  socket_parent_frame: /ground
  socket_child_frame: /bodyset/rod
  coordinates:
  - {name: angle, range: [-Inf, Inf]}
"""


@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_the_walker_survives_both_forms(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("yaml") if suffix == ".yaml" else None
    walker = dynamic_walker()
    path = tmp_path / f"walker{suffix}"
    write_data(walker, path)
    again = read_data(path)
    assert osimlite.to_text(again) == osimlite.to_text(walker)


def test_real_models_survive(corpus_model: CorpusModel) -> None:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    model = osimlite.read_text(gzip.decompress(corpus_model.converted.read_bytes()))
    again = from_data(json.loads(to_json(model)))
    assert again == model
    if not (model.layout and model.layout.defaults):
        assert osimlite.to_text(again) == osimlite.to_text(model)


def test_written_by_hand(tmp_path: Path) -> None:
    yaml = pytest.importorskip("yaml")
    path = tmp_path / "hinge.yaml"
    path.write_text(HINGE)
    model = read_data(path)
    rod = model.find("/bodyset/rod")
    assert isinstance(rod, Body)
    assert rod.inertia[:3] == (1e-3, 1e-3, 1e-3)
    assert model.find("/jointset/pin/angle").range == (-math.inf, math.inf)
    assert from_data(yaml.safe_load(to_yaml(model))) == model


def test_a_set_of_a_file_is_the_list_of_its_members() -> None:
    data = to_data(osimlite.read_text(osimlite.to_text(dynamic_walker())))
    assert [body["name"] for body in data["body_set"]][:2] == ["Platform", "Pelvis"]


def test_values_that_json_cannot_say() -> None:
    model = Model(name="m")
    model.add(Body(name="b", mass=math.nan, mass_center=(math.inf, -math.inf, -0.0)))
    data = to_data(model)
    assert data["body_set"] == [{"name": "b", "mass": "NaN", "mass_center": ["Inf", "-Inf", -0.0]}]
    again = from_data(data)
    assert again == model
    assert str(again.body_set.objects[0].mass_center[2]) == "-0.0"


def test_components_given_as_references_become_their_texts() -> None:
    walker = dynamic_walker()
    force = next(c for c in walker.components() if isinstance(c, CoordinateLimitForce))
    coordinate = walker.tree().target(force, "coordinate", force.coordinate)
    force.coordinate = coordinate
    assert force.coordinate is coordinate
    assert osimlite.to_text(from_data(to_data(walker))) == osimlite.to_text(walker)


def test_unknown_classes_and_elements_stay() -> None:
    text = osimlite.to_text(dynamic_walker()).replace(
        '<ForceSet name="forceset">\n\t\t\t<objects>',
        '<ForceSet name="forceset">\n\t\t\t<colour>red</colour>\n\t\t\t<objects><PlugIn name="p"><a>1</a></PlugIn>',
    )
    model = osimlite.read_text(text)
    assert from_data(json.loads(to_json(model))) == model


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "a model is a mapping from properties to values, not a list"),
        ({"gravty": [0, 0, 0]}, "model: a Model has no property 'gravty'; did you mean 'gravity'"),
        ({"gravity": [0, 0]}, "model.gravity: expected 3 numbers, got 2"),
        (
            {"body_set": [{"mass": "heavy"}]},
            r"model.body_set.objects\[0\].mass: expected a number, got 'heavy'",
        ),
        (
            {"body_set": [{"name": 3}]},
            r"model.body_set.objects\[0\].name: expected a text, not a number",
        ),
        ({"body_set": [{"class": "PinJoint"}]}, "a PinJoint cannot stand here, only a Body"),
        ({"body_set": [{"class": "Bdy"}]}, "there is no class 'Bdy'; did you mean 'Body'"),
        ({"body_set": 1}, "expected a mapping that describes a BodySet, not a number"),
        ({"joint_set": [{}]}, "say the class of this Joint, such as 'class: BallJoint'"),
        ({"body_set": [], "BodySet": []}, "'body_set' is given twice, also as 'BodySet'"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(data: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        from_data(data)


def test_data_that_are_no_model_are_told_with_their_file(tmp_path: Path) -> None:
    path = tmp_path / "mistaken.json"
    path.write_text('{"gravty": [0, 0, 0]}')
    with pytest.raises(
        ModelError, match=r"mistaken\.json: model: a Model has no property 'gravty'"
    ):
        read_data(path)


def test_a_text_that_is_neither(tmp_path: Path) -> None:
    broken = tmp_path / "broken.json"
    broken.write_text('{"name": "m",\n "gravity": }')
    with pytest.raises(DocumentError, match="not JSON") as caught:
        read_data(broken)
    assert (caught.value.line, caught.value.column) == (2, 13)
    broken.write_text("[" * 100_000)
    with pytest.raises(DocumentError):
        read_data(broken)
    with pytest.raises(DocumentError, match="no such file"):
        read_data(tmp_path / "nothing.json")


def test_aliases_cannot_make_a_short_text_endless(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("yaml")
    monkeypatch.setattr("osimlite.io.document.data.MAX_NUMBERS", 20_000)
    levels = ["&a0 {class: ComponentSet}"]
    levels += [
        f"&a{i} {{class: ComponentSet, objects: [{', '.join([f'*a{i - 1}'] * 9)}]}}"
        for i in range(1, 9)
    ]
    bomb = tmp_path / "bomb.yaml"
    bomb.write_text(f"component_set: [{', '.join(levels)}]")
    with pytest.raises(ModelError, match="more values than any model"):
        read_data(bomb)


def test_yaml_is_only_needed_for_yaml(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "yaml", None)
    path = tmp_path / "m.yaml"
    path.write_text("name: m")
    with pytest.raises(MissingDependency, match="YAML"):
        read_data(path)
    assert from_data({"name": "m"}).name == "m"


@pytest.mark.parametrize(
    "number",
    ["1" * 400, "-" + "9" * 400, "0x" + "f" * 300, "1" + ":59" * 300, "0" + "7" * 400],
    ids=["ones", "nines below zero", "base 16", "base 60", "base 8"],
)
@pytest.mark.parametrize(
    "text",
    [
        "gravity: [{}, 0, 0]",
        "body_set: [{{name: b, mass: {}}}]",
        "force_set: [{{class: TorqueActuator, name: a, optimal_force: {}}}]",
    ],
    ids=["in a list", "alone", "of a force"],
)
def test_a_whole_number_without_end_is_told_with_its_place(
    tmp_path: Path, number: str, text: str
) -> None:
    pytest.importorskip("yaml")
    path = tmp_path / "it.yaml"
    path.write_text("name: m\n" + text.format(number))
    with pytest.raises(ModelError, match=r"(gravity|mass|optimal_force): .*larger than 1\.8e308"):
        read_data(path)


@pytest.mark.parametrize(
    "word",
    [
        "9" * 5000,
        "2001-99-99",
        "2001-01-01T99:99:99Z",
        "2001-01-01T01:01:01+99:99",
        "1" + ":59" * 300 + ".5",
        "!!int abc",
        "!!float ''",
        "!!bool perhaps",
        "!!timestamp x",
        "!!binary a",
        "!!pairs [a: 1, 2]",
    ],
)
def test_a_word_that_yaml_cannot_convert_is_an_error(tmp_path: Path, word: str) -> None:
    pytest.importorskip("yaml")
    path = tmp_path / "it.yaml"
    path.write_text(f"name: m\ncredits: {word}\n")
    with pytest.raises(DocumentError, match="YAML"):
        read_data(path)


def test_a_long_number_does_not_fill_the_message(tmp_path: Path) -> None:
    path = tmp_path / "it.json"
    path.write_text('{"credits": ' + "9" * 4000 + "}")
    with pytest.raises(ModelError, match="credits: expected a text, got") as caught:
        read_data(path)
    assert len(str(caught.value)) < 700


@pytest.mark.parametrize(
    "text",
    [
        "name: a\ngravity: [0, 0, 0]\nname: b\n",
        "body_set: [{name: b, mass: 1, mass: 2}]\n",
        "a: &a {name: b}\nc: *a\nd: {e: 1, f: &f [*a, {e: 1, 'e': 2}]}\n",
    ],
)
def test_a_key_that_stands_twice_in_yaml_is_refused(tmp_path: Path, text: str) -> None:
    pytest.importorskip("yaml")
    path = tmp_path / "it.yaml"
    path.write_text(text)
    with pytest.raises(DocumentError, match="occurs twice in one mapping"):
        read_data(path)


@pytest.mark.parametrize(
    "text", ['{"name": "a", "name": "b"}', '{"body_set": [{"mass": 1, "mass": 2}]}']
)
def test_a_key_that_stands_twice_in_json_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "it.json"
    path.write_text(text)
    with pytest.raises(DocumentError, match="occurs twice in one mapping"):
        read_data(path)
