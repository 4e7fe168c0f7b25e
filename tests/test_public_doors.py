"""Tests that tests use public names: what they rightly need is public, or stands in a support module."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).resolve().parent
FOREIGN = {
    # Methods and attributes of other libraries that begin with an underscore although they are public.
    "_asdict",
    "_exit",
    "_field_defaults",
    "_fields",
    "_make",
    "_replace",
    "_repr_html_",
    # Python, pytest-xdist and Matplotlib offer nothing public for these.
    "_reschedule",
    "_run_exitfuncs",
    "_shutdown",
    "_supxlabel",
}
PRIVATE_MODULES = {"_architecture", "_console", "_gallery", "_llms", "_progress"}
"""Modules of the command line and of the manual that are private for users of the library."""


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def list_private_uses(tree: ast.Module) -> Iterator[str]:
    """Yield the private attributes and imported private names, and the test modules that are imported."""
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(ast.Name("self" | "cls")):
                pass
            case ast.Attribute(_, name) if is_private(name) and name not in FOREIGN:
                yield f"{node.lineno}: {name}"
            case ast.ImportFrom(module=str(module), names=names):
                names_in_use = {name.name for name in names} - PRIVATE_MODULES
                yield from (f"{node.lineno}: {name}" for name in names_in_use if is_private(name))
                if module.rpartition(".")[2].startswith(("test_", "check_")):
                    yield f"{node.lineno}: {module}"
            case ast.Call(ast.Attribute(attr="setattr"), [_, ast.Constant(str(name)), *_]):
                if is_private(name):
                    yield f"{node.lineno}: {name}"


def test_tests_use_public_names() -> None:
    uses = {
        f"{file.relative_to(TESTS)}:{use}"
        for file in TESTS.rglob("*.py")
        for use in list_private_uses(ast.parse(file.read_text(encoding="utf-8")))
    }
    assert not uses


def test_private_uses_are_found() -> None:
    code = (
        "import osimlite\n"
        "from osimlite.cli.demo import _Tour\n"
        "from tests.lint.test_many import check\n"
        "osimlite.base._line.draw()\n"
        'monkeypatch.setattr(osimlite, "_cache", {})\n'
        "row._replace(a=1)\n"
        "self._count = 1\n"
    )
    uses = list(list_private_uses(ast.parse(code)))
    assert sorted(uses) == ["2: _Tour", "3: tests.lint.test_many", "4: _line", "5: _cache"]
