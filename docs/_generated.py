"""Pages of the manual that are generated from the package when the site is built.

This is a hook of MkDocs. The page of commands consists of their `--help`, the pages of rules of
their docstrings, and the page of components of the schema, so that the manual agrees with the
package.
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
"""Width of the help texts (columns)."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the site, as an event of MkDocs."""
    for name, text in generate_pages():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Link the rules in their index to their pages, as an event of MkDocs."""
    # The index cannot have these links itself: in a clone, the pages do not exist.
    if page.file.src_uri != "rules.md":
        return markdown
    return re.sub(r"^\| (OSIM\d+) \|", r"| [\1](rules/\1.md) |", markdown, flags=re.MULTILINE)


def generate_pages() -> Iterator[tuple[str, str]]:
    """Generate all pages.

    Yields:
        Name and text of each page.
    """
    yield "reference/commands.md", generate_commands()
    yield "reference/components.md", generate_components()
    for rule in all_rules():
        severity = f"{rule.severity.value} ([all rules](../rules.md#{rule.family}))"
        head = f"# {rule.name}\n\n`{rule.code}`, {severity}"
        yield f"rules/{rule.code}.md", f"{head}\n\n{rule.page}\n"
    for group in rule_groups():
        members = [rule for rule in all_rules() if rule.group == group.name]
        listed = "".join(
            f"- [{rule.code}]({rule.code}.md) {rule.name}: {rule.summary}\n" for rule in members
        )
        yield f"rules/{group.code}.md", f"{format_group_page(group)}\n\n{listed}"


def generate_commands() -> str:
    """Return the page of all commands with their help texts."""
    parts = [
        "# Commands",
        "Exit codes of all commands: 0 done, 1 problems found, 2 the command could not run.",
    ]
    for command in COMMANDS:
        parts.append(f"## {command}\n\n```text\n{_format_help(command)}\n```")
    return "\n\n".join(parts) + "\n"


def _format_help(command: str) -> str:
    return format_help(command, load_command(command), WIDTH).rstrip()


def generate_components() -> str:
    """Return the page of all classes with their properties, by modules of the schema."""
    areas: dict[str, list[type[Object]]] = defaultdict(list)
    for tag in list_tags():
        cls = find_class(tag)
        assert cls is not None
        areas[cls.__module__.removeprefix("osimlite.schema.").replace(".", ": ")].append(cls)
    parts = [
        "# Components",
        "Classes and properties as OpenSim names them; `osimlite.PinJoint` is the class of "
        "`<PinJoint>`. Properties that every component has are left out: `name`, and `components` "
        "with the components inside.",
    ]
    for area, classes in sorted(areas.items()):
        parts.append(f"## {area.replace('_', ' ')}")
        parts += [_format_component(cls) for cls in classes]
    return "\n\n".join(parts) + "\n"


def _format_component(cls: type[Object]) -> str:
    lines = [f"### {cls.tag}", "", _convert_roles(describe_class(cls))]
    # Every component has `components`; the page says so once.
    specs = [spec for spec in cls.field_specs().values() if spec.tag != "components"]
    if specs:
        lines += ["", "| property | value | default | meaning |", "|---|---|---|---|"]
        for spec in specs:
            value = _format_cell(describe_value(spec))
            meaning = _format_cell(describe_property(spec))
            lines.append(f"| `{spec.tag}` | {value} | {_format_default(spec)} | {meaning} |")
    return "\n".join(lines)


def _format_default(spec: FieldSpec) -> str:
    if isinstance(spec.kind, ObjectField) or spec.default in (None, "", ()):
        return ""
    text = (
        " ".join(map(repr, spec.default)) if isinstance(spec.default, tuple) else str(spec.default)
    )
    # OpenSim's files have "true" and "false".
    if isinstance(spec.kind, Value) and spec.kind.scalar == "bool":
        text = text.lower()
    return f"`{text}`"


def _convert_roles(text: str) -> str:
    """Return a docstring as Markdown, with names in backticks instead of Sphinx's roles."""
    return re.sub(r":[a-z]+:`~?([^`]+)`", r"`\1`", text)


def _format_cell(text: str) -> str:
    """Return a text as the cell of a table: one line with escaped bars."""
    return _convert_roles(" ".join(text.split())).replace("|", "\\|")
