"""Finding model files, and writing files so that they appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from osimlite.errors import MissingFileError, OsimliteError


def model_files(paths: Iterable[Path]) -> list[Path]:
    """The files named, and every ``.osim`` file below the folders named, sorted within each folder.

    Raises:
        MissingFileError: a path is not there.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found.extend(sorted(file for file in path.rglob("*.osim") if file.is_file()))
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
    target = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    except OSError as error:
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(target)) from None
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
        Path(name).chmod(mode)
        Path(name).replace(target)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise OsimliteError(f"cannot write the file: {error.strerror}", file=str(target)) from None
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
