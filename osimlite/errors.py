"""Errors that users can cause. Each message is a sentence with the cause and the next step."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, ClassVar

from osimlite.base.text import escape_unprintable, shorten_message


class OsimliteError(Exception):
    """Base class of all errors that osimlite raises on purpose.

    Args:
        message: sentence that says what is wrong and what to do.
        file: file with the error, if any.
        line: line in this file, from 1.
        column: column in this line in characters, from 1.
    """

    exit_code: ClassVar[int] = 2
    """Exit code of commands: 1 if the answer is no, 2 if the command could not be carried out."""

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
        location = ":".join(
            str(part) for part in (self.file, self.line, self.column) if part is not None
        )
        return escape_unprintable(f"{location}: {self.message}" if location else self.message)


class DoubtfulWarning(UserWarning):
    """Warning about an input that is valid, but probably a mistake."""


class UnitWarning(DoubtfulWarning):
    """Warning about a number without a unit that is probably not in rad."""


class ResultWarning(DoubtfulWarning):
    """Warning about the results of a tool that is also among the messages of its outcome."""


class DeprecatedWarning(DoubtfulWarning, DeprecationWarning):
    """Warning that a name or an option will be removed; commands print it on standard error."""


class DocumentError(OsimliteError):
    """Error of a file whose content is not what it should be.

    The attribute `meant` is the tag that the author probably meant, if known.
    """

    meant: str | None = None


class MissingFileError(DocumentError):
    """Error of a file that does not exist or may not be read."""


class MissingFolderError(MissingFileError):
    """Error of a folder that does not exist."""


class SpecialFileError(MissingFileError):
    """Error of a path that is no regular file (a pipe, a device), or of a file that is too large."""


class NotWellFormedError(DocumentError):
    """Error of a text that is not well-formed XML, or declares entities."""


class VersionError(DocumentError):
    """Error of a document whose version is missing, not a number, or not supported.

    In the first two cases the attribute `version` has no value.
    """

    version: int | None = None


class ModelError(OsimliteError):
    """Error of a model that contradicts itself, or names something that does not exist."""

    exit_code = 1


class MissingNameError(ModelError, AttributeError):
    """Error of a component that lacks the requested property or member.

    Args:
        describe: function that returns the message. It is called when the message is read: finding
            the nearest name takes milliseconds, and `hasattr` and `getattr` with a default discard
            the error unread.
    """

    def __init__(self, describe: Callable[[], str]) -> None:
        super().__init__("")
        self._describe = describe
        # The property below takes the place of this.
        del self.message

    @cached_property
    def message(self) -> str:  # type: ignore[override]
        """Sentence that says which name is missing."""
        return shorten_message(self._describe())

    def __reduce__(self) -> tuple[Any, ...]:
        # Functions do not pass from one process to another, sentences do.
        location = {"file": self.file, "line": self.line, "column": self.column}
        return _restore_missing_name, (type(self), self.message), location


def _restore_missing_name(cls: type[MissingNameError], message: str) -> MissingNameError:
    """Return the error with a message that is known."""
    return cls(lambda: message)


class SimulationError(OsimliteError):
    """Error of a motion that cannot be computed any further."""

    exit_code = 1
    trajectory: Any = None  # recorded part of the motion, a `Trajectory`; None before any step


class SettingError(SimulationError):
    """Error of a setting without meaning: a negative time, a coordinate that does not exist."""

    exit_code = 2


class UnsupportedError(OsimliteError):
    """Error of a model that contains something which osimlite does not support."""

    exit_code = 1


class MissingDependency(OsimliteError):
    """Error of a missing optional package; the message names the extra that installs it."""
