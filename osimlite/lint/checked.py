"""Base class of check targets: models, tables, setups, trials."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, TypedDict, Unpack

from osimlite.lint.config import Config
from osimlite.lint.fixes import replace_name
from osimlite.lint.suppressions import Suppression, read_suppressions

if TYPE_CHECKING:
    from osimlite.io.document.source import Position, Source
    from osimlite.lint.diagnostic import Fix
    from osimlite.lint.registry import Rule
    from osimlite.schema.base import Object


class LocationArguments(TypedDict, total=False):
    """Arguments that locate a finding; see :meth:`Subject.position`."""

    tag: str | None
    word: str | None
    nth: int
    attribute: str | None
    number: int | None


class CheckTarget:
    """Target of a check with its file and bytes; rules with the same `about` apply to it (:attr:`Rule.about`)."""

    about: ClassVar[str] = "model"
    source: Source | None = None
    file: str | None = None
    data: bytes = b""
    version: int | None = None
    upgraded = False
    sure_until: int | None = None

    def __init__(self, config: Config | None = None) -> None:
        self.config = config or Config()

    @property
    def text(self) -> str:
        """The text, for reports that show lines of it."""
        return self.source.text if self.source is not None else self.data.decode("utf-8", "replace")

    def is_for(self, rule: Rule) -> bool:
        """Return whether a rule applies to this target."""
        return rule.about == self.about

    def measure(self, *, compute: bool = True) -> str:
        """Measure paths and muscles, or recall the results; return the reason of a failure.

        Args:
            compute: whether to measure if there is no result yet; otherwise results are only recalled.

        Returns:
            The reason why nothing was measured; empty on success.
        """
        return ""

    def find_obstacles(self, *, compute: bool = True) -> str:
        """Find the reasons why the model cannot be computed; return why that failed, if so.

        Returns:
            The reason why nothing was computed; empty on success.
        """
        return ""

    def path(self, item: Object | None) -> str:
        """Return the absolute path of the component that an object belongs to."""
        return ""

    def position(
        self, item: Object | None, **location: Unpack[LocationArguments]
    ) -> Position | None:
        """Return the position of something in the text."""
        return None

    def make_replacement(
        self, position: Position, expected: object, text: str, *, certain: bool
    ) -> Fix | None:
        """Return the fix that replaces the words `expected` at a position; None if other words are there."""
        return replace_name(self.source, position, expected, text, certain=certain)

    def suppressions(self) -> list[Suppression]:
        """Return the comments that ignore findings."""
        return (
            read_suppressions(self.source)
            if self.source is not None and self.source.remarks
            else []
        )

    def list_outside_paths(self) -> list[str] | None:
        """Return every path outside the text that findings may depend on; None if that is unknown."""
        return []
