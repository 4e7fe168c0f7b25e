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
        # Files that the study names have reported themselves, and are nearer to the problem.
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

    def _locate_part(self, study_object: Object) -> dict[str, Any]:
        """Find a part of the study in its file.

        Objects know no lines, but their tags and names are in the text.

        Returns:
            Entries ``file`` and ``line`` of an error; empty for a study without a file.
        """
        if self.file is None:
            return {}
        tag_pattern = re.compile(rf"<{re.escape(_get_tag(study_object))}(\s[^>]*)?/?>")
        name_pattern = re.compile(rf'name="{re.escape(study_object.name)}"')
        try:
            lines = read_file(self.file).decode("utf-8", "replace").splitlines()
        except OsimliteError:
            # The file may have changed or gone since it was read; the error at hand must still be
            # reported.
            return {"file": str(self.file)}
        matches = [
            (number, text) for number, text in enumerate(lines, 1) if tag_pattern.search(text)
        ]
        matches = [
            # Of several parts with one tag, that with the name; the first if the name is on another
            # line.
            numbered_line
            for numbered_line in matches
            if name_pattern.search(numbered_line[1])
        ] or matches
        return {"file": str(self.file), "line": matches[0][0] if matches else 1}

    def make_unsupported_error(self, study_object: Object, reason: str) -> UnsupportedError:
        """Return the error for a part that OpenSim accepts and osimlite does not support.

        Args:
            study_object: part of the study.
            reason: clause with the unsupported thing and the next step for the user.
        """
        name = f" '{study_object.name}'" if study_object.name else ""
        return UnsupportedError(
            f"{_get_tag(study_object)}{name}: {reason}", **self._locate_part(study_object)
        )

    def invalid_error(self, study_object: Object, reason: str) -> DocumentError:
        """Return the error for a part that is invalid.

        Args:
            study_object: part of the study.
            reason: clause with the error and the next step for the user.
        """
        name = f" '{study_object.name}'" if study_object.name else ""
        return DocumentError(
            f"{_get_tag(study_object)}{name}: {reason}", **self._locate_part(study_object)
        )

    def check_name(
        self,
        study_object: Object,
        name: str,
        known_names: Iterable[str],
        noun: str,
        owner: str = "the model",
    ) -> None:
        """Check that a name is known; the error suggests the nearest known name.

        Args:
            study_object: part of the study with the name, for the message.
            name: name to check.
            known_names: known names.
            noun: noun for the named thing, such as "control", for the message.
            owner: owner of the known names, for the message.

        Raises:
            DocumentError: the name is unknown.
        """
        known_names = [*known_names]
        if name not in known_names:
            raise self.invalid_error(
                study_object, f"{owner} has no {noun} '{name}'{suggest_name(name, known_names)}"
            )

    def check_values(self, study_root: Object) -> None:
        """Check all parts of a study except its model for unknown classes and invalid values.

        Raises:
            DocumentError: a part is of an unknown class, or a value is invalid.
        """
        for study_object in study_root.walk():
            # Components of the model have their own rules, in the linter and when the model is
            # built.
            if isinstance(study_object, Component) and study_object.model is not None:
                continue
            if isinstance(study_object, Unknown):
                suggestion = (
                    suggest_name(study_object.class_name, MODULES)
                    if study_object.class_name not in MODULES
                    else ""
                )
                raise self.invalid_error(
                    study_object, f"objects of this class are not allowed here{suggestion}"
                )
            for spec in get_value_specs(type(study_object)):
                value = getattr(study_object, spec.name)
                for item_value in value if isinstance(value, tuple) else (value,):
                    if spec.name in study_object.model_fields_set and (
                        fault := _describe_invalid_value(spec, item_value)
                    ):
                        raise self.invalid_error(
                            study_object, f"{spec.tag} is {item_value!r}{fault}"
                        )
                if (
                    spec.name in ("bounds", "initial_bounds", "final_bounds")
                    and len(value)
                    and (value[0] == math.inf or value[-1] == -math.inf)
                ):
                    raise self.invalid_error(study_object, f"{spec.name} contain no finite value")
                if (
                    spec.name in ("bounds", "initial_bounds", "final_bounds")
                    and len(value) == 2
                    and value[0] > value[1]
                ):
                    raise self.invalid_error(
                        study_object, f"{spec.name} are reversed: from {value[0]:g} to {value[1]:g}"
                    )

    def compile_pattern(self, study_object: Object, text: str) -> Callable[[str], Any]:
        """Return the function that matches names against a pattern of the study.

        Args:
            study_object: part of the study with the pattern, for messages.
            text: pattern.

        Raises:
            UnsupportedError: the pattern uses syntax that is not supported here.
            DocumentError: the pattern is invalid.
        """
        try:
            return Pattern(text).fullmatch
        except UnsupportedPatternError as error:
            raise self.make_unsupported_error(
                study_object, f"the pattern '{text}' is not supported: {error}"
            ) from None
        except PatternError as error:
            raise self.invalid_error(
                study_object, f"'{text}' is not a valid pattern: {error}"
            ) from None


def _describe_invalid_value(spec: FieldSpec, value: Any) -> str:
    """Return the end of the message on an invalid value of a property; empty if the value is valid.

    Args:
        spec: property.
        value: value of the property, or one value of a list.
    """
    value_type = spec.kind
    if not isinstance(value_type, Value) or value is None:
        return ""
    if value_type.choices and value not in value_type.choices:
        return f"; expected {join_words(map(repr, value_type.choices))}{suggest_name(str(value), map(str, value_type.choices))}"
    if isinstance(value, float) and value != value:
        return ", which is not a number"
    if (
        value_type.domain
        and value_type.scalar in ("double", "int")
        and not make_domain_test(value_type.domain)(value)
    ):
        return f"; expected {value_type.domain}"
    return ""


def _get_tag(study_object: Object) -> str:
    """Return the XML tag of a part."""
    return study_object.class_name if isinstance(study_object, Unknown) else type(study_object).tag
