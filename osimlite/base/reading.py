"""Opening of regular files for reading; pipes, sockets and devices are refused.

Files that a user or a document names are opened through :func:`open_file`, on which
:func:`osimlite.base.files.read_file` builds. Without this check, the name of a pipe or of a device in
an untrusted document could block the program or fill the memory.
"""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from typing import BinaryIO

from osimlite.base.patterns import compile_later
from osimlite.errors import MissingFileError, MissingFolderError, SpecialFileError

_SPECIAL = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def open_file(path: str | Path) -> BinaryIO:
    """Open a regular file for reading.

    Returns:
        The stream of bytes.

    Raises:
        SpecialFileError: the path is a pipe, a device or a similar file.
        MissingFileError: the file does not exist or is not readable.
    """  # noqa: DOC501 - a function makes the error, which is named
    try:
        # Check before opening, because opening a device can have effects, and after it, because
        # the file can have been replaced meanwhile.
        _expect_regular(os.stat(path).st_mode, path)
        return open(path, "rb", opener=_open_nonblocking)
    except (OSError, ValueError) as error:
        if isinstance(error, FileNotFoundError):
            raise make_missing_error(path) from None
        reason = getattr(error, "strerror", None) or error
        raise MissingFileError(f"cannot read the file: {reason}", file=str(path)) from None


def make_missing_error(path: str | Path, *, may_be_folder: bool = False) -> MissingFileError:
    """Return the error for a missing path, by the end of its name: a folder, a file, or either.

    Args:
        path: path that does not exist.
        may_be_folder: whether a path without suffix can mean a folder.
    """
    path_text = str(path)
    if path_text.endswith(("/", os.sep)):
        return MissingFolderError("the folder does not exist; check its name", file=path_text)
    if may_be_folder and not os.path.splitext(path_text)[1]:
        return MissingFolderError("no such file or folder; check its name", file=path_text)
    return MissingFileError("cannot read the file: no such file", file=path_text)


def read_at_most(path: str | Path, limit: int) -> bytes:
    """Return the first `limit` bytes of a regular file, or all of it if it is shorter.

    Args:
        path: path of the file.
        limit: number of bytes.

    Raises:
        SpecialFileError: the path is a pipe, a device or a similar file.
        MissingFileError: the file does not exist or is not readable.
    """
    with open_file(path) as stream:
        try:
            return stream.read(limit)
        except OSError as error:
            raise MissingFileError(
                f"cannot read the file: {error.strerror}", file=str(path)
            ) from None


def _open_nonblocking(path: str, flags: int) -> int:
    """Open a file without waiting; refuse it if it has become a pipe since it was checked.

    Returns:
        The file descriptor.
    """
    handle = os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
    try:
        _expect_regular(os.fstat(handle).st_mode, path)
    except BaseException:
        os.close(handle)
        raise
    return handle


def _expect_regular(mode: int, path: str | Path) -> None:
    """Raise an error unless a mode is that of a regular file.

    Args:
        mode: mode of the path, from `os.stat`.
        path: path of the file, for messages.

    Raises:
        MissingFileError: the mode is that of a folder.
        SpecialFileError: the mode is that of a pipe, a device or a similar file.
    """
    if stat.S_ISDIR(mode):
        raise MissingFileError(
            "cannot read the file: this is a folder; name a model file in it", file=str(path)
        )
    if not stat.S_ISREG(mode):
        kind = _SPECIAL.get(stat.S_IFMT(mode), "something else")
        raise SpecialFileError(
            f"cannot read the file: this is {kind}; only regular files are read", file=str(path)
        )


def describe_content(beginning: bytes) -> str | None:
    """Return the type of a text in words by its beginning; None if it is no result of a tool.

    Args:
        beginning: first bytes of a file, with the head of a table or the first element of a
            document.
    """
    if b"\0" in beginning:
        return None
    text = beginning.decode("utf-8", "replace").lstrip("\ufeff")
    if document := _DOCUMENT.match(text):
        return f"an OpenSim document with <{document[1]}>"
    first_line = text.partition("\n")[0]
    if first_line.startswith("PathFileType"):
        return "a table of markers"
    header, end_mark, _ = text.partition("endheader")
    if end_mark and re.search(
        r"^(version|nRows|datarows|DataType) *=", header, re.MULTILINE | re.IGNORECASE
    ):
        name = "" if "=" in first_line else first_line.strip()
        return f"a table '{name}' of OpenSim"
    if _RESIDUALS.match(text):
        return "a list of residuals"
    return None


_DOCUMENT = compile_later(
    r"\s*(?:<\?[^>]*>\s*|<!--(?:[^-]|-(?!->))*-->\s*)*<OpenSimDocument\b[^>]*>\s*"
    r"(?:<!--(?:[^-]|-(?!->))*-->\s*)*<(\w+)"
)
_RESIDUALS = compile_later(r"Average Residuals:\s")
