"""Reading of files and folders, and the functions for writing that most modules use."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import BinaryIO

from osimlite.base.project import DEFAULT_MAX_FILE_BYTES, get_max_file_size
from osimlite.base.reading import make_missing_error as make_missing_error
from osimlite.base.reading import open_file as open_file
from osimlite.base.reading import read_at_most as read_at_most
from osimlite.base.writing import WriteRefusedError as WriteRefusedError
from osimlite.base.writing import expect_folder_of as expect_folder_of
from osimlite.base.writing import make_folder as make_folder
from osimlite.base.writing import make_folder_of as make_folder_of
from osimlite.base.writing import open_atomically as open_atomically
from osimlite.base.writing import prepare_folder as prepare_folder
from osimlite.base.writing import replace_with as replace_with
from osimlite.base.writing import write_atomically as write_atomically
from osimlite.errors import MissingFileError, SpecialFileError

GEOMETRY_VARIABLE = "OSIMLITE_GEOMETRY"
"""Environment variable with folders in which mesh files are searched, separated as in PATH.

They are searched after the folders of OpenSim's search.
"""

MESH_FOLDER_HINT = f"in the environment variable {GEOMETRY_VARIABLE}, or with --geometry"
"""Sentence part of messages that says how users name a folder of meshes."""


def list_mesh_folders() -> tuple[Path, ...]:
    """Return the folders that `OSIMLITE_GEOMETRY` names.

    Returns:
        The folders in the order of the search.
    """
    return tuple(
        Path(name) for name in os.environ.get(GEOMETRY_VARIABLE, "").split(os.pathsep) if name
    )


TABLE_SUFFIXES = (".sto", ".mot", ".trc")
"""Suffixes of tables over time."""

unsaved: dict[str, bytes] = {}
"""Unsaved texts of files that are open in an editor, by real path; they are read instead."""


def read_file(path: str | Path) -> bytes:
    """Return the content of a regular file.

    Raises:
        SpecialFileError: the file is not regular, or larger than the settings of its folder allow.
        MissingFileError: the file does not exist or is not readable.
    """
    if unsaved and (text := unsaved.get(os.path.realpath(path))) is not None:
        return text
    with open_file(path) as stream:
        try:
            return _read_stream(stream, os.fstat(stream.fileno()).st_size, path)
        except OSError as error:
            raise MissingFileError(
                f"cannot read the file: {error.strerror}", file=str(path)
            ) from None


def get_file_stamp(path: str | Path) -> int | None:
    """Return a number that changes with the content of a file; None if the file does not exist."""
    if unsaved and (text := unsaved.get(os.path.realpath(path))) is not None:
        return hash(text)
    try:
        result = os.stat(path)
    except (OSError, ValueError):
        return None
    # A program that replaces a file can keep its time of last change.
    return hash(
        (result.st_mtime_ns, result.st_ctime_ns, result.st_size, result.st_ino, result.st_dev)
    )


def read_standard_input() -> bytes:
    """Return the content of standard input.

    Raises:
        SpecialFileError: it is larger than the settings of the current folder allow.
    """
    return _read_stream(sys.stdin.buffer, 0, "<stdin>")


def _read_stream(stream: BinaryIO, size: int, path: str | Path) -> bytes:
    """Return the content of a stream, which can be longer than `size`."""
    expect_size(size, path)
    content = stream.read(size + 1) or b""
    while len(content) > size:
        size = expect_size(len(content), path)
        content += stream.read(size + 1 - len(content)) or b""
    return content


def expect_size(size: int, path: str | Path) -> int:
    """Return the largest number of bytes that are read of a file.

    Args:
        size: size of the file, bytes.
        path: path of the file.

    Raises:
        SpecialFileError: the file has more bytes.
    """
    limit = (
        DEFAULT_MAX_FILE_BYTES
        if size <= DEFAULT_MAX_FILE_BYTES
        else get_max_file_size(Path(path).absolute().parent)
    )
    if size > limit:
        raise SpecialFileError(
            f"cannot read the file: it is larger than {limit / 1e6:g} MB; allow it by 'largest-file' in "
            "osimlite.toml or in [tool.osimlite] of pyproject.toml",
            file=str(path),
        )
    return limit


def get_relative_path(path: str | Path, folder: str | Path) -> str:
    """Return a path relative to a folder, with slashes; on another Windows drive the absolute path.

    Args:
        path: path of a file or folder.
        folder: folder that the result starts from.
    """
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(path).absolute().as_posix()
