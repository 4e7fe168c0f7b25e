"""Models as plain data: the content of YAML and JSON files.

An object is a mapping from its properties, under their Python names or their XML tags, to values.
``class`` is its class; it may be left out where a property accepts only that class. A set without
further properties may be written as the list of its members. Numbers that JSON cannot represent are
the words NaN, Inf and -Inf. Comments of a file are not part of its data.
"""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from osimlite.base.files import read_file, write_atomically
from osimlite.base.require import require
from osimlite.base.text import add_article, shorten_message, suggest_name
from osimlite.errors import DocumentError, MissingFileError, ModelError
from osimlite.io.document.lexical import UncleanText, parse_real
from osimlite.io.document.objects import get_layout
from osimlite.io.document.printer import has_content
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.fields import ObjectField, ObjectList, Reference, Value
from osimlite.schema.layout import Remark
from osimlite.schema.model import Model
from osimlite.schema.registry import find_class, list_class_tags, list_tags
from osimlite.schema.specs import FieldSpec, get_field_specs

SUFFIXES = (".json", ".yaml", ".yml")
"""File name endings of data files."""

MAX_NUMBERS = 2_000_000
"""Largest number of values in a data file, with an object counted as ten.

No real model has as many. Without a limit the aliases of a short YAML text could expand to an
endless one.
"""


def read_data(path: str | Path) -> Model:
    """Read a model from a YAML or JSON file.

    Returns:
        Model that the data describes.

    Raises:
        DocumentError: the file is not YAML or JSON; with line and column.
        MissingDependency: the file is YAML and PyYAML is not installed.
        ModelError: the data does not describe a model; with the position in the data.
        MissingFileError: the file cannot be read, or is not text in UTF-8.
    """
    data_path = Path(path)
    try:
        text = read_file(data_path).decode()
    except UnicodeDecodeError as error:
        raise MissingFileError(f"cannot read the file: {error}", file=str(path)) from None
    data = (
        _parse_json(text, str(path)) if data_path.suffix == ".json" else parse_yaml(text, str(path))
    )
    try:
        return from_data(data)
    except ModelError as error:
        error.file = str(path)
        raise


def write_data(model: Model, path: str | Path) -> None:
    """Write a model as JSON if the suffix of `path` is ``.json``, else as YAML.

    A failure leaves no partial file.

    Args:
        model: model to write.
        path: file to write.

    Raises:
        ModelError: a reference leads to a component outside the model.
        MissingDependency: the file is YAML and PyYAML is not installed.
        OsimliteError: the file cannot be written.
    """
    as_json = Path(path).suffix == ".json"
    write_atomically(path, to_json(model) if as_json else to_yaml(model))


def to_json(model: Model) -> str:
    """Return a model as JSON, with each list of numbers on one line."""
    return "".join(_format_json(to_data(model), "")) + "\n"


def to_yaml(model: Model) -> str:
    """Return a model as YAML.

    Raises:
        MissingDependency: PyYAML is not installed.
    """
    return _import_yaml().safe_dump(
        to_data(model), sort_keys=False, default_flow_style=None, allow_unicode=True, width=120
    )


def to_data(model: Model) -> dict[str, Any]:
    """Return a model as dicts, lists, strings and numbers.

    Returns:
        Data from which `from_data` makes an equal model.

    Raises:
        ModelError: a reference leads to a component outside the model.
    """
    return _Writer(model).convert_object(model, None)


def from_data(data: Mapping[str, Any]) -> Model:
    """Return the model that plain data describes.

    Raises:
        ModelError: the data does not describe a model; with the position in the data.
    """
    if not isinstance(data, Mapping):
        raise ModelError(
            f"a model is a mapping from properties to values, not {_describe_type(data)}"
        )
    # Editors use the key "$schema" to find the JSON schema.
    data = {key: value for key, value in data.items() if key != "$schema"}
    try:
        model = _Reader().convert_object(data, Model, "model")
    except RecursionError:
        raise ModelError("the data is nested too deeply to be a model") from None
    assert isinstance(model, Model)
    return model


class _Writer:
    def __init__(self, model: Model) -> None:
        self.tree = model.tree()

    def convert_object(self, item: Object, accepts: type[Object] | None) -> dict[str, Any]:
        """Return an object as a mapping: class, name, and the properties that are set, inherited or have content.

        Returns:
            Values by the name of the property, after `class` and `name`.
        """
        data: dict[str, Any] = {}
        # The class is written only where the property does not say it.
        if type(item) is not accepts:
            data["class"] = type(item).tag
        if item.name and ("name" in item.model_fields_set or not isinstance(item, Unknown)):
            data["name"] = item.name
        if isinstance(item, Unknown):
            return {**data, "class_name": item.class_name, "content": item.content}
        # Values from <defaults> are written too: data has no such block.
        inherited = item.layout.inherited if item.layout is not None else frozenset()
        for spec in get_field_specs(type(item)).values():
            value = getattr(item, spec.name)
            if (
                spec.name in item.model_fields_set
                or spec.name in inherited
                or (isinstance(spec.kind, ObjectField) and has_content(value, spec))
            ):
                data[spec.name] = self._convert_value(item, spec, value)
        if item.layout is not None and item.layout.unknown:
            data["unknown"] = item.layout.unknown
        return data

    def _convert_value(self, item: Object, spec: FieldSpec, value: Any) -> Any:
        if isinstance(spec.kind, ObjectField):
            if isinstance(value, list):
                return [self.convert_object(member, spec.accepts) for member in value]
            return None if value is None else self._convert_property_object(spec, value)
        if isinstance(spec.kind, Reference):
            return self._convert_reference(item, spec.kind, value)
        return (
            [_format_number(word) for word in value]
            if isinstance(value, tuple)
            else _format_number(value)
        )

    def _convert_property_object(self, spec: FieldSpec, value: Object) -> Any:
        """Return the object of a property in its shortest form.

        The reader adds what is left out: the name that the property gives to its object by default,
        and the word "objects" around the members of a set.

        Returns:
            A list for a set with members only, else a mapping.
        """
        data = self.convert_object(value, spec.accepts)
        default_name = (
            spec.tag if isinstance(spec.kind, ObjectField) and spec.kind.form == "single" else ""
        )
        if spec.factory is not None and not default_name:
            default = spec.factory()
            default_name = default.name if isinstance(default, Object) else ""
        if data.get("name") == default_name:
            del data["name"]
        return data["objects"] if data.keys() == {"objects"} else data

    def _convert_reference(self, item: Object, reference: Reference, value: Any) -> Any:
        if isinstance(value, Component):
            return self.tree.format_reference(self.tree.owner_of(item), reference, value)
        return (
            [self._convert_reference(item, reference, word) for word in value]
            if isinstance(value, tuple)
            else value
        )


class _Reader:
    """Converter of data to objects; `count` is the number of values converted so far."""

    def __init__(self) -> None:
        self.count = 0

    def convert_object(
        self, data: Any, accepts: type[Object], location: str, name: str = ""
    ) -> Object:
        """Return the object that `data` describes, where a property accepts the class `accepts`.

        Raises:
            ModelError: the data does not describe such an object; with the position in the data.
        """
        # The count limits what the aliases of YAML can expand to.
        self._count_values(10)
        # The short form of a set.
        if isinstance(data, list) and "objects" in get_field_specs(accepts):
            data = {"objects": data}
        if not isinstance(data, Mapping):
            raise ModelError(
                f"{location}: expected a mapping that describes {add_article(accepts.tag)}, not {_describe_type(data)}"
            )
        cls = self._find_class(data, accepts, location)
        specs = get_field_specs(cls)
        by_name = {spec.name: spec for spec in specs.values()}
        values: dict[str, Any] = {}
        for key, value in data.items():
            key_location = f"{location}.{key}"
            if key in ("class", "unknown"):
                continue
            if key == "name" or (cls is Unknown and key in ("class_name", "content")):
                if not isinstance(value, str):
                    raise ModelError(
                        f"{key_location}: expected a text, not {_describe_type(value)}; put it in quotation marks"
                    )
                values[key] = value
                continue
            spec = by_name.get(key) or specs.get(key)
            if spec is None:
                raise ModelError(
                    f"{location}: {add_article(cls.tag)} has no property '{key}'{suggest_name(str(key), by_name)}"
                )
            # A property may be given by its Python name and by its tag.
            if spec.name in values:
                raise ModelError(f"{location}: '{spec.name}' is given twice, also as '{spec.tag}'")
            values[spec.name] = self._convert_value(value, spec, key_location)
        present = set(values)
        if name and "name" not in values:
            values["name"] = name
        built = cls.build(values, present)
        remarks = data.get("unknown")
        if remarks:
            if not isinstance(remarks, list) or not all(isinstance(text, str) for text in remarks):
                raise ModelError(f"{location}.unknown: expected a list of XML texts")
            get_layout(built).before[None] = [Remark(text, True) for text in remarks]
        return built

    def _find_class(
        self, data: Mapping[str, Any], accepts: type[Object], location: str
    ) -> type[Object]:
        """Return the class that a mapping names, or the accepted class if it names none.

        Raises:
            ModelError: the mapping names a class that is unknown or not accepted, or no class where
                the accepted one is abstract.
        """
        tag = data.get("class")
        if tag is None:
            if accepts.abstract:
                raise ModelError(
                    f"{location}: say the class of this {accepts.tag}, such as 'class: {list_class_tags(accepts)[0]}'"
                )
            return accepts
        if tag == "Unknown":
            return Unknown
        cls = find_class(tag) if isinstance(tag, str) else None
        if cls is None:
            raise ModelError(
                f"{location}.class: there is no class '{tag}'{suggest_name(str(tag), list_tags())}"
            )
        if not issubclass(cls, accepts):
            raise ModelError(
                f"{location}.class: {add_article(tag)} cannot stand here, only {add_article(accepts.tag)}"
            )
        return cls

    def _convert_value(self, data: Any, spec: FieldSpec, location: str) -> Any:
        """Return the value of a property from its data: objects, numbers, texts or references.

        Raises:
            ModelError: the data has another type than the property, or a value that it does not
                accept.
        """
        kind = spec.kind
        if isinstance(kind, ObjectField):
            assert spec.accepts is not None
            if kind.form == "list":
                if not isinstance(data, list):
                    raise ModelError(
                        f"{location}: expected a list of {spec.accepts.tag}, not {_describe_type(data)}"
                    )
                members = (
                    self.convert_object(item, spec.accepts, f"{location}[{i}]")
                    for i, item in enumerate(data)
                )
                return ObjectList(members)
            if data is None and kind.form == "optional":
                return None
            # The default tells the name that an object has in this property.
            default = spec.factory() if spec.factory is not None else None
            return self.convert_object(
                data,
                spec.accepts,
                location,
                spec.tag if kind.form == "single" else getattr(default, "name", ""),
            )
        try:
            if isinstance(kind, Value) and kind.scalar == "double":
                # YAML reads "1e-9" as text, and JSON has no infinity.
                data = (
                    [self._parse_number(word) for word in data]
                    if isinstance(data, list)
                    else self._parse_number(data)
                )
            return kind.check(data, None)
        except (ValueError, OverflowError) as error:
            raise ModelError(shorten_message(f"{location}: {error}")) from None

    def _parse_number(self, data: Any) -> Any:
        """Return the number in a text, or the data unchanged if it is not such a text.

        YAML reads some numbers as text (1e-9), and JSON cannot represent infinity.

        Raises:
            ValueError: a whole number is too large for a real number.
        """
        self._count_values()
        # Text that is no number is left to `check`, whose message names the property.
        if isinstance(data, str):
            try:
                return parse_real(data.strip())
            except UncleanText:
                return data
        if isinstance(data, int) and abs(data) > sys.float_info.max:
            # Python's whole numbers have no end. All digits in a message would hide its words.
            raise ValueError("a whole number is larger than 1.8e308, the largest real number")
        return data

    def _count_values(self, weight: int = 1) -> None:
        self.count += weight
        if self.count > MAX_NUMBERS:
            # Billion-laughs attacks repeat a short list by aliases.
            raise ModelError(
                "the data has more values than any model; its aliases may repeat it endlessly"
            )


def _format_number(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if value != value else "Inf" if value > 0 else "-Inf"
    return value


def _describe_type(data: Any) -> str:
    names = {
        dict: "a mapping",
        list: "a list",
        str: "a text",
        bool: "true or false",
        type(None): "nothing",
    }
    return names.get(
        type(data),
        "a number" if isinstance(data, (int, float)) else add_article(type(data).__name__),
    )


def _format_json(data: Any, indent: str) -> Iterator[str]:
    """Yield JSON with one property per line; data without nested data is on one line.

    `json.dumps` can only put every number of a vector on a line of its own, or all on one line.
    """
    if not isinstance(data, (dict, list)) or not any(
        isinstance(part, (dict, list)) for part in _list_parts(data)
    ):
        yield json.dumps(data, ensure_ascii=False, allow_nan=False)
        return
    inner = indent + "  "
    opening, closing = "{}" if isinstance(data, dict) else "[]"
    yield opening
    for number, part in enumerate(_list_parts(data)):
        yield ("," if number else "") + "\n" + inner
        if isinstance(data, dict):
            yield json.dumps(list(data)[number], ensure_ascii=False) + ": "
        yield from _format_json(part, inner)
    yield "\n" + indent + closing


def _list_parts(data: dict[str, Any] | list[Any]) -> list[Any]:
    return list(data.values()) if isinstance(data, dict) else data


def _parse_json(text: str, file: str) -> Any:
    try:
        return json.loads(text, object_pairs_hook=lambda pairs: _join_pairs(pairs, file))
    except json.JSONDecodeError as error:
        raise DocumentError(
            f"not JSON: {error.msg}", file=file, line=error.lineno, column=error.colno
        ) from None
    except (RecursionError, ValueError):
        raise DocumentError(
            "the JSON text is nested too deeply, or has too long a number", file=file, line=1
        ) from None


def _join_pairs(pairs: list[tuple[str, Any]], file: str) -> dict[str, Any]:
    """Return the dict of a mapping in JSON.

    Raises:
        DocumentError: a key stands twice; Python would keep the last without a word.
    """
    result = dict(pairs)
    if len(result) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        repeated_key = next(key for key, count in counts.items() if count > 1)
        raise DocumentError(
            f"the key {repeated_key!r} occurs twice in one mapping; remove one of them", file=file
        )
    return result


def parse_yaml(text: str, file: str, *, with_lines: bool = False) -> Any:
    """Parse a YAML text.

    Args:
        text: YAML text.
        file: path of the file, for messages.
        with_lines: whether to return PyYAML's nodes, which know their lines, instead of data.

    Returns:
        Data of the text, or PyYAML's top node for `with_lines`; None for an empty text.

    Raises:
        DocumentError: the text is not YAML; with line and column in the file.
        MissingDependency: PyYAML is not installed.
    """
    yaml = _import_yaml()
    try:
        loader = yaml.SafeLoader(text)
        top = loader.get_single_node()
        # The nodes keep all pairs of a mapping: in settings a key may stand several times.
        if with_lines or top is None:
            return top
        _refuse_repeated_keys(yaml, top, file)
        return loader.construct_document(top)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line, column = (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)
        reason = getattr(error, "problem", None) or "it cannot be read"
        raise DocumentError(f"not YAML: {reason}", file=file, line=line, column=column) from None
    # A date after the year 9999, or a number that is too large for Python, raises an error of the
    # class's constructor.
    except (RecursionError, ValueError, ArithmeticError, LookupError, TypeError, AttributeError):
        raise DocumentError("the YAML text cannot be read as a model", file=file, line=1) from None


def _refuse_repeated_keys(yaml: Any, root: Any, file: str) -> None:
    """Raise an error if a mapping has a key twice, where PyYAML silently keeps the last one.

    Raises:
        DocumentError: a key stands twice; with its line.
    """
    # Aliases lead to one node from several places, and may lead in circles.
    met = set()
    pending = [root]
    while pending:
        node = pending.pop()
        if id(node) in met or isinstance(node, yaml.ScalarNode):
            continue
        met.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            pending.extend(node.value)
            continue
        keys = set()
        for key, value in node.value:
            pending += (key, value)
            if not isinstance(key, yaml.ScalarNode):
                continue
            if key.value in keys:
                mark = key.start_mark
                raise DocumentError(
                    f"the key {key.value!r} occurs twice in one mapping; remove one of them",
                    file=file,
                    line=mark.line + 1,
                    column=mark.column + 1,
                )
            keys.add(key.value)


def _import_yaml() -> Any:
    return require("yaml", extra="yaml", purpose="a model in YAML")
