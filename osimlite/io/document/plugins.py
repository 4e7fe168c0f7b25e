"""Classes of plug-ins, declared in files of the form of ``schemas/opensim-4.6.json``."""

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
from osimlite.schema.base import Component, Object, make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import FieldType, ObjectField, Reference, Tag, Value
from osimlite.schema.registry import MODULES, get_plugin_classes, register_plugin_classes
from osimlite.schema.resolution import RULES

Paths = str | PathLike[str] | Iterable[str | PathLike[str]]

# Keys that the parts of a file may have. Unknown keys are errors, because a misspelt one would be
# ignored silently.
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
    """Register the plug-in classes that files declare, in place of those registered before.

    Raises:
        OsimliteError: a declaration is wrong; with file and line.
        MissingFileError: a file does not exist.
    """
    names = [paths] if isinstance(paths, str | PathLike) else paths
    register_plugin_classes(classes_in(*names))


@contextmanager
def classes_in_use(paths: Paths) -> Iterator[None]:
    """Register the plug-in classes of files for the duration of a context.

    Raises:
        OsimliteError: a declaration is wrong; with file and line.
        MissingFileError: a file does not exist.
    """
    before = get_plugin_classes()
    use_classes(paths)
    try:
        yield
    finally:
        register_plugin_classes(before)


def classes_in(*paths: str | PathLike[str]) -> dict[str, type[Object]]:
    """Read the plug-in classes that files declare, to make objects of them in Python.

    Returns:
        Classes by name.

    Raises:
        OsimliteError: a declaration is wrong; with file and line.
        MissingFileError: a file does not exist.
    """
    return dict(
        _load_declarations(
            # The time of modification is a part of the key of the cache.
            tuple((name, get_file_stamp(name)) for name in [fspath(path) for path in paths])
        )
    )


@lru_cache(maxsize=16)
def _load_declarations(files: tuple[tuple[str, int | None], ...]) -> Mapping[str, type[Object]]:
    """Return the classes that declaration files define, by name.

    Raises:
        OsimliteError: a file declares a class wrongly, or has data of unexpected types.
    """
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
            # The file has data of unexpected types; the types that are often confused have messages
            # of their own.
            raise OsimliteError(f"cannot create its classes: {error}", file=path) from None
    return result


MAX_INHERITANCE_DEPTH = 50
"""Largest depth of inheritance among the classes of a file; OpenSim's own classes have eight levels."""

MAX_VALUES = 1_000_000
"""Largest bound of a list's length that a declaration may have."""


class _Declarations:
    """Declarations of one file; its classes are added to those of earlier files."""

    def __init__(self, path: str, classes: dict[str, type[Object]]) -> None:
        self.path = path
        # The classes of earlier files may be bases of this one.
        self.classes = classes
        self.text = read_file(path).decode("utf-8", "replace")
        try:
            document = json.loads(self.text)
        except (ValueError, RecursionError) as error:
            line = getattr(error, "lineno", None)
            raise OsimliteError(
                f"not JSON: {getattr(error, 'msg', error)}", file=path, line=line
            ) from None
        self.top: dict[str, Any] = self.check_mapping(document, _TOP, "the file")
        self.entries: dict[str, Any] = self.check_mapping(
            self.top.get("classes"), None, "'classes'"
        )
        self.pending: list[str] = []
        self.references: dict[tuple[str, str], Any] = {}

    def build(self) -> None:
        """Make all classes of the file, and check its references."""
        for entry in self.list_rows(self.top, "references"):
            self.check_mapping(entry, _OF_A_REFERENCE, "a reference", "references")
            rule = entry.get("resolution")
            if not isinstance(rule, str) or rule not in RULES:
                raise self.make_error(
                    f"unknown resolution '{rule}'{suggest_or_list(str(rule), RULES)}",
                    "references",
                    str(rule),
                )
            self.references[str(entry.get("cls")), str(entry.get("property"))] = entry
        for name in self.entries:
            self.find_class(name, name)
        for owner, name in self.references:
            if owner not in self.entries or not any(
                row["name"] == name for row in self.list_properties(owner)
            ):
                raise self.make_error(
                    f"no class of this file has a property '{owner}.{name}'; add it to the properties of "
                    f"'{owner}', or delete the reference",
                    "references",
                    name,
                )

    def find_class(self, name: str, *words: str) -> type[Object]:
        """Return a class by name: OpenSim's, one of an earlier file, or one of this file, made when needed."""
        # OpenSim's classes are imported one by one: a file refers to few of them.
        if name in MODULES and name not in self.entries:
            return cast("type[Object]", getattr(import_module(MODULES[name]), name))
        if name not in self.classes:
            if name not in self.entries:
                suggestion = suggest_name(name, [*MODULES, *self.entries, *self.classes])
                raise self.make_error(f"there is no class '{name}'{suggestion}", *words)
            if name in MODULES:
                raise self.make_error(f"'{name}' is a class of OpenSim itself", name)
            if len(self.pending) > MAX_INHERITANCE_DEPTH:
                raise self.make_error(
                    f"the chain of base classes is longer than {MAX_INHERITANCE_DEPTH}", name
                )
            if name in self.pending:
                raise self.make_error(
                    f"{join_words(self.pending)} form a circle: each derives from the next one, or contains it",
                    name,
                )
            # The list also shows the chain of names in the error.
            # A class that refers to itself while it is being made is found by this list.
            self.pending.append(name)
            self.classes[name] = self.make_class(name)
            self.pending.pop()
        return self.classes[name]

    def make_class(self, name: str) -> type[Object]:
        """Return a class that is made from its entry in the file."""
        entry = self.check_mapping(self.entries[name], _OF_A_CLASS, f"class '{name}'", name)
        if not name.isidentifier():
            raise self.make_error(f"'{name}' is not a legal name of a class", name)
        bases = entry.get("bases")
        if (
            not isinstance(bases, list)
            or not bases
            or not all(isinstance(base, str) for base in bases)
        ):
            raise self.make_error(
                f"'bases' of '{name}' must list the class that it derives from, the nearest first",
                name,
            )
        # Names with "<" are templates of C++, which have no class here.
        base = self.find_class(
            next((base_name for base_name in bases if "<" not in base_name), "Object"),
            name,
            "bases",
            bases[0],
        )
        namespace: dict[str, Any] = {
            "__module__": __name__,
            "__doc__": f"A class of a plug-in, as declared in {self.path}.",
            "__annotations__": {"facts": ClassVar[Facts]},
            "facts": Facts(
                outputs=" ".join(map(self.format_output, self.list_rows(entry, "outputs", name)))
            ),
        }
        inherited = base.field_specs()
        sockets = {row["tag"] for row in self.list_sockets(entry, name)}
        for row in self.list_sockets(entry, name):
            # Inherited sockets are declared already.
            if row["tag"] not in inherited:
                self.add_field(namespace, base, row["tag"], *self.parse_socket(row))
        for row in self.list_properties(name):
            spec = inherited.get(row["name"])
            if spec is None and row["name"] not in sockets:
                self.add_field(namespace, base, row["name"], *self.parse_property(name, row))
            elif (
                spec is not None and isinstance(spec.kind, Value) and row.get("default") is not None
            ):
                # A class may change the default of an inherited property.
                namespace["__annotations__"][spec.name] = Annotated[Any, spec.kind, Tag(spec.tag)]
                namespace[spec.name] = self.parse_default(
                    name, row, spec.kind, _format_default(row["default"])
                )
        metaclass: Any = type(base)
        return cast(
            "type[Object]",
            metaclass(name, (base,), namespace, tag=name, abstract=bool(entry.get("abstract"))),
        )

    def add_field(
        self,
        namespace: dict[str, Any],
        base: type[Object],
        tag: str,
        annotation: Any,
        kind: FieldType,
        default: Any,
    ) -> None:
        """Add a property to the namespace of a new class; attributes of all objects are not overridden."""
        # A Python attribute must be free and a legal name; the tag stays as it is.
        needs_new_name = hasattr(base, tag) or iskeyword(tag) or not tag.isidentifier()
        field = (
            "".join(letter if letter.isalnum() else "_" for letter in tag) + "_"
            if needs_new_name
            else tag
        )
        namespace["__annotations__"][field] = (
            Annotated[annotation, kind, Tag(tag)] if needs_new_name else Annotated[annotation, kind]
        )
        namespace[field] = default

    def parse_socket(self, row: Any) -> tuple[Any, FieldType, Any]:
        """Return annotation, type and default of a socket or an input.

        Returns:
            Annotation of the attribute, type of the property, default.
        """
        rule, target = (
            ("socket", row.get("connectee_type"))
            if "connectee_type" in row
            else ("input", row.get("type"))
        )
        is_list = bool(row.get("list"))
        kind = Reference(
            rule,
            str(target),
            "list" if is_list else "single",
            required=not row.get("optional", rule == "input"),
        )
        annotation = str | Component
        return (tuple[annotation, ...], kind, ()) if is_list else (annotation, kind, "")

    def parse_property(self, owner: str, row: Any) -> tuple[Any, FieldType, Any]:
        """Return annotation, type and default of a property.

        Returns:
            Annotation of the attribute, type of the property, default.
        """
        name = row["name"]
        type_name = str(row.get("type"))
        shape = row.get("kind", "single")
        if shape not in _KINDS:
            raise self.make_error(
                f"there is no kind '{shape}'{suggest_or_list(str(shape), _KINDS)}",
                owner,
                name,
                # The words lead to the line of the error, each searched after the previous one.
                str(shape),
            )
        legacy = bool(row.get("legacy"))
        if row.get("object") or type_name not in (*_SCALARS, *_VECTORS):
            return self.parse_object_property(owner, row, shape, legacy)
        kind: FieldType
        reference = self.references.get((owner, name))
        if type_name in _VECTORS:
            if shape == "list":
                raise self.make_error(
                    f"no class of OpenSim reads a list of {type_name}", owner, name
                )
            vector = cast("Any", type_name.replace("Vector", "vector"))
            kind = Value(
                "double", vector, row.get("unit"), legacy=legacy, optional=shape == "optional"
            )
            annotation: Any = tuple[float, ...]
        elif reference is not None:
            required = bool(reference.get("required", True))
            kind = Reference(
                reference["resolution"], str(reference.get("target")), shape, required, legacy
            )
            annotation = str | Component
        else:
            min_count = row.get("min") or 0
            max_count = row.get("max")
            for key, count in (("min", min_count), ("max", 0 if max_count is None else max_count)):
                if (
                    isinstance(count, bool)
                    or not isinstance(count, int)
                    or not 0 <= count <= MAX_VALUES
                ):
                    raise self.make_error(
                        f"'{key}' of '{name}' must be a number of values, not '{count}'",
                        owner,
                        name,
                        key,
                    )
            if not isinstance(row.get("unit") or "", str):
                raise self.make_error(f"'unit' of '{name}' must be a text", owner, name, "unit")
            kind = Value(
                cast("Any", type_name), shape, row.get("unit"), "", min_count, max_count, legacy
            )
            annotation = _SCALARS[type_name]
        if shape == "list":
            annotation = tuple[annotation, ...]
        default = row.get("default")
        if shape == "optional":
            annotation = annotation | None
            # An optional value without a default is absent.
            if default is None:
                return annotation, kind, None
        text = (
            # Without a default OpenSim's types start at zero, texts empty.
            _ZEROS.get(type_name, "")
            if default is None and shape == "single"
            else _format_default(default)
        )
        return annotation, kind, self.parse_default(owner, row, kind, text)

    def parse_default(self, owner: str, row: Any, kind: FieldType, text: str) -> Any:
        """Return the value of a default's text.

        Args:
            owner: name of the class.
            row: declaration of the property.
            kind: type of the property.
            text: text of the default.
        """
        name = row["name"]
        try:
            return make_converter(kind)(text)
        except UncleanText:
            words = kind.words() if isinstance(kind, Value) else "a text"
            raise self.make_error(
                f"the default of '{name}' must be {words}, not '{text}'", owner, name, "default"
            ) from None

    def parse_object_property(
        self, owner: str, row: Any, shape: str, legacy: bool
    ) -> tuple[Any, FieldType, Any]:
        """Return annotation, type and default of a property that holds objects.

        Returns:
            Annotation of the attribute, type of the property, default.
        """
        name = row["name"]
        type_name = str(row.get("accepts_base") or row.get("type"))
        accepts: Any = self.find_class(type_name, owner, name, type_name)
        if shape == "list":
            return list[accepts], ObjectField("list", legacy), make_empty_list()
        default = row.get("default")
        if shape == "optional" and not default:
            return accepts | None, ObjectField("optional", legacy), None
        word = default.get("class") if isinstance(default, dict) else type_name
        starts = self.find_class(str(word), owner, name, "default", str(word))
        if starts.abstract or not issubclass(starts, accepts):
            raise self.make_error(
                f"the default of '{name}' must be an object: {{\"class\": ...}} of {type_name}",
                owner,
                name,
            )
        # An unnamed property has no name to look for, a single object that of the property.
        form = "optional" if shape == "optional" else "unnamed" if row.get("unnamed") else "single"
        named = {"name": name} if form == "single" else {}
        return accepts, ObjectField(cast("Any", form), legacy), make_default(starts, **named)

    def list_properties(self, name: str) -> list[Any]:
        """Return the checked entries of the properties of a class."""
        rows = self.list_rows(self.entries[name], "properties", name)
        for row in rows:
            description = f"a property of '{name}'"
            self.check_mapping(
                row,
                _OF_A_PROPERTY,
                description,
                name,
                str(row.get("name") if isinstance(row, dict) else ""),
            )
            if not isinstance(row.get("name"), str):
                raise self.make_error(f"{description} has no name", name)
            if "type" not in row:
                raise self.make_error(f"'{row['name']}' of '{name}' has no type", name, row["name"])
        return rows

    def list_sockets(self, entry: dict[str, Any], name: str) -> list[Any]:
        rows = [*self.list_rows(entry, "sockets", name), *self.list_rows(entry, "inputs", name)]
        for row in rows:
            self.check_mapping(row, _OF_A_SOCKET, f"a socket of '{name}'", name)
            if not isinstance(row.get("tag"), str) or not (
                "connectee_type" in row or "type" in row
            ):
                raise self.make_error(
                    f"a socket of '{name}' needs 'tag' and 'connectee_type', an input 'tag' and 'type'",
                    name,
                )
        return rows

    def format_output(self, row: Any) -> str:
        """Return an output in the notation of :mod:`osimlite.schema.facts`."""
        self.check_mapping(row, _OF_AN_OUTPUT, "an output", "outputs")
        kind = row.get("type", "double")
        return f"{row.get('name')}{'[]' if row.get('list') else ''}{'' if kind == 'double' else f':{kind}'}"

    def list_rows(self, entry: dict[str, Any], key: str, *words: str) -> list[Any]:
        """Return the list under a key; for abstract classes the catalogue has the key ``own_...`` instead.

        Args:
            entry: declaration of a class.
            key: key of the list.
            words: words of the file that lead to the declaration, for the line of an error.
        """
        result = entry.get(key, entry.get(f"own_{key}", []))
        if not isinstance(result, list):
            raise self.make_error(f"'{key}' must be a list", *words, key)
        return result

    def check_mapping(
        self, value: Any, known_keys: tuple[str, ...] | None, description: str, *words: str
    ) -> dict[str, Any]:
        """Return a value that must be a JSON object with known keys.

        Args:
            value: value from the file.
            known_keys: keys that are allowed; None for any.
            description: name of the value in messages.
            words: words of the file that lead to it, for the line of an error.

        Returns:
            `value` itself.
        """
        if not isinstance(value, dict):
            raise self.make_error(f"{description} must be an object of JSON, in braces", *words)
        for key in value:
            if known_keys is not None and key not in known_keys:
                raise self.make_error(
                    f"{description} has no '{key}'{suggest_or_list(key, known_keys)}", *words, key
                )
        return value

    def make_error(self, message: str, *words: str) -> OsimliteError:
        """Return an error at the last of several words, each searched after the one before.

        Args:
            message: message of the error.
            words: words to search, as strings of JSON.
        """
        # The search starts at the classes: "meta" may contain the same words.
        offset = max(0, self.text.find('"classes"'))
        for word in words:
            offset = max(offset, self.text.find(json.dumps(word, ensure_ascii=False), offset))
        return OsimliteError(message, file=self.path, line=self.text.count("\n", 0, offset) + 1)


def _format_default(value: Any) -> str:
    """Return a default as the text of a document; the file may also contain it as JSON."""
    if isinstance(value, bool):
        return str(value).lower()
    return (
        " ".join(map(_format_default, value))
        if isinstance(value, list)
        else ""
        if value is None
        else str(value)
    )
