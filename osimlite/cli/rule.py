"""``osimlite rule``: the page of a rule, or the table of all."""

from __future__ import annotations

import shutil
import sys
import textwrap
from typing import Annotated

from osimlite.cli._command import Argument, command


@command
def rule(
    code: Annotated[
        str | None,
        Argument(
            help="Code or name of a rule, or several: a prefix of codes (OSIM8) or a family (data).",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Explain a rule of the validator: what it reports, why it matters, and an example with its correction.

    Example: osimlite rule OSIM301
    """
    from osimlite.base.text import suggest_name
    from osimlite.cli._console import show
    from osimlite.errors import OsimliteError
    from osimlite.lint.registry import all_rules, rule_groups

    rules = all_rules()
    columns = max(shutil.get_terminal_size().columns, 60) if sys.stdout.isatty() else 80
    result = [each_rule for each_rule in rules if code is None or each_rule.matches(code)]
    if code is not None and not result:
        names = [
            name
            for each_rule in (*rules, *rule_groups())
            for name in (each_rule.code, each_rule.name)
        ]
        suggestion = suggest_name(code, names) or "; 'osimlite rule' lists all rules"
        raise OsimliteError(f"there is no rule '{code}'{suggestion}")
    from osimlite.lint.pages import format_group_page, format_rule_page

    for group in rule_groups():
        if code is not None and (code == group.name or code.upper() == group.code):
            show(_wrap_page(format_group_page(group), columns) + "\n\n")
    if len(result) > 1:
        width = max(len(each_rule.name) for each_rule in result)
        for each_rule in result:
            heading = f"{each_rule.code}  {each_rule.name:{width}}  {each_rule.severity.value:7}  "
            show(
                textwrap.fill(
                    each_rule.summary,
                    columns,
                    initial_indent=heading,
                    subsequent_indent=" " * len(heading),
                )
                + "\n"
            )
        return
    show(_wrap_page(format_rule_page(result[0]), columns) + "\n")


def _wrap_page(page: str, columns: int) -> str:
    """Return a page with its prose wrapped to `columns`; examples stay unchanged."""
    rows: list[str] = []
    prose: list[str] = []
    code = False
    for line in [*page.splitlines(), ""]:
        if not code and line and not line.startswith(("#", "```", "- ", "Severity:", "Fix:")):
            prose.append(line)
            continue
        if prose:
            rows.append(textwrap.fill(" ".join(prose), columns, break_on_hyphens=False))
            prose = []
        code ^= line.startswith("```")
        indent = "  " if line.startswith("- ") else ""
        rows.append(
            textwrap.fill(line, columns, subsequent_indent=indent, break_on_hyphens=False)
            if indent
            else line
        )
    return "\n".join(rows[:-1])
