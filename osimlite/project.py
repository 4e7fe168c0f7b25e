"""The settings of a project: ``[tool.osimlite]`` of the nearest pyproject.toml, or an osimlite.toml."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from osimlite.errors import OsimliteError

LARGEST_FILE = 100_000_000
"""The most bytes that are read of a file where no settings allow more; models have some million at most."""


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
    if isinstance(given, bool) or not isinstance(given, int | float) or not LARGEST_FILE <= given * 1e6 < math.inf:
        raise OsimliteError(
            f"'largest-file' must be a number of MB, {LARGEST_FILE / 1e6:g} or more, not '{given}'", file=str(file)
        )
    return int(given * 1e6)


def _table(file: Path, *, whole: bool) -> dict[str, Any] | None:
    import tomllib

    try:
        with file.open("rb") as stream:
            data = tomllib.loads(stream.read(LARGEST_FILE).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise OsimliteError(f"this is no TOML: {error}", file=str(file)) from None
    except OSError as error:
        raise OsimliteError(f"cannot read the settings: {error.strerror}", file=str(file)) from None
    table = data if whole else data.get("tool", {}).get("osimlite")
    return table if isinstance(table, dict) else None
