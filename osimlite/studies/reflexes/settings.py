"""Trees of keys and values: files of SCONE (.scone, .zml) with includes and constants, YAML, data of Python.

In YAML and Python a key that stands several times has a list of what stands below it; `include`
names another file.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import read_file
from osimlite.base.records import dataclass, field
from osimlite.base.text import join_words, suggest_name
from osimlite.base.writing import find_shared_folders
from osimlite.errors import DocumentError, MissingFileError
from osimlite.io.document.data import SUFFIXES, parse_yaml
from osimlite.mechanics.multibody.spatial import Array

_TOKEN = re.compile(r'\s+|#[^\n]*|(?P<token>"[^"]*"|<<|>>|[{}=\[\]]|[^\s{}=\[\]#"]+)')
FLAGS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}
MAX_INCLUDE_DEPTH = 20
"""Files that may include one another in a chain."""
MAX_INCLUDED_FILES = 200
"""Files that one scenario reads: a file that includes the next twice doubles their number each time."""
MAX_PARTS = 200_000
"""Parts of all files together, with those that stand there again because a file is included again."""
MAX_NESTING = 100
"""Levels of braces; SCONE's own scenarios have about ten."""
INCLUDED_ENDINGS = (".scone", ".zml", *SUFFIXES)
"""Endings of files that a scenario may include; errors would show the first words of any other file."""

CALLED = "name", "signature", "signature_prefix", "signature_postfix"
"""How any part is called, and the folder of its results in SCONE; nothing else depends on these."""


@dataclass
class Node:
    """A value, and what stands below it.

    Attributes:
        value: as it is written; "" if there is none.
        parts: below it, in their order.
        file, line: where it stands.
        asked: keys that something has asked for.
    """

    value: str = ""
    parts: list[tuple[str, Node]] = field(default_factory=list)
    file: str = ""
    line: int = 0
    asked: set[str] = field(default_factory=set)

    def get(self, key: str) -> Node | None:
        """The part of a name.

        Raises:
            DocumentError: there are several.
        """
        self.asked.add(key)
        found = [node for name, node in self.parts if name == key]
        if len(found) > 1:
            raise found[1].error(f"'{key}' stands here again; it counts once only")
        return found[0] if found else None

    def text(self, key: str, otherwise: str | None = None) -> str:
        """The value of a part.

        Raises:
            DocumentError: there is none, and nothing to take otherwise.
        """
        found = self.get(key)
        if found is not None:
            return found.value
        if otherwise is None:
            raise self.error(f"'{key}' is missing")
        return otherwise

    def number(self, key: str, otherwise: float | None = None) -> float:
        """The number that a part is.

        Raises:
            DocumentError: it is none.
        """
        found = self.get(key)
        if found is None and otherwise is not None:
            return otherwise
        text = self.text(key)
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if math.isnan(number):
            raise (found or self).error(f"'{key}' must be a number, not '{text}'")
        return number

    def count(self, key: str, default: int, least: int, most: int) -> int:
        """Return the whole number of a part.

        Args:
            key: name of the part.
            default: if there is no such part.
            least, most: limits of what makes sense.

        Raises:
            DocumentError: it is no whole number, or beyond the limits.
        """
        number = self.number(key, default)
        if not least <= number <= most or number != int(number):
            raise (self.get(key) or self).error(
                f"'{key}' must be a whole number from {least} to {most}, not '{self.text(key)}'"
            )
        return int(number)

    def flag(self, key: str, otherwise: bool) -> bool:
        """Whether a part is 1 or true.

        Raises:
            DocumentError: it is neither that nor 0 or false.
        """
        text = self.text(key, "1" if otherwise else "0")
        if text.lower() not in FLAGS:
            raise (self.get(key) or self).error(f"'{key}' must be 0 or 1, not '{text}'")
        return FLAGS[text.lower()]

    def vector(self, key: str, otherwise: str | None = None) -> Array:
        """The three numbers that a part is.

        Raises:
            DocumentError: it is something else.
        """
        text = self.text(key, otherwise)
        try:
            x, y, z = map(parse_finite, text.split())
        except ValueError:
            raise (self.get(key) or self).error(
                f"'{key}' must be three numbers, as [ 0 0 1 ], not '{text}'"
            ) from None
        return np.array([x, y, z])

    def all_of(self, *names: str) -> Iterator[tuple[str, Node]]:
        """The parts of some names, in their order."""
        self.asked.update(names)
        return ((name, node) for name, node in self.parts if name in names)

    def one_of(self, *names: str) -> tuple[str, Node] | None:
        """The part that has one of some names.

        Raises:
            DocumentError: there are several.
        """
        found = [*self.all_of(*names)]
        if len(found) > 1:
            raise found[1][1].error(
                f"'{found[1][0]}' stands beside '{found[0][0]}'; join them in a composite one"
            )
        return found[0] if found else None

    def error(self, message: str) -> DocumentError:
        """An error about this place."""
        return DocumentError(message, file=self.file, line=self.line or None)

    def expect_all_asked(self, what: str, known: tuple[str, ...] = ()) -> None:
        """Refuse parts that nothing has asked for.

        Raises:
            DocumentError: there is one; it names the nearest that is known.
        """
        for name, node in self.parts:
            if name not in self.asked and name not in CALLED:
                near = suggest_name(name, {*self.asked, *known})
                raise node.error(f"'{name}' of {what} is not done here{near}")


def parse_finite(word: str) -> float:
    """Parse a finite number; raise ValueError for anything else."""
    number = float(word)
    if not math.isfinite(number):
        raise ValueError(f"{word} is not finite")
    return number


@dataclass
class _Budget:
    """What reading one scenario may still take, with all files that it includes."""

    files: int = MAX_INCLUDED_FILES
    parts: int = MAX_PARTS

    def take_file(self, path: Path) -> None:
        self.files -= 1
        if self.files < 0:
            raise DocumentError(
                f"the files include more than {MAX_INCLUDED_FILES} others, some of them again and again",
                file=str(path),
            )

    def take_part(self, node: Node) -> None:
        self.parts -= 1
        if self.parts < 0:
            raise node.error(
                f"the scenario has more than {MAX_PARTS} parts with all that it includes"
            )


def read_settings(path: str | Path) -> Node:
    """Read a file, and those that it includes, which are looked for beside it and in its folders above.

    Raises:
        MissingFileError: a file is not there.
        MissingDependency: one is YAML and PyYAML is not installed.
        DocumentError: one is damaged; with its line.
    """
    constants: dict[str, str] = {}
    return _read_source(Path(path), Path(path).parent, constants, 0, _Budget())


def settings_of(data: Mapping[str, Any]) -> Node:
    """The tree that data of Python describe."""
    return Node(parts=[part for key, value in data.items() for part in _parts_of(key, value)])


def _parts_of(key: str, value: Any) -> Iterator[tuple[str, Node]]:
    if isinstance(value, Mapping):
        yield key, settings_of(value)
    elif isinstance(value, list | tuple) and any(isinstance(item, Mapping) for item in value):
        for item in value:
            yield from _parts_of(key, item)
    else:
        yield (
            key,
            Node(" ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)),
        )


def _read_source(
    path: Path, base: Path, constants: dict[str, str], depth: int, budget: _Budget
) -> Node:
    budget.take_file(path)
    try:
        text = read_file(path).decode()
    except UnicodeDecodeError as error:
        message = (
            f"the file is not UTF-8: byte {error.start + 1} is {error.object[error.start]:#04x}"
        )
        raise DocumentError(message, file=str(path)) from None
    if depth > MAX_INCLUDE_DEPTH:
        raise DocumentError("the files include one another without end", file=str(path))
    if path.suffix in SUFFIXES:
        top = Node(file=str(path), line=1)
        found = parse_yaml(text, str(path), with_lines=True)
        if found is not None:
            _fill_from_yaml(top, found, path, base, depth, 0, budget)
        return top
    tokens = []
    line = 1
    place = 0
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            raise DocumentError(
                f"a quotation mark is not closed: {text[place : place + 20]!r}",
                file=str(path),
                line=line,
            )
        if found["token"] is not None:
            tokens.append((found["token"], line))
        line += found.group().count("\n")
        place = found.end()
    reader = _Reader(tokens, path, base, constants, depth, budget)
    top = Node(file=str(path), line=1)
    reader.fill(top, 0)
    if reader.place < len(tokens):
        raise top.error(f"line {tokens[reader.place][1]}: a '}}' without its '{{'")
    return top


def _fill_from_yaml(
    node: Node, found: Any, path: Path, base: Path, depth: int, level: int, budget: _Budget
) -> None:
    """Put below a node what a mapping of YAML has."""
    if found.id != "mapping":
        raise node.error("keys with values are wanted")
    # An anchor that contains an alias of itself has no end.
    if level > MAX_NESTING:
        raise node.error(f"the parts nest more than {MAX_NESTING} levels deep")
    for key, value in found.value:
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
        several = value.value if value.id == "sequence" else [value]
        if value.id == "sequence" and all(item.id == "scalar" for item in several):
            words = " ".join(item.value for item in several)
            node.parts.append(
                (key.value, Node(words, file=node.file, line=value.start_mark.line + 1))
            )
            continue
        for item in several:
            budget.take_part(node)
            part = Node(file=node.file, line=item.start_mark.line + 1)
            node.parts.append((key.value, part))
            if item.id == "scalar":
                part.value = item.value
            else:
                _fill_from_yaml(part, item, path, base, depth, level + 1, budget)


class _Reader:
    def __init__(
        self,
        tokens: list[tuple[str, int]],
        path: Path,
        base: Path,
        constants: dict[str, str],
        depth: int,
        budget: _Budget,
    ) -> None:
        self.tokens, self.path, self.base, self.constants = tokens, path, base, constants
        self.depth, self.budget, self.place = depth, budget, 0

    def next(self) -> str:
        if self.place >= len(self.tokens):
            raise DocumentError(
                "the file ends in the middle of something", file=str(self.path), line=self.line()
            )
        self.place += 1
        return self.tokens[self.place - 1][0]

    def line(self) -> int:
        return self.tokens[min(self.place, len(self.tokens)) - 1][1] if self.tokens else 1

    def fill(self, node: Node, level: int) -> None:
        if level > MAX_NESTING:
            raise node.error(f"the braces nest more than {MAX_NESTING} levels deep")
        while self.place < len(self.tokens) and self.tokens[self.place][0] != "}":
            key = self.next()
            if key == "<<":
                words = []
                while (word := self.next()) != ">>":
                    words.append(word.strip('"'))
                node.parts += self._read_included(" ".join(words)).parts
                continue
            self.budget.take_part(node)
            part = Node(file=str(self.path), line=self.line())
            what = self.next() if self.place < len(self.tokens) else ""
            if what == "=":
                part.value = self._value()
                if self.place < len(self.tokens) and self.tokens[self.place][0] == "{":
                    what = self.next()
            if what == "{":
                self.fill(part, level + 1)
                if self.next() != "}":
                    raise part.error(f"'{key}' has no end")
            elif what != "=":
                raise part.error(f"after '{key}' a '=' or a '{{' is wanted, not '{what}'")
            if key.startswith("$"):
                self.constants[key] = part.value
            else:
                node.parts.append((key.strip('"'), part))

    def _value(self) -> str:
        value = self.next()
        if value == "[":
            words = []
            while (word := self.next()) != "]":
                words.append(word.strip('"'))
            return " ".join(words)
        if value in ("{", "}", "="):
            raise DocumentError(
                f"a value is wanted, not '{value}'", file=str(self.path), line=self.line()
            )
        if value.startswith("$"):
            if value not in self.constants:
                near = suggest_name(value, self.constants)
                raise DocumentError(
                    f"there is no constant '{value}'{near}", file=str(self.path), line=self.line()
                )
            return self.constants[value]
        return value.strip('"')

    def _read_included(self, name: str) -> Node:
        included = _resolve_include(name, self.path, self.base)
        return _read_source(included, self.base, self.constants, self.depth + 1, self.budget)


def matches_pattern(name: str, patterns: str) -> bool:
    """Whether a name fits one of some patterns, between which there are semicolons."""
    return any(fnmatchcase(name, pattern) for pattern in patterns.split(";") if pattern)


def _resolve_include(name: str, path: Path, base: Path) -> Path:
    """Return the path of an included file.

    Errors in it quote its words, so that it must not be any file of the user: it has an ending of
    settings, is in the folders of the scenario, and is not hidden; the same holds of what a link
    leads to.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: it may not be included.
    """
    found = find_file(name, path.parent, base)
    real = found.resolve()
    if not {found.suffix.lower(), real.suffix.lower()} <= {*INCLUDED_ENDINGS}:
        endings = join_words(INCLUDED_ENDINGS)
        message = f"'{name}' is not included: the name of the file must end in {endings}"
        raise DocumentError(message, file=str(path))
    top = base.resolve()
    shared = find_shared_folders()
    for folder in top.parents[:3]:
        if str(folder) in shared:
            break
        top = folder
    if not real.is_relative_to(top) or any(part[0] == "." for part in real.relative_to(top).parts):
        message = f"'{name}' is not included: it is hidden, or outside of '{top}'"
        raise DocumentError(message, file=str(path))
    return found


def find_file(name: str, *folders: Path) -> Path:
    """A file that a scenario names: beside it, or in one of the folders above.

    Raises:
        MissingFileError: it is in none.
    """
    for folder in folders:
        for place in (folder, *folder.resolve().parents[:3]):
            if os.path.isfile(place / name):
                return place / name
    raise MissingFileError("no such file", file=str(folders[0] / name))
