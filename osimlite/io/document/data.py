"""Models as plain data: the form of YAML and JSON files.

An object is a mapping from its properties, under their Python names or their XML tags, to values.
``class`` says which class it is; it may be left out where a property takes only that class. A set
that is nothing but its members may be given as the list of them. Numbers that JSON cannot say are
the words NaN, Inf and -Inf. Comments of a file are not part of its data.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from osimlite.base.files import read_file, write_atomically
from osimlite.base.require import require
from osimlite.base.text import suggest_name
from osimlite.errors import DocumentError, MissingFileError, ModelError
from osimlite.io.document.lexical import UncleanText, parse_real
from osimlite.io.document.objects import get_layout
from osimlite.io.document.printer import has_content
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.fields import Held, ObjectList, Reference, Value
from osimlite.schema.layout import Remark
from osimlite.schema.model import Model
from osimlite.schema.registry import find_class, list_class_tags, list_tags
from osimlite.schema.specs import FieldSpec, get_field_specs

SUFFIXES = (".json", ".yaml", ".yml")
"""How the names of data files end."""

MAX_NUMBERS = 2_000_000
"""More than any real model has, an object counted as ten; the aliases of a short YAML text can make it endless."""


def read_data(path: str | Path) -> Model:
    """Read a model from a YAML or JSON file.

    Raises:
        DocumentError: the file is missing, or its text is no YAML or JSON; with line and column.
        MissingDependency: the file is YAML and PyYAML is not installed.
        ModelError: the data is no model; the message says where and why.
    """
    place = Path(path)
    try:
        text = read_file(place).decode()
    except UnicodeDecodeError as error:
        raise MissingFileError(f"cannot read the file: {error}", file=str(path)) from None
    data = _parse_json(text, str(path)) if place.suffix == ".json" else parse_yaml(text, str(path))
    try:
        return from_data(data)
    except ModelError as error:
        error.file = str(path)
        raise


def write_data(model: Model, path: str | Path) -> None:
    """Write a model as JSON if the suffix of `path` is ``.json``, else as YAML; it appears whole or not at all.

    Raises:
        ModelError: a reference leads to a component outside the model.
        MissingDependency: the file is YAML and PyYAML is not installed.
        OsimliteError: the file cannot be written.
    """
    as_json = Path(path).suffix == ".json"
    write_atomically(path, to_json(model) if as_json else to_yaml(model))


def to_json(model: Model) -> str:
    """The model as JSON, a list of numbers on one line."""
    return "".join(_format_json(to_data(model), "")) + "\n"


def to_yaml(model: Model) -> str:
    """The model as YAML; MissingDependency if PyYAML is not installed."""
    return _import_yaml().safe_dump(
        to_data(model), sort_keys=False, default_flow_style=None, allow_unicode=True, width=120
    )


def to_data(model: Model) -> dict[str, Any]:
    """The model as dicts, lists, texts and numbers; `from_data` makes an equal one of it.

    Raises:
        ModelError: a reference leads to a component outside the model.
    """
    return _Writer(model).object(model, None)


def from_data(data: Mapping[str, Any]) -> Model:
    """The model that plain data describes.

    Raises:
        ModelError: it describes none; the message says where and why.
    """
    if not isinstance(data, Mapping):
        raise ModelError(f"a model is a mapping from properties to values, not {_find_class(data)}")
    data = {key: value for key, value in data.items() if key != "$schema"}
    try:
        model = _Reader().object(data, Model, "model")
    except RecursionError:
        raise ModelError("the data is nested too deeply to be a model") from None
    assert isinstance(model, Model)
    return model


class _Writer:
    def __init__(self, model: Model) -> None:
        self.tree = model.tree()

    def object(self, item: Object, accepts: type[Object] | None) -> dict[str, Any]:
        data: dict[str, Any] = {}
        if type(item) is not accepts:
            data["class"] = type(item).tag
        if item.name and ("name" in item.model_fields_set or not isinstance(item, Unknown)):
            data["name"] = item.name
        if isinstance(item, Unknown):
            return {**data, "class_name": item.class_name, "content": item.content}
        inherited = item.layout.inherited if item.layout is not None else frozenset()
        for spec in get_field_specs(type(item)).values():
            value = getattr(item, spec.name)
            if (
                spec.name in item.model_fields_set
                or spec.name in inherited
                or (isinstance(spec.kind, Held) and has_content(value, spec))
            ):
                data[spec.name] = self._value(item, spec, value)
        if item.layout is not None and item.layout.unknown:
            data["unknown"] = item.layout.unknown
        return data

    def _value(self, item: Object, spec: FieldSpec, value: Any) -> Any:
        if isinstance(spec.kind, Held):
            if isinstance(value, list):
                return [self.object(member, spec.accepts) for member in value]
            return None if value is None else self._owned(spec, value)
        if isinstance(spec.kind, Reference):
            return self._named(item, spec.kind, value)
        return (
            [_format_number(word) for word in value]
            if isinstance(value, tuple)
            else _format_number(value)
        )

    def _owned(self, spec: FieldSpec, value: Object) -> Any:
        data = self.object(value, spec.accepts)
        default_name = (
            spec.tag if isinstance(spec.kind, Held) and spec.kind.form == "single" else ""
        )
        if spec.factory is not None and not default_name:
            made = spec.factory()
            default_name = made.name if isinstance(made, Object) else ""
        if data.get("name") == default_name:
            del data["name"]
        return data["objects"] if data.keys() == {"objects"} else data

    def _named(self, item: Object, reference: Reference, value: Any) -> Any:
        if isinstance(value, Component):
            return self.tree.text_for(self.tree.owner_of(item), reference, value)
        return (
            [self._named(item, reference, word) for word in value]
            if isinstance(value, tuple)
            else value
        )


class _Reader:
    """Makes objects of data; `count` is how much of it there was."""

    def __init__(self) -> None:
        self.count = 0

    def object(self, data: Any, accepts: type[Object], where: str, name: str = "") -> Object:
        """The object that `data` describes, where a property takes an `accepts`."""
        self._counted(10)
        if isinstance(data, list) and "objects" in get_field_specs(accepts):
            data = {"objects": data}
        if not isinstance(data, Mapping):
            raise ModelError(
                f"{where}: expected a mapping that describes a {accepts.tag}, not {_find_class(data)}"
            )
        cls = self._class(data, accepts, where)
        specs = get_field_specs(cls)
        by_name = {spec.name: spec for spec in specs.values()}
        values: dict[str, Any] = {}
        for key, value in data.items():
            place = f"{where}.{key}"
            if key in ("class", "unknown"):
                continue
            if key == "name" or (cls is Unknown and key in ("class_name", "content")):
                if not isinstance(value, str):
                    raise ModelError(
                        f"{place}: expected a text, not {_find_class(value)}; put it in quotation marks"
                    )
                values[key] = value
                continue
            spec = by_name.get(key) or specs.get(key)
            if spec is None:
                raise ModelError(
                    f"{where}: a {cls.tag} has no property '{key}'{suggest_name(str(key), by_name)}"
                )
            if spec.name in values:
                raise ModelError(f"{where}: '{spec.name}' is given twice, also as '{spec.tag}'")
            values[spec.name] = self._value(value, spec, place)
        present = set(values)
        if name and "name" not in values:
            values["name"] = name
        item = cls.build(values, present)
        remarks = data.get("unknown")
        if remarks:
            if not isinstance(remarks, list) or not all(isinstance(text, str) for text in remarks):
                raise ModelError(f"{where}.unknown: expected a list of XML texts")
            get_layout(item).before[None] = [Remark(text, True) for text in remarks]
        return item

    def _class(self, data: Mapping[str, Any], accepts: type[Object], where: str) -> type[Object]:
        tag = data.get("class")
        if tag is None:
            if accepts.abstract:
                raise ModelError(
                    f"{where}: say the class of this {accepts.tag}, such as 'class: {list_class_tags(accepts)[0]}'"
                )
            return accepts
        if tag == "Unknown":
            return Unknown
        cls = find_class(tag) if isinstance(tag, str) else None
        if cls is None:
            raise ModelError(
                f"{where}.class: there is no class '{tag}'{suggest_name(str(tag), list_tags())}"
            )
        if not issubclass(cls, accepts):
            raise ModelError(f"{where}.class: a {tag} cannot stand here, only a {accepts.tag}")
        return cls

    def _value(self, data: Any, spec: FieldSpec, where: str) -> Any:
        kind = spec.kind
        if isinstance(kind, Held):
            assert spec.accepts is not None
            if kind.form == "list":
                if not isinstance(data, list):
                    raise ModelError(
                        f"{where}: expected a list of {spec.accepts.tag}, not {_find_class(data)}"
                    )
                members = (
                    self.object(item, spec.accepts, f"{where}[{i}]") for i, item in enumerate(data)
                )
                return ObjectList(members)
            if data is None and kind.form == "optional":
                return None
            made = spec.factory() if spec.factory is not None else None
            return self.object(
                data,
                spec.accepts,
                where,
                spec.tag if kind.form == "single" else getattr(made, "name", ""),
            )
        if isinstance(kind, Value) and kind.scalar == "double":
            data = (
                [self._real(word) for word in data] if isinstance(data, list) else self._real(data)
            )
        try:
            return kind.check(data, None)
        except (ValueError, OverflowError) as error:
            raise ModelError(f"{where}: {error}") from None

    def _real(self, data: Any) -> Any:
        """A number that JSON cannot say, or that YAML takes for a text (1e-9), else `data` itself."""
        self._counted()
        if isinstance(data, str):
            try:
                return parse_real(data.strip())
            except UncleanText:
                return data
        return data

    def _counted(self, weight: int = 1) -> None:
        self.count += weight
        if self.count > MAX_NUMBERS:
            raise ModelError(
                "the data has more values than any model; its aliases may repeat it endlessly"
            )


def _format_number(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if value != value else "Inf" if value > 0 else "-Inf"
    return value


def _find_class(data: Any) -> str:
    names = {
        dict: "a mapping",
        list: "a list",
        str: "a text",
        bool: "true or false",
        type(None): "nothing",
    }
    return names.get(
        type(data), "a number" if isinstance(data, (int, float)) else f"a {type(data).__name__}"
    )


def _format_json(data: Any, indent: str) -> Iterator[str]:
    """JSON with one property a line, and what holds no further objects on one line."""
    if not isinstance(data, (dict, list)) or not any(
        isinstance(part, (dict, list)) for part in _format_parts(data)
    ):
        yield json.dumps(data, ensure_ascii=False, allow_nan=False)
        return
    inner = indent + "  "
    opening, closing = "{}" if isinstance(data, dict) else "[]"
    yield opening
    for number, part in enumerate(_format_parts(data)):
        yield ("," if number else "") + "\n" + inner
        if isinstance(data, dict):
            yield json.dumps(list(data)[number], ensure_ascii=False) + ": "
        yield from _format_json(part, inner)
    yield "\n" + indent + closing


def _format_parts(data: dict[str, Any] | list[Any]) -> list[Any]:
    return list(data.values()) if isinstance(data, dict) else data


def _parse_json(text: str, file: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise DocumentError(
            f"not JSON: {error.msg}", file=file, line=error.lineno, column=error.colno
        ) from None
    except (RecursionError, ValueError):
        raise DocumentError(
            "the JSON text is nested too deeply, or has too long a number", file=file, line=1
        ) from None


def parse_yaml(text: str, file: str, *, with_lines: bool = False) -> Any:
    """The data of a YAML text, or PyYAML's nodes, which know their lines.

    Raises:
        DocumentError: it is none; with line and column in the file.
        MissingDependency: PyYAML is not installed.
    """
    yaml = _import_yaml()
    try:
        return yaml.compose(text, yaml.SafeLoader) if with_lines else yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line, column = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
        reason = getattr(error, "problem", None) or "it cannot be read"
        raise DocumentError(f"not YAML: {reason}", file=file, line=line, column=column) from None
    # A date of a year beyond 9999, or a number beyond those of Python, raises whatever its
    # constructor does.
    except (RecursionError, ValueError, ArithmeticError, LookupError, TypeError, AttributeError):
        raise DocumentError("the YAML text cannot be read as a model", file=file, line=1) from None


def _import_yaml() -> Any:
    return require("yaml", extra="yaml", purpose="a model in YAML")
