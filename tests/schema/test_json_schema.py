"""Check the JSON Schema in `schemas/`.

It must be generated from the declarations, and accept what the reader of data accepts.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from osimlite.io.document.data import to_data
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.json_schema import make_json_schema
from osimlite.schema.registry import list_tags
from tests.suite import choose

jsonschema = pytest.importorskip("jsonschema")


@pytest.fixture(scope="module")
def validator() -> Any:
    schema = make_json_schema()
    # One function makes all definitions, and checking them takes longer than all other tests here.
    # A quick run therefore checks one in six.
    definitions = [*schema["$defs"].items()][:: choose(6, 1)]
    jsonschema.Draft202012Validator.check_schema({**schema, "$defs": dict(definitions)})
    return jsonschema.Draft202012Validator(schema)


def test_the_file_is_current(repo: Path) -> None:
    written = json.loads((repo / "schemas" / "osim-4.6.schema.json").read_text())
    assert written == json.loads(json.dumps(make_json_schema())), (
        "run: python -m osimlite.schema.json_schema > schemas/..."
    )


def test_every_class_has_its_definition() -> None:
    assert set(list_tags()) <= make_json_schema()["$defs"].keys()


def test_a_document_of_another_class() -> None:
    validator = jsonschema.Draft202012Validator(make_json_schema("MocoStudy"))
    goal = {"class": "MocoFinalTimeGoal", "weight": 2.0}
    study = {"problem": {"phases": {"goals": [goal], "time_final_bounds": {"bounds": [1.0, 2.0]}}}}
    validator.validate(study)
    for wrong in ({"class": "IKMarkerTask"}, {**goal, "weight": "much"}):
        study["problem"]["phases"]["goals"] = [wrong]
        assert not validator.is_valid(study)


def test_a_model_is_valid(validator: Any) -> None:
    validator.validate(to_data(dynamic_walker()))


@pytest.mark.parametrize(
    ("damage", "word"),
    [
        ({"gravty": [0, 0, 0]}, "gravty"),
        ({"gravity": [0, 0]}, "gravity"),
        ({"body_set": [{"class": "PinJoint", "name": "x"}]}, "body_set"),
        ({"body_set": [{"mass": "heavy"}]}, "body_set"),
        ({"joint_set": [{"name": "x"}]}, "joint_set"),
        ({"class": "Body"}, "Body"),
    ],
)
def test_what_the_reader_refuses_the_schema_refuses(
    validator: Any, damage: dict[str, Any], word: str
) -> None:
    from osimlite.errors import ModelError
    from osimlite.io.document.data import from_data

    assert word in str(next(iter(validator.iter_errors({"name": "m", **damage}))))
    with pytest.raises(ModelError):
        from_data({"name": "m", **damage})
