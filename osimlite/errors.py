"""Errors a user can cause. Each is one plain sentence that names the thing and the next step."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, ClassVar

from osimlite.base.text import escape_unprintable, shorten_message


class OsimliteError(Exception):
    """Base of every error osimlite raises on purpose.

    Args:
        message: one plain sentence that says what is wrong and what to do.
        file: the file concerned, if any.
        line: 1-based line in that file.
        column: 1-based column, counted in characters.
    """

    exit_code: ClassVar[int] = 2
    """What the command line exits with: 1 if the answer is no, 2 if the command could not be carried out."""

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        super().__init__(message)
        self.message = shorten_message(message)
        self.file = file
        self.line = line
        self.column = column

    def __str__(self) -> str:
        place = ":".join(
            str(part) for part in (self.file, self.line, self.column) if part is not None
        )
        return escape_unprintable(f"{place}: {self.message}" if place else self.message)


class DoubtfulWarning(UserWarning):
    """Something can be done as it is asked for, but was hardly meant so."""


class UnitWarning(DoubtfulWarning):
    """A number without a unit was hardly meant in rad."""


class DeprecatedWarning(DoubtfulWarning, DeprecationWarning):
    """A name or an option still works, and will be removed; commands print it as a line on standard error."""


class DocumentError(OsimliteError):
    """A file cannot be read as what it should be. `meant` is the tag that would be right there, if that is known."""

    meant: str | None = None


class MissingFileError(DocumentError):
    """A file is not there or may not be read."""


class MissingFolderError(MissingFileError):
    """A folder is not there."""


class SpecialFileError(MissingFileError):
    """There is something, but no file that is read: a pipe, a device, or more than the settings allow."""


class NotWellFormedError(DocumentError):
    """The text is not XML, or declares entities."""


class VersionError(DocumentError):
    """The version of the document is missing, not a number, or not supported.

    In the first two cases the attribute `version` has no value.
    """

    version: int | None = None


class ModelError(OsimliteError):
    """The model says something that cannot be, or names something that is not there."""

    exit_code = 1


class MissingNameError(ModelError, AttributeError):
    """A component has no property or member of that name.

    Args:
        describe: returns the message. It is called when the message is read: finding the
            nearest name takes milliseconds, and `hasattr` and `getattr` with a default drop the
            error unread.
    """

    def __init__(self, describe: Callable[[], str]) -> None:
        super().__init__("")
        self._describe = describe
        # The property below takes the place of this.
        del self.message

    @cached_property
    def message(self) -> str:  # type: ignore[override]
        """The sentence that says which name is missing."""
        return shorten_message(self._describe())

    def __reduce__(self) -> tuple[Any, ...]:
        # Functions do not pass from one process to another, sentences do.
        place = {"file": self.file, "line": self.line, "column": self.column}
        return _restore_missing_name, (type(self), self.message), place


def _restore_missing_name(cls: type[MissingNameError], message: str) -> MissingNameError:
    """Return the error with a message that is known."""
    return cls(lambda: message)


class SimulationError(OsimliteError):
    """The motion cannot be computed any further."""

    exit_code = 1
    trajectory: Any = None  # what was recorded up to there, an `Trajectory`; None before any step


class SettingError(SimulationError):
    """A simulation is asked for in a way that means nothing: a negative time, a coordinate that is not there."""

    exit_code = 2


class UnsupportedError(OsimliteError):
    """The model uses something this version cannot do; the message names it."""

    exit_code = 1


class MissingDependency(OsimliteError):
    """An optional package is not installed; the message says which extra brings it."""
