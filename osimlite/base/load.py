"""Python code that a user names: a file, or a module that can be imported from the current folder.

Python keeps what it compiled in a folder ``__pycache__`` beside a file, and tells versions of the
file apart by second and size: a model that is built again at once with another digit would be the
old one. What stands in a user's folder is compiled each time, and nothing is written there.
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

from osimlite.base.files import no_such
from osimlite.errors import OsimliteError


def module_of_file(path: Path) -> ModuleType:
    """Run a Python file.

    Raises:
        MissingFileError: it is not there.
        OsimliteError: it fails; with the line.
    """
    if not path.is_file():
        raise no_such(path)
    # A name of our own, so that a model in json.py does not take the place of a module that others
    # import.
    name = f"_osimlite_source_{path.stem}"
    place = str(path.absolute())
    spec = importlib.util.spec_from_file_location(name, place, loader=_Loader(name, place))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    _read_anew(str(path.resolve().parent))
    sys.modules[name] = module
    with imports_beside(place), errors_placed(place):
        spec.loader.exec_module(module)
    return module


def module_name(name: str) -> str:
    """The module of what osimlite makes of a class: PathSpring is in path_spring, IMUPlacer in imu_placer."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def module_named(name: str) -> ModuleType:
    """Import a module.

    Raises:
        OsimliteError: it cannot be imported.
    """
    # `python -m osimlite` finds modules in the current folder; so must the command of that name.
    if "" not in sys.path:
        sys.path.insert(0, "")
    _read_anew(os.getcwd())
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise OsimliteError(f"cannot import '{name}': {error}") from None


@contextmanager
def imports_beside(file: str) -> Iterator[None]:
    """Let the user's code in a file import what stands beside it."""
    folder = str(Path(file).resolve().parent)
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        with suppress(ValueError):
            sys.path.remove(folder)


class _Loader(SourceFileLoader):
    """Runs a file as it is now."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


class _Finder:
    """Finds modules as Python does, and has those in the users' folders run as they are now."""

    def __init__(self) -> None:
        self.folders: set[str] = set()

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The specification of a module; None leaves it to Python, as the parts of a package that Python has found."""
        around = getattr(sys.modules.get(name.rpartition(".")[0]), "__spec__", None)
        if type(getattr(around, "loader", None)) is SourceFileLoader:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if (
            spec is not None
            and type(spec.loader) is SourceFileLoader
            and self._is_users(spec.loader.path)
        ):
            spec.loader = _Loader(name, spec.loader.path)
        return spec

    def _is_users(self, file: str) -> bool:
        """Whether a file is in a user's folder; what is installed there, as in .venv, is not the user's."""
        places = {*self.folders, *map(os.path.abspath, sys.path)}
        around = [place for place in places if file.startswith(os.path.join(place, ""))]
        return max(around, key=len, default="") in self.folders


_FINDER = _Finder()


def _read_anew(folder: str) -> None:
    """From now on run what is in a folder as it is, and no module that was loaded from a user's folder before."""
    _FINDER.folders.add(folder)
    if _FINDER not in sys.meta_path:
        sys.meta_path.insert(sys.meta_path.index(PathFinder), _FINDER)
    importlib.invalidate_caches()
    for name, module in list(sys.modules.items()):
        spec = getattr(module, "__spec__", None)
        if isinstance(getattr(spec, "loader", None), _Loader) and not name.startswith(
            "_osimlite_source_"
        ):
            del sys.modules[name]


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
        raise OsimliteError(
            f"{type(error).__name__}: {error}", file=file, line=_line_in(error, file)
        ) from error


def _line_in(error: BaseException, file: str) -> int | None:
    """The last line of `file` on the way to the error."""
    line = getattr(error, "lineno", None) if isinstance(error, SyntaxError) else None
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
