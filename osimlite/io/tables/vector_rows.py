"""Rows of tables of vectors, split and read as OpenSim's ``STOFileAdapter`` does.

Tabs separate the cells of a row, and commas the numbers of a cell. A number may have blanks around it.
"""

from __future__ import annotations

from math import isfinite, nan

from osimlite.base.patterns import compile_later

BLANKS = " \t\n\v\f\r"
"""White space that C++ passes over before a number; Python's `strip` knows more."""
DECIMAL_COMMA = compile_later(r"[-+]?[0-9]+,[0-9]+")
"""Number with a decimal comma, as spreadsheets of many countries write it."""
LARGE_NUMBER = compile_later(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE]\+?0*[1-9][0-9]{2,}")
"""Number with an exponent of three digits or more; one that is not readable is beyond 1.8e308."""
_NUMBER = compile_later(r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eE]([-+]?[0-9]+)|([eE]))?")


def split_vector_row(line: str) -> list[str]:
    """Return the cells of a row; an empty cell at the end does not count."""
    cells = line.removesuffix("\n").removesuffix("\r").split("\t")
    if not cells[-1]:
        cells.pop()
    return cells


def split_vector(cell: str) -> list[str]:
    """Return the numbers of a cell as texts; an empty text at the end does not count."""
    parts = cell.rstrip(" \r").split(",")
    if not parts[-1]:
        parts.pop()
    return parts


def parse_leading_number(text: str) -> float:
    """Return the number at the beginning of a text as OpenSim reads it.

    C++ streams pass over white space and stop at the first character that cannot continue the
    number, so that ``1x`` is 1. Without digits, with an incomplete exponent and beyond the largest
    number they fail, and OpenSim reads NaN; it knows neither ``inf`` nor hexadecimal numbers.
    """
    match = _NUMBER.match(text.lstrip(BLANKS))
    if not match or match[3]:
        return nan
    value = float(f"{match[1]}e{match[2]}" if match[2] else match[1])
    return value if isfinite(value) else nan
