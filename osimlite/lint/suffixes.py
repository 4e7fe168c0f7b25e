"""What is checked, by the names of files, and for XML by how it begins."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from osimlite.base.files import TABLES as TABLES
from osimlite.base.files import no_such, read_at_most, unsaved
from osimlite.errors import OsimliteError
from osimlite.lint.ours import BEGINNING, is_ours

DOCUMENTS = (".xml", ".omoco")
"""Setups of tools and what they consist of."""
PROJECT = (".osim", *DOCUMENTS, *TABLES)
"""Everything that belongs to a project."""


def is_table(file: str | None) -> bool:
    """Whether a file is a table, by its name."""
    return file is not None and file.lower().endswith(TABLES)


def is_document(file: str | None) -> bool:
    """Whether a file may be a document other than a model, by its name; standard input has none."""
    return file is not None and (file == "<stdin>" or file.lower().endswith(DOCUMENTS))


def project_files(
    paths: Iterable[str | Path],
    suffixes: tuple[str, ...] = PROJECT,
    *,
    only_ours: bool = False,
    passed: list[str] | None = None,
) -> list[str]:
    """The files that are named, and OpenSim's files with some suffixes below the folders that are named, each once.

    With `only_ours`, XML of other programs is passed over even where it is named. What is passed
    over is added to `passed`.

    Raises: MissingFileError: a path is not there; MissingFolderError of one that ends as those of
        folders do. OsimliteError: there is none in a folder.
    """
    result: list[str] = []
    others: list[str] = [] if passed is None else passed
    for path in paths:
        if os.path.isdir(path):
            named = (file for file in Path(path).rglob("*.*") if file.suffix.lower() in suffixes)
            inside = sorted(str(file) for file in named if not file.is_dir())
            below = [file for file in inside if begins_as_ours(file)]
            if not below:
                raise OsimliteError(
                    f"there is no file of OpenSim in this folder: no {', '.join(suffixes[:-1])} or {suffixes[-1]}",
                    file=str(path),
                )
            result += below
            others += sorted({*inside}.difference(below))
        elif (
            str(path) != "-" and not os.path.lexists(path) and os.path.realpath(path) not in unsaved
        ):
            raise no_such(path, may_be_folder=True)
        elif not only_ours or begins_as_ours(str(path)):
            result.append(str(path))
        else:
            others.append(str(path))
    return list({os.path.abspath(file): file for file in reversed(result)}.values())[::-1]


def begins_as_ours(file: str) -> bool:
    """Whether a file is OpenSim's, as far as its name and its beginning tell: other programs write XML too."""
    if not file.lower().endswith(".xml"):
        return True
    try:
        return is_ours(read_at_most(file, BEGINNING))
    except OsimliteError:
        return True
