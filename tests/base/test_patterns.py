"""Tests of regular expressions that are compiled when first used: they behave as those of `re`."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import pytest

from osimlite.base.patterns import compile_later


def test_a_pattern_is_compiled_once_when_it_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = []
    monkeypatch.setattr(re, "compile", lambda *arguments: compiled.append(arguments))
    compile_later("a", re.IGNORECASE)
    assert not compiled
    monkeypatch.undo()
    pattern: Any = compile_later("(?P<letter>a)", re.IGNORECASE)
    assert pattern.fullmatch("A")["letter"] == "A"
    assert pattern.fullmatch is pattern.fullmatch
    with monkeypatch.context() as context:
        context.setattr(re, "compile", None)
        assert pattern.groups == 1


def test_methods_and_attributes_are_those_of_the_compiled_pattern() -> None:
    expression, text = rb"(?m)^(\w)(\d)?", b"a1\nb"
    late, early = compile_later(expression), re.compile(expression)
    assert late.pattern == early.pattern
    assert late.flags == early.flags
    assert late.groups == early.groups
    assert late.findall(text) == early.findall(text)
    assert late.sub(rb"\1", text) == early.sub(rb"\1", text)
    assert [match.span() for match in late.finditer(text, 1)] == [
        match.span() for match in early.finditer(text, 1)
    ]


def test_a_wrong_expression_is_reported_when_it_is_used() -> None:
    pattern = compile_later("(")
    assert repr(pattern) == "compile_later('(', 0)"
    with pytest.raises(re.error):
        pattern.match("")
    with pytest.raises(AttributeError):
        compile_later("a").unknown  # type: ignore[attr-defined]  # noqa: B018


def test_no_group_has_a_possessive_quantifier(repo: Path) -> None:
    """Python before 3.11.5, as that of Debian 12, matches such groups wrongly (CPython issue 106052)."""
    possessive_group = re.compile(r"\)(?:[*+?]|\{[0-9,]+\})\+")
    expressions = {
        f"{path.name}:{call.lineno}": str(argument.value)
        for path in sorted((repo / "osimlite").rglob("*.py"))
        for call in ast.walk(ast.parse(path.read_text()))
        if isinstance(call, ast.Call)
        and ast.unparse(call.func)
        in ("compile_later", "re.compile", "re.sub", "re.match", "re.search")
        for argument in call.args[:1]
        if isinstance(argument, ast.Constant)
    }
    assert len(expressions) > 100
    assert {
        place: text for place, text in expressions.items() if possessive_group.search(text)
    } == {}
