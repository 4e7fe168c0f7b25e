"""Pages of the manual that are made from the program itself when the site is built, so that they cannot differ from it.

A hook of MkDocs: commands from their `--help`, rules from their docstrings, components from their
declarations.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from osimlite.cli import COMMANDS, load_command
from osimlite.cli._help import format_help
from osimlite.lint.pages import format_group_page
from osimlite.lint.registry import all_rules, rule_groups
from osimlite.schema.base import Object
from osimlite.schema.descriptions import describe_class, describe_property, describe_value
from osimlite.schema.fields import ObjectField, Value
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import FieldSpec

WIDTH = 80
"""Columns of the help texts."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    for name, text in pages():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let the index of rules lead to their pages, which have no file in the repository."""
    if page.file.src_uri != "rules.md":
        return markdown
    return re.sub(r"^\| (OSIM\d+) \|", r"| [\1](rules/\1.md) |", markdown, flags=re.MULTILINE)


def pages() -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each page."""
    yield "reference/commands.md", commands()
    yield "reference/components.md", components()
    for rule in all_rules():
        head = f"# {rule.name}\n\n`{rule.code}`, {rule.severity.value} ([all rules](../rules.md#{rule.family}))"
        yield f"rules/{rule.code}.md", f"{head}\n\n{rule.page}\n"
    for group in rule_groups():
        members = [rule for rule in all_rules() if rule.group == group.name]
        listed = "".join(
            f"- [{rule.code}]({rule.code}.md) {rule.name}: {rule.summary}\n" for rule in members
        )
        yield f"rules/{group.code}.md", f"{format_group_page(group)}\n\n{listed}"


def commands() -> str:
    """What every command says of itself."""
    parts = [
        "# Commands",
        "Exit codes of all commands: 0 done, 1 problems found, 2 the command could not run.",
    ]
    for command in COMMANDS:
        parts.append(f"## {command}\n\n```text\n{_help(command)}\n```")
    return "\n\n".join(parts) + "\n"


def _help(command: str) -> str:
    return format_help(command, load_command(command), WIDTH).rstrip()


def components() -> str:
    """Every class with its properties, by the area of OpenSim that it belongs to."""
    areas: dict[str, list[type[Object]]] = defaultdict(list)
    for tag in list_tags():
        cls = find_class(tag)
        assert cls is not None
        areas[cls.__module__.removeprefix("osimlite.schema.").replace(".", ": ")].append(cls)
    parts = [
        "# Components",
        "Classes and properties as OpenSim names them; `osimlite.PinJoint` is the class of `<PinJoint>`. Properties "
        "that every component has are left out: `name`, and `components` with the components inside.",
    ]
    for area, classes in sorted(areas.items()):
        parts.append(f"## {area.replace('_', ' ')}")
        parts += [_component(cls) for cls in classes]
    return "\n\n".join(parts) + "\n"


def _component(cls: type[Object]) -> str:
    lines = [f"### {cls.tag}", "", _text(describe_class(cls))]
    specs = [spec for spec in cls.field_specs().values() if spec.tag != "components"]
    if specs:
        lines += ["", "| property | holds | default | meaning |", "|---|---|---|---|"]
        for spec in specs:
            meaning = _cell(describe_property(spec))
            lines.append(
                f"| `{spec.tag}` | {_cell(describe_value(spec))} | {_default(spec)} | {meaning} |"
            )
    return "\n".join(lines)


def _default(spec: FieldSpec) -> str:
    if isinstance(spec.kind, ObjectField) or spec.default in (None, "", ()):
        return ""
    text = (
        " ".join(map(repr, spec.default)) if isinstance(spec.default, tuple) else str(spec.default)
    )
    if isinstance(spec.kind, Value) and spec.kind.scalar == "bool":
        text = text.lower()
    return f"`{text}`"


def _text(text: str) -> str:
    """A docstring as Markdown: roles of other classes become plain words."""
    return re.sub(r":[a-z]+:`~?([^`]+)`", r"`\1`", text)


def _cell(text: str) -> str:
    return _text(" ".join(text.split())).replace("|", "\\|")
