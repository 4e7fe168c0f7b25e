"""Formats of a report, one small module each. A reporter turns a report into a text."""

from __future__ import annotations

from importlib import import_module

from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Report

FORMATS = ("full", "concise", "json", "github", "sarif", "junit")
FOR_PEOPLE = ("full", "concise")
"""The formats that are read on a terminal; the others are for programs, and are UTF-8 wherever they go."""


def render(
    report: Report,
    name: str = "full",
    *,
    colour: bool = False,
    width: int = 80,
    everything: bool = False,
) -> str:
    """The report in a format.

    Args: report: what was found. name: one of `FORMATS`. colour: whether to write the colours of a
        terminal, in the formats that people read. width: columns to keep to, in the full format.
        everything: whether findings that are alike are all written, where people read them; else
        the first stands for all. The formats for programs are always whole.

    Raises:
        OsimliteError: there is no such format.
    """
    if name not in FORMATS:
        from osimlite.base.text import listed

        raise OsimliteError(f"--format is one of {listed(FORMATS)}, not '{name}'")
    module = import_module(f"osimlite.lint.reporters.{name}")
    if name == "full":
        return str(module.render(report, colour=colour, width=width, everything=everything))
    if name == "concise":
        return str(module.render(report, colour=colour, everything=everything))
    return str(module.render(report))
