"""Models, data and comparisons for the tests of commands."""

from __future__ import annotations

from importlib import import_module

from osimlite.cli._command import Command


def loaded(name: str) -> Command:
    function = name.replace("-", "_")
    command: Command = getattr(import_module(f"osimlite.cli.{function}"), function)
    return command
