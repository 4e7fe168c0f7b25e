"""Projects for random faults: a model with setups and tables that fit it.

A fault knows the lines in which it may be reported: those that it changes, and those of other files
that refer to them. It is `sure` if it is a fault in every project; for the others OpenSim decides.
"""

from __future__ import annotations

import gzip
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.oracle.structural_edits import Text

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"

# File and line number.
Place = tuple[str, int]

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(inf|infinity|nan)", re.IGNORECASE)
# Start tag with a name.
_NAMED = re.compile(r'<(\w+) name="([^"]+)"')


class Fault(NamedTuple):
    """Fault in a project, with the changed files (None for a missing file) and where it may be reported."""

    kind: str  # name of the function that made the fault
    what: str  # description
    file: str  # changed file
    texts: dict[str, str | None]  # new text of each changed file, None for a missing file
    places: frozenset[Place]  # lines where the fault may be reported
    sure: bool  # whether the change is a fault in every project


class Change(NamedTuple):
    """Changed text of one file, with the lines and words that the change concerns."""

    file: str  # changed file
    what: str  # description
    text: str | None  # new text, None for a missing file
    lines: tuple[int, ...]  # changed lines, and others where the fault may be reported
    words: tuple[str, ...] = ()  # names that the change is about
    sure: bool = False  # whether the change is a fault in every project


class Table:
    """Lines of a table, and the positions of its labels and rows."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.lines = text.split("\n")
        self.is_markers = name.endswith(".trc")
        self.label_line = 3 if self.is_markers else self.lines.index("endheader") + 1
        self.labels = self.lines[self.label_line].split("\t")
        self.rows = [
            k for k, line in enumerate(self.lines) if k > self.label_line and line[:1].isdigit()
        ]
        self.time = int(self.is_markers)
        self.old = "version=1" in self.lines

    def cells(self, line: int) -> list[str]:
        return self.lines[line].split("\t")

    def with_cells(self, line: int, cells: list[str]) -> str:
        return "\n".join([*self.lines[:line], "\t".join(cells), *self.lines[line + 1 :]])

    def with_lines(self, line: int, *new: str, instead_of: int = 1) -> str:
        return "\n".join([*self.lines[:line], *new, *self.lines[line + instead_of :]])


class Project:
    """Texts of all files of a folder, and the references between them."""

    def __init__(self, texts: dict[str, str]) -> None:
        self.texts = texts
        self.documents = {
            name: Text(text) for name, text in texts.items() if name.endswith((".xml", ".omoco"))
        }
        self.tables = {
            name: Table(name, text)
            for name, text in texts.items()
            if name.endswith((".trc", ".mot", ".sto"))
        }
        self.components: dict[str, str] = {
            name: tag for tag, name in _NAMED.findall(texts["model.osim"])
        }
        labels = {label for table in self.tables.values() for label in table.labels[1:] if label}
        self.names = sorted(
            {*self.components, "ground", *labels, *(label[:-1] for label in labels)}
        )

    def users(self, file: str) -> dict[str, int]:
        """Return the line of each document that names a file, directly or through other documents.

        Returns:
            Line numbers by the name of the document.
        """
        result: dict[str, int] = {}
        for name, document in self.documents.items():
            for line, text in enumerate(document.text.split("\n"), 1):
                if name != file and re.search(rf"[>\s]{re.escape(file)}[<\s]", text):
                    result |= {
                        name: line,
                        **{user: at for user, at in self.users(name).items() if user not in result},
                    }
        return result

    def places_of(self, word: str) -> set[Place]:
        """Return the lines of all documents that contain a name."""
        whole = re.compile(rf"""(?<![^\s<>"'/]){re.escape(word)}(?![^\s<>"'/.])""")
        return {
            (name, line)
            for name, document in self.documents.items()
            for line, text in enumerate(document.text.split("\n"), 1)
            if whole.search(text)
        }


# Ways to misspell a word.
_MISSPELT: tuple[Callable[[random.Random, str], str], ...] = (
    lambda draw, word: word[: (at := draw.randrange(len(word)))] + word[at + 1 :],
    lambda draw, word: word[: (at := draw.randrange(len(word)))] + word[at] + word[at:],
    lambda draw, word: (
        word[: (at := draw.randrange(len(word)))] + draw.choice("abcxyz_1") + word[at + 1 :]
    ),
    lambda draw, word: word.swapcase(),
    lambda draw, word: word[: (at := draw.randrange(len(word)))] + word[at:].swapcase(),
)


def misspelt(draw: random.Random, word: str) -> str:
    """Return a word with a letter dropped, repeated, replaced, or in another case."""
    return draw.choice(_MISSPELT)(draw, word)


def walking() -> Project:
    """Return a gait project with scaling, IK, inverse dynamics, analyses, RRA and CMC."""
    texts = {
        file.name: file.read_text()
        for folder in ("setups", "pipelines/walking")
        for file in sorted((FIXTURES / folder).iterdir())
        if file.suffix != ".gz"
    }
    texts["model.osim"] = gzip.decompress(
        (FIXTURES / "setups" / "model.osim.gz").read_bytes()
    ).decode()
    return Project(texts)


def pendulum() -> Project:
    """Return a project of a double pendulum with placed sensors, their tracking, and a Moco study."""
    return Project(
        {
            file.name: file.read_text()
            for file in sorted((FIXTURES / "pipelines" / "pendulum").iterdir())
        }
    )
