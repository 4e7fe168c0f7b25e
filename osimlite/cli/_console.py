"""What commands print when they have done their work."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def plain_console(**choices: Any) -> Console:
    """A console that prints text as it is: names of files and messages of others may look like its markup."""
    from rich.console import Console

    return Console(**{"markup": False, "emoji": False, **choices})


@dataclass
class Facts:
    """What came out: names, and what is said of each."""

    title: str
    rows: list[tuple[str, str]] = field(default_factory=list)

    def add(self, name: str, words: str) -> None:
        """Say one thing more."""
        self.rows.append((name, words))

    def show(self) -> None:
        """Print them as a table; a long name goes on in the next line."""
        from rich.table import Table

        table = Table(title=self.title, title_justify="left", show_header=False)
        table.add_column(style="bold", overflow="fold")
        table.add_column(overflow="fold")
        for row in self.rows:
            table.add_row(*row)
        plain_console().print(table)
