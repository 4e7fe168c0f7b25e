"""What is checked, by the names of files."""

from __future__ import annotations

TABLES = (".sto", ".mot", ".trc")
"""Tables over time."""


def is_table(file: str | None) -> bool:
    """Whether a file is a table, by its name."""
    return file is not None and file.lower().endswith(TABLES)
