"""Files that nobody but the user can have written: who can change a file that is run can run what he likes."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

from osimlite.errors import OsimliteError


def read_private(path: Path) -> bytes | None:
    """What is in a file; None if there is none, or if anybody else could have put it there."""
    folder = Path(os.path.realpath(path.parent))
    if others_in(folder) is not None:
        return None
    flags = os.O_RDONLY | sum(
        getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY")
    )
    try:
        with open(os.open(folder / path.name, flags), "rb") as stream:
            info = os.fstat(stream.fileno())
            return stream.read() if stat.S_ISREG(info.st_mode) and _others(info) is None else None
    except OSError:
        return None


def write_private(path: Path, content: bytes) -> None:
    """Write a file that only the user can read and change, whole or not at all, and make its folder.

    Raises: OsimliteError: it cannot be written, or others can write in the folder or put another in
        its place.
    """
    folder = Path(os.path.realpath(path.parent))
    try:
        for place in (*reversed(folder.parents), folder):
            if not place.exists():
                place.mkdir(mode=0o700, exist_ok=True)
        if (why := others_in(folder)) is not None:
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


def others_in(folder: Path) -> str | None:
    """Why others than the user and the administrator can put files into a folder; None if they cannot.

    Args:
        folder: an absolute path without links.
    """
    for place in (folder, *folder.parents):
        try:
            info = place.lstat()
        except OSError as error:
            return f"'{place}' cannot be looked at: {error.strerror}"
        # In a folder such as /tmp everybody can make files, but move away or replace only his own.
        is_passage = place != folder and info.st_mode & stat.S_ISVTX
        if (why := _others(info, is_passage=bool(is_passage))) is not None:
            return f"'{place}' {why}"
    return None


def _others(info: os.stat_result, *, is_passage: bool = False) -> str | None:
    if sys.platform == "win32":
        # A user's folders there are closed to others by lists of their own, which these bits do not
        # tell.
        return None
    if info.st_uid not in (0, os.geteuid()):
        return "belongs to another user"
    if info.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not is_passage:
        return "can be written by others (chmod go-w mends that)"
    return None
