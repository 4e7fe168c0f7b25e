"""Compare every component class with the catalogue of OpenSim 4.6.

The comparison covers properties, their order, types and defaults, and references.
"""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from osimlite.io.document.lexical import make_formatter
from osimlite.schema.base import Object
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.registry import MODULES, find_class, list_tags
from osimlite.schema.specs import get_field_specs
from tests.cases import of_each
from tests.schema.support import UNREGISTERED

SCHEMAS = Path(__file__).resolve().parents[2] / "schemas"
CATALOGUE = json.loads((SCHEMAS / "opensim-4.6.json").read_text())["classes"]
REFERENCES = json.loads((SCHEMAS / "references.json").read_text())["references"]

CONCRETE = sorted(
    name
    for name, entry in CATALOGUE.items()
    if entry.get("registered") and not entry["abstract"] and name != "SimbodyEngine"
)
"""Classes that a document may hold, except for SimbodyEngine, of which OpenSim supports only the name."""


NOT_IN_FILES = {"PathWrapPoint"}
"""Classes that are concrete in OpenSim's C++ but never written to a file: internal parts without a tag."""

WITHOUT_TEXT = {"point-index", "positional"}
"""Rules of references whose values are numbers or owned objects instead of names."""

NO_COMPONENT = {"property of that component"}
"""Targets of references that are not components, files or columns."""

OUTSIDE_46 = {"@file", "actuator_list"}
"""Properties outside the catalogue: an attribute of every object, and a property before version 40600."""

OUTSIDE_TARGETS = {"file": "file", "column": "column"}
"""Target of each rule that leads out of the model; the catalogue describes it in prose."""

TARGETS = {
    "SimTK::Vector_<double>": "Vector",
    "object in the enclosing Set": "Object",
    "Actuator or group": "Actuator",
    "Force or ForceSet group": "Force",
    "Marker (2)": "Marker",
    "PhysicalFrame base frame name": "PhysicalFrame",
    "segment of the model": "Body",
    ".sto/.mot file": "table file",
    ".sto or ControlSet .xml": "ControlSet or table file",
}
"""Classes for targets that the catalogue describes in prose."""

FILES = re.compile(r"\w+_files?|filepath|\w+_(directory|folder)|orientation_file_for_calibration")
"""Names of properties of tools that are paths of files and folders."""


def declared(tag: str) -> Any:
    """Return the class of an XML element; fail if the class does not exist."""
    cls = find_class(tag)
    assert cls is not None, f"no class for <{tag}>"
    return cls


def references() -> dict[tuple[str, str], dict]:
    result = {}
    for entry in REFERENCES:
        result[entry["cls"], entry["property"]] = entry
    return result


REFERENCE_OF = references()


def expected_reference(prop: dict) -> tuple[str, str, bool, bool] | None:
    """Return what the catalogue says about a reference, or None for other properties.

    Returns:
        The rule, the target, whether the reference is required, and whether it is a list.
    """
    entry = REFERENCE_OF.get((prop["declared_in"], prop["name"]))
    if entry is None or entry["resolution"] in WITHOUT_TEXT or entry["target"] in NO_COMPONENT:
        return None
    rule = entry["resolution"]
    target = entry["target"].removeprefix("Output of type ").removesuffix(" (list)")
    target = TARGETS.get(target, OUTSIDE_TARGETS.get(rule, target))
    return rule, target, entry["required"], prop["kind"] == "list"


def tag_of(prop: dict) -> str:
    """Return the tag of a property in a file.

    An unnamed property with one object has the tag of its class.
    """
    return prop["accepts_base"] if "printed_as" in prop else prop["name"]


def expected_default(prop: dict) -> str | None:
    return "" if prop["default"] is None else prop["default"]


def printed(kind: Any, value: Any) -> str:
    # OpenSim prints six digits of these properties.
    if kind.legacy and kind.shape == "list" and kind.scalar == "double":
        return " ".join(f"{number:g}" for number in value)
    text = make_formatter(kind, "opensim")(value)
    return text.strip() if kind.legacy else text


def same_default_object(made: Object, wanted: dict, where: str) -> None:
    """Compare a default object with the catalogue: class, name, and differences from the class's defaults."""
    assert type(made).tag == wanted["class"], where
    assert made.name == wanted.get("name", ""), where
    assert not made.model_fields_set, (
        f"{where}: a default object is not printed unless something is set"
    )
    overrides = wanted.get("overrides", {})
    plain = type(made)()
    for spec in get_field_specs(type(made)).values():
        value = getattr(made, spec.name)
        override = overrides.get(spec.tag)
        if isinstance(override, list):
            same_default_object(value, override[0], f"{where}/{spec.tag}")
        elif isinstance(override, dict):
            same_default_object(value, override, f"{where}/{spec.tag}")
        elif override is not None:
            assert printed(spec.kind, value) == override, f"{where}/{spec.tag}"
        elif isinstance(value, Object):
            assert value == getattr(plain, spec.name), f"{where}/{spec.tag}"
        else:
            assert repr(value) == repr(getattr(plain, spec.name)), f"{where}/{spec.tag}"
    # OpenSim has completed the ground of a model that is a default object already.
    assert overrides.keys() - {"Ground"} <= get_field_specs(type(made)).keys()


@of_each(CONCRETE)
def test_class_equals_the_catalogue(name: str) -> None:
    entry = CATALOGUE[name]
    cls = declared(entry["xml_tag"])
    specs = get_field_specs(cls)
    assert list(specs) == [tag_of(prop) for prop in entry["properties"]]
    plain = cls()
    for prop in entry["properties"]:
        spec = specs[tag_of(prop)]
        kind = spec.kind
        value = getattr(plain, spec.name)
        assert spec.legacy == bool(prop.get("legacy")), prop["name"]
        if prop.get("object"):
            assert isinstance(kind, ObjectField), prop["name"]
            form = "unnamed" if prop["unnamed"] or "printed_as" in prop else prop["kind"]
            assert kind.form == form, prop["name"]
            assert spec.accepts is not None and spec.accepts.tag == prop["accepts_base"], prop[
                "name"
            ]
            default = prop["default"] or []
            if kind.form == "list":
                assert len(value) == len(default), prop["name"]
                for item, wanted in zip(value, default, strict=True):
                    same_default_object(item, wanted, prop["name"])
            elif kind.form == "optional":
                assert (value is not None) == bool(default), prop["name"]
                if default:
                    same_default_object(value, default[0], prop["name"])
            else:
                same_default_object(value, prop["default"], prop["name"])
            continue
        wanted_reference = expected_reference(prop)
        if wanted_reference is not None:
            assert isinstance(kind, Reference), f"{prop['name']} names another component"
            assert (
                kind.rule,
                kind.target,
                kind.required,
                kind.shape == "list",
            ) == wanted_reference, prop["name"]
            assert kind.shape == prop["kind"], prop["name"]
            text = " ".join(value) if isinstance(value, tuple) else "" if value is None else value
            assert text == expected_default(prop), prop["name"]
            assert (value is None) == (prop["default"] is None), prop["name"]
            continue
        if isinstance(kind, Reference) and kind.target.endswith(("file", "folder")):
            assert FILES.fullmatch(prop["name"]), prop["name"]
            assert (" ".join(value) if kind.shape == "list" else value) == expected_default(prop), (
                prop["name"]
            )
            continue
        assert isinstance(kind, Value), f"{prop['name']} names nothing"
        assert not FILES.fullmatch(prop["name"]), f"{prop['name']} names a file"
        assert kind.unit == prop.get("unit"), prop["name"]
        if prop["type"] in ("Vec2", "Vec3", "Vec6", "Transform", "Vector"):
            assert (kind.scalar, kind.shape) == (
                "double",
                prop["type"].replace("Vector", "vector"),
            ), prop["name"]
            assert kind.optional == (prop["kind"] == "optional"), prop["name"]
        else:
            assert (kind.scalar, kind.shape) == (prop["type"], prop["kind"]), prop["name"]
        if prop["kind"] == "list":
            assert (kind.least, kind.most) == (prop["min"], prop["max"]), prop["name"]
        assert printed(kind, value) == expected_default(prop), prop["name"]
        assert (value is None) == (prop["default"] is None), prop["name"]


@of_each(CONCRETE)
def test_every_property_is_declared_where_opensim_declares_it(name: str) -> None:
    entry = CATALOGUE[name]
    cls = declared(entry["xml_tag"])
    for prop in entry["properties"]:
        if prop["declared_in"] in CATALOGUE and prop["name"] not in ("objects", "groups"):
            assert get_field_specs(cls)[tag_of(prop)].declared_in.tag == prop["declared_in"], prop[
                "name"
            ]


@of_each(CONCRETE)
def test_bases_are_opensims(name: str) -> None:
    cls = declared(CATALOGUE[name]["xml_tag"])
    ours = {base.__name__ for base in cls.__mro__}
    theirs = {base for base in CATALOGUE[name]["bases"] if "<" not in base}
    assert theirs <= ours
    assert cls().is_component == CATALOGUE[name]["is_component"]


@pytest.mark.parametrize(
    "name", [name for name in CONCRETE if "coordinate_count" in CATALOGUE[name]]
)
def test_joints_have_opensims_coordinates(name: str) -> None:
    cls = declared(name)
    motions = CATALOGUE[name].get("coordinate_motion_types")
    assert cls.motion_types == (
        None if motions is None else tuple(word.lower() for word in motions)
    )
    assert len(cls().coordinates) == (CATALOGUE[name]["coordinate_count"] or 0)


@of_each(CONCRETE)
def test_internal_parts_are_opensims(name: str) -> None:
    cls = declared(CATALOGUE[name]["xml_tag"])
    wanted = [
        (part["name"], part["class"]) for part in CATALOGUE[name].get("internal_subcomponents", [])
    ]
    assert [(part, kind.__name__) for part, kind in getattr(cls, "internal", ())] == wanted


def test_no_reference_is_forgotten() -> None:
    """Every reference in the catalogue belongs to a class whose test covers it."""
    reached = set()
    for name in CONCRETE:
        for prop in CATALOGUE[name]["properties"]:
            reached.add((prop["declared_in"], prop["name"]))
    named = {key for key in REFERENCE_OF if key[1] == "@name"}
    others = {key for key in REFERENCE_OF if key[1] in OUTSIDE_46}
    assert REFERENCE_OF.keys() - reached == named | others
    assert len(REFERENCE_OF) == 151
    for owner, _ in named:
        rule = declared(owner).name_reference
        entry = REFERENCE_OF[owner, "@name"]
        target = TARGETS.get(entry["target"], entry["target"])
        assert (rule.rule, rule.target, rule.required) == (
            entry["resolution"],
            target,
            entry["required"],
        )


def test_the_registry_knows_exactly_the_classes_of_model_documents() -> None:
    """Besides the catalogue there are only classes that are declared to be newer than OpenSim 4.6."""
    known = [tag for tag in list_tags() if not declared(tag).since]
    assert known == sorted({*(CATALOGUE[name]["xml_tag"] for name in CONCRETE), *UNREGISTERED})
    assert len(known) == 301
    assert not {tag for tag in list_tags() if declared(tag).since} & {
        entry.get("xml_tag") for entry in CATALOGUE.values()
    }


def test_bases_without_a_file_form_are_opensims_too() -> None:
    """Declared classes without a tag in files are abstract in OpenSim, or are exceptions listed here."""
    root_and_unknown = {"Object", "Unknown"}
    templates = {"Set", "ModelComponentSet", "TwoFrameLinker", "TableSource"}
    templates |= {"NumberReporter", "Vec3Reporter", "VectorReporter"}
    ours_alone = root_and_unknown | templates
    for name, module in MODULES.items():
        cls = getattr(import_module(module), name)
        if cls.abstract and name not in ours_alone | NOT_IN_FILES:
            assert CATALOGUE[name]["abstract"], name


@pytest.mark.parametrize(
    "entry",
    [e for e in REFERENCES if e["document"] != "model" and e["resolution"] != "column"],
    ids=lambda entry: f"{entry['cls']}.{entry['property']}",
)
def test_words_besides_names_and_the_fate_of_a_missing_name(entry: dict) -> None:
    cls = next(
        base
        for tag in list_tags()
        for base in declared(tag).__mro__
        if base.__name__ == entry["cls"]
    )
    kind = (
        cls.name_reference
        if entry["property"] == "@name"
        else get_field_specs(cls)[entry["property"]].kind
    )
    if isinstance(kind, Reference):
        # The catalogue does not mention tasks without a body, which have the wildcard -1.
        assert set(kind.words) - {"-1"} == {words.split()[0] for words in entry["wildcards"]}
        assert (kind.consequence == "refused") is entry["on_missing"].startswith("throws")
