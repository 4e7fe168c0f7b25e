"""Opening of files for reading: regular files only, never a pipe, a socket or a device.

A file that a user or a document names is opened through :func:`open_file` or through what is built
on it, :func:`osimlite.base.files.read_file`. A pipe may never begin and a device may never
end, so that a name in a stranger's document could stop the program or fill the memory.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from osimlite.errors import MissingFileError, MissingFolderError, SpecialFileError

_SPECIAL = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def open_file(path: str | Path) -> BinaryIO:
    """Open an ordinary file for reading.

    Raises:
        SpecialFileError: it is a pipe, a device or the like, which may never end or never begin.
        MissingFileError: it is not there or may not be read.
    """
    try:
        # Opening a device may already do something; and what was there may be another thing a
        # moment later.
        _expect_ordinary(os.stat(path).st_mode, path)
        return open(path, "rb", opener=_open_nonblocking)
    except (OSError, ValueError) as error:
        if isinstance(error, FileNotFoundError):
            raise no_such(path) from None
        reason = getattr(error, "strerror", None) or error
        raise MissingFileError(f"cannot read the file: {reason}", file=str(path)) from None


def no_such(path: str | Path, *, may_be_folder: bool = False) -> MissingFileError:
    """The error that nothing is there: no folder, if the path ends as those do, else no file."""
    written = str(path)
    if written.endswith(("/", os.sep)) or (may_be_folder and not os.path.splitext(written)[1]):
        return MissingFolderError("there is no such folder", file=written)
    return MissingFileError("cannot read the file: no such file", file=written)


def read_at_most(path: str | Path, limit: int) -> bytes:
    """Return the first `limit` bytes of a regular file, or all of it if it is shorter.

    Raises:
        SpecialFileError: it is a pipe, a device or the like.
        MissingFileError: it does not exist or may not be read.
    """
    with open_file(path) as stream:
        try:
            return stream.read(limit)
        except OSError as error:
            raise MissingFileError(
                f"cannot read the file: {error.strerror}", file=str(path)
            ) from None


def _open_nonblocking(path: str, flags: int) -> int:
    """Open a file, and refuse it without waiting if it has become a pipe since it was checked."""
    handle = os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
    try:
        _expect_ordinary(os.fstat(handle).st_mode, path)
    except BaseException:
        os.close(handle)
        raise
    return handle


def _expect_ordinary(mode: int, path: str | Path) -> None:
    if stat.S_ISDIR(mode):
        raise MissingFileError(
            "cannot read the file: this is a folder; name a model file in it", file=str(path)
        )
    if not stat.S_ISREG(mode):
        kind = _SPECIAL.get(stat.S_IFMT(mode), "something else")
        raise SpecialFileError(
            f"cannot read the file: this is {kind}, and only files are read", file=str(path)
        )
