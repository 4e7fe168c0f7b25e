"""Descriptions of classes and properties, taken from their docstrings."""

from __future__ import annotations

import ast
import inspect
import textwrap
from functools import cache
from importlib import import_module

from osimlite.base.syntax_trees import parse_module
from osimlite.base.text import add_article
from osimlite.schema.base import Object
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.specs import FieldSpec, get_field_specs


def describe_property(spec: FieldSpec) -> str:
    """Return the docstring of a property; empty without one, or if the source is not available."""
    texts = (
        _read_descriptions(cls.__module__).get((cls.__name__, spec.name)) for cls in spec.declarers
    )
    return next(filter(None, texts), "")


def describe_value(spec: FieldSpec) -> str:
    """Describe the type of a property in a few words: ``one number in N/m, > 0``.

    Returns:
        A phrase without a final dot: number of values, unit and domain, or the class of the objects.
    """
    kind = spec.kind
    if isinstance(kind, Value):
        text = kind.words()
        if kind.choices:
            text = "one of " + ", ".join(map(str, kind.choices))
        text += f" in {kind.unit}" if kind.unit else ""
        return text + (f", {kind.domain}" if kind.domain else "")
    if isinstance(kind, Reference):
        is_list = kind.shape == "list"
        return (
            f"names of {kind.target} components"
            if is_list
            else f"the name of {add_article(kind.target)}"
        )
    assert isinstance(kind, ObjectField) and spec.accepts is not None
    tag = spec.accepts.tag or "Object"
    return f"objects of class {tag}" if kind.form == "list" else f"one {tag}"


def describe_class(cls: type[Object]) -> str:
    """Return the docstring of a class."""
    return inspect.cleandoc(cls.__dict__.get("__doc__") or "")


@cache
def add_properties(cls: type[Object], docstring: str) -> str:
    """Return a docstring with a section on the properties of the class, for ``help()``.

    Args:
        cls: class that is described.
        docstring: docstring of the class.
    """
    rows = [
        inspect.cleandoc(docstring),
        "",
        "Properties, in the order of a file:",
        "    name: a text",
    ]
    for spec in get_field_specs(cls).values():
        default_text = (
            ""
            if isinstance(spec.kind, ObjectField)
            else f"; {_format_property(spec.default)} by default"
        )
        meaning = " ".join(describe_property(spec).split())
        text = f"{spec.name}: {describe_value(spec)}{default_text}" + (
            f". {meaning}" if meaning else ""
        )
        rows.append(textwrap.fill(text, 100, initial_indent="    ", subsequent_indent="        "))
    return "\n".join(rows)


def _format_property(value: object) -> str:
    if value is None or value == "" or value == ():
        return "nothing"
    if isinstance(value, tuple):
        return " ".join(map(_format_property, value))
    return (
        f"{value:g}"
        if isinstance(value, float)
        else str(value).lower()
        if isinstance(value, bool)
        else str(value)
    )


@cache
def _read_descriptions(module: str) -> dict[tuple[str, str], str]:
    """Return the docstrings of properties in a module, by class and property.

    Python discards strings below assignments, so they are parsed from the source.
    """
    result: dict[tuple[str, str], str] = {}
    try:
        source = inspect.getsource(import_module(module))
    except OSError:
        return result
    for node in parse_module(source).body:
        if not isinstance(node, ast.ClassDef):
            continue
        for field, text in zip(node.body, node.body[1:], strict=False):
            is_field = isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            if is_field and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                assert isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
                result[node.name, field.target.id] = inspect.cleandoc(str(text.value.value))
    return result
