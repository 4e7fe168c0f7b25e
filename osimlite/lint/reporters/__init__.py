"""Formats of a report: a renderer turns a report into a text."""

from __future__ import annotations

from importlib import import_module

from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Report

RENDERERS = {
    "full": ("terminal", "render_full"),
    "concise": ("terminal", "render_concise"),
    "json": ("interchange", "render_json"),
    "github": ("interchange", "render_github"),
    "sarif": ("interchange", "render_sarif"),
    "junit": ("interchange", "render_junit"),
}
"""Module and function of each format; a module is imported when its format is used."""

FORMATS = tuple(RENDERERS)
FOR_PEOPLE = ("full", "concise")
"""The formats for a terminal; the others are for programs and are always written in UTF-8."""


def render(
    report: Report,
    name: str = "full",
    *,
    colour: bool = False,
    width: int = 80,
    everything: bool = False,
) -> str:
    """Return a report as text in a format.

    Args:
        report: findings of a check.
        name: name of the format, one of `FORMATS`.
        colour: whether to write terminal colours, in the formats for people.
        width: number of columns, in the full format.
        everything: whether the formats for people show every finding; otherwise one finding stands
            for similar ones. The formats for programs always have every finding.

    Returns:
        Text of the report.

    Raises:
        OsimliteError: the format is unknown.
    """
    if name not in RENDERERS:
        from osimlite.base.text import join_words

        raise OsimliteError(f"the format must be one of {join_words(FORMATS)}, not '{name}'")
    module, function = RENDERERS[name]
    renderer = getattr(import_module(f"osimlite.lint.reporters.{module}"), function)
    if name == "full":
        return str(renderer(report, colour=colour, width=width, everything=everything))
    if name == "concise":
        return str(renderer(report, colour=colour, everything=everything))
    return str(renderer(report))
