"""What a tool is told to do: its setup, and where its files are."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from osimlite.base.records import dataclass
from osimlite.errors import DocumentError, UnsupportedError
from osimlite.io.document.cache import read_anew
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.model import Model

NONE = frozenset(("", "Unassigned"))
"""What stands for no file."""


class NotRunnable(UnsupportedError):
    """A document, or a part of it, is not what can be run."""

    exit_code = 2


@dataclass(frozen=True, eq=False)
class Job:
    """A setup that is run."""

    setup: Any  # what the document says
    file: Path  # the document
    output: Path | None = None  # folder for all results, in place of those that the setup names
    # to what error meshes of optimal control are refined, if they are
    refine: float | str | None = None
    simulates: bool = False  # whether what optimal control finds is simulated, too

    def error(self, message: str) -> DocumentError:
        """An error of the setup."""
        return DocumentError(message, file=str(self.file))

    def unable(self, message: str) -> NotRunnable:
        """An error of what the setup asks for and nobody computes here."""
        return NotRunnable(message, file=str(self.file))

    def path(self, tag: str) -> Path | None:
        """The file that a property names; None if it names none.

        It is looked for from the folder of the setup, then from that in which the program runs.
        OpenSim looks for the models of some tools in the second only, and crashes without.
        """
        return self.place(str(getattr(self.setup, tag)))

    def place(self, name: str) -> Path | None:
        """Where a file is that the setup names, as for :meth:`path`."""
        name = name.strip()
        if name in NONE:
            return None
        there, here = self.file.parent / name, Path(name)
        return here if not os.path.exists(there) and os.path.exists(here) else there

    def needed(self, *tags: str) -> Path:
        """The file that one of some properties names.

        Raises:
            DocumentError: none does.
        """
        for tag in tags:
            if (path := self.path(tag)) is not None:
                return path
        raise self.error(f"it names no {' or '.join(tags)}; give it one")

    def model(self) -> Model:
        """The model that the setup names, read anew.

        Raises:
            DocumentError: it names none, or that cannot be read.
        """
        return read_anew(self.needed("model_file"), Model)

    def read(self, path: Path, cls: type) -> Any:
        """An object of a class that another document holds; what it says that means nothing is ignored, as in OpenSim.

        Raises:
            DocumentError: the file is missing or holds something else.
        """
        return read_document(Source.of_file(path), of=cls).top

    def result(self, name: str) -> Path:
        """Where a file of results goes that the setup names by itself: its `results_directory` does not count."""
        return self._put(Path(name), self.file.parent)

    def in_results(self, name: str) -> Path:
        """Where a file of results goes: into the `results_directory`, of which OpenSim makes the last part only.

        Folders in its name do not count, and without an ending it is a .sto.
        """
        folder, last = self.setup.results_directory.strip(), Path(name).name
        own = Path(last if "." in last else f"{last}.sto")
        return self._put(own, self.file.parent / ("" if folder in NONE else folder))

    def _put(self, name: Path, folder: Path) -> Path:
        return folder / name if self.output is None else self.output / name.name
