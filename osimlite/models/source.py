"""Where a model to build comes from: a built-in name, Python, or a data file."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, get_type_hints

from osimlite.document.data import read_data
from osimlite.errors import MissingFileError, OsimliteError
from osimlite.models import BUILT_IN
from osimlite.schema.model import Model
from osimlite.text import did_you_mean, listed

_WORDS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


def make_model(source: str, parameters: Mapping[str, str] | None = None) -> Model:
    """Make the model that `source` describes.

    Args:
        source: a built-in name (``dynamic-walker``), ``file.py``, ``file.py:function``, ``package.module:function``,
            or a ``.yaml`` or ``.json`` model.
        parameters: arguments of the model function, as text; a data file takes none.

    Raises:
        OsimliteError: there is no such source, it has no such parameter, or it does not return a Model.
    """
    if source.endswith((".yaml", ".yml", ".json")):
        if parameters:
            raise OsimliteError(f"'{source}' is data and takes no parameters; edit the file, or build from Python")
        return read_data(source)
    function = _function(source)
    arguments = _arguments(function, parameters or {}, source)
    file = inspect.getsourcefile(function)
    with _errors_placed(str(file)):
        model = function(**arguments)
    if not isinstance(model, Model):
        raise OsimliteError(f"'{source}' returned a {type(model).__name__}, not an osimlite.Model")
    return model


def describe(name: str) -> str:
    """One line about a built-in model: its summary and its parameters."""
    function = _function(BUILT_IN[name])
    summary = (inspect.getdoc(sys.modules[function.__module__]) or "").split("\n")[0]
    parameters = ", ".join(f"{p.name}={p.default}" for p in inspect.signature(function).parameters.values())
    return f"{summary} ({parameters})"


def _function(source: str) -> Callable[..., Any]:
    target = BUILT_IN.get(source, source)
    place, _, name = target.rpartition(":")
    if not place:
        place, name = target, ""
    if place.endswith(".py"):
        module = _module_of_file(Path(place))
    elif ":" in target:
        module = _module_named(place)
    else:
        known = did_you_mean(source, BUILT_IN) or f"; the built-in models are {listed(BUILT_IN)}"
        raise OsimliteError(f"'{source}' is no built-in model, Python file, module:function or data file{known}")
    if name:
        found = getattr(module, name, None)
        if not callable(found):
            raise OsimliteError(f"'{place}' has no function '{name}'{did_you_mean(name, _functions(module))}")
        return found  # type: ignore[no-any-return]
    return _only_function(module, place)


def _module_of_file(path: Path) -> ModuleType:
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
        with _errors_placed(str(path)):
            spec.loader.exec_module(module)
    finally:
        sys.path.pop(0)
    return module


def _module_named(name: str) -> ModuleType:
    # `python -m osimlite` finds modules in the current folder; so must the command of that name.
    if "" not in sys.path:
        sys.path.insert(0, "")
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise OsimliteError(f"cannot import '{name}': {error}") from None


def _functions(module: ModuleType) -> dict[str, Callable[..., Any]]:
    return {
        name: value
        for name, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not name.startswith("_")
    }


def _only_function(module: ModuleType, place: str) -> Callable[..., Any]:
    """The function of a file that makes its model: the one annotated to return a Model, or the only one."""
    ready = getattr(module, "model", None)
    if isinstance(ready, Model):
        return lambda: ready
    functions = _functions(module)
    annotated = {name: f for name, f in functions.items() if _returns_model(f)}
    candidates = annotated or functions
    if len(candidates) == 1:
        return next(iter(candidates.values()))
    if not candidates:
        raise OsimliteError("the file has no function that returns a Model", file=place)
    raise OsimliteError(
        f"the file has several functions ({listed(candidates)}); say which one with {place}:FUNCTION", file=place
    )


def _returns_model(function: Callable[..., Any]) -> bool:
    try:
        return get_type_hints(function).get("return") is Model
    except NameError:
        return False


def _arguments(function: Callable[..., Any], parameters: Mapping[str, str], source: str) -> dict[str, Any]:
    known = inspect.signature(function).parameters
    arguments = {}
    for name, text in parameters.items():
        if name not in known:
            hint = did_you_mean(name, known) or f"; it has {listed(known) or 'none'}"
            raise OsimliteError(f"'{source}' has no parameter '{name}'{hint}")
        arguments[name] = _value(name, text, known[name])
    for name, parameter in known.items():
        optional = parameter.default is not parameter.empty or parameter.kind in (
            parameter.VAR_POSITIONAL,
            parameter.VAR_KEYWORD,
        )
        if name not in arguments and not optional:
            raise OsimliteError(f"'{source}' needs its parameter '{name}'; give it with -p {name}=VALUE")
    return arguments


def _value(name: str, text: str, parameter: inspect.Parameter) -> Any:
    default = parameter.default
    kind: type | None = None if default in (inspect.Parameter.empty, None) else type(default)
    try:
        if kind is bool:
            return _WORDS[text.lower()]
        if kind is int:
            return int(text)
        return text if kind is str else float(text)
    except (KeyError, ValueError):
        if kind is None:
            return text
        noun = {bool: "true or false", int: "a whole number"}.get(kind, "a number")
        raise OsimliteError(f"parameter '{name}' must be {noun}, got '{text}'") from None


@contextmanager
def _errors_placed(file: str) -> Iterator[None]:
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
