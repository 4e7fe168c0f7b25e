"""All output of commands. Control characters in names and messages are escaped before they are printed.

A terminal would obey escape sequences in a file name, and CI systems obey lines such as
``::error::``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TextIO, cast

from osimlite.base.text import escape_control_sequences, escape_unprintable

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console
    from rich.table import Table


_output_hook: Callable[[], None] | None = None
"""Function that makes room for output."""


def set_output_hook(function: Callable[[], None] | None) -> None:
    """Set the function that is called before anything is printed; None for none."""
    global _output_hook
    _output_hook = function


class EscapingStream:
    """Text stream that escapes control sequences and characters that its encoding lacks."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self._starts_line = True
        if hasattr(stream, "reconfigure"):
            # An old terminal encoding must not end a command because of a letter in a name.
            stream.reconfigure(errors="backslashreplace")

    def write(self, text: str) -> int:
        """Write text with escapes for its control sequences.

        Returns:
            Number of characters of `text`.
        """
        if _output_hook is not None:
            _output_hook()
        self.stream.write(escape_control_sequences(text, starts_line=self._starts_line))
        last = text[text.rfind("\n") + 1 :]
        # Commands of CI systems such as `::error::` count at the start of a line only, after blanks
        # too.
        self._starts_line = not last.strip() and (self._starts_line or "\n" in text)
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


@contextmanager
def escape_output() -> Iterator[None]:
    """Replace standard output and standard error by escaping streams."""
    streams = sys.stdout, sys.stderr
    # A Windows program without a console has None for both.
    sys.stdout, sys.stderr = (stream and cast(TextIO, EscapingStream(stream)) for stream in streams)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = streams


def say(text: object = "", *, err: bool = False) -> None:
    """Print one line; a terminal shows it in several, broken between words.

    Whatever names the text holds, it stays one line in a file or a pipe.
    """
    stream = sys.stderr if err else sys.stdout
    line = escape_unprintable(str(text))
    print(_break_line(line) if stream.isatty() else line, file=stream, flush=True)


def _break_line(line: str) -> str:
    """Return a line with breaks between words where a terminal would break it inside a word."""
    width = count_columns()
    # Letters of other scripts may be twice as wide; the terminal breaks their lines itself.
    if len(line) <= width or not line.isascii():
        return line
    from textwrap import wrap

    return "\n".join(wrap(line, width, break_on_hyphens=False, break_long_words=False))


MIN_TEXT_WIDTH = 30
"""Smallest width of a column of text beside others, in letters."""

TEXT_INDENT = 4
"""Indentation of text that does not fit beside its row and stands below it, in letters."""

MIN_WRAP_WIDTH = 10
"""Smallest width of text, in letters, however narrow the terminal is."""


def show_rows(
    headings: Sequence[str], rows: Sequence[Sequence[str]], right_aligned: Sequence[int] = ()
) -> None:
    """Print a table whose last column is text that is broken between words.

    Where the other columns leave too little room, the text stands below each row, and there are no
    headings. No word and no path is ever broken.

    Args:
        headings: headings of the columns.
        rows: cells of each row, as many as headings.
        right_aligned: indices of the columns that are aligned to the right.
    """
    from textwrap import wrap

    escaped = [[escape_unprintable(cell) for cell in row] for row in rows]
    all_rows = [[*headings], *escaped]
    last = len(headings) - 1
    widths = [max(len(row[index]) for row in all_rows) for index in range(last)]
    indent = sum(widths) + 2 * last
    fits_in_column = count_columns() - indent >= MIN_TEXT_WIDTH
    text_indent = indent if fits_in_column else TEXT_INDENT
    bold, reset = ("\033[1m", "\033[0m") if wants_colour() else ("", "")
    for row_index, row in enumerate(all_rows):
        if row_index == 0 and not fits_in_column:
            continue
        cells = [
            f"{cell:>{width}}" if index in right_aligned else f"{cell:{width}}"
            for index, (cell, width) in enumerate(zip(row[:last], widths, strict=True))
        ]
        # Above its text a row is not aligned with others, so that empty cells are left out.
        first_line = "  ".join(cells if fits_in_column else [cell for cell in row[:last] if cell])
        text_width = max(count_columns() - text_indent, MIN_WRAP_WIDTH)
        lines = wrap(row[last], text_width, break_on_hyphens=False, break_long_words=False)
        if fits_in_column:
            first_line = f"{first_line}  {lines.pop(0) if lines else ''}"
        text = "\n".join([first_line.rstrip(), *(f"{'':{text_indent}}{line}" for line in lines)])
        show((f"{bold}{text}{reset}" if row_index == 0 else text) + "\n")


def complain(text: object, advice: str = "") -> None:
    """Print one sentence to standard error, after the name of the program.

    Args:
        text: message; for an exception, the page of the manual is added.
        advice: text after the message that says what the user can do.
    """
    from osimlite.cli._manual import find_page

    page = f" (see {find_page(text)})" if isinstance(text, BaseException) else ""
    say(f"osimlite: {text}{advice}{page}", err=True)


def show(lines: str, *, err: bool = False) -> None:
    """Print lines in which :func:`osimlite.base.text.escape_unprintable` has escaped the names.

    Args:
        lines: text with line ends.
        err: whether to print to standard error.
    """
    (sys.stderr if err else sys.stdout).write(lines)


def print_diff(old_text: str, new_text: str, old_name: str, new_name: str) -> None:
    """Print a unified diff of two texts.

    Args:
        old_text: first text.
        new_text: second text.
        old_name: name of the first text.
        new_name: name of the second text.
    """
    import difflib
    import io

    # ``str.splitlines`` would also split at form feeds and other characters; a diff splits at \\n.
    old_lines, new_lines = (list(io.StringIO(text, newline="\n")) for text in (old_text, new_text))
    for line in difflib.unified_diff(old_lines, new_lines, old_name, new_name):
        body = line.rstrip("\r\n")
        end = line[len(body) :] if line.endswith("\n") else "\n\\ No newline at end of file\n"
        show("\t".join(map(escape_unprintable, body.split("\t"))) + end)


def print_for_programs(text: str) -> None:
    """Write text for other programs to standard output, unescaped and in UTF-8."""
    if _output_hook is not None:
        _output_hook()
    # Text before this line is still in the buffer of the text stream, above the bytes written
    # below.
    sys.stdout.flush()
    # Tests replace standard output by streams without bytes.
    if hasattr(sys.stdout, "buffer"):
        sys.stdout.buffer.write(text.encode())
        sys.stdout.buffer.flush()
    else:
        get_raw_stream(sys.stdout).write(text)


def get_raw_stream(stream: TextIO) -> TextIO:
    """Return the stream below an escaping stream, for text that moves the cursor on purpose."""
    return stream.stream if isinstance(stream, EscapingStream) else stream


def wants_colour() -> bool:
    """Return whether output is coloured; NO_COLOR and FORCE_COLOR take precedence over the terminal."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    if not sys.stdout.isatty() or os.environ.get("TERM") == "dumb":
        return False
    # All terminals of other systems obey these codes.
    if os.name != "nt":
        return True
    from rich.console import detect_legacy_windows

    # Consoles of Windows before version 10 print colour codes as text.
    return not detect_legacy_windows()


def count_columns() -> int:
    """Return the width of the terminal in characters."""
    columns = os.environ.get("COLUMNS", "")
    # The variable precedes the terminal, so that pipes and tests can choose a width.
    if columns.isdigit():
        return int(columns)
    for stream in range(3):
        with suppress(OSError):
            return os.get_terminal_size(stream).columns or 80
    return 80


def create_console(**settings: Any) -> Console:
    """Return a console of rich without markup, which names of files and messages may contain."""
    from rich.console import Console

    return Console(**{"markup": False, "emoji": False, **settings})


def create_table(title: str = "", **settings: Any) -> Table:
    """Return an empty table without lines, in the style of all commands.

    Args:
        title: text above the table.
        settings: keyword arguments of ``rich.table.Table``.
    """
    from rich.table import Table

    style = {
        "box": None,
        "pad_edge": False,
        "padding": (0, 2, 0, 0),
        "header_style": "bold",
        "title_justify": "left",
    }
    return Table(title=escape_unprintable(title) or None, **{**style, **settings})


def add_row(table: Table, *cells: str) -> None:
    """Add a row whose cells are escaped.

    Args:
        table: table to which the row is added.
        cells: texts of the row.
    """
    table.add_row(*map(escape_unprintable, cells))


MAX_PATH_LINES = 3
"""Largest number of lines of a list of files in which each file is written with its folder."""

TEXT_COLUMN_GAP = 2
"""Blanks between the columns of a table."""
CELL_COLOURS = {"good": "\033[32m", "okay": "\033[33m", "bad": "\033[31m"}
"""Colours of cells that are one of these words, where output is coloured."""


def print_table(table: Table) -> None:
    """Print a table made by :func:`create_table` without breaking any word or path.

    Cells are wrapped between words. Where even the longest words do not fit beside each other, each
    row becomes a block: its first cell, and below it the others with their headings.

    Args:
        table: table to print.
    """
    columns = table.columns
    heads = [str(column.header) for column in columns]
    rows = [*zip(*([str(cell) for cell in column.cells] for column in columns), strict=True)]
    # Letters of other scripts may be twice as wide, which only rich knows.
    if not all(text.isascii() or text.isprintable() for row in [heads, *rows] for text in row):
        create_console().print(table)
        return
    if table.title:
        italic, end = ("\033[3m", "\033[0m") if wants_colour() else ("", "")
        show(f"{italic}{table.title}{end}\n")
    widths = _choose_widths([heads, *rows], count_columns())
    has_gaps = table.padding[2] > 0
    for number, row in enumerate([heads, *rows] if any(heads) else rows):
        is_heading = number == 0 and any(heads)
        if widths is None:
            lines = [] if is_heading else _list_block_lines(heads, row)
        else:
            lines = _list_row_lines(
                row, widths, [column.justify == "right" for column in columns], bold=is_heading
            )
        for line in lines:
            show(f"{line.rstrip()}\n")
        if has_gaps and lines:
            show("\n")


def _choose_widths(rows: Sequence[Sequence[str]], width: int) -> list[int] | None:
    """Return the widths of columns; None if their longest words do not fit beside each other.

    Args:
        rows: cells of all rows.
        width: width of the terminal.
    """
    cells = [*zip(*rows, strict=True)]
    widest = [max(len(cell) for cell in column) for column in cells]
    narrowest = [
        max((len(word) for cell in column for word in cell.split()), default=0) for column in cells
    ]
    remaining = width - TEXT_COLUMN_GAP * (len(cells) - 1)
    if sum(widest) <= remaining:
        return widest
    remaining -= sum(narrowest)
    if remaining < 0:
        return None
    # Each column gets an equal part of the remaining width, and leaves what it does not need to the next.
    widths = [*narrowest]
    # The least demanding column first: what it leaves is divided among those after it.
    order = sorted(range(len(cells)), key=lambda index: widest[index] - narrowest[index])
    for number, index in enumerate(order):
        extra = min(widest[index] - narrowest[index], remaining // (len(order) - number))
        widths[index] += extra
        remaining -= extra
    return widths


def _list_row_lines(
    row: Sequence[str], widths: Sequence[int], is_right: Sequence[bool], *, bold: bool
) -> list[str]:
    """Return the lines of a row whose cells are wrapped between words.

    Args:
        row: texts of the cells.
        widths: widths of the columns.
        is_right: whether each column is aligned to the right.
        bold: whether the row is bold where output is coloured.
    """
    from itertools import zip_longest

    is_coloured = wants_colour()
    cells = []
    for text, width in zip(row, widths, strict=True):
        cells.append(_wrap_words(text, max(width, 1)))
    lines = []
    for cell_lines in zip_longest(*cells, fillvalue=""):
        formatted = []
        for cell_line, width, to_right in zip(cell_lines, widths, is_right, strict=True):
            padded = f"{cell_line:>{width}}" if to_right else f"{cell_line:{width}}"
            colour = "\033[1m" if bold else CELL_COLOURS.get(cell_line, "")
            formatted.append(f"{colour}{padded}\033[0m" if is_coloured and colour else padded)
        lines.append((" " * TEXT_COLUMN_GAP).join(formatted))
    return lines


def _list_block_lines(headings: Sequence[str], row: Sequence[str]) -> list[str]:
    """Return the lines of a row that does not fit beside each other."""
    width = max(count_columns() - 4, 10)
    lines = _wrap_words(row[0], max(count_columns() - 1, 10))
    for heading, text in zip(headings[1:], row[1:], strict=True):
        if text:
            labelled = f"{heading}: {text}" if heading else text
            lines += [f"    {line}" for line in _wrap_words(labelled, width)]
    return lines


def _wrap_words(text: str, width: int) -> list[str]:
    """Return the lines of a text, broken between words only."""
    from textwrap import wrap

    return wrap(text, width, break_on_hyphens=False, break_long_words=False)


def _join_content(content: str | list[str]) -> str:
    """Return a text, or the paths of files as one text."""
    return content if isinstance(content, str) else ", ".join(content) or "none"


def _has_single_columns(name: str, content: str | list[str]) -> bool:
    """Return whether each character of a row is one column wide."""
    text = name + _join_content(content)
    if text.isascii():
        return True
    from unicodedata import combining, east_asian_width

    return not any(east_asian_width(letter) in "WF" or combining(letter) for letter in text)


def _list_content_lines(content: str | list[str], width: int) -> list[str]:
    """Return the lines of a text or of paths of files; single words and paths can be longer than `width`."""
    if isinstance(content, str) or not content:
        return _wrap_words(_join_content(content), width)
    lines = _wrap_items(content, width)
    if len(lines) <= MAX_PATH_LINES and max(map(len, lines)) <= width:
        return lines
    folders: dict[str, list[str]] = {}
    for path in content:
        folder, name = os.path.split(_shorten_path(path))
        folders.setdefault(os.path.join(folder, "") if folder else "", []).append(name)
    lines = []
    for folder, names in folders.items():
        if not folder:
            lines += _wrap_items(names, width)
        elif len(names) == 1:
            lines.append(folder + names[0])
        else:
            lines += [folder, *(f"  {line}" for line in _wrap_items(names, width - 2))]
    return lines


def _shorten_path(path: str) -> str:
    """Return a path relative to the current folder if the file is below it."""
    from pathlib import Path

    with suppress(OSError, ValueError):
        return str(Path(path).relative_to(Path.cwd()))
    return path


def _wrap_items(items: Sequence[str], width: int) -> list[str]:
    """Return the lines of a list with commas, broken between items only: file names can have spaces."""
    lines: list[str] = []
    for index, item in enumerate(items):
        text = item + "," * (index < len(items) - 1)
        if lines and len(lines[-1]) + 1 + len(text) <= width:
            lines[-1] += f" {text}"
        else:
            lines.append(text)
    return lines


class FactTable:
    """Table of two columns: names, and what is stated about each."""

    def __init__(self, title: str = "", rows: Iterable[tuple[str, str]] = ()) -> None:
        self.title = title
        self.rows: list[tuple[str, str | list[str]]] = [*rows]

    def add(self, name: str, text: str) -> None:
        """Add a row.

        Args:
            name: first column.
            text: second column.
        """
        self.rows.append((name, text))

    def add_files(self, paths: Iterable[str | Path]) -> None:
        """Add the row of the files that were written; many files of one folder are listed below its name."""
        self.rows.append(("files", [str(path) for path in paths]))

    def show(self) -> None:
        """Print the table; text that is too long for its column is wrapped between words.

        Words are never broken, so that a file path can be copied and searched for. A text with a
        word that is wider than the second column starts below its name.
        """
        rows: list[tuple[str, str | list[str]]] = [
            (
                escape_unprintable(name),
                escape_unprintable(content)
                if isinstance(content, str)
                else [escape_unprintable(path) for path in content],
            )
            for name, content in self.rows
        ]
        width = max((len(name) for name, _ in rows), default=0)
        remaining_width = count_columns() - width - 2
        # Narrow columns need broken words, and characters of other scripts can be two columns wide.
        if remaining_width < 30 or not all(_has_single_columns(name, text) for name, text in rows):
            self._show_any([(name, _join_content(content)) for name, content in rows])
            return

        italic, bold, end = ("\033[3m", "\033[1m", "\033[0m") if wants_colour() else ("", "", "")
        if self.title:
            show(f"{italic}{escape_unprintable(self.title)}{end}\n")
        for name, content in rows:
            lines = _list_content_lines(content, remaining_width) or [""]
            if max(map(len, lines)) > remaining_width:
                show(f"{bold}{name}{end}\n")
                for line in _list_content_lines(content, count_columns() - 2):
                    show(f"  {line}\n")
                continue
            for line in lines:
                show(f"{bold}{name:{width}}{end}  {line}".rstrip() + "\n")
                name = ""

    def _show_any(self, rows: list[tuple[str, str]]) -> None:
        """Print the table with rich, which knows the width of characters and breaks words in narrow terminals."""
        table = create_table(self.title, show_header=False)
        table.add_column(style="bold", overflow="fold")
        table.add_column(overflow="fold")
        for row in rows:
            table.add_row(*row)
        create_console().print(table)
