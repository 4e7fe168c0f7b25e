"""Finding and reading files, and writing them so that they appear whole or not at all."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from osimlite.errors import MissingFileError, MissingFolderError, OsimliteError, SpecialFileError
from osimlite.project import LARGEST_FILE, largest_file

GEOMETRY_VARIABLE = "OSIMLITE_GEOMETRY"
"""Environment variable with folders to look for mesh files in, besides OpenSim's own places, separated as in PATH."""

NAMED_SO = f"in the environment variable {GEOMETRY_VARIABLE}, or with --geometry"
"""How people name such a folder, for messages."""


def named_mesh_folders() -> tuple[Path, ...]:
    """The folders that the environment names."""
    return tuple(Path(name) for name in os.environ.get(GEOMETRY_VARIABLE, "").split(os.pathsep) if name)


TABLES = (".sto", ".mot", ".trc")
"""How tables over time are called."""

unsaved: dict[str, bytes] = {}
"""What is read in place of files: their texts in an editor, not written yet, by real path."""

_SPECIAL = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}


def open_file(path: str | Path) -> BinaryIO:
    """Open an ordinary file for reading.

    Raises:
        SpecialFileError: it is a pipe, a device or the like, which may never end or never begin.
        MissingFileError: it is not there or may not be read.
    """
    try:
        # Opening a device may already do something; and what was there may be another thing a moment later.
        _expect_ordinary(os.stat(path).st_mode, path)
        return open(path, "rb", opener=_without_waiting)
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
            raise MissingFileError(f"cannot read the file: {error.strerror}", file=str(path)) from None


def stamped(path: str | Path) -> int | None:
    """What is another number of another file, and when its content has changed; None if there is no such file."""
    if unsaved and (held := unsaved.get(os.path.realpath(path))) is not None:
        return hash(held)
    try:
        result = os.stat(path)
    except (OSError, ValueError):
        return None
    # Whoever puts another file in the place of one may keep the time of its last change.
    return hash((result.st_mtime_ns, result.st_ctime_ns, result.st_size, result.st_ino, result.st_dev))


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


def expect_folder_of(path: str | Path) -> None:
    """Say before long work that a file cannot be written because its folder is not there.

    Raises:
        OsimliteError: it is not.
    """
    if not os.path.isdir(os.path.dirname(os.path.realpath(path))):
        raise _nowhere(path)


def _nowhere(path: str | Path) -> OsimliteError:
    return OsimliteError("cannot write here: the folder does not exist", file=str(path))


def write_atomically(path: str | Path, content: str | bytes) -> None:
    """Write a file beside its place and move it there.

    Raises:
        OsimliteError: the folder is missing or cannot be written to; nothing has changed then.
    """
    with written_atomically(path) as stream:
        stream.write(_encoded(content, path) if isinstance(content, str) else content)


def _encoded(content: str, path: str | Path) -> bytes:
    try:
        return content.encode()
    except UnicodeEncodeError as error:
        # Half of a character: JSON can hold it, UTF-8 cannot.
        odd = content[max(0, error.start - 20) : error.end]
        raise OsimliteError(f"cannot write the file: '{odd}' ends in half a character", file=str(path)) from None


@contextmanager
def written_atomically(path: str | Path) -> Iterator[BinaryIO]:
    """A stream whose content becomes a file when all is written; errors as those of :func:`write_atomically`.

    A file that was there keeps its owner, its mode and all of its names.
    """
    # A link stays a link to the file that is written; a pipe or a device takes the text as it is.
    target = Path(os.path.realpath(path))
    # Unlike those of Path, these take a name that is too long for one that is not there.
    is_there = os.path.exists(target)
    if is_there and not target.is_file():
        with _opened(target) as stream:
            yield stream
        return
    there = target.stat() if is_there else None
    # To those who may do everything the mode says it all the same.
    if there is not None and not (there.st_mode & 0o222 and os.access(target, os.W_OK)):
        raise OsimliteError("cannot write the file: it is read-only; make it writable first", file=str(target))
    try:
        from tempfile import mkstemp

        handle, name = mkstemp(dir=target.parent, prefix=".osimlite-")
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            raise _nowhere(target) from None
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(target)) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
        if there is None:
            Path(name).chmod(0o666 & ~_umask())
        replaces = (there is None or _made_like(name, target, there)) and _replaced(name, target)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise OsimliteError(f"cannot write the file: {error.strerror}", file=str(target)) from None
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    if not replaces:
        _copy_into(name, target)


def put_in_place(path: Path, target: Path) -> None:
    """Let a finished file take the place of another.

    Raises:
        OSError, OsimliteError: it cannot.
    """
    if not _replaced(path, target):
        _copy_into(path, target)


def from_folder(path: str | Path, folder: str | Path) -> str:
    """A path as it leads there from a folder, with slashes; the whole path from another drive of Windows."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(path).absolute().as_posix()


def make_folder(path: str | Path) -> Path:
    """Make a folder, and those above it, unless it is there.

    Raises:
        OsimliteError: it cannot be made; the message says why.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        file = next(
            (place for place in (folder, *folder.parents) if os.path.exists(place) and not place.is_dir()), None
        )
        reason = "this is a file, not a folder" if file is not None else error.strerror
        raise OsimliteError(f"cannot make a folder here: {reason}", file=str(file or folder)) from None
    return folder


@contextmanager
def folder_to_fill(path: str | Path) -> Iterator[Path]:
    """A folder for what takes a while to find, made before the work begins; gone again if that fails without a file.

    Raises:
        OsimliteError: it cannot be made or written to; the message says why.
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
def _opened(target: Path) -> Iterator[BinaryIO]:
    if target.is_dir():
        raise OsimliteError("cannot write the file: this is a folder; name a file in it", file=str(target))
    try:
        with target.open("wb") as stream:
            yield stream
    except OSError as error:
        raise OsimliteError(f"cannot write the file: {error.strerror}", file=str(target)) from None


def _made_like(name: str, target: Path, there: os.stat_result) -> bool:
    """Give a file what a system notes of another that it is to replace; whether all of it could be given."""
    if there.st_nlink > 1:
        return False
    try:
        made = os.stat(name)
        if (made.st_uid, made.st_gid) != (there.st_uid, there.st_gid):
            os.chown(name, there.st_uid, there.st_gid)
        os.chmod(name, stat.S_IMODE(there.st_mode))
        if sys.platform == "linux":
            for attribute in os.listxattr(target):
                os.setxattr(name, attribute, os.getxattr(target, attribute))
    except OSError:
        return False
    return True


def _replaced(name: str | Path, target: Path) -> bool:
    """Put a file in the place of another; False if that stays, as on Windows while a program has it open."""
    try:
        os.replace(name, target)
    except PermissionError:
        if not target.is_file():
            raise
        return False
    return True


def _copy_into(name: str | Path, target: Path) -> None:
    """Write what is in one file into another, which stays itself, and remove the first.

    Raises:
        OsimliteError: it cannot be written whole; the first file is kept then.
    """
    import shutil

    try:
        with open(name, "rb") as source, target.open("r+b") as stream:
            shutil.copyfileobj(source, stream)
            stream.truncate()
    except OSError as error:
        raise OsimliteError(
            f"cannot write the file: {error.strerror}; what was to be written is in {name}", file=str(target)
        ) from None
    os.unlink(name)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _without_waiting(path: str, flags: int) -> int:
    """Open a file; one that has become a pipe meanwhile is not waited for, and refused."""
    handle = os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
    try:
        _expect_ordinary(os.fstat(handle).st_mode, path)
    except BaseException:
        os.close(handle)
        raise
    return handle


def _expect_ordinary(mode: int, path: str | Path) -> None:
    if stat.S_ISDIR(mode):
        raise MissingFileError("cannot read the file: this is a folder; name a model file in it", file=str(path))
    if not stat.S_ISREG(mode):
        kind = _SPECIAL.get(stat.S_IFMT(mode), "something else")
        raise SpecialFileError(f"cannot read the file: this is {kind}, and only files are read", file=str(path))
