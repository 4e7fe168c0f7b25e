"""The one way out for what commands print: nothing that a terminal or the log of a CI job would obey gets through."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TextIO, cast

from osimlite.base.text import escape_control_sequences, escape_unprintable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


class Guarded:
    """A text stream that writes out what terminals and logs obey, and what its encoding lacks."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self._starts_line = True
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")

    def write(self, text: str) -> int:
        """Write text, lines or parts of them."""
        self.stream.write(escape_control_sequences(text, starts_line=self._starts_line))
        last = text[text.rfind("\n") + 1 :]
        self._starts_line = not last.strip() and (self._starts_line or "\n" in text)
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


@contextmanager
def guarded_output() -> Iterator[None]:
    """Let all that is written to standard output and standard error go through :class:`Guarded`."""
    kept = sys.stdout, sys.stderr
    # A program without a console has no streams.
    sys.stdout, sys.stderr = (stream and cast(TextIO, Guarded(stream)) for stream in kept)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = kept


def say(text: object = "", *, err: bool = False) -> None:
    """Print one line: whatever names in it hold, it stays one."""
    print(escape_unprintable(str(text)), file=sys.stderr if err else sys.stdout, flush=True)


def complain(text: object, cure: str = "") -> None:
    """Say one sentence on standard error, as the program; of an error, with the page of the manual to read on."""
    from osimlite.cli._manual import page_of

    page = f" (see {page_of(text)})" if isinstance(text, BaseException) else ""
    say(f"osimlite: {text}{cure}{page}", err=True)


def show(lines: str, *, err: bool = False) -> None:
    """Print lines whose names have gone through :func:`osimlite.base.text.escape_unprintable`."""
    (sys.stderr if err else sys.stdout).write(lines)


def print_diff(before: str, after: str, old: str, new: str) -> None:
    """Print what differs between two texts, under their names, as a unified diff."""
    import difflib
    import io

    # A text breaks its lines at \\n; what else looks like a break to Python is written out.
    first, second = (list(io.StringIO(text, newline="\n")) for text in (before, after))
    for line in difflib.unified_diff(first, second, old, new):
        body = line.rstrip("\r\n")
        end = line[len(body) :] if line.endswith("\n") else "\n\\ No newline at end of file\n"
        show("\t".join(map(escape_unprintable, body.split("\t"))) + end)


def hand_over(text: str) -> None:
    """Write a text for programs to standard output: as it is, in UTF-8, whatever people here read."""
    sys.stdout.flush()
    # What takes the place of standard output in tests may be without bytes.
    if hasattr(sys.stdout, "buffer"):
        sys.stdout.buffer.write(text.encode())
        sys.stdout.buffer.flush()
    else:
        raw_stream(sys.stdout).write(text)


def raw_stream(stream: TextIO) -> TextIO:
    """The stream itself: for texts of our own that move the cursor."""
    return stream.stream if isinstance(stream, Guarded) else stream


def wants_colour() -> bool:
    """Whether what is printed on standard output is coloured."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    if not sys.stdout.isatty() or os.environ.get("TERM") == "dumb":
        return False
    if os.name != "nt":
        return True
    from rich.console import detect_legacy_windows

    # An old console prints the codes of colours instead of obeying them.
    return not detect_legacy_windows()


def columns() -> int:
    """How many letters a line has here."""
    told = os.environ.get("COLUMNS", "")
    if told.isdigit():
        return int(told)
    for stream in range(3):
        with suppress(OSError):
            return os.get_terminal_size(stream).columns or 80
    return 80


def plain_console(**choices: Any) -> Console:
    """A console that prints text as it is: names of files and messages of others may look like its markup."""
    from rich.console import Console

    return Console(**{"markup": False, "emoji": False, **choices})


def plain_table(title: str = "", **choices: Any) -> Table:
    """A table without lines, as all commands print theirs."""
    from rich.table import Table

    style = {
        "box": None,
        "pad_edge": False,
        "padding": (0, 2, 0, 0),
        "header_style": "bold",
        "title_justify": "left",
    }
    return Table(title=escape_unprintable(title) or None, **{**style, **choices})


def add_row(table: Table, *cells: str) -> None:
    """Add a row to a table of the console, whatever names its cells hold."""
    table.add_row(*map(escape_unprintable, cells))


class Facts:
    """What came out: names, and what is said of each."""

    def __init__(self, title: str = "", rows: Iterable[tuple[str, str]] = ()) -> None:
        self.title = title
        self.rows = [*rows]

    def add(self, name: str, words: str) -> None:
        """Say one thing more."""
        self.rows.append((name, words))

    def show(self) -> None:
        """Print them as a table; text that is too long for its column is wrapped between words.

        A word is never broken: a path of a file stays whole, so that it can be copied and searched
        for.
        """
        rows = [(escape_unprintable(name), escape_unprintable(words)) for name, words in self.rows]
        width = max((len(name) for name, _ in rows), default=0)
        room = columns() - width - 2
        if room < 30 or not all(name.isascii() and words.isascii() for name, words in rows):
            self._show_any(rows)
            return
        from textwrap import wrap

        italic, bold, end = ("\033[3m", "\033[1m", "\033[0m") if wants_colour() else ("", "", "")
        if self.title:
            show(f"{italic}{escape_unprintable(self.title)}{end}\n")
        for name, words in rows:
            for line in wrap(words, room, break_on_hyphens=False, break_long_words=False) or [""]:
                show(f"{bold}{name:{width}}{end}  {line}".rstrip() + "\n")
                name = ""

    def _show_any(self, rows: list[tuple[str, str]]) -> None:
        """Print them where there is little room, or where letters are as wide as two: by a library that knows both."""
        table = plain_table(self.title, show_header=False)
        table.add_column(style="bold", overflow="fold")
        table.add_column(overflow="fold")
        for row in rows:
            table.add_row(*row)
        plain_console().print(table)
