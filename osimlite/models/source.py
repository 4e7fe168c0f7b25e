"""Sources of models to build: built-in names, Python functions, and data files."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, get_type_hints

from osimlite.base.load import (
    allow_local_imports,
    import_user_module,
    locate_errors,
    run_python_file,
)
from osimlite.base.text import add_article, join_words, suggest_name
from osimlite.errors import MissingDependency, OsimliteError
from osimlite.io.document.data import SUFFIXES, read_data
from osimlite.models import BUILT_IN, STUDIES
from osimlite.schema.model import Model

_WORDS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
"""Spellings of true and false in parameters."""


def make_model(source: str, parameters: Mapping[str, str] | None = None) -> Model:
    """Make the model that a source describes.

    Args:
        source: a built-in name (`dynamic-walker`), `file.py`, `file.py:function`,
            `package.module:function`, or a `.yaml` or `.json` model.
        parameters: arguments of the model function as text; a data file has none.

    Returns:
        The model.

    Raises:
        OsimliteError: the source or a parameter is unknown, or the function does not return a
            Model.
    """
    if source.endswith(SUFFIXES):
        if parameters:
            raise OsimliteError(
                f"'{source}' is data and has no parameters; edit the file, or build from Python"
            )
        return read_data(source)
    function = _find_function(source)
    arguments = _parse_arguments(function, parameters or {}, source)
    file = inspect.getsourcefile(function)
    # Errors in the file of the user are reported with its line.
    with (
        locate_errors(str(file)),
        nullcontext() if source in BUILT_IN else allow_local_imports(str(file)),
    ):
        model = function(**arguments)
    if not isinstance(model, Model):
        raise OsimliteError(
            f"'{source}' returned {add_article(type(model).__name__)}, not an osimlite.Model"
        )
    return model


def write_companion_files(source: str, model: Model, file: Path) -> list[Path]:
    """Write further files of a built-in model, such as a study, beside its file.

    Args:
        source: built-in name.
        model: model that was built.
        file: path of its file.

    Returns:
        Paths of the files.

    Raises:
        OsimliteError: a file cannot be written.
    """
    if source not in STUDIES:
        return []
    module_name, _, name = STUDIES[source].partition(":")
    return getattr(_import_built_in(module_name, source), name)(model, file)


def list_parameters(source: str) -> dict[str, Any]:
    """List the parameters of a model function.

    Args:
        source: source of the model.

    Returns:
        Default per name; a data file has no parameters.

    Raises:
        OsimliteError: there is no such source.
    """
    if source.endswith(SUFFIXES):
        return {}
    return {
        name: parameter.default
        for name, parameter in inspect.signature(_find_function(source)).parameters.items()
    }


def describe_model(name: str) -> str:
    """Return one line about a built-in model: its summary and its parameters, or what it needs to be built."""
    try:
        function = _find_function(name)
    except MissingDependency as error:
        return error.message
    summary = (
        (inspect.getdoc(function) or "").split("\n")[0].removeprefix("Build ").removesuffix(".")
    )
    parameters = ", ".join(
        f"{p.name}={p.default}" for p in inspect.signature(function).parameters.values()
    )
    # Without its verb the summary begins in the middle of a sentence.
    summary = summary[:1].upper() + summary[1:]
    return f"{summary} ({parameters})" if parameters else summary


def _find_function(source: str) -> Callable[..., Any]:
    """Return the function that a source names; an error lists what a source can be.

    Raises:
        OsimliteError: the source names nothing, or no function.
    """
    target = BUILT_IN.get(source, source)
    location, _, name = target.rpartition(":")
    # Without a colon the target is a file, whose function is found by itself.
    if not location:
        location, name = target, ""
    if source in BUILT_IN:
        module = _import_built_in(location, source)
    elif location.endswith(".py"):
        module = run_python_file(Path(location))
    elif ":" in target:
        module = import_user_module(location)
    else:
        known_models = (
            suggest_name(source, BUILT_IN) or f"; the built-in models are {join_words(BUILT_IN)}"
        )
        raise OsimliteError(
            f"'{source}' is not a built-in model, Python file, module:function or data file{known_models}"
        )
    if name:
        result = getattr(module, name, None)
        if not callable(result):
            raise OsimliteError(
                f"'{location}' has no function '{name}'{suggest_name(name, _list_functions(module))}"
            )
        return result
    return _select_function(module, location)


def _import_built_in(module: str, source: str) -> ModuleType:
    """Import the module of a built-in model.

    Returns:
        The module.

    Raises:
        MissingDependency: the model needs a package that is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise MissingDependency(
            f"the built-in model '{source}' needs {error.name}, which is not installed; "
            "run: pip install 'osimlite[sim]'"
        ) from error


def _list_functions(module: ModuleType) -> dict[str, Callable[..., Any]]:
    """Return the public functions that a module defines, by name."""
    return {
        name: value
        for name, value in vars(module).items()
        if inspect.isfunction(value)
        and value.__module__ == module.__name__
        and not name.startswith("_")
    }


def _select_function(module: ModuleType, location: str) -> Callable[..., Any]:
    """Return the function of a file that makes its model.

    It is the one annotated to return a Model, or the only one.

    Raises:
        OsimliteError: the file has no such function, or several.
    """
    # A script may build its model at once, in a variable.
    ready = getattr(module, "model", None)
    if isinstance(ready, Model):
        return lambda: ready
    functions = _list_functions(module)
    annotated = {name: function for name, function in functions.items() if _returns_model(function)}
    # A file may contain helper functions; an annotation tells which one makes the model.
    candidates = annotated or functions
    if len(candidates) == 1:
        return next(iter(candidates.values()))
    if not candidates:
        raise OsimliteError("the file has no function that returns a Model", file=location)
    raise OsimliteError(
        f"the file has several functions ({join_words(candidates)}); say which one with {location}:FUNCTION",
        file=location,
    )


def _returns_model(function: Callable[..., Any]) -> bool:
    """Return whether a function is annotated to return a Model."""
    try:
        return get_type_hints(function).get("return") is Model
    # An annotation may name a type that is imported for type checkers only.
    except NameError:
        return False


def _parse_arguments(
    function: Callable[..., Any], parameters: Mapping[str, str], source: str
) -> dict[str, Any]:
    """Return the arguments of a model function; all parameters without a default must be given.

    Raises:
        OsimliteError: the function has no such parameter, or one without a default is missing.
    """
    known_parameters = inspect.signature(function).parameters
    arguments = {}
    for name, text in parameters.items():
        if name not in known_parameters:
            hint = (
                suggest_name(name, known_parameters)
                or f"; it has {join_words(known_parameters) or 'none'}"
            )
            raise OsimliteError(f"'{source}' has no parameter '{name}'{hint}")
        arguments[name] = _parse_value(name, text, known_parameters[name])
    for name, parameter in known_parameters.items():
        optional = parameter.default is not parameter.empty or parameter.kind in (
            parameter.VAR_POSITIONAL,
            parameter.VAR_KEYWORD,
        )
        if name not in arguments and not optional:
            raise OsimliteError(
                f"'{source}' needs its parameter '{name}'; give it with -p {name}=VALUE"
            )
    return arguments


def _parse_value(name: str, text: str, parameter: inspect.Parameter) -> Any:
    """Return the value of a parameter, of the type of its default.

    Raises:
        OsimliteError: the text is no value of that type.
    """
    default = parameter.default
    # The type of the default decides how a text is read.
    value_type: type | None = None if default in (inspect.Parameter.empty, None) else type(default)
    try:
        if value_type is bool:
            return _WORDS[text.lower()]
        if value_type is int:
            return int(text)
        return text if value_type is str else float(text)
    except (KeyError, ValueError):
        # Without a default, a text that is no number remains a text.
        if value_type is None:
            return text
        noun = {bool: "true or false", int: "a whole number"}.get(value_type, "a number")
        raise OsimliteError(f"parameter '{name}' must be {noun}, got '{text}'") from None
