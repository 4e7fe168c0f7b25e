"""Tests that everything the manual uses exists: functions, keywords, commands and options.

The full suite executes the manual. These tests only read it: they are quick, and cover blocks that
are never executed.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import shlex
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from osimlite.cli import ALIASES, COMMANDS
from osimlite.errors import MissingDependency
from osimlite.schema.base import Object

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in [
        ROOT / "README.md",
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "docs").rglob("*.ipynb"),
    ]
)
_FENCE = re.compile(
    r"^(?P<fence>`{3,})(?P<language>\w*)[^\n]*\n(?P<code>.*?)^(?P=fence)", re.M | re.S
)


def read_programs(path: Path) -> Iterator[tuple[str, str]]:
    """Yield language (`python` or `sh`) and text of each program of a page or notebook."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        for cell in json.loads(text)["cells"]:
            source = "".join(cell["source"])
            if cell["cell_type"] == "code":
                lines = source.splitlines()
                yield (
                    "python",
                    "\n".join("" if line.startswith(("!", "%")) else line for line in lines),
                )
                yield "sh", "\n".join(line[1:] for line in lines if line.startswith("!"))
    else:
        for match in _FENCE.finditer(text):
            if match["language"] in ("python", "sh"):
                yield match["language"], match["code"]


def resolve(node: ast.expr, names: dict[str, Any]) -> Any:
    """Return the module, class or function that an expression names, or None where that depends on values.

    Raises:
        AssertionError: it names something that does not exist.
    """
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        owner = resolve(node.value, names)
        if isinstance(owner, ModuleType):
            try:
                return getattr(owner, node.attr)
            except AttributeError:
                return import_module(f"{owner.__name__}.{node.attr}")
        if isinstance(owner, type):
            assert hasattr(owner, node.attr) or node.attr in getattr(owner, "model_fields", {}), (
                ast.unparse(node)
            )
    return None


def check_python(code: str, names: dict[str, Any]) -> None:
    """Fail if a program imports, names or passes a keyword to something of osimlite that does not exist."""
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.partition(".")[0] == "osimlite":
                    module = import_module(alias.name)
                    names[alias.asname or "osimlite"] = (
                        module if alias.asname else import_module("osimlite")
                    )
        elif (
            isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "osimlite"
        ):
            module = import_module(str(node.module))
            for alias in node.names:
                names[alias.asname or alias.name] = resolve(
                    ast.Attribute(ast.Name("module"), alias.name), {"module": module}
                )
    # Within `try` a page shows which error a mistake raises.
    shown_mistakes = {
        call
        for attempt in ast.walk(tree)
        if isinstance(attempt, ast.Try)
        for call in ast.walk(attempt)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            resolve(node, names)
        elif isinstance(node, ast.Call) and node not in shown_mistakes:
            check_keywords(node, resolve(node.func, names))


def check_keywords(call: ast.Call, function: Any) -> None:
    """Fail if a function of osimlite has no parameter of the name of a keyword."""
    if not inspect.isfunction(function) and not inspect.isclass(function):
        return
    if inspect.isclass(function) and issubclass(function, Object):
        # The signature of a model class is complete only after pydantic has built a validator, and
        # lacks the tags.
        accepted = {"name", *function.model_fields, *function.field_specs()}
        assert {keyword.arg for keyword in call.keywords} - {None} <= accepted, ast.unparse(call)
        return
    try:
        parameters = inspect.signature(function).parameters
    except ValueError:
        return
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()):
        return
    for keyword in call.keywords:
        assert keyword.arg is None or keyword.arg in parameters, (
            f"{ast.unparse(call)}: {keyword.arg}"
        )


def split_commands(code: str) -> Iterator[list[str]]:
    """Yield the words of each call of osimlite in a program for bash."""
    for line in code.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars="|&;<>()")
        lexer.whitespace_split = True
        words: list[str] = []
        for word in [*lexer, ";"]:
            if set(word) <= set("|&;<>()"):
                if "osimlite" in words:
                    yield words[words.index("osimlite") + 1 :]
                words = []
            else:
                words.append(word)


def option_names(command: str) -> set[str]:
    """Return all spellings of the options of a command."""
    function = ALIASES.get(command, command).replace("-", "_")
    parameters = getattr(import_module(f"osimlite.cli.{function}"), function).parameters()
    return {word for each in parameters for word in each.spellings} | {"--help", "-h"}


def check_command(words: list[str]) -> None:
    """Fail if a command or one of its long options does not exist."""
    if not words or words[0].startswith("-") or not re.fullmatch(r"[a-z][a-z-]*", words[0]):
        return
    assert words[0] in (*COMMANDS, *ALIASES), words
    for word in words[1:]:
        option = word.partition("=")[0]
        if re.fullmatch(r"--[a-z][a-z-]*", option):
            assert option in option_names(words[0]), words


@pytest.mark.parametrize("page", PAGES)
def test_a_page_names_what_exists(page: str) -> None:
    pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")
    names: dict[str, Any] = {}
    for language, code in read_programs(ROOT / page):
        if language == "sh":
            for words in split_commands(code):
                check_command(words)
        elif ">>>" not in code and not re.search(r"^\s*\.\.\.$", code, re.M):
            try:
                check_python(code, names)
            except MissingDependency as missing:
                # CasADi cannot be loaded after another test of this process has loaded OpenSim.
                pytest.skip(str(missing))


@pytest.mark.parametrize(
    "code",
    [
        "from osimlite import no_such",
        "import osimlite\nosimlite.no_such(1)",
        "import osimlite\nosimlite.simulation.no_such",
        "import osimlite\nosimlite.read('m.osim', until=1)",
        "from osimlite.simulation import Simulation as S\nS.no_such",
    ],
)
def test_a_name_that_does_not_exist_fails(code: str) -> None:
    pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")
    with pytest.raises((AssertionError, ImportError)):
        check_python(code, {})


@pytest.mark.parametrize(
    "line", ["osimlite simulat x", "cd a && osimlite validate x --formt json | head"]
)
def test_a_command_that_does_not_exist_fails(line: str) -> None:
    with pytest.raises(AssertionError):
        for words in split_commands(line):
            check_command(words)
