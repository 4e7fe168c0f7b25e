"""The settings of a project: ``[tool.osimlite]`` of the nearest pyproject.toml, or an osimlite.toml."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from osimlite.base.reading import read_at_most
from osimlite.errors import OsimliteError

LARGEST_FILE = 100_000_000
"""The most bytes that are read of a file where no settings allow more; models have some million at most."""
LARGEST_SETTINGS = 10_000_000
"""The most bytes of a file of settings: a pyproject.toml has some thousand."""


def settings_table(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """The nearest file above a folder that has settings, and what it says; None if there is none.

    Raises:
        OsimliteError: the file is no TOML.
    """
    for place in (folder, *folder.parents):
        for name in ("osimlite.toml", "pyproject.toml"):
            file = place / name
            if not file.is_file():
                continue
            table = _table(file, whole=name == "osimlite.toml")
            if table is not None:
                return file, table
    return None


def largest_file(folder: Path) -> int:
    """The most bytes that are read of a file in a folder; OsimliteError if the settings make no sense."""
    result = settings_table(folder)
    return LARGEST_FILE if result is None else largest_file_in(*result)


def largest_file_in(file: Path, table: dict[str, Any]) -> int:
    """The most bytes of a file by the settings in `file`; OsimliteError if they make no sense."""
    given = table.get("largest-file", LARGEST_FILE / 1e6)
    is_number = isinstance(given, int | float) and not isinstance(given, bool)
    # TOML has integers of any length, most of them beyond the range of floats.
    if not is_number or not LARGEST_FILE / 1e6 <= given <= sys.float_info.max / 1e6:
        raise OsimliteError(
            f"'largest-file' must be a number of MB, {LARGEST_FILE / 1e6:g} or more, not '{given}'",
            file=str(file),
        )
    return int(given * 1e6)


def _table(file: Path, *, whole: bool) -> dict[str, Any] | None:
    import tomllib

    text = read_at_most(file, LARGEST_SETTINGS + 1)
    if len(text) > LARGEST_SETTINGS:
        message = f"settings of more than {LARGEST_SETTINGS / 1e6:g} MB are not read"
        raise OsimliteError(message, file=str(file))
    try:
        data: Any = tomllib.loads(text.decode())
    except (ValueError, RecursionError) as error:
        # A deep nesting of brackets ends the parser's recursion; its message says only that.
        reason = "brackets nest too deeply" if isinstance(error, RecursionError) else error
        raise OsimliteError(f"this is no TOML: {reason}", file=str(file)) from None
    for key in () if whole else ("tool", "osimlite"):
        data = data.get(key) if isinstance(data, dict) else None
    return data if isinstance(data, dict) else None
