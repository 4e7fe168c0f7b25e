"""JSON Schema of models and other documents as plain data, generated from the declarations.

``python -m osimlite.schema.json_schema > schemas/osim-4.6.schema.json`` writes the file that
editors use; a test compares it with the declarations. :mod:`osimlite.io.document.data` reads such
documents. With the tag of another class as argument, such as ``ScaleTool``, the schema is that of
its documents.
"""

from __future__ import annotations

import json
import math
import sys
from importlib import import_module
from typing import Any

from osimlite.base.text import add_article
from osimlite.schema.base import Object, Unknown
from osimlite.schema.descriptions import describe_property
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.registry import MODULES
from osimlite.schema.specs import FieldSpec, get_field_specs

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_NOT_FINITE = {"enum": ["NaN", "Inf", "-Inf"]}
_SCALARS: dict[str, dict[str, Any]] = {
    "double": {"anyOf": [{"type": "number"}, _NOT_FINITE]},
    "int": {"type": "integer"},
    "bool": {"type": "boolean"},
    "string": {"type": "string"},
}


def make_json_schema(tag: str = "Model") -> dict[str, Any]:
    """Return the schema of a document whose top object has a tag.

    It has a definition for each concrete class, and one for each abstract class that a property
    accepts.

    Returns:
        The schema as data for ``json.dumps``.
    """
    classes = _list_classes()
    definitions: dict[str, Any] = {"Unknown": _make_unknown_definition()}
    for cls in classes:
        definitions[cls.tag] = _make_definition(cls, classes)
    for cls in {
        spec.accepts
        for holder in classes
        for spec in get_field_specs(holder).values()
        if spec.accepts is not None
    }:
        if cls.abstract:
            alternatives = [
                *(
                    _make_tagged_reference(subclass)
                    for subclass in classes
                    if issubclass(subclass, cls)
                ),
                {"$ref": "#/$defs/Unknown"},
            ]
            definitions[cls.tag] = {"description": _get_summary(cls), "anyOf": alternatives}
    return {
        "$schema": DIALECT,
        "title": f"A {tag} of OpenSim 4.6 as plain data",
        "$ref": f"#/$defs/{tag}",
        "$defs": dict(sorted(definitions.items())),
    }


def _list_classes() -> list[type[Object]]:
    result: list[type[Object]] = [
        getattr(import_module(module), name) for name, module in MODULES.items()
    ]
    return sorted((cls for cls in result if not cls.abstract), key=lambda cls: cls.tag)


def _make_definition(cls: type[Object], classes: list[type[Object]]) -> dict[str, Any]:
    """Return the schema of the objects of one class."""
    properties: dict[str, Any] = {"class": {"const": cls.tag}, "name": {"type": "string"}}
    if cls.tag == "Model":
        properties["$schema"] = {"type": "string"}
    for spec in get_field_specs(cls).values():
        properties[spec.name] = _make_property(spec, classes)
    properties["unknown"] = {
        "description": "Elements that no class knows, as XML.",
        "type": "array",
        "items": {"type": "string"},
    }
    return {
        "description": _get_summary(cls),
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
    }


def _make_unknown_definition() -> dict[str, Any]:
    names = ("class", "name", "class_name", "content")
    return {
        "description": _get_summary(Unknown),
        "type": "object",
        "properties": {
            name: {"const": "Unknown"} if name == "class" else {"type": "string"} for name in names
        },
        "required": ["class", "class_name"],
        "additionalProperties": False,
    }


def _make_property(spec: FieldSpec, classes: list[type[Object]]) -> dict[str, Any]:
    text = _describe_field(spec)
    return {**({"description": text} if text else {}), **_make_content(spec, classes)}


def _make_content(spec: FieldSpec, classes: list[type[Object]]) -> dict[str, Any]:
    if isinstance(spec.kind, ObjectField):
        return _make_object_schema(spec, spec.kind, classes)
    if isinstance(spec.kind, Reference):
        return (
            {"type": "array", "items": {"type": "string"}}
            if spec.kind.shape == "list"
            else {"type": "string"}
        )
    assert isinstance(spec.kind, Value)
    result = _make_value_schema(spec.kind)
    return {**result, "default": spec.default} if _is_plain(spec.default) else result


def _make_object_schema(
    spec: FieldSpec, kind: ObjectField, classes: list[type[Object]]
) -> dict[str, Any]:
    assert spec.accepts is not None
    schema = _make_reference(spec.accepts, classes)
    if kind.form == "list":
        return {"type": "array", "items": schema}
    members = get_field_specs(spec.accepts).get("objects")
    if members is None:
        return schema
    # A set without further properties may be written as the list of its members.
    return {"anyOf": [schema, _make_content(members, classes)]}


def _make_reference(cls: type[Object], classes: list[type[Object]]) -> dict[str, Any]:
    """Return the schema of an object where a property accepts `cls`.

    Only an object of exactly that class may leave out its class.
    """
    exact = {"$ref": f"#/$defs/{cls.tag}"}
    if cls.abstract:
        return exact
    kinds = [
        _make_tagged_reference(other)
        for other in classes
        if issubclass(other, cls) and other is not cls
    ]
    return {"anyOf": [exact, *kinds]} if kinds else exact


def _make_tagged_reference(cls: type[Object]) -> dict[str, Any]:
    return {"$ref": f"#/$defs/{cls.tag}", "required": ["class"]}


def _make_value_schema(kind: Value) -> dict[str, Any]:
    scalar = {"enum": list(kind.choices)} if kind.choices else _SCALARS[kind.scalar]
    if kind.shape == "single":
        return scalar
    if kind.shape == "optional":
        return {"anyOf": [scalar, {"type": "null"}]}
    bounds = {"minItems": kind.size or kind.least, "maxItems": kind.size or kind.most}
    result = {
        "type": "array",
        "items": scalar,
        **{key: bound for key, bound in bounds.items() if bound},
    }
    return {"anyOf": [result, {"type": "null"}]} if kind.optional else result


def _describe_field(spec: FieldSpec) -> str:
    """Return the text that an editor shows: the meaning of a property and what its type leaves open."""
    words = ""
    if isinstance(spec.kind, Reference):
        words = f"names {add_article(spec.kind.target)}, {spec.kind.rule}"
    elif isinstance(spec.kind, Value):
        words = ", ".join(word for word in (spec.kind.unit, spec.kind.domain) if word)
    return " ".join(part for part in (describe_property(spec), words and f"({words})") if part)


def _get_summary(cls: type[Object]) -> str:
    return (cls.__doc__ or "").split("\n")[0]


def _is_plain(value: Any) -> bool:
    """Return whether JSON can represent a value."""
    if isinstance(value, float):
        return math.isfinite(value)
    return all(map(_is_plain, value)) if isinstance(value, tuple) else value is not None


if __name__ == "__main__":
    print(json.dumps(make_json_schema(*sys.argv[1:2]), indent=1))  # noqa: T201
