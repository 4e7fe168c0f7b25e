"""Names of files and folders; reading and writing them under the names that most modules use."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import BinaryIO

from osimlite.base.project import LARGEST_FILE, largest_file
from osimlite.base.reading import no_such as no_such
from osimlite.base.reading import open_file as open_file
from osimlite.base.reading import read_at_most as read_at_most
from osimlite.base.writing import WriteRefusedError as WriteRefusedError
from osimlite.base.writing import expect_folder_of as expect_folder_of
from osimlite.base.writing import folder_to_fill as folder_to_fill
from osimlite.base.writing import make_folder as make_folder
from osimlite.base.writing import put_in_place as put_in_place
from osimlite.base.writing import write_atomically as write_atomically
from osimlite.base.writing import written_atomically as written_atomically
from osimlite.errors import MissingFileError, SpecialFileError

GEOMETRY_VARIABLE = "OSIMLITE_GEOMETRY"
"""Environment variable with folders to look for mesh files in, besides OpenSim's own places, separated as in PATH."""

NAMED_SO = f"in the environment variable {GEOMETRY_VARIABLE}, or with --geometry"
"""How people name such a folder, for messages."""


def named_mesh_folders() -> tuple[Path, ...]:
    """The folders that the environment names."""
    return tuple(
        Path(name) for name in os.environ.get(GEOMETRY_VARIABLE, "").split(os.pathsep) if name
    )


TABLES = (".sto", ".mot", ".trc")
"""How tables over time are called."""

unsaved: dict[str, bytes] = {}
"""What is read in place of files: their texts in an editor, not written yet, by real path."""


def read_file(path: str | Path) -> bytes:
    """What is in an ordinary file.

    Raises:
        SpecialFileError: it is none, or larger than the settings of its folder allow.
        MissingFileError: it is not there or may not be read.
    """
    if unsaved and (held := unsaved.get(os.path.realpath(path))) is not None:
        return held
    with open_file(path) as stream:
        try:
            return _content(stream, os.fstat(stream.fileno()).st_size, path)
        except OSError as error:
            raise MissingFileError(
                f"cannot read the file: {error.strerror}", file=str(path)
            ) from None


def stamped(path: str | Path) -> int | None:
    """What is another number of another file, and when its content has changed; None if there is no such file."""
    if unsaved and (held := unsaved.get(os.path.realpath(path))) is not None:
        return hash(held)
    try:
        result = os.stat(path)
    except (OSError, ValueError):
        return None
    # Whoever puts another file in the place of one may keep the time of its last change.
    return hash(
        (result.st_mtime_ns, result.st_ctime_ns, result.st_size, result.st_ino, result.st_dev)
    )


def read_standard_input() -> bytes:
    """What comes from standard input; SpecialFileError if that is more than the settings of this folder allow."""
    return _content(sys.stdin.buffer, 0, "<stdin>")


def _content(stream: BinaryIO, size: int, path: str | Path) -> bytes:
    """What is in a stream, which may be more than its `size` says."""
    expect_size(size, path)
    content = stream.read(size + 1) or b""
    while len(content) > size:
        size = expect_size(len(content), path)
        content += stream.read(size + 1 - len(content)) or b""
    return content


def expect_size(size: int, path: str | Path) -> int:
    """The most bytes that are read of a file; SpecialFileError if it has more."""
    limit = LARGEST_FILE if size <= LARGEST_FILE else largest_file(Path(path).absolute().parent)
    if size > limit:
        raise SpecialFileError(
            f"cannot read the file: there are more than {limit / 1e6:g} MB in it; allow them by 'largest-file' in "
            "osimlite.toml or in [tool.osimlite] of pyproject.toml",
            file=str(path),
        )
    return limit


def from_folder(path: str | Path, folder: str | Path) -> str:
    """A path as it leads there from a folder, with slashes; the whole path from another drive of Windows."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(path).absolute().as_posix()
