"""Finding model files, and writing files so that they appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from osimlite.errors import MissingFileError, OsimliteError

GEOMETRY_VARIABLE = "OSIMLITE_GEOMETRY"
"""Environment variable with folders to look for mesh files in, besides OpenSim's own places, separated as in PATH."""


def named_mesh_folders() -> tuple[Path, ...]:
    """The folders that the environment names."""
    return tuple(Path(name) for name in os.environ.get(GEOMETRY_VARIABLE, "").split(os.pathsep) if name)


def model_files(paths: Iterable[Path]) -> list[Path]:
    """The files named, and every ``.osim`` file below the folders named, sorted within each folder.

    Raises:
        MissingFileError: a path is not there.
        OsimliteError: a folder has no such file.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            below = sorted(file for file in path.rglob("*.osim") if file.is_file())
            if not below:
                raise OsimliteError("there is no .osim file in this folder", file=str(path))
            found.extend(below)
        elif path.exists():
            found.append(path)
        else:
            raise MissingFileError("cannot read the file: no such file or folder", file=str(path))
    return found


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
    """A stream whose content becomes a file when all is written; errors as those of :func:`write_atomically`."""
    # A link stays a link to the file that is written; a pipe or a device takes the text as it is.
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        with _opened(target) as stream:
            yield stream
        return
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(target)) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
        Path(name).chmod(mode)
        Path(name).replace(target)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise OsimliteError(f"cannot write the file: {error.strerror}", file=str(target)) from None
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def make_folder(path: str | Path) -> Path:
    """Make a folder, and those above it, unless it is there.

    Raises:
        OsimliteError: it cannot be made; the message says why.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        file = next((place for place in (folder, *folder.parents) if place.exists() and not place.is_dir()), None)
        reason = "this is a file, not a folder" if file is not None else error.strerror
        raise OsimliteError(f"cannot make a folder here: {reason}", file=str(file or folder)) from None
    return folder


@contextmanager
def folder_to_fill(path: str | Path) -> Iterator[Path]:
    """A folder for what takes a while to find, made before the work begins; gone again if that fails without a file.

    Raises:
        OsimliteError: it cannot be made or written to; the message says why.
    """
    is_new = not Path(path).exists()
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


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
