"""Atomic writing of all files that osimlite writes, and the checks before it.

What is allowed depends on who chose the path (SECURITY.md has the rule for users):

- :func:`write_atomically`: the user named the file or its folder. A link is followed only if it
  stays in its project, or without one in its folder; a pipe with a reader or a device receives the
  text.
- :func:`write_into`: the program chose the name. Never through a link, and never into anything but
  a regular file.
- :class:`~osimlite.base.result_writing.ResultWriter`: a document names the file. As
  :func:`write_into`, and only in the trees of the project and the current folder, under no hidden
  name, and only over a result of the same type.
- :func:`write_cached`: nobody named the file. A cache is in the user's cache folder, which no
  project can fill with links.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from osimlite.base.pruning import MARKER, is_due, prune_cache
from osimlite.errors import OsimliteError

_PROJECT_MARKS = (".git", "osimlite.toml", "pyproject.toml")
"""Names whose presence marks the top folder of a project."""


class WriteRefusedError(OsimliteError):
    """Error for an output file of a document that needs the user's permission."""


def expect_folder_of(path: str | Path) -> None:
    """Check before long work that the folder of an output file exists or can be made.

    Raises:
        OsimliteError: a file has the name of a folder above the output file, or the folder in which
            folders would be made is read-only.
    """
    folder = os.path.dirname(os.path.realpath(path))
    while not os.path.exists(folder):
        folder = os.path.dirname(folder)
    if not os.path.isdir(folder):
        raise OsimliteError(
            "cannot make a folder here: this is a file, not a folder", file=str(folder)
        )
    if not os.access(folder, os.W_OK):
        raise OsimliteError("cannot write here: permission denied", file=str(folder))


def make_folder_of(path: str | Path) -> None:
    """Make the folder of an output file that the user named, unless it exists.

    Raises:
        OsimliteError: the folder cannot be made; the message says why.
    """
    make_folder(os.path.dirname(os.path.realpath(path)))


def _make_folder_error(path: str | Path) -> OsimliteError:
    """Return the error for an output folder that does not exist."""
    return OsimliteError("cannot write here: the folder does not exist", file=str(path))


def write_atomically(path: str | Path, content: str | bytes) -> None:
    """Write a file under a temporary name, then rename it.

    Args:
        path: file to write.
        content: content of the file; text is encoded as UTF-8.

    Raises:
        OsimliteError: the folder is missing or cannot be written to; nothing has changed then.
    """
    with open_atomically(path) as stream:
        stream.write(encode_text(content, path) if isinstance(content, str) else content)


def encode_text(content: str, path: str | Path) -> bytes:
    """Return a text in UTF-8.

    Args:
        content: text of the file.
        path: path of the file, for messages.

    Raises:
        OsimliteError: the text has a lone surrogate, which UTF-8 cannot express.
    """
    try:
        return content.encode()
    except UnicodeEncodeError as error:
        # A lone surrogate, which JSON can contain and UTF-8 cannot.
        excerpt = content[max(0, error.start - 20) : error.end]
        raise OsimliteError(
            f"cannot write the file: '{excerpt}' ends in half a character", file=str(path)
        ) from None


@contextmanager
def open_atomically(path: str | Path) -> Iterator[BinaryIO]:
    """Yield a stream whose content becomes the file that the user named when the context ends.

    An existing file keeps its owner, its mode and its hard links. A symbolic link stays a link to
    the written file. A pipe or a device receives the text directly.

    Raises:
        OsimliteError: the folder is missing or cannot be written to, or the path is a link that
            leads out of its project; nothing has changed then.
    """
    target = Path(os.path.realpath(path))
    # Unlike those of Path, these functions accept names that are too long for a file.
    exists = os.path.exists(target)
    if exists and not target.is_file():
        with _open_special(target) as stream:
            yield stream
        return
    _expect_link_inside(path, target)
    with _open_temporary(target, target.stat() if exists else None) as stream:
        yield stream


@contextmanager
def open_into(folder: str | Path, name: str) -> Iterator[BinaryIO]:
    """Yield a stream whose content becomes a file in a folder, under a name that the program chose.

    The new file replaces a regular file or a link; the target of the link stays unchanged.

    Args:
        folder: existing folder.
        name: name of the file.

    Raises:
        OsimliteError: the folder is missing or cannot be written to, or something else than a
            regular file has the name; nothing has changed then.
    """
    target = Path(os.path.realpath(folder)) / name
    expect_regular_or_none(target)
    target_stat = target.lstat() if os.path.isfile(target) and not target.is_symlink() else None
    with _open_temporary(target, target_stat, in_place=False) as stream:
        yield stream


def write_into(folder: str | Path, name: str, content: str | bytes) -> Path:
    """Write a file in a folder under a name that the program chose, and return its path.

    Args:
        folder: existing folder.
        name: name of the file.
        content: content of the file; text is encoded as UTF-8.

    Returns:
        Path of the file.

    Raises:
        OsimliteError: the file cannot be written, see :func:`open_into`.
    """
    path = Path(folder) / name
    with open_into(folder, name) as stream:
        stream.write(encode_text(content, path) if isinstance(content, str) else content)
    return path


def user_cache_folder() -> Path | None:
    """Return the folder of osimlite where programs of this user keep their caches; None without a home."""
    try:
        home = Path.home()
    except RuntimeError:
        # The system knows no home of this user, as in some containers.
        home = None
    # By its specification a relative path is invalid; it would lead into a stranger's folder.
    variable = "LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME"
    named = os.environ.get(variable, "")
    if os.path.isabs(named) and sys.platform != "darwin":
        folder = Path(named, "osimlite")
    elif home is None:
        return None
    elif sys.platform == "darwin":
        return home / "Library" / "Caches" / "osimlite"
    else:
        folder = home / ("" if sys.platform == "win32" else ".cache") / "osimlite"
    return folder / "cache" if sys.platform == "win32" else folder


def write_cached(path: Path, content: str | bytes) -> None:
    """Write an entry of a cache, and make its folder; the entry is left out if that is not possible.

    Once a day entries that were not used for long are removed first.

    Args:
        path: path of the entry.
        content: content of the entry; text is encoded as UTF-8.
    """
    with suppress(OSError, OsimliteError):
        path.parent.mkdir(parents=True, exist_ok=True)
        folder = user_cache_folder()
        if folder is not None and folder in path.parents:
            _prune_daily(folder)
        write_into(path.parent, path.name, content)


def _prune_daily(folder: Path) -> None:
    """Remove old entries of the user's cache, unless this was done in the last day."""
    now = time.time()
    if is_due(folder, now):
        # The mark comes first: processes that start meanwhile need not do the same.
        write_into(folder, MARKER, "")
        prune_cache(folder, now)


def open_to_append(path: Path) -> BinaryIO:
    """Open a regular file for appending, or make it; a link or a pipe under its name is refused.

    Returns:
        The stream of bytes.

    Raises:
        OSError: it cannot be opened.
        OsimliteError: something else than a regular file has the name.
    """
    expect_regular_or_none(path, links=False)
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT
    flags |= sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    return open(os.open(path, flags, 0o666), "ab")


def expect_folder_inside(folder: Path) -> None:
    """Raise an error if a folder whose name the program chose is a link out of the current folder.

    Raises:
        OsimliteError: it is such a link.
    """
    if os.path.islink(folder) and not is_inside(os.path.realpath(folder), [os.getcwd()]):
        raise OsimliteError(
            f"the results would go through this link to '{os.path.realpath(folder)}', out of the "
            "current folder; name a folder with -o",
            file=str(folder),
        )


def _list_ancestors(folder: str | Path) -> tuple[Path, ...]:
    """Return a folder and all folders above it."""
    path = Path(folder)
    return (path, *path.parents)


def find_shared_folders() -> set[str]:
    """Return the folders that hold more than one project: home, the temporary one, and those above."""
    import tempfile

    folders = [os.path.expanduser("~"), tempfile.gettempdir(), os.sep]
    return {
        str(ancestor)
        for folder in folders
        for ancestor in _list_ancestors(os.path.realpath(folder))
    }


def find_marked_folder(folder: Path, shared_folders: set[str]) -> str | None:
    """Return the nearest of a folder and those above it that is marked as the top of a project.

    Args:
        folder: absolute path of the folder where the search begins.
        shared_folders: folders above projects, such as the home folder, where the search ends: a
            mark there does not make one project of all that is below.

    Returns:
        Path of the project; None without a mark.
    """
    for ancestor in _list_ancestors(folder):
        if str(ancestor) in shared_folders:
            return None
        if any((ancestor / mark).exists() for mark in _PROJECT_MARKS):
            return str(ancestor)
    return None


def is_inside(path: str | Path, folders: Iterable[str | Path]) -> bool:
    """Return whether a real path is in the tree of one of some folders."""
    return any(Path(path).is_relative_to(os.path.realpath(folder)) for folder in folders)


def _expect_link_inside(path: str | Path, target: Path) -> None:
    """Refuse a link that leads out of its project, or without a project out of its folder.

    Args:
        path: path that the user named.
        target: path with all links resolved.

    Raises:
        WriteRefusedError: the path is a link that leads out of its project, or without a project
            out of its folder.
    """
    if not os.path.islink(path) or os.path.abspath(path).startswith(("/dev/", "/proc/")):
        return
    folder = Path(os.path.realpath(os.path.dirname(os.path.abspath(path))))
    if not is_inside(target, [find_marked_folder(folder, find_shared_folders()) or folder]):
        raise WriteRefusedError(
            f"this is a link to '{target}', out of its project, and is not followed; name that file itself",
            file=str(path),
        )


def expect_regular_or_none(path: Path, *, links: bool = True) -> None:
    """Refuse a path under which there is a folder, a pipe, a device or, unless allowed, a link.

    Args:
        path: path of the file to write.
        links: whether a symbolic link is allowed.

    Raises:
        OsimliteError: there is a folder, a pipe, a device or a forbidden link.
    """
    try:
        mode = path.lstat().st_mode
    except OSError:
        return
    if stat.S_ISREG(mode) or (links and stat.S_ISLNK(mode)):
        return
    kind = (
        "a folder"
        if stat.S_ISDIR(mode)
        else "a link"
        if stat.S_ISLNK(mode)
        else "a pipe or a device"
    )
    raise OsimliteError(f"cannot write the file: this is {kind}; remove it first", file=str(path))


@contextmanager
def _open_temporary(
    target: Path, target_stat: os.stat_result | None, *, in_place: bool = True
) -> Iterator[BinaryIO]:
    """Yield a stream to a temporary file that replaces the target when the context ends.

    Args:
        target: path of the file.
        target_stat: status of the present file; None without one or if it may be replaced anyway.
        in_place: whether a file with several hard links, or whose owner cannot be copied, is
            overwritten instead of replaced.

    Raises:
        OsimliteError: the target is read-only, its folder does not exist, or the file cannot be
            written.
    """  # noqa: DOC501 - a function makes the error, which is named
    # The mode counts too, because root may write read-only files.
    if target_stat is not None and not (target_stat.st_mode & 0o222 and os.access(target, os.W_OK)):
        raise OsimliteError(
            "cannot write the file: it is read-only; make it writable first", file=str(target)
        )
    try:
        from tempfile import mkstemp

        handle, name = mkstemp(dir=target.parent, prefix=".osimlite-")
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            raise _make_folder_error(target) from None
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(target)) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
        if target_stat is None:
            Path(name).chmod(0o666 & ~_get_umask())
        has_same_attributes = target_stat is None or _copy_attributes(name, target, target_stat)
        if not has_same_attributes and not in_place and target_stat is not None:
            os.chmod(name, stat.S_IMODE(target_stat.st_mode))
            has_same_attributes = True
        replaces = has_same_attributes and _replace_file(name, target)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise OsimliteError(f"cannot write the file: {error.strerror}", file=str(target)) from None
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    if not replaces:
        _copy_into(name, target)


def replace_with(path: Path, target: Path) -> None:
    """Replace a file by another one.

    Args:
        path: new file, which is moved to `target`.
        target: file to replace.

    Raises:
        OSError, OsimliteError: the file cannot be replaced.
    """
    if not _replace_file(path, target):
        _copy_into(path, target)


def make_folder(path: str | Path) -> Path:
    """Make a folder and those above it unless they exist, and return its path.

    Returns:
        Path of the folder.

    Raises:
        OsimliteError: the folder cannot be made; the message says why.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        file = next(
            (
                ancestor
                for ancestor in (folder, *folder.parents)
                if os.path.exists(ancestor) and not ancestor.is_dir()
            ),
            None,
        )
        reason = "this is a file, not a folder" if file is not None else error.strerror
        raise OsimliteError(
            f"cannot make a folder here: {reason}", file=str(file or folder)
        ) from None
    return folder


@contextmanager
def prepare_folder(path: str | Path) -> Iterator[Path]:
    """Make a folder before long work begins, and remove it if the work fails without a file.

    Args:
        path: folder to make, if it does not exist.

    Yields:
        Path of the folder.

    Raises:
        OsimliteError: the folder cannot be made or written to; the message says why.
    """
    is_new = not os.path.exists(path)
    folder = make_folder(path)
    if not os.access(folder, os.W_OK):
        raise OsimliteError("cannot write here: permission denied", file=str(folder))
    try:
        yield folder
    except BaseException:
        if is_new:
            with suppress(OSError):
                folder.rmdir()
        raise


@contextmanager
def _open_special(target: Path) -> Iterator[BinaryIO]:
    """Yield a stream into a pipe or a device, without waiting for a reader of the pipe.

    Raises:
        OsimliteError: the target is a folder, no program reads from the pipe, or the device cannot
            be written to.
    """
    if target.is_dir():
        raise OsimliteError(
            "cannot write the file: this is a folder; name a file in it", file=str(target)
        )
    try:
        handle = os.open(target, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
        os.set_blocking(handle, True)
        with open(handle, "wb") as stream:
            yield stream
    except OSError as error:
        reason = "no program reads from this pipe" if error.errno == errno.ENXIO else error.strerror
        raise OsimliteError(f"cannot write the file: {reason}", file=str(target)) from None


def _copy_attributes(name: str, target: Path, target_stat: os.stat_result) -> bool:
    """Copy owner, mode and extended attributes to a new file.

    Returns:
        Whether all could be copied; no file with several hard links counts as copied.
    """
    if target_stat.st_nlink > 1:
        return False
    try:
        new_stat = os.stat(name)
        if (new_stat.st_uid, new_stat.st_gid) != (target_stat.st_uid, target_stat.st_gid):
            os.chown(name, target_stat.st_uid, target_stat.st_gid)
        os.chmod(name, stat.S_IMODE(target_stat.st_mode))
        if sys.platform == "linux":
            for attribute in os.listxattr(target):
                os.setxattr(name, attribute, os.getxattr(target, attribute))
    except OSError:
        return False
    return True


def _replace_file(name: str | Path, target: Path) -> bool:
    """Replace a file; return False if the old one stays, as on Windows while a program has it open.

    Returns:
        Whether the file was replaced.

    Raises:
        PermissionError: the file may not be renamed, and the target is not an existing file.
    """
    try:
        os.replace(name, target)
    except PermissionError:
        if not target.is_file():
            raise
        return False
    return True


def _copy_into(name: str | Path, target: Path) -> None:
    """Copy the content of one file into another, and remove the first.

    Raises:
        OsimliteError: the copy is incomplete; the first file stays then.
    """
    import shutil

    try:
        with open(name, "rb") as source, target.open("r+b") as stream:
            shutil.copyfileobj(source, stream)
            stream.truncate()
    except OSError as error:
        raise OsimliteError(
            f"cannot write the file: {error.strerror}; the new content is in {name}",
            file=str(target),
        ) from None
    os.unlink(name)


def _get_umask() -> int:
    """Return the umask of this process."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
