"""What classes and properties mean, in words: their docstrings, read when somebody asks."""

from __future__ import annotations

import ast
import inspect
import textwrap
from functools import cache
from importlib import import_module

from osimlite.schema.base import Object
from osimlite.schema.fields import Held, Reference, Value
from osimlite.schema.specs import FieldSpec, get_field_specs


def describe_property(spec: FieldSpec) -> str:
    """What a property means: the text below its declaration; "" if there is none, or no source to read it from."""
    texts = (
        _read_descriptions(cls.__module__).get((cls.__name__, spec.name)) for cls in spec.declarers
    )
    return next(filter(None, texts), "")


def describe_value(spec: FieldSpec) -> str:
    """What may stand in a property, in a few words: ``one number in N/m, > 0``."""
    kind = spec.kind
    if isinstance(kind, Value):
        words = kind.words()
        if kind.choices:
            words = "one of " + ", ".join(map(str, kind.choices))
        words += f" in {kind.unit}" if kind.unit else ""
        return words + (f", {kind.domain}" if kind.domain else "")
    if isinstance(kind, Reference):
        many = kind.shape == "list"
        return f"names of {kind.target} components" if many else f"the name of a {kind.target}"
    assert isinstance(kind, Held) and spec.accepts is not None
    tag = spec.accepts.tag or "Object"
    return f"objects of class {tag}" if kind.form == "list" else f"one {tag}"


def describe_class(cls: type[Object]) -> str:
    """What a class is: its docstring."""
    return inspect.cleandoc(cls.__dict__.get("__doc__") or "")


@cache
def add_properties(cls: type[Object], own: str) -> str:
    """A docstring with a section on the properties of the class, as ``help()`` shows it."""
    rows = [inspect.cleandoc(own), "", "Properties, in the order of a file:", "    name: a text"]
    for spec in get_field_specs(cls).values():
        given = (
            "" if isinstance(spec.kind, Held) else f"; {_format_property(spec.default)} by default"
        )
        meaning = " ".join(describe_property(spec).split())
        text = f"{spec.name}: {describe_value(spec)}{given}" + (f". {meaning}" if meaning else "")
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
    """The texts below the declarations of a module, by class and property. Python itself drops them."""
    result: dict[tuple[str, str], str] = {}
    try:
        source = inspect.getsource(import_module(module))
    except OSError:
        return result
    for node in ast.parse(source).body:
        if not isinstance(node, ast.ClassDef):
            continue
        for field, text in zip(node.body, node.body[1:], strict=False):
            is_field = isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            if is_field and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                assert isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
                result[node.name, field.target.id] = inspect.cleandoc(str(text.value.value))
    return result
