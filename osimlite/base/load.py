"""Import of Python files and modules that a user names.

Python caches compiled code in ``__pycache__`` and recognizes a new version of a file by time (s) and
size: a model that is built again within a second with another digit would be the old one. Files in
the folders of users are therefore compiled each time, and nothing is written there.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

from osimlite.base.files import make_missing_error
from osimlite.errors import OsimliteError


def run_python_file(path: Path) -> ModuleType:
    """Run a Python file and return it as a module.

    Returns:
        The module, which is also in ``sys.modules`` under a private name.

    Raises:
        MissingFileError: the file does not exist.
        OsimliteError: the code raises an error; with the line.
    """  # noqa: DOC501 - a function makes the error, which is named
    if not path.is_file():
        raise make_missing_error(path)
    # A private name, so that a model in json.py does not replace the module json.
    name = f"_osimlite_source_{path.stem}"
    location = str(path.absolute())
    spec = importlib.util.spec_from_file_location(name, location, loader=_Loader(name, location))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    _register_user_folder(str(path.resolve().parent))
    sys.modules[name] = module
    with allow_local_imports(location), locate_errors(location):
        spec.loader.exec_module(module)
    return module


def make_module_name(name: str) -> str:
    """Return a class name in snake case: PathSpring is path_spring, IMUPlacer is imu_placer."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def import_user_module(name: str) -> ModuleType:
    """Import a module that a user names, also from the current folder.

    Returns:
        Imported module.

    Raises:
        OsimliteError: the module cannot be imported.
    """
    # `python -m osimlite` finds modules in the current folder; the command osimlite must too.
    if "" not in sys.path:
        sys.path.insert(0, "")
    _register_user_folder(os.getcwd())
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise OsimliteError(f"cannot import '{name}': {error}") from None


@contextmanager
def allow_local_imports(file: str) -> Iterator[None]:
    """Let the code of a user's file import modules of the same folder."""
    folder = str(Path(file).resolve().parent)
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        with suppress(ValueError):
            sys.path.remove(folder)


class _Loader(SourceFileLoader):
    """Loader that compiles a file without any cache."""

    def get_code(self, fullname: str) -> CodeType:
        """Return the code of the present file."""
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


class _Finder:
    """Finder of modules that loads those in users' folders without a cache."""

    def __init__(self) -> None:
        self.folders: set[str] = set()

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the specification of a module; None leaves the module to Python's finders."""
        parent = getattr(sys.modules.get(name.rpartition(".")[0]), "__spec__", None)
        if type(getattr(parent, "loader", None)) is SourceFileLoader:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if (
            spec is not None
            and type(spec.loader) is SourceFileLoader
            and self.is_users(spec.loader.path)
        ):
            spec.loader = _Loader(name, spec.loader.path)
        return spec

    def is_users(self, file: str) -> bool:
        """Return whether a file is a user's; packages installed in a user's folder, as in .venv, are not."""
        folders = {*self.folders, *map(os.path.abspath, sys.path)}
        parents = [folder for folder in folders if file.startswith(os.path.join(folder, ""))]
        return max(parents, key=len, default="") in self.folders


_FINDER = _Finder()


def _register_user_folder(folder: str) -> None:
    """Add a folder to those of users, and forget the modules that were loaded from such folders."""
    _FINDER.folders.add(folder)
    if _FINDER not in sys.meta_path:
        sys.meta_path.insert(sys.meta_path.index(PathFinder), _FINDER)
    importlib.invalidate_caches()
    # Where a folder without ``__init__.py`` is, Python asks the packages around it: all are found
    # before one is forgotten.
    loaded_names = [
        name
        for name, module in list(sys.modules.items())
        if _is_users_module(getattr(module, "__spec__", None))
        and not name.startswith("_osimlite_source_")
    ]
    for name in loaded_names:
        del sys.modules[name]


def _is_users_module(spec: ModuleSpec | None) -> bool:
    """Return whether a module was loaded from a user's folder, or is such a folder without ``__init__.py``."""
    if spec is None:
        return False
    if isinstance(spec.loader, _Loader):
        return True
    if spec.origin is not None or spec.submodule_search_locations is None:
        return False
    try:
        folders = list(spec.submodule_search_locations)
    except KeyError:
        # The package around it is no longer there.
        return False
    return any(_FINDER.is_users(os.path.join(folder, "__init__.py")) for folder in folders)


@contextmanager
def locate_errors(file: str) -> Iterator[None]:
    """Raise errors of the user's code as OsimliteError with file and line.

    Raises:
        OsimliteError: the code in the context raises an error.
    """
    try:
        yield
    except OsimliteError as error:
        if error.file is None:
            error.file, error.line = file, _line_in(error, file)
        raise
    except Exception as error:
        raise OsimliteError(
            f"{type(error).__name__}: {error}", file=file, line=_line_in(error, file)
        ) from error


def _line_in(error: BaseException, file: str) -> int | None:
    """Return the last line of `file` in the traceback of an error."""
    line = getattr(error, "lineno", None) if isinstance(error, SyntaxError) else None
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
