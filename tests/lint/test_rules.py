"""Every rule: its page, its examples, and its fixtures."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from osimlite.document.source import Source
from osimlite.lint import validate
from osimlite.lint.engine import FAMILIES, Rule, all_rules

HERE = Path(__file__).resolve().parent
FIXTURES = HERE.parents[1] / "fixtures" / "lint"
HEADINGS = ["What it does", "Why is this bad", "Example", "Use instead"]

_spec = importlib.util.spec_from_file_location("skeleton", HERE / "skeleton.py")
assert _spec is not None and _spec.loader is not None
skeleton = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(skeleton)

RULES = [pytest.param(rule, id=rule.code) for rule in all_rules()]


def example(rule: Rule, heading: str) -> bytes:
    """The document under a heading of a rule's page."""
    section = rule.page.split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    block = re.search(r"```(\S+)\n(.*?)```", section, re.DOTALL)
    assert block is not None, f"{rule.code} shows nothing under '{heading}'"
    if block[1] == "document":
        return block[2].encode()
    return str(skeleton.document(block[2])).encode("latin-1" if block[1] == "latin-1" else "utf-8")


def test_the_skeleton_is_without_findings():
    assert str(validate(skeleton.SKELETON)) == "nothing found"


@pytest.mark.parametrize("rule", RULES)
def test_a_page_has_its_headings_and_prose(rule):
    assert re.findall(r"^## (.*)$", rule.page, re.MULTILINE) == HEADINGS
    assert rule.page.splitlines()[0].endswith(".")
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", rule.name)
    assert rule.code[4] in FAMILIES and re.fullmatch(r"OSIM\d{3}", rule.code)


@pytest.mark.parametrize("rule", RULES)
def test_the_example_of_a_page_has_the_finding(rule, tmp_path):
    path = tmp_path / "example.osim"
    path.write_bytes(example(rule, "Example"))
    report = validate(path)
    assert set(report.codes) == {rule.code}, str(report)
    assert all(finding.line is not None for finding in report)


@pytest.mark.parametrize("rule", RULES)
def test_the_mended_example_has_no_finding(rule, tmp_path):
    path = tmp_path / "mended.osim"
    path.write_bytes(example(rule, "Use instead"))
    assert str(validate(path)) == "nothing found"


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_has_fixtures_that_fail_and_that_pass(rule):
    folder = FIXTURES / rule.code
    failing, passing = sorted(folder.glob("fail-*.osim")), sorted(folder.glob("pass-*.osim"))
    assert failing and passing, f"fixtures/lint/{rule.code} needs fail-NN-*.osim and pass-*.osim"
    for path in failing:
        expected = int(path.name.split("-")[1])
        report = validate(path)
        assert dict(report.codes) == {rule.code: expected}, f"{path.name}:\n{report}"
    for path in passing:
        assert str(validate(path)) == "nothing found", path.name


def test_fixture_folders_belong_to_rules():
    codes = {rule.code for rule in all_rules()}
    assert {path.name for path in FIXTURES.iterdir() if path.is_dir()} == codes


def test_rules_can_be_selected_and_ignored():
    source = Source(skeleton.document("<foo>1</foo><gravity>0 -9806 0</gravity>").encode())
    assert set(validate(source).codes) == {"OSIM101", "OSIM505"}
    assert set(validate(source, select="OSIM1").codes) == {"OSIM101"}
    assert set(validate(source, select=["unknown-tag", "OSIM505"]).codes) == {"OSIM101", "OSIM505"}
    assert set(validate(source, ignore="structure,OSIM3").codes) == {"OSIM505"}
