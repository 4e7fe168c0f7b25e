"""Writer of the results that a document names: which paths it may write, and over what.

A document may come from somebody else. Its results are therefore written only in the trees of the
project and the current folder, under no hidden name, and only over a result of the same type.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from osimlite.base.reading import describe_content, read_at_most
from osimlite.base.records import dataclass
from osimlite.base.writing import (
    WriteRefusedError,
    encode_text,
    expect_regular_or_none,
    find_marked_folder,
    find_shared_folders,
    is_inside,
    make_folder,
    open_into,
)

RESULT_ENDINGS = (".sto", ".mot", ".trc", ".osim", ".xml", ".omoco", ".csv", ".txt")
"""Suffixes that a document may give to a new file; no program executes such files."""

BEGINNING_BYTES = 65_536
"""Number of bytes of an existing file that are read to recognize its type."""


@dataclass(frozen=True)
class ResultWriter:
    """Writer of files that a document names as its results.

    Attributes:
        trees: real paths of the folders in whose trees files may be written.
        overwrite: whether any regular file or link may be replaced.
        outside: whether files may be written outside of the trees.
    """

    trees: tuple[str, ...]
    overwrite: bool = False
    outside: bool = False

    @classmethod
    def for_document(
        cls,
        document: str | Path,
        output: str | Path | None = None,
        *,
        overwrite: bool = False,
        outside: bool = False,
    ) -> ResultWriter:
        """Return the writer for the results of a document.

        Args:
            document: path of the file that names the results.
            output: folder that the user named for all results; None if the document decides.
            overwrite: whether any regular file or link may be replaced.
            outside: whether files may be written outside of the trees of the project and the
                current folder.
        """
        folders = [project_folder(document), os.getcwd()] if output is None else [output]
        trees = tuple(dict.fromkeys(map(os.path.realpath, folders)))
        return cls(trees, overwrite, outside)

    def resolve(self, path: str | Path) -> Path:
        """Return the real path of a result, after checking all that depends on its name alone.

        Raises:
            WriteRefusedError: the path leads out of the trees, is hidden, is a link, or its ending
                is not that of a result.
        """
        path = Path(path)
        real_path = Path(os.path.realpath(path.parent)) / path.name
        if "\0" in str(path) or path.name in ("", ".", ".."):
            raise WriteRefusedError("a result needs the name of a file", file=str(path))
        tree = next((tree for tree in self.trees if is_inside(real_path, [tree])), None)
        if tree is None and not self.outside:
            folders = " and ".join(f"'{tree}'" for tree in self.trees)
            raise WriteRefusedError(
                f"the document names a result outside of {folders}; to write there, use "
                "--write-outside, or name another folder with -o",
                file=str(real_path),
            )
        relative_path = real_path.relative_to(tree) if tree is not None else Path(real_path.name)
        if any(part.startswith(".") for part in relative_path.parts):
            raise WriteRefusedError(
                "the document names a hidden file as a result, which is never written; use another name",
                file=str(real_path),
            )
        if self.overwrite:
            return real_path
        # os.path.islink is false, without an error, where a name is too long; writing then says so.
        if os.path.islink(real_path):
            raise WriteRefusedError(
                "the document names a link as a result, and results are not written through links; "
                "remove it, or replace it with --overwrite",
                file=str(path),
            )
        # OpenSim gives tables of a tool that is called `v1.2` no ending: `v1.2_states`.
        is_numbered = real_path.suffix[1:2].isdigit()
        if not is_numbered and not real_path.name.lower().endswith(RESULT_ENDINGS):
            raise WriteRefusedError(
                f"the name of a result ends in {', '.join(RESULT_ENDINGS[:-1])} or "
                f"{RESULT_ENDINGS[-1]}; use such a name, or --overwrite",
                file=str(real_path),
            )
        return real_path

    def expect_replaceable(self, path: Path, beginning: bytes) -> None:
        """Check that an existing file is a result of the same type, so that it can be replaced.

        Args:
            path: real path of the result.
            beginning: first bytes of the new content.

        Raises:
            WriteRefusedError: another file exists.
        """
        expect_regular_or_none(path)
        if self.overwrite or not os.path.lexists(path):
            return
        existing = read_at_most(path, BEGINNING_BYTES)
        kind = describe_content(beginning)
        if existing and not _can_replace(describe_content(existing), kind):
            raise WriteRefusedError(
                f"a result would replace this file, which is not {kind or 'such a text'}; move it, "
                "let the document name another file, or replace it with --overwrite",
                file=str(path),
            )

    @contextmanager
    def written(self, path: str | Path, lines: Iterable[str]) -> Iterator[BinaryIO]:
        """Write a result under a temporary name, and rename it when the context ends without an error.

        Args:
            path: path in the document.
            lines: parts of the text, with line ends.

        Yields:
            Stream of the complete temporary file, which is closed already.

        Raises:
            WriteRefusedError: the file may not be written.
            OsimliteError: it cannot be written.
        """
        real_path = self.resolve(path)
        chunks = iter(lines)
        beginning = b""
        # Chunks may be single lines of a table; the type of the file shows only in the whole
        # header.
        for chunk in chunks:
            beginning += encode_text(chunk, real_path)
            if len(beginning) >= BEGINNING_BYTES:
                break
        self.expect_replaceable(real_path, beginning)
        make_folder(real_path.parent)
        with open_into(real_path.parent, real_path.name) as stream:
            stream.write(beginning)
            stream.writelines(encode_text(chunk, real_path) for chunk in chunks)
            stream.close()
            yield stream


def project_folder(document: str | Path) -> str:
    """Return the top folder of the project that a document belongs to.

    It is the nearest folder above that has `.git`, `osimlite.toml` or `pyproject.toml`. Without one
    it is the folder around the document's, because laboratories keep setups and results side by
    side (`../results`). It is never the home folder, the temporary folder or what is above one of
    them.
    """
    folder = Path(os.path.realpath(document)).parent
    shared = find_shared_folders()
    if (marked := find_marked_folder(folder, shared)) is not None:
        return marked
    around = folder.parent
    return str(folder if str(around) in shared else around)


UNNAMED_TABLE = "a table 'UNKNOWN' of OpenSim"
"""Type of a table without a name, as RRA and CMC write their states."""


def _can_replace(present: str | None, new: str | None) -> bool:
    """Return whether a new text of one type may replace a result of another type."""
    if present is None or new is None:
        return False
    is_table = present == UNNAMED_TABLE and new.startswith("a table '")
    return present == new or is_table
