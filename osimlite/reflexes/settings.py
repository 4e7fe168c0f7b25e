"""Trees of keys and values: files of SCONE (.scone, .zml) with includes and constants, YAML, data of Python.

In YAML and Python a key that stands several times has a list of what stands below it; `include` names another file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.document.data import SUFFIXES, parsed_yaml
from osimlite.errors import DocumentError, MissingFileError
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass, field
from osimlite.text import did_you_mean

_TOKEN = re.compile(r'\s+|#[^\n]*|(?P<token>"[^"]*"|<<|>>|[{}=\[\]]|[^\s{}=\[\]#"]+)')
FLAGS = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}
_MOST_DEEP = 20
"""Files that may include one another."""


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
            return float(text)
        except ValueError:
            raise (found or self).error(f"'{key}' must be a number, not '{text}'") from None

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
            x, y, z = map(float, text.split())
        except ValueError:
            raise (self.get(key) or self).error(f"'{key}' must be three numbers, as [ 0 0 1 ], not '{text}'") from None
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
            raise found[1][1].error(f"'{found[1][0]}' stands beside '{found[0][0]}'; join them in a composite one")
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
                near = did_you_mean(name, {*self.asked, *known})
                raise node.error(f"'{name}' of {what} is not done here{near}")


def read_settings(path: str | Path) -> Node:
    """Read a file, and those that it includes, which are looked for beside it and in its folders above.

    Raises:
        MissingFileError: a file is not there.
        MissingDependency: one is YAML and PyYAML is not installed.
        DocumentError: one is damaged; with its line.
    """
    constants: dict[str, str] = {}
    return _read(Path(path), Path(path).parent, constants, 0)


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
        yield key, Node(" ".join(map(str, value)) if isinstance(value, list | tuple) else str(value))


def _read(path: Path, base: Path, constants: dict[str, str], depth: int) -> Node:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise MissingFileError("no such file", file=str(path)) from None
    except (OSError, UnicodeError) as error:
        raise DocumentError(f"cannot be read: {error}", file=str(path)) from None
    if depth > _MOST_DEEP:
        raise DocumentError("the files include one another without end", file=str(path))
    if path.suffix in SUFFIXES:
        top = Node(file=str(path), line=1)
        found = parsed_yaml(text, str(path), with_lines=True)
        if found is not None:
            _fill_from_yaml(top, found, path, base, depth)
        return top
    tokens = []
    line = 1
    place = 0
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            raise DocumentError(
                f"a quotation mark is not closed: {text[place : place + 20]!r}", file=str(path), line=line
            )
        if found["token"] is not None:
            tokens.append((found["token"], line))
        line += found.group().count("\n")
        place = found.end()
    reader = _Reader(tokens, path, base, constants, depth)
    top = Node(file=str(path), line=1)
    reader.fill(top)
    if reader.place < len(tokens):
        raise top.error(f"line {tokens[reader.place][1]}: a '}}' without its '{{'")
    return top


def _fill_from_yaml(node: Node, found: Any, path: Path, base: Path, depth: int) -> None:
    """Put below a node what a mapping of YAML has."""
    if found.id != "mapping":
        raise node.error("keys with values are wanted")
    for key, value in found.value:
        if key.value == "include":
            node.parts += _read(found_file(value.value, path.parent, base), base, {}, depth + 1).parts
            continue
        several = value.value if value.id == "sequence" else [value]
        if value.id == "sequence" and all(item.id == "scalar" for item in several):
            words = " ".join(item.value for item in several)
            node.parts.append((key.value, Node(words, file=node.file, line=value.start_mark.line + 1)))
            continue
        for item in several:
            part = Node(file=node.file, line=item.start_mark.line + 1)
            node.parts.append((key.value, part))
            if item.id == "scalar":
                part.value = item.value
            else:
                _fill_from_yaml(part, item, path, base, depth)


class _Reader:
    def __init__(
        self, tokens: list[tuple[str, int]], path: Path, base: Path, constants: dict[str, str], depth: int
    ) -> None:
        self.tokens, self.path, self.base, self.constants, self.depth, self.place = (
            tokens,
            path,
            base,
            constants,
            depth,
            0,
        )

    def next(self) -> str:
        if self.place >= len(self.tokens):
            raise DocumentError("the file ends in the middle of something", file=str(self.path), line=self.line())
        self.place += 1
        return self.tokens[self.place - 1][0]

    def line(self) -> int:
        return self.tokens[min(self.place, len(self.tokens)) - 1][1] if self.tokens else 1

    def fill(self, node: Node) -> None:
        while self.place < len(self.tokens) and self.tokens[self.place][0] != "}":
            key = self.next()
            if key == "<<":
                words = []
                while (word := self.next()) != ">>":
                    words.append(word.strip('"'))
                node.parts += self._included(" ".join(words)).parts
                continue
            part = Node(file=str(self.path), line=self.line())
            what = self.next() if self.place < len(self.tokens) else ""
            if what == "=":
                part.value = self._value()
                if self.place < len(self.tokens) and self.tokens[self.place][0] == "{":
                    what = self.next()
            if what == "{":
                self.fill(part)
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
            raise DocumentError(f"a value is wanted, not '{value}'", file=str(self.path), line=self.line())
        if value.startswith("$"):
            if value not in self.constants:
                near = did_you_mean(value, self.constants)
                raise DocumentError(f"there is no constant '{value}'{near}", file=str(self.path), line=self.line())
            return self.constants[value]
        return value.strip('"')

    def _included(self, name: str) -> Node:
        return _read(found_file(name, self.path.parent, self.base), self.base, self.constants, self.depth + 1)


def matches(name: str, patterns: str) -> bool:
    """Whether a name fits one of some patterns, between which there are semicolons."""
    return any(fnmatchcase(name, pattern) for pattern in patterns.split(";") if pattern)


def found_file(name: str, *folders: Path) -> Path:
    """A file that a scenario names: beside it, or in one of the folders above.

    Raises:
        MissingFileError: it is in none.
    """
    for folder in folders:
        for place in (folder, *folder.resolve().parents[:3]):
            if (place / name).is_file():
                return place / name
    raise MissingFileError("no such file", file=str(folders[0] / name))
