"""Files that nobody but the user can have written.

Compiled kernels are executed: users who can change such a file could execute anything.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

from osimlite.errors import OsimliteError


def read_private(path: Path) -> bytes | None:
    """Return the content of a file that only the user can have written.

    Args:
        path: the file.

    Returns:
        The content; None if the file does not exist, or if others could have written it.
    """
    folder = Path(os.path.realpath(path.parent))
    if find_other_writers(folder) is not None:
        return None
    # No links, and no waiting for a pipe. Windows lacks the first two flags and needs the third.
    flags = os.O_RDONLY | sum(
        getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY")
    )
    try:
        with open(os.open(folder / path.name, flags), "rb") as stream:
            # The open file is examined, not its name, which another program could replace meanwhile.
            info = os.fstat(stream.fileno())
            return (
                stream.read()
                if stat.S_ISREG(info.st_mode) and _describe_other_writers(info) is None
                else None
            )
    except OSError:
        return None


def write_private(path: Path, content: bytes) -> None:
    """Write a file that only the user can read and change, completely or not at all.

    Args:
        path: the file; its folder is made if necessary.
        content: the content.

    Raises:
        OsimliteError: the file cannot be written, or others can write to the folder or replace it.
    """
    folder = Path(os.path.realpath(path.parent))
    try:
        for ancestor in (*reversed(folder.parents), folder):
            if not ancestor.exists():
                ancestor.mkdir(mode=0o700, exist_ok=True)
        if (why := find_other_writers(folder)) is not None:
            raise OsimliteError(why)
        handle, name = tempfile.mkstemp(dir=folder)
        try:
            with open(handle, "wb") as stream:
                stream.write(content)
            os.replace(name, folder / path.name)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(folder)) from None


def find_other_writers(folder: Path) -> str | None:
    """Find out whether others than the user and the administrator can put files into a folder.

    Args:
        folder: an absolute path without links.

    Returns:
        The reason why they can; None if they cannot.
    """
    for ancestor in (folder, *folder.parents):
        try:
            info = ancestor.lstat()
        except OSError as error:
            return f"'{ancestor}' cannot be examined: {error.strerror}"
        # In a sticky folder such as /tmp anyone can create files, but can move or replace only
        # their own.
        is_passage = ancestor != folder and info.st_mode & stat.S_ISVTX
        if (why := _describe_other_writers(info, is_passage=bool(is_passage))) is not None:
            return f"'{ancestor}' {why}"
    return None


def _describe_other_writers(info: os.stat_result, *, is_passage: bool = False) -> str | None:
    """Return why others can write to a file or folder.

    Args:
        info: status of the file or folder.
        is_passage: whether it is a sticky folder on the way to the file.

    Returns:
        The end of a sentence; None if they cannot.
    """
    if sys.platform == "win32":
        # Windows protects the user's folders by access lists, which these bits do not show.
        return None
    if info.st_uid not in (0, os.geteuid()):
        return "belongs to another user"
    if info.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not is_passage:
        return "can be written by others (run chmod go-w)"
    return None
