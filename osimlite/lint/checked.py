"""What every subject of a check has, whatever it is: a model, a table, a document that runs a tool."""

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


class Where(TypedDict, total=False):
    """What more tells the place of a finding; :meth:`Subject.position` says how."""

    tag: str | None
    word: str | None
    nth: int
    attribute: str | None
    number: int | None


class CheckTarget:
    """Something under check, its file and its bytes. `about` says which rules speak of it (:attr:`Rule.about`)."""

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
        """Its text, for those who show lines of it."""
        return self.source.text if self.source is not None else self.data.decode("utf-8", "replace")

    def is_for(self, rule: Rule) -> bool:
        """Whether a rule has anything to look at."""
        return rule.about == self.about

    def measure(self, *, anew: bool = True) -> str:
        """Measure what rules about measures speak of, or recall it; why that cannot be done, if it cannot."""
        return ""

    def find_obstacles(self, *, anew: bool = True) -> str:
        """Find what stops a computation, for rules that report it; return why not, if that fails."""
        return ""

    def path(self, item: Object | None) -> str:
        """The absolute path of the component an object belongs to."""
        return ""

    def position(self, item: Object | None, **where: Unpack[Where]) -> Position | None:
        """Where something is in the text."""
        return None

    def make_replacement(
        self, at: Position, named: object, text: str, *, certain: bool
    ) -> Fix | None:
        """The fix that puts a text in a place where the words `named` stand; None if something else does."""
        return replace_name(self.source, at, named, text, certain=certain)

    def suppressions(self) -> list[Suppression]:
        """The comments that ignore findings."""
        return (
            read_suppressions(self.source)
            if self.source is not None and self.source.remarks
            else []
        )

    def list_outside_paths(self) -> list[str] | None:
        """Every path outside the text that findings may depend on; None if nobody can say."""
        return []
