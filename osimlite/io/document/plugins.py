"""Classes of plug-ins: files in the form of ``schemas/opensim-4.6.json`` that declare what OpenSim itself has not."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from importlib import import_module
from keyword import iskeyword
from os import PathLike, fspath
from typing import Annotated, Any, ClassVar, cast

from osimlite.base.files import get_file_stamp, read_file
from osimlite.base.text import join_words, suggest_name, suggest_or_list
from osimlite.errors import OsimliteError
from osimlite.io.document.lexical import UncleanText, make_converter
from osimlite.schema.base import Component, Object, made, none
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Held, Kind, Reference, Tag, Value
from osimlite.schema.registry import MODULES, get_plugin_classes, register_plugin_classes
from osimlite.schema.resolution import RULES

Paths = str | PathLike[str] | Iterable[str | PathLike[str]]

_TOP = ("meta", "classes", "references")
_OF_A_CLASS = (
    "bases", "properties", "own_properties", "sockets", "own_sockets", "inputs", "own_inputs", "outputs", "own_outputs",
    "abstract", "name", "xml_tag", "registered", "area", "source", "is_component", "in_model_tree", "model_slot",
    "document", "concrete_subclasses", "set_of", "template", "internal_subcomponents", "coordinate_count",
    "coordinate_motion_types",
)  # fmt: skip
_OF_A_PROPERTY = (
    "name", "type", "kind", "default", "min", "max", "object", "unnamed", "unit", "legacy", "declared_in",
    "accepts_base", "unit_basis", "role", "default_size", "printed_as",
)  # fmt: skip
_OF_A_SOCKET = ("tag", "connectee_type", "type", "list", "optional", "declared_in")
_OF_AN_OUTPUT = ("name", "type", "list")
_OF_A_REFERENCE = (
    "cls",
    "property",
    "target",
    "resolution",
    "required",
    "wildcards",
    "on_missing",
    "source",
)
_KINDS = ("single", "optional", "list")
_SCALARS = {"double": float, "int": int, "bool": bool, "string": str}
_VECTORS = ("Vec2", "Vec3", "Vec6", "Transform", "Vector")
_ZEROS = {
    "double": "0",
    "int": "0",
    "bool": "false",
    "Vec2": "0 0",
    "Vec3": "0 0 0",
    "Vec6": "0 0 0 0 0 0",
}


def use_classes(paths: Paths) -> None:
    """Let the classes that files declare count from now on, and no others besides OpenSim's own.

    Raises:
        OsimliteError: a file declares what makes no sense; with file and line.
        MissingFileError: a file is not there.
    """
    names = [paths] if isinstance(paths, str | PathLike) else paths
    register_plugin_classes(classes_in(*names))


@contextmanager
def classes_in_use(paths: Paths) -> Iterator[None]:
    """Let the classes that files declare count for a while, and no others; raises as `use_classes` does."""
    before = get_plugin_classes()
    use_classes(paths)
    try:
        yield
    finally:
        register_plugin_classes(before)


def classes_in(*paths: str | PathLike[str]) -> dict[str, type[Object]]:
    """The classes that files declare, by name: to make objects of them in Python.

    Raises:
        OsimliteError: a file declares what makes no sense; with file and line.
        MissingFileError: a file is not there.
    """
    return dict(
        _load_declarations(
            tuple((name, get_file_stamp(name)) for name in [fspath(path) for path in paths])
        )
    )


@lru_cache(maxsize=16)
def _load_declarations(files: tuple[tuple[str, int | None], ...]) -> Mapping[str, type[Object]]:
    result: dict[str, type[Object]] = {}
    for path, _ in files:
        try:
            _Declarations(path, result).build()
        except (
            TypeError,
            ValueError,
            ArithmeticError,
            LookupError,
            AttributeError,
            RecursionError,
        ) as error:
            # The file holds data of kinds that no declaration has; those that people mix up have
            # messages of their own.
            raise OsimliteError(f"its classes cannot be made: {error}", file=path) from None
    return result


MAX_LINEAGE = 50
"""Classes of a file that derive from each other; OpenSim's own have eight."""

MAX_VALUES = 1_000_000
"""Values of a list for which a declaration asks."""


class _Declarations:
    """One file: its classes are added to those found before."""

    def __init__(self, path: str, found: dict[str, type[Object]]) -> None:
        self.path = path
        self.found = found
        self.text = read_file(path).decode("utf-8", "replace")
        try:
            top = json.loads(self.text)
        except (ValueError, RecursionError) as error:
            line = getattr(error, "lineno", None)
            raise OsimliteError(
                f"this is no JSON: {getattr(error, 'msg', error)}", file=path, line=line
            ) from None
        self.top: dict[str, Any] = self.mapping(top, _TOP, "the file")
        self.entries: dict[str, Any] = self.mapping(self.top.get("classes"), None, "'classes'")
        self.pending: list[str] = []
        self.references: dict[tuple[str, str], Any] = {}

    def build(self) -> None:
        for entry in self.rows(self.top, "references"):
            self.mapping(entry, _OF_A_REFERENCE, "a reference", "references")
            rule = entry.get("resolution")
            if not isinstance(rule, str) or rule not in RULES:
                raise self.error(
                    f"there is no resolution '{rule}'{suggest_or_list(str(rule), RULES)}",
                    "references",
                    str(rule),
                )
            self.references[str(entry.get("cls")), str(entry.get("property"))] = entry
        for name in self.entries:
            self.cls(name, name)
        for owner, name in self.references:
            if owner not in self.entries or not any(
                row["name"] == name for row in self.properties(owner)
            ):
                raise self.error(
                    f"no class of this file has a property '{owner}.{name}'", "references", name
                )

    def cls(self, name: str, *words: str) -> type[Object]:
        """The class of a name: OpenSim's, one of another file, or one of this, which is made when it is needed."""
        if name in MODULES and name not in self.entries:
            return cast("type[Object]", getattr(import_module(MODULES[name]), name))
        if name not in self.found:
            if name not in self.entries:
                near = suggest_name(name, [*MODULES, *self.entries, *self.found])
                raise self.error(f"there is no class '{name}'{near}", *words)
            if name in MODULES:
                raise self.error(f"'{name}' is a class of OpenSim itself", name)
            if len(self.pending) > MAX_LINEAGE:
                raise self.error(f"more than {MAX_LINEAGE} classes derive from each other", name)
            if name in self.pending:
                raise self.error(
                    f"{join_words(self.pending)} derive from each other, or hold each other", name
                )
            self.pending.append(name)
            self.found[name] = self.made(name)
            self.pending.pop()
        return self.found[name]

    def made(self, name: str) -> type[Object]:
        entry = self.mapping(self.entries[name], _OF_A_CLASS, f"class '{name}'", name)
        if not name.isidentifier():
            raise self.error(f"'{name}' is no name of a class", name)
        bases = entry.get("bases")
        if (
            not isinstance(bases, list)
            or not bases
            or not all(isinstance(base, str) for base in bases)
        ):
            raise self.error(
                f"'bases' of '{name}' must list the class that it derives from, the nearest first",
                name,
            )
        base = self.cls(
            next((word for word in bases if "<" not in word), "Object"), name, "bases", bases[0]
        )
        inside: dict[str, Any] = {
            "__module__": __name__,
            "__doc__": f"A class of a plug-in, as declared in {self.path}.",
            "__annotations__": {"facts": ClassVar[Facts]},
            "facts": Facts(outputs=" ".join(map(self.output, self.rows(entry, "outputs", name)))),
        }
        known = base.field_specs()
        sockets = {row["tag"] for row in self.sockets(entry, name)}
        for row in self.sockets(entry, name):
            if row["tag"] not in known:
                self.add(inside, base, row["tag"], *self.socket(row))
        for row in self.properties(name):
            spec = known.get(row["name"])
            if spec is None and row["name"] not in sockets:
                self.add(inside, base, row["name"], *self.property(name, row))
            elif (
                spec is not None and isinstance(spec.kind, Value) and row.get("default") is not None
            ):
                # A class may give what it has from its base another default.
                inside["__annotations__"][spec.name] = Annotated[Any, spec.kind, Tag(spec.tag)]
                inside[spec.name] = self.default(name, row, spec.kind, _expect_text(row["default"]))
        metaclass: Any = type(base)
        return cast(
            "type[Object]",
            metaclass(name, (base,), inside, tag=name, abstract=bool(entry.get("abstract"))),
        )

    def add(
        self,
        inside: dict[str, Any],
        base: type[Object],
        tag: str,
        held: Any,
        kind: Kind,
        default: Any,
    ) -> None:
        """Put a field into the body of a class that is to be; not in the way of what all objects have."""
        taken = hasattr(base, tag) or iskeyword(tag) or not tag.isidentifier()
        field = (
            "".join(letter if letter.isalnum() else "_" for letter in tag) + "_" if taken else tag
        )
        inside["__annotations__"][field] = (
            Annotated[held, kind, Tag(tag)] if taken else Annotated[held, kind]
        )
        inside[field] = default

    def socket(self, row: Any) -> tuple[Any, Kind, Any]:
        """Type, kind and default of a socket or an input."""
        rule, target = (
            ("socket", row.get("connectee_type"))
            if "connectee_type" in row
            else ("input", row.get("type"))
        )
        many = bool(row.get("list"))
        kind = Reference(
            rule,
            str(target),
            "list" if many else "single",
            required=not row.get("optional", rule == "input"),
        )
        held = str | Component
        return (tuple[held, ...], kind, ()) if many else (held, kind, "")

    def property(self, owner: str, row: Any) -> tuple[Any, Kind, Any]:
        """Type, kind and default of a property."""
        name, typed, shape = row["name"], str(row.get("type")), row.get("kind", "single")
        if shape not in _KINDS:
            raise self.error(
                f"there is no kind '{shape}'{suggest_or_list(str(shape), _KINDS)}",
                owner,
                name,
                str(shape),
            )
        legacy = bool(row.get("legacy"))
        if row.get("object") or typed not in (*_SCALARS, *_VECTORS):
            return self.holding(owner, row, shape, legacy)
        kind: Kind
        reference = self.references.get((owner, name))
        if typed in _VECTORS:
            if shape == "list":
                raise self.error(f"a list of {typed} is read by no class of OpenSim", owner, name)
            vector = cast("Any", typed.replace("Vector", "vector"))
            kind = Value(
                "double", vector, row.get("unit"), legacy=legacy, optional=shape == "optional"
            )
            held: Any = tuple[float, ...]
        elif reference is not None:
            required = bool(reference.get("required", True))
            kind = Reference(
                reference["resolution"], str(reference.get("target")), shape, required, legacy
            )
            held = str | Component
        else:
            least, most = row.get("min") or 0, row.get("max")
            for key, count in (("min", least), ("max", 0 if most is None else most)):
                if (
                    isinstance(count, bool)
                    or not isinstance(count, int)
                    or not 0 <= count <= MAX_VALUES
                ):
                    raise self.error(
                        f"'{key}' of '{name}' must be a number of values, not '{count}'",
                        owner,
                        name,
                        key,
                    )
            if not isinstance(row.get("unit") or "", str):
                raise self.error(f"'unit' of '{name}' must be a text", owner, name, "unit")
            kind = Value(cast("Any", typed), shape, row.get("unit"), "", least, most, legacy)
            held = _SCALARS[typed]
        if shape == "list":
            held = tuple[held, ...]
        default = row.get("default")
        if shape == "optional":
            held = held | None
            if default is None:
                return held, kind, None
        text = (
            _ZEROS.get(typed, "")
            if default is None and shape == "single"
            else _expect_text(default)
        )
        return held, kind, self.default(owner, row, kind, text)

    def default(self, owner: str, row: Any, kind: Kind, text: str) -> Any:
        """The value that the text of a default stands for."""
        name = row["name"]
        try:
            return make_converter(kind)(text)
        except UncleanText:
            words = kind.words() if isinstance(kind, Value) else "a text"
            raise self.error(
                f"the default of '{name}' must be {words}, not '{text}'", owner, name, "default"
            ) from None

    def holding(self, owner: str, row: Any, shape: str, legacy: bool) -> tuple[Any, Kind, Any]:
        """Type, kind and default of a property that holds objects."""
        name = row["name"]
        typed = str(row.get("accepts_base") or row.get("type"))
        accepts: Any = self.cls(typed, owner, name, typed)
        if shape == "list":
            return list[accepts], Held("list", legacy), none()
        default = row.get("default")
        if shape == "optional" and not default:
            return accepts | None, Held("optional", legacy), None
        word = default.get("class") if isinstance(default, dict) else typed
        starts = self.cls(str(word), owner, name, "default", str(word))
        if starts.abstract or not issubclass(starts, accepts):
            raise self.error(
                f"the default of '{name}' must be an object: {{\"class\": ...}} of {typed}",
                owner,
                name,
            )
        form = "optional" if shape == "optional" else "unnamed" if row.get("unnamed") else "single"
        named = {"name": name} if form == "single" else {}
        return accepts, Held(cast("Any", form), legacy), made(starts, **named)

    def properties(self, name: str) -> list[Any]:
        rows = self.rows(self.entries[name], "properties", name)
        for row in rows:
            where = f"a property of '{name}'"
            self.mapping(
                row,
                _OF_A_PROPERTY,
                where,
                name,
                str(row.get("name") if isinstance(row, dict) else ""),
            )
            if not isinstance(row.get("name"), str):
                raise self.error(f"{where} has no name", name)
            if "type" not in row:
                raise self.error(f"'{row['name']}' of '{name}' has no type", name, row["name"])
        return rows

    def sockets(self, entry: dict[str, Any], name: str) -> list[Any]:
        rows = [*self.rows(entry, "sockets", name), *self.rows(entry, "inputs", name)]
        for row in rows:
            self.mapping(row, _OF_A_SOCKET, f"a socket of '{name}'", name)
            if not isinstance(row.get("tag"), str) or not (
                "connectee_type" in row or "type" in row
            ):
                raise self.error(
                    f"a socket of '{name}' needs 'tag' and 'connectee_type', an input 'tag' and 'type'",
                    name,
                )
        return rows

    def output(self, row: Any) -> str:
        """An output as a word of :mod:`osimlite.schema.facts`."""
        self.mapping(row, _OF_AN_OUTPUT, "an output", "outputs")
        kind = row.get("type", "double")
        return f"{row.get('name')}{'[]' if row.get('list') else ''}{'' if kind == 'double' else f':{kind}'}"

    def rows(self, entry: dict[str, Any], key: str, *words: str) -> list[Any]:
        """What a key lists; of abstract classes the catalogue lists their own."""
        result = entry.get(key, entry.get(f"own_{key}", []))
        if not isinstance(result, list):
            raise self.error(f"'{key}' must be a list", *words, key)
        return result

    def mapping(
        self, value: Any, known: tuple[str, ...] | None, what: str, *words: str
    ) -> dict[str, Any]:
        """A value that must be an object of JSON with keys that are known."""
        if not isinstance(value, dict):
            raise self.error(f"{what} must be an object of JSON, in braces", *words)
        for key in value:
            if known is not None and key not in known:
                raise self.error(f"{what} has no '{key}'{suggest_or_list(key, known)}", *words, key)
        return value

    def error(self, message: str, *words: str) -> OsimliteError:
        """The error at the last of some words, each of which is looked for behind the one before."""
        place = max(0, self.text.find('"classes"'))
        for word in words:
            place = max(place, self.text.find(json.dumps(word, ensure_ascii=False), place))
        return OsimliteError(message, file=self.path, line=self.text.count("\n", 0, place) + 1)


def _expect_text(value: Any) -> str:
    """A default as a document has it; in the file it may be written as JSON has it, too."""
    if isinstance(value, bool):
        return str(value).lower()
    return (
        " ".join(map(_expect_text, value))
        if isinstance(value, list)
        else ""
        if value is None
        else str(value)
    )
