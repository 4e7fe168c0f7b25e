"""Python code that a user names: a file, or a module that can be imported from the current folder."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from osimlite.errors import MissingFileError, OsimliteError


def module_of_file(path: Path) -> ModuleType:
    """Run a Python file.

    Raises:
        MissingFileError: it is not there.
        OsimliteError: it fails; with the line.
    """
    if not path.is_file():
        raise MissingFileError("cannot read the file: no such file", file=str(path))
    # A name of our own, so that a model in json.py does not take the place of a module that others import.
    name = f"_osimlite_source_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.resolve().parent))
    sys.modules[name] = module
    try:
        with errors_placed(str(path)):
            spec.loader.exec_module(module)
    finally:
        sys.path.pop(0)
    return module


def module_named(name: str) -> ModuleType:
    """Import a module.

    Raises:
        OsimliteError: it cannot be imported.
    """
    # `python -m osimlite` finds modules in the current folder; so must the command of that name.
    if "" not in sys.path:
        sys.path.insert(0, "")
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise OsimliteError(f"cannot import '{name}': {error}") from None


@contextmanager
def errors_placed(file: str) -> Iterator[None]:
    """Tell of any error in the user's own code with the file and the line of it."""
    try:
        yield
    except OsimliteError as error:
        if error.file is None:
            error.file, error.line = file, _line_in(error, file)
        raise
    except Exception as error:
        raise OsimliteError(f"{type(error).__name__}: {error}", file=file, line=_line_in(error, file)) from error


def _line_in(error: BaseException, file: str) -> int | None:
    """The last line of `file` on the way to the error."""
    line = getattr(error, "lineno", None) if isinstance(error, SyntaxError) else None
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
