"""Context of a study: the folder of its files, checks of its parts, and errors with their line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from osimlite.base.files import read_file
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import DocumentError, OsimliteError, UnsupportedError
from osimlite.io.tables.storage import find_named_file
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.fields import Value, make_domain_test
from osimlite.schema.patterns import Pattern, PatternError, UnsupportedPatternError
from osimlite.schema.registry import MODULES
from osimlite.schema.specs import FieldSpec, get_value_specs


@contextmanager
def name_file_in_errors(file: object) -> Iterator[None]:
    """Add a file to errors that name none.

    Args:
        file: file of a study; anything but a path is left alone.

    Raises:
        OsimliteError: the error of the block, with the file.
    """
    try:
        yield
    except OsimliteError as error:
        if error.file is None and isinstance(file, str | Path):
            error.file = str(file)
        raise


MAX_MESH_INTERVALS = 20_000
"""Maximum number of mesh intervals. Published studies have some hundred; each takes memory and time."""

MAX_MESH_VALUES = 2_000_000
"""Maximum product of the number of mesh intervals and the number of states."""


class StudyContext:
    """A study or a tool of Moco, with the file and the folder that it belongs to.

    Args:
        file: file of the study; None for a study that was not read from a file.
        folder: folder of the files that a study without a file names; the current folder if None.

    Attributes:
        file: file of the study, or None.
        folder: folder in which files are looked for first.
    """

    def __init__(self, file: str | Path | None, folder: Path | None) -> None:
        self.file = None if file is None else Path(file)
        self.folder = self.file.parent if self.file is not None else folder or Path(".")

    def locate_file(self, name: str) -> Path:
        """Return the path of a file that the study names.

        Args:
            name: path as in the study, looked for in its folder, then in the current one.
        """
        return find_named_file(self.folder, name.strip())

    def _locate_part(self, part: Object) -> dict[str, Any]:
        """Find a part of the study in its file.

        Objects know no lines, but their tags and names are in the text.

        Returns:
            Entries ``file`` and ``line`` of an error; empty for a study without a file.
        """
        if self.file is None:
            return {}
        tags = re.compile(rf"<{re.escape(_get_tag(part))}(\s[^>]*)?/?>")
        named = re.compile(rf'name="{re.escape(part.name)}"')
        try:
            lines = read_file(self.file).decode("utf-8", "replace").splitlines()
        except OsimliteError:
            return {"file": str(self.file)}
        found = [(number, text) for number, text in enumerate(lines, 1) if tags.search(text)]
        found = [pair for pair in found if named.search(pair[1])] or found
        return {"file": str(self.file), "line": found[0][0] if found else 1}

    def unsupported_error(self, part: Object, reason: str) -> UnsupportedError:
        """Return the error for a part that OpenSim accepts and osimlite does not support.

        Args:
            part: part of the study.
            reason: what osimlite does not support, and what to do.
        """
        name = f" '{part.name}'" if part.name else ""
        return UnsupportedError(f"{_get_tag(part)}{name}: {reason}", **self._locate_part(part))

    def invalid_error(self, part: Object, reason: str) -> DocumentError:
        """Return the error for a part that is invalid.

        Args:
            part: part of the study.
            reason: what is wrong, and what to do.
        """
        name = f" '{part.name}'" if part.name else ""
        return DocumentError(f"{_get_tag(part)}{name}: {reason}", **self._locate_part(part))

    def check_name(
        self, part: Object, name: str, known: Iterable[str], what: str, whose: str = "the model"
    ) -> None:
        """Check that a name is known; the error suggests the nearest known name.

        Args:
            part: part of the study with the name, for the message.
            name: name to check.
            known: known names.
            what: what the name stands for, for the message.
            whose: owner of the known names, for the message.

        Raises:
            DocumentError: the name is unknown.
        """
        known = [*known]
        if name not in known:
            raise self.invalid_error(
                part, f"{whose} has no {what} '{name}'{suggest_name(name, known)}"
            )

    def check_values(self, whole: Object) -> None:
        """Check all parts of a study except its model for unknown classes and invalid values.

        Raises:
            DocumentError: a part is of an unknown class, or a value is invalid.
        """
        for part in whole.walk():
            if isinstance(part, Component) and part.model is not None:
                continue
            if isinstance(part, Unknown):
                near = (
                    suggest_name(part.class_name, MODULES) if part.class_name not in MODULES else ""
                )
                raise self.invalid_error(part, f"objects of this class are not allowed here{near}")
            for spec in get_value_specs(type(part)):
                value = getattr(part, spec.name)
                for word in value if isinstance(value, tuple) else (value,):
                    if spec.name in part.model_fields_set and (
                        fault := _describe_invalid_value(spec, word)
                    ):
                        raise self.invalid_error(part, f"{spec.tag} is {word!r}{fault}")
                if (
                    spec.name in ("bounds", "initial_bounds", "final_bounds")
                    and len(value)
                    and (value[0] == math.inf or value[-1] == -math.inf)
                ):
                    raise self.invalid_error(part, f"{spec.name} contain no finite value")
                if (
                    spec.name in ("bounds", "initial_bounds", "final_bounds")
                    and len(value) == 2
                    and value[0] > value[1]
                ):
                    raise self.invalid_error(
                        part, f"{spec.name} are reversed: from {value[0]:g} to {value[1]:g}"
                    )

    def compile_pattern(self, part: Object, text: str) -> Callable[[str], Any]:
        """Return the function that matches names against a pattern of the study.

        Args:
            part: part of the study with the pattern, for messages.
            text: pattern.

        Raises:
            UnsupportedError: the pattern uses syntax that is not supported here.
            DocumentError: the pattern is invalid.
        """
        try:
            return Pattern(text).fullmatch
        except UnsupportedPatternError as error:
            raise self.unsupported_error(
                part, f"the pattern '{text}' is not supported: {error}"
            ) from None
        except PatternError as error:
            raise self.invalid_error(part, f"'{text}' is not a valid pattern: {error}") from None


def _describe_invalid_value(spec: FieldSpec, word: Any) -> str:
    """Return the end of the message on an invalid value of a property; empty if the value is valid.

    Args:
        spec: property.
        word: its value, or one of its values.
    """
    kind = spec.kind
    if not isinstance(kind, Value) or word is None:
        return ""
    if kind.choices and word not in kind.choices:
        return f"; expected {join_words(map(repr, kind.choices))}{suggest_name(str(word), map(str, kind.choices))}"
    if isinstance(word, float) and word != word:
        return ", which is not a number"
    if kind.domain and kind.scalar in ("double", "int") and not make_domain_test(kind.domain)(word):
        return f"; expected {kind.domain}"
    return ""


def _get_tag(part: Object) -> str:
    """Return the XML tag of a part."""
    return part.class_name if isinstance(part, Unknown) else type(part).tag
