"""A setup that a tool carries out, and the paths of its files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from osimlite.base.records import dataclass
from osimlite.errors import DocumentError, UnsupportedError
from osimlite.io.document.cache import read_copy
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.model import Model

NO_FILE = frozenset(("", "Unassigned"))
"""Values of a file property that name no file."""


class NotRunnable(UnsupportedError):
    """Error for a document, or a part of one, that osimlite cannot run."""

    exit_code = 2


@dataclass(frozen=True, eq=False)
class Job:
    """Setup of a tool, with the paths of its inputs and results."""

    setup: Any  # object of the setup
    file: Path  # file of the setup
    output: Path | None = None  # folder for all results, instead of those of the setup
    # Error to which optimal control refines its mesh; None for no refinement.
    refine: float | str | None = None
    simulates: bool = False  # whether to simulate the solution of optimal control

    def create_error(self, message: str) -> DocumentError:
        """Return an error about the setup."""
        return DocumentError(message, file=str(self.file))

    def create_unsupported_error(self, message: str) -> NotRunnable:
        """Return an error about something in the setup that osimlite does not support."""
        return NotRunnable(message, file=str(self.file))

    def find_path(self, tag: str) -> Path | None:
        """Return the path of the file that a property of the setup names; None if it names none.

        A relative path starts from the folder of the setup, then from the current folder. For some
        tools OpenSim looks for models in the current folder only, and crashes otherwise.
        """
        return self.resolve_name(str(getattr(self.setup, tag)))

    def resolve_name(self, name: str) -> Path | None:
        """Return the path of a file by its name in the setup; None if the name is empty.

        Args:
            name: path as in the setup; see :meth:`find_path` for the folders.
        """
        name = name.strip()
        if name in NO_FILE:
            return None
        path_from_setup = self.file.parent / name
        path_from_current = Path(name)
        # A file that is in neither folder is reported in that of the setup.
        return (
            path_from_current
            if not os.path.exists(path_from_setup) and os.path.exists(path_from_current)
            else path_from_setup
        )

    def require_path(self, *tags: str) -> Path:
        """Return the path of the file that the first non-empty of some properties names.

        Args:
            tags: names of properties of the setup.

        Raises:
            DocumentError: all of them are empty.
        """
        for tag in tags:
            if (path := self.find_path(tag)) is not None:
                return path
        raise self.create_error(f"the setup names no {' or '.join(tags)}; add one")

    def read_model(self) -> Model:
        """Return the model that the setup names, read without the cache.

        Raises:
            DocumentError: the setup names no model, or osimlite cannot read it.
        """
        return read_copy(self.require_path("model_file"), Model)

    def read_object(self, path: Path, cls: type) -> Any:
        """Read the object of a document; ignore unknown properties, as OpenSim does.

        Args:
            path: file of the document.
            cls: class of the object.

        Returns:
            Object at the top of the document.

        Raises:
            DocumentError: the file is missing or holds another class.
        """
        return read_document(Source.from_file(path), expected_class=cls).top

    def get_output_path(self, name: str) -> Path:
        """Return the path of a result that a property of the setup names.

        The `results_directory` of the setup has no effect on it.
        """
        return self._join_output(Path(name), self.file.parent)

    def get_results_path(self, name: str) -> Path:
        """Return the path of a result in the `results_directory` of the setup.

        OpenSim creates only the last folder of that path. Folders in the name are dropped, and a
        name without suffix gets `.sto`.
        """
        folder = self.setup.results_directory.strip()
        base_name = Path(name).name
        file_name = Path(base_name if "." in base_name else f"{base_name}.sto")
        return self._join_output(
            file_name, self.file.parent / ("" if folder in NO_FILE else folder)
        )

    def _join_output(self, name: Path, folder: Path) -> Path:
        """Return a path in the requested output folder, or else in a default folder."""
        return folder / name if self.output is None else self.output / name.name
