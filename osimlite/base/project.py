"""Settings of a project: ``[tool.osimlite]`` of the nearest pyproject.toml, or an osimlite.toml."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from osimlite.base.reading import read_at_most
from osimlite.errors import OsimliteError

DEFAULT_MAX_FILE_BYTES = 100_000_000
"""Largest file that is read without settings (bytes); models have some million bytes at most."""
MAX_SETTINGS_BYTES = 10_000_000
"""Largest file of settings (bytes); a pyproject.toml has some thousand."""


def find_settings(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """Search the settings of a folder.

    Returns:
        The nearest file with settings in the folder or above it, and its table; None without one.

    Raises:
        OsimliteError: the file is not valid TOML.
    """
    for parent in (folder, *folder.parents):
        for name in ("osimlite.toml", "pyproject.toml"):
            file = parent / name
            if not file.is_file():
                continue
            table = _read_settings(file, is_dedicated=name == "osimlite.toml")
            if table is not None:
                return file, table
    return None


def get_max_file_size(folder: Path) -> int:
    """Return the largest number of bytes that are read of a file in a folder.

    Raises:
        OsimliteError: the setting `largest-file` is invalid.
    """
    result = find_settings(folder)
    return DEFAULT_MAX_FILE_BYTES if result is None else parse_max_file_size(*result)


def parse_max_file_size(file: Path, table: dict[str, Any]) -> int:
    """Return the largest number of bytes of a file by the settings in `file`.

    Args:
        file: settings file, for messages.
        table: settings in the file, by key.

    Raises:
        OsimliteError: the setting `largest-file` is invalid.
    """
    value = table.get("largest-file", DEFAULT_MAX_FILE_BYTES / 1e6)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    # TOML allows integers beyond the range of floats.
    if not is_number or not DEFAULT_MAX_FILE_BYTES / 1e6 <= value <= sys.float_info.max / 1e6:
        raise OsimliteError(
            f"'largest-file' must be a number of MB, {DEFAULT_MAX_FILE_BYTES / 1e6:g} or more, not '{value}'",
            file=str(file),
        )
    return int(value * 1e6)


def _read_settings(file: Path, *, is_dedicated: bool) -> dict[str, Any] | None:
    """Return the table of osimlite in a file of settings; None if the file has none.

    Args:
        file: pyproject.toml, or a file for osimlite alone.
        is_dedicated: whether the complete file is the table of osimlite.

    Raises:
        OsimliteError: the file is larger than `MAX_SETTINGS_BYTES`, or is not valid TOML.
    """
    import tomllib

    text = read_at_most(file, MAX_SETTINGS_BYTES + 1)
    if len(text) > MAX_SETTINGS_BYTES:
        message = f"the file of settings is larger than {MAX_SETTINGS_BYTES / 1e6:g} MB"
        raise OsimliteError(message, file=str(file))
    try:
        data: Any = tomllib.loads(text.decode())
    except (ValueError, RecursionError) as error:
        # Deeply nested brackets exceed Python's recursion limit; the parser's message is no help.
        reason = "brackets nest too deeply" if isinstance(error, RecursionError) else error
        raise OsimliteError(f"this is not valid TOML: {reason}", file=str(file)) from None
    for key in () if is_dedicated else ("tool", "osimlite"):
        data = data.get(key) if isinstance(data, dict) else None
    return data if isinstance(data, dict) else None
