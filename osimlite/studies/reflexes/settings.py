"""Reader of scenarios as trees of keys and values: SCONE files, YAML and Python data.

SCONE files may include other files and define constants (`$name = 3`). In YAML and in Python data,
a key that occurs several times in SCONE has a list of mappings; the key `include` of YAML names
another file.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import read_file
from osimlite.base.patterns import compile_later
from osimlite.base.records import dataclass, field
from osimlite.base.text import join_words, suggest_name
from osimlite.base.writing import find_shared_folders
from osimlite.errors import DocumentError, MissingFileError
from osimlite.io.document.data import SUFFIXES, parse_yaml
from osimlite.mechanics.multibody.spatial import Array

_TOKEN = compile_later(r'\s+|#[^\n]*|(?P<token>"[^"]*"|<<|>>|[{}=\[\]]|[^\s{}=\[\]#"]+)')
"""Tokens of SCONE files; white space and comments match too, but have no group `token`."""
FLAGS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}
"""Spellings of true and false that scenarios may use."""
MAX_INCLUDE_DEPTH = 20
"""Longest chain of files that include one another."""
MAX_INCLUDED_FILES = 200
"""Most files that one scenario reads.

The depth alone does not bound them: where each file includes the next one twice, their number
doubles with each level.
"""
MAX_PARTS = 200_000
"""Most parts of all files together; a file that is included twice counts twice."""
MAX_NESTING = 100
"""Most levels of braces; SCONE's own scenarios have about ten."""
INCLUDED_ENDINGS = (".scone", ".zml", *SUFFIXES)
"""Endings of files that a scenario may include; errors about any other file would show its first
words.
"""

IGNORED_KEYS = "name", "signature", "signature_prefix", "signature_postfix"
"""Keys that any part may have and that change no result: names, and SCONE's folder for the output."""


@dataclass
class SettingNode:
    """Value with its parts, and its position in a file.

    Attributes:
        value: text of the value as it is written; "" for none.
        parts: keys and nodes below this one, in the order of the file.
        file: path of the file, or "" for Python data.
        line: line in the file, from 1; 0 for Python data.
        read_keys: keys that the program has read, or refuses deliberately.
    """

    value: str = ""
    parts: list[tuple[str, SettingNode]] = field(default_factory=list)
    file: str = ""
    line: int = 0
    read_keys: set[str] = field(default_factory=set)

    def get(self, key: str) -> SettingNode | None:
        """Return the only part with a key, or None; the key counts as read.

        Raises:
            DocumentError: several parts have this key.
        """
        self.read_keys.add(key)
        matches = [node for name, node in self.parts if name == key]
        if len(matches) > 1:
            # Which of the two the author meant cannot be known.
            raise matches[1].error(f"'{key}' is set twice; remove one of the two")
        return matches[0] if matches else None

    def text(self, key: str, default: str | None = None) -> str:
        """Return the text of a part.

        Args:
            key: key of the part.
            default: text if there is no such part; None if the part is required.

        Raises:
            DocumentError: the part is missing and has no default, or occurs twice.
        """
        part = self.get(key)
        if part is not None:
            return part.value
        if default is None:
            raise self.error(f"'{key}' is missing")
        return default

    def number(self, key: str, default: float | None = None) -> float:
        """Return the number of a part; infinity is allowed.

        Args:
            key: key of the part.
            default: number if there is no such part; None if the part is required.

        Raises:
            DocumentError: the part is missing and has no default, or is not a number.
        """
        part = self.get(key)
        if part is None and default is not None:
            return default
        text = self.text(key)
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        # "nan" parses as a number, but no setting may be undefined.
        if math.isnan(number):
            raise (part or self).error(f"'{key}' must be a number, not '{text}'")
        return number

    def count(self, key: str, default: int, minimum: int, maximum: int) -> int:
        """Return the whole number of a part.

        Args:
            key: key of the part.
            default: number if there is no such part.
            minimum: smallest number that is allowed.
            maximum: largest number that is allowed.

        Raises:
            DocumentError: the part is not a whole number, or is out of bounds.
        """
        number = self.number(key, default)
        if not minimum <= number <= maximum or number != int(number):
            raise (self.get(key) or self).error(
                f"'{key}' must be a whole number from {minimum} to {maximum}, not '{self.text(key)}'"
            )
        return int(number)

    def flag(self, key: str, default: bool) -> bool:
        """Return whether a part is true; see `FLAGS` for the spellings.

        Args:
            key: key of the part.
            default: value if there is no such part.

        Raises:
            DocumentError: the part is neither true nor false.
        """
        text = self.text(key, "1" if default else "0")
        # A misspelt flag must not count as false.
        if text.lower() not in FLAGS:
            raise (self.get(key) or self).error(f"'{key}' must be 0 or 1, not '{text}'")
        return FLAGS[text.lower()]

    def vector(self, key: str, default: str | None = None) -> Array:
        """Return the three numbers of a part (3,).

        Args:
            key: key of the part.
            default: text with three numbers if there is no such part; None if the part is required.

        Raises:
            DocumentError: the part does not consist of three finite numbers.
        """
        text = self.text(key, default)
        try:
            x, y, z = map(parse_finite, text.split())
        except ValueError:
            raise (self.get(key) or self).error(
                f"'{key}' must be three numbers, as [ 0 0 1 ], not '{text}'"
            ) from None
        return np.array([x, y, z])

    def select_all(self, *names: str) -> Iterator[tuple[str, SettingNode]]:
        """Return an iterator over the parts with any of some keys, as (key, node).

        They have the order of the file.
        """
        self.read_keys.update(names)
        return ((name, node) for name, node in self.parts if name in names)

    def select_one(self, *names: str) -> tuple[str, SettingNode] | None:
        """Return the only part with any of some keys.

        Returns:
            Key and node, or None if there is no such part.

        Raises:
            DocumentError: there are several such parts.
        """
        matches = [*self.select_all(*names)]
        if len(matches) > 1:
            raise matches[1][1].error(
                f"'{matches[1][0]}' follows '{matches[0][0]}', but only one is allowed here; put both into a composite one"
            )
        return matches[0] if matches else None

    def require_one(self, noun: str, names: Iterable[str]) -> tuple[str, SettingNode]:
        """Return the only part with any of some keys.

        Args:
            noun: noun for the part in messages, such as "controller".
            names: supported keys.

        Returns:
            Key and node.

        Raises:
            DocumentError: there is no such part, or there are several. A part with a similar key, or
                whose key ends with the noun, is named.
        """
        supported = list(names)
        selection = self.select_one(*supported)
        if selection is not None:
            return selection
        choices = f"osimlite supports {join_words(supported)}"
        for key, node in self.parts:
            # Names of SCONE's classes are alike: MirrorController is not a misspelt ReflexController.
            if matches := get_close_matches(key, supported, n=1, cutoff=0.9):
                raise node.error(f"unknown {noun} '{key}'; did you mean '{matches[0]}'?")
        for key, node in self.parts:
            if key.endswith(noun.capitalize()):
                raise node.error(f"osimlite does not support {key}; {choices}")
        raise self.error(f"a {noun} is required; {choices}")

    def error(self, message: str) -> DocumentError:
        """Return an error that points at this node."""
        return DocumentError(message, file=self.file, line=self.line or None)

    def refuse_parts(self, owner: str, keys: Iterable[str]) -> None:
        """Refuse settings of SCONE that osimlite does not support.

        Args:
            owner: description of the object that the settings belong to, for the message.
            keys: keys of the settings.

        Raises:
            DocumentError: a part has one of these keys.
        """
        for key in keys:
            if self.get(key) is not None:
                raise self.error(f"osimlite does not support '{key}' of {owner}; leave it out")

    def refuse_flags(self, owner: str, keys: Iterable[str]) -> None:
        """Refuse options of SCONE that osimlite does not support; they may be false.

        Args:
            owner: description of the object that the options belong to, for the message.
            keys: keys of the options.

        Raises:
            DocumentError: one of the options is true.
        """
        self.refuse_parts(owner, (key for key in keys if self.flag(key, False)))

    def refuse_unread_parts(self, node_description: str, more_keys: tuple[str, ...] = ()) -> None:
        """Refuse parts whose keys the program has not read, so that no setting is ignored silently.

        Args:
            node_description: description of this node for the message, for example "a NoiseController".
            more_keys: further keys to compare with for a suggestion.

        Raises:
            DocumentError: there is such a part; the message suggests the nearest known key.
        """
        for name, node in self.parts:
            if name not in self.read_keys and name not in IGNORED_KEYS:
                suggestion = suggest_name(name, {*self.read_keys, *more_keys})
                raise node.error(
                    f"osimlite does not support '{name}' of {node_description}{suggestion}"
                )


def parse_finite(text: str) -> float:
    """Return the finite number that a text contains.

    Raises:
        ValueError: the text is not a number, or the number is infinite or NaN.
    """
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is not finite")
    return number


@dataclass
class _Budget:
    """Files and parts that reading one scenario may still use, over all files that it includes."""

    files: int = MAX_INCLUDED_FILES
    parts: int = MAX_PARTS

    def take_file(self, path: Path) -> None:
        """Count a file of a scenario.

        Raises:
            DocumentError: the scenario includes too many files.
        """
        self.files -= 1
        if self.files < 0:
            raise DocumentError(
                f"the scenario includes more than {MAX_INCLUDED_FILES} files, some of them repeatedly",
                file=str(path),
            )

    def take_part(self, node: SettingNode) -> None:
        """Count a part of a scenario.

        Raises:
            DocumentError: the scenario has too many parts.
        """
        self.parts -= 1
        if self.parts < 0:
            raise node.error(
                f"the scenario and its included files have more than {MAX_PARTS} parts"
            )


def read_settings(path: str | Path) -> SettingNode:
    """Return the settings in a scenario file and in the files that it includes.

    Included files are searched in the folder of the file that includes them, in that of the
    scenario, and in up to three folders above each.

    Raises:
        MissingFileError: a file does not exist.
        MissingDependency: a file is YAML and PyYAML is not installed.
        DocumentError: a file is malformed or too large; the error has its line.
    """
    constants: dict[str, str] = {}
    return _read_source(Path(path), Path(path).parent, constants, 0, _Budget())


def make_node(data: Mapping[str, Any]) -> SettingNode:
    """Return the tree of a mapping of Python data, which has the same keys as a file."""
    return SettingNode(
        parts=[part for key, value in data.items() for part in _list_parts(key, value)]
    )


def _list_parts(key: str, value: Any) -> Iterator[tuple[str, SettingNode]]:
    """Yield the parts that a value of YAML means: one, or one for each mapping of a list."""
    if isinstance(value, Mapping):
        yield key, make_node(value)
    elif isinstance(value, list | tuple) and any(isinstance(element, Mapping) for element in value):
        for element in value:
            yield from _list_parts(key, element)
    else:
        yield (
            key,
            SettingNode(
                " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
            ),
        )


def _read_source(
    path: Path, base: Path, constants: dict[str, str], depth: int, budget: _Budget
) -> SettingNode:
    """Return the settings in a file of any supported format, and in all files that it includes.

    Raises:
        DocumentError: the file is not UTF-8 or is malformed, includes itself through other files,
            or includes too many files.
    """
    budget.take_file(path)
    try:
        text = read_file(path).decode()
    except UnicodeDecodeError as error:
        message = (
            f"the file is not UTF-8: byte {error.start + 1} is {error.object[error.start]:#04x}"
        )
        raise DocumentError(message, file=str(path)) from None
    if depth > MAX_INCLUDE_DEPTH:
        raise DocumentError(
            "this file is part of an endless chain of includes: the files include each other",
            file=str(path),
        )
    if path.suffix in SUFFIXES:
        root_node = SettingNode(file=str(path), line=1)
        match = parse_yaml(text, str(path), with_lines=True)
        if match is not None:
            _fill_from_yaml(root_node, match, path, base, depth, 0, budget)
        return root_node
    tokens = []
    line = 1
    offset = 0
    while offset < len(text):
        match = _TOKEN.match(text, offset)
        # Only an opening quotation mark without its end matches no token.
        if match is None:
            raise DocumentError(
                f"a quotation mark is not closed: {text[offset : offset + 20]!r}",
                file=str(path),
                line=line,
            )
        if match["token"] is not None:
            tokens.append((match["token"], line))
        line += match.group().count("\n")
        offset = match.end()
    reader = _TokenReader(tokens, path, base, constants, depth, budget)
    root_node = SettingNode(file=str(path), line=1)
    reader.fill(root_node, 0)
    if reader.index < len(tokens):
        raise root_node.error(f"line {tokens[reader.index][1]}: a '}}' without its '{{'")
    return root_node


def _fill_from_yaml(
    node: SettingNode, mapping: Any, path: Path, base: Path, depth: int, level: int, budget: _Budget
) -> None:
    """Add the parts of a YAML mapping to a node.

    Args:
        node: node to fill.
        mapping: YAML node with marks of lines.
        path: file of the mapping.
        base: folder of the scenario.
        depth: number of includes that led to this file.
        level: nesting of mappings.
        budget: remaining files and parts.

    Raises:
        DocumentError: the YAML is no mapping, nests too deeply or has too many parts; a key is not
            a word; or an included file cannot be read.
    """
    if mapping.id != "mapping":
        raise node.error("expected keys with values")
    # An anchor that contains an alias of itself has no end.
    if level > MAX_NESTING:
        raise node.error(f"the parts nest more than {MAX_NESTING} levels deep")
    for key, value in mapping.value:
        if key.id != "scalar":
            raise node.error("a key must be a word")
        if key.value == "include":
            if value.id != "scalar":
                raise DocumentError(
                    "'include' must be the name of one file",
                    file=node.file,
                    line=value.start_mark.line + 1,
                )
            included = _resolve_include(value.value, path, base)
            node.parts += _read_source(included, base, {}, depth + 1, budget).parts
            continue
        values = value.value if value.id == "sequence" else [value]
        if value.id == "sequence" and all(value_node.id == "scalar" for value_node in values):
            # A list of plain values is one value of several words, such as a vector.
            joined_text = " ".join(value_node.value for value_node in values)
            node.parts.append(
                (
                    key.value,
                    SettingNode(joined_text, file=node.file, line=value.start_mark.line + 1),
                )
            )
            continue
        for value_node in values:
            budget.take_part(node)
            child_node = SettingNode(file=node.file, line=value_node.start_mark.line + 1)
            node.parts.append((key.value, child_node))
            if value_node.id == "scalar":
                child_node.value = value_node.value
            else:
                _fill_from_yaml(child_node, value_node, path, base, depth, level + 1, budget)


class _TokenReader:
    """Recursive-descent parser of the tokens of one SCONE file."""

    def __init__(
        self,
        tokens: list[tuple[str, int]],
        path: Path,
        base: Path,
        constants: dict[str, str],
        depth: int,
        budget: _Budget,
    ) -> None:
        self.tokens = tokens
        self.path = path
        self.base = base
        self.constants = constants
        self.depth = depth
        self.budget = budget
        self.index = 0

    def next(self) -> str:
        """Return the next token, and move on.

        Raises:
            DocumentError: there is no token left.
        """
        if self.index >= len(self.tokens):
            raise DocumentError(
                "the file ends too early: a value or a '}' is missing",
                file=str(self.path),
                line=self.line(),
            )
        self.index += 1
        return self.tokens[self.index - 1][0]

    def line(self) -> int:
        """Return the number of the line of the latest token."""
        return self.tokens[min(self.index, len(self.tokens)) - 1][1] if self.tokens else 1

    def fill(self, node: SettingNode, level: int) -> None:
        """Read the parts of a node up to its closing brace."""
        if level > MAX_NESTING:
            raise node.error(f"the braces nest more than {MAX_NESTING} levels deep")
        while self.index < len(self.tokens) and self.tokens[self.index][0] != "}":
            key = self.next()
            if key == "<<":
                texts = []
                while (text := self.next()) != ">>":
                    texts.append(text.strip('"'))
                node.parts += self._read_included(" ".join(texts)).parts
                continue
            self.budget.take_part(node)
            child_node = SettingNode(file=str(self.path), line=self.line())
            token = self.next() if self.index < len(self.tokens) else ""
            # A part is `key = value`, `key { ... }`, or `key = value { ... }`.
            if token == "=":
                child_node.value = self._read_value()
                if self.index < len(self.tokens) and self.tokens[self.index][0] == "{":
                    token = self.next()
            if token == "{":
                self.fill(child_node, level + 1)
                if self.next() != "}":
                    raise child_node.error(f"'{key}' has no closing '}}'")
            elif token != "=":
                raise child_node.error(f"expected '=' or '{{' after '{key}', found '{token}'")
            # Constants are shared by all files that are read after this line.
            if key.startswith("$"):
                self.constants[key] = child_node.value
            else:
                node.parts.append((key.strip('"'), child_node))

    def _read_value(self) -> str:
        """Return a value: a word, the words of a list, or the value of a constant.

        Raises:
            DocumentError: the next token is a brace or an equals sign, there is none, or a constant
                is unknown.
        """
        value = self.next()
        if value == "[":
            texts = []
            while (text := self.next()) != "]":
                texts.append(text.strip('"'))
            return " ".join(texts)
        if value in ("{", "}", "="):
            raise DocumentError(
                f"expected a value, found '{value}'", file=str(self.path), line=self.line()
            )
        if value.startswith("$"):
            if value not in self.constants:
                suggestion = suggest_name(value, self.constants)
                raise DocumentError(
                    f"there is no constant '{value}'{suggestion}",
                    file=str(self.path),
                    line=self.line(),
                )
            return self.constants[value]
        return value.strip('"')

    def _read_included(self, name: str) -> SettingNode:
        """Return the contents of an included file."""
        included = _resolve_include(name, self.path, self.base)
        return _read_source(included, self.base, self.constants, self.depth + 1, self.budget)


def matches_pattern(name: str, patterns: str) -> bool:
    """Return whether a name matches one of several patterns with `*` and `?`, separated by semicolons."""
    return any(fnmatchcase(name, pattern) for pattern in patterns.split(";") if pattern)


def _resolve_include(name: str, path: Path, base: Path) -> Path:
    """Return the path of an included file.

    Errors in an included file quote its words. Therefore it must not be an arbitrary file of the
    user: it ends like a settings file, lies in the folders of the scenario, and is not hidden. The
    same holds for the target of a link.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: the file must not be included.
    """
    included = find_file(name, path.parent, base)
    real = included.resolve()
    if not {included.suffix.lower(), real.suffix.lower()} <= {*INCLUDED_ENDINGS}:
        endings = join_words(INCLUDED_ENDINGS)
        message = f"'{name}' is not included: the name of the file must end in {endings}"
        raise DocumentError(message, file=str(path))
    # Scenarios of SCONE include files of folders up to three levels above. The climb ends at folders
    # that hold more than one project, such as home: their files are not part of the scenario.
    root = base.resolve()
    shared_folders = find_shared_folders()
    for folder in root.parents[:3]:
        if str(folder) in shared_folders:
            break
        root = folder
    if not real.is_relative_to(root) or any(
        path_part[0] == "." for path_part in real.relative_to(root).parts
    ):
        message = f"'{name}' is not included: it is hidden, or outside of '{root}'"
        raise DocumentError(message, file=str(path))
    return included


def find_file(name: str, *folders: Path) -> Path:
    """Return a file that a scenario names, from the first of some folders that has it.

    Args:
        name: path relative to one of the folders, or absolute.
        folders: folders to search; after each one, the three folders above it.

    Raises:
        MissingFileError: no folder has this file.
    """
    for folder in folders:
        for parent in (folder, *folder.resolve().parents[:3]):
            if os.path.isfile(parent / name):
                return parent / name
    raise MissingFileError("no such file", file=str(folders[0] / name))
