"""Find the files of a project that OpenSim reads, by their suffixes and, for XML, by their beginning."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from osimlite.base.files import TABLE_SUFFIXES as TABLE_SUFFIXES
from osimlite.base.files import make_missing_error, read_at_most, unsaved
from osimlite.base.patterns import compile_later
from osimlite.errors import OsimliteError

BEGINNING_BYTES = 1 << 16
"""Number of bytes at the beginning of a file that decide whether it is OpenSim's."""

_ROOT = compile_later(r"<(?:[\w.-]+:)?OpenSimDocument\b")
_TAGS = compile_later(
    r"<(?:!--.*?-->|!\[CDATA\[.*?\]\]>|[?!][^>]*+>|(/?)([A-Za-z_][\w:.-]*)[^<>]*?(/?)>)", re.DOTALL
)
_TOP = compile_later(
    r"\w*(?:Tool|TaskSet|MarkerSet|ExternalLoads|ControlSet|ForceSet|ScaleSet)", re.IGNORECASE
)
# A name of several words, or of letters and digits, is hardly another program's.
_COMPOUND = compile_later(r"[a-z][A-Z]|[A-Z]{2}|_|\d")


def is_opensim_xml(beginning: bytes) -> bool:
    """Return whether XML with this beginning is OpenSim's: by its root, even misspelt, or its content.

    Content is OpenSim's if at least two elements are properties of the class of their parent.
    """
    # A file in UTF-16 is checked, too, and reported. UTF-16 of ASCII text is ASCII with zero bytes
    # between.
    text = beginning.replace(b"\0", b"").decode("latin-1")
    if _ROOT.search(text):
        return True
    open_tags: list[str] = []
    evidence: set[tuple[str, str]] = set()
    for number, (closing, name, is_empty) in enumerate(
        result for result in _TAGS.findall(text) if result[1]
    ):
        tag = name.rpartition(":")[2]
        # Malformed XML may lack closing tags, hence up to the matching one.
        if closing:
            while open_tags and open_tags.pop() != tag:
                pass
            continue
        if number == 0 and is_root(tag):
            return True
        if open_tags and _is_property(open_tags[-1], tag):
            evidence.add((open_tags[-1], tag))
            # A single property could be an accident.
            if len(evidence) > 1:
                return True
        if not is_empty:
            open_tags.append(tag)
    return False


def find_misspelt_name(word: str, candidates: Iterable[str]) -> str | None:
    """Return the known name that differs from a word in letter case and at most two letters; None without one.

    Args:
        word: word to compare.
        candidates: known names.
    """
    lower_word = word.lower()
    # Names of fewer than eight letters differ from many words by two letters.
    if len(word) < 8:
        return next((name for name in candidates if name.lower() == lower_word), None)
    letters = set(lower_word)
    # Each of two changes replaces at most one letter by another. Hardly a name passes, and importing
    # rapidfuzz takes as long as reading a small file.
    similar_names = [
        name
        for name in candidates
        if abs(len(name) - len(word)) <= 2 and len(letters.symmetric_difference(name.lower())) <= 4
    ]
    if not similar_names:
        return None
    if word in similar_names:
        return word
    from rapidfuzz.distance import OSA
    from rapidfuzz.process import extractOne

    result = extractOne(
        word, similar_names, scorer=OSA.distance, processor=str.lower, score_cutoff=2
    )
    return result[0] if result else None


def is_root(tag: str) -> bool:
    """Return whether a root tag is OpenSim's: of a document, or of a setup of an old release."""
    if find_misspelt_name(tag, ["OpenSimDocument"]) is not None:
        return True
    name = _find_class_name(tag)
    return name is not None and _TOP.fullmatch(name) is not None


@cache
def _find_class_name(tag: str) -> str | None:
    """Return the class that a tag means, even if it is misspelt or an old name."""
    from osimlite.io.document.upgrade.class_names import RENAMED
    from osimlite.schema.registry import MODULES

    class_names = {**{name: name for name in MODULES}, **RENAMED}
    result = tag if tag in class_names else find_misspelt_name(tag, class_names)
    return None if result is None else class_names[result]


@cache
def _is_property(owner: str, tag: str) -> bool:
    """Return whether an element is a property of its parent, and both are unlikely in other programs."""
    name = _find_class_name(owner)
    if name is None or not (_COMPOUND.search(name) or _COMPOUND.search(tag)):
        return False
    from osimlite.schema.registry import find_class
    from osimlite.schema.specs import get_field_specs

    cls = find_class(name)
    return cls is not None and tag in get_field_specs(cls)


DOCUMENTS = (".xml", ".omoco")
"""Suffixes of setups of tools and of their parts."""
PROJECT = (".osim", *DOCUMENTS, *TABLE_SUFFIXES)
"""Suffixes of all files of a project."""


def is_table(file: str | None) -> bool:
    """Return whether a file is a table, by its name."""
    return file is not None and file.lower().endswith(TABLE_SUFFIXES)


def is_document(file: str | None) -> bool:
    """Return whether a file may be a document other than a model, by its name; standard input may be one."""
    return file is not None and (file == "<stdin>" or file.lower().endswith(DOCUMENTS))


def find_project_files(
    paths: Iterable[str | Path],
    suffixes: tuple[str, ...] = PROJECT,
    *,
    only_ours: bool = False,
    passed: list[str] | None = None,
) -> list[str]:
    """Return the named files, and OpenSim's files with some suffixes in the named folders, each once.

    With `only_ours`, XML files of other programs are skipped even if they are named. Skipped files
    are added to `passed`.

    Raises:
        MissingFileError: a path does not exist.
        MissingFolderError: a path without a suffix does not exist.
        OsimliteError: a folder contains no OpenSim file.
    """  # noqa: DOC501 - a function makes the error, which is named
    result: list[str] = []
    skipped: list[str] = [] if passed is None else passed
    for path in paths:
        if os.path.isdir(path):
            matching_files = (
                file for file in Path(path).rglob("*.*") if file.suffix.lower() in suffixes
            )
            folder_files = sorted(str(file) for file in matching_files if not file.is_dir())
            below = [file for file in folder_files if is_opensim_file(file)]
            if not below:
                raise OsimliteError(
                    f"no OpenSim file in this folder: no {', '.join(suffixes[:-1])} or "
                    f"{suffixes[-1]}",
                    file=str(path),
                )
            result += below
            skipped += sorted({*folder_files}.difference(below))
        elif (
            str(path) != "-" and not os.path.lexists(path) and os.path.realpath(path) not in unsaved
        ):
            raise make_missing_error(path, may_be_folder=True)
        elif not only_ours or is_opensim_file(str(path)):
            result.append(str(path))
        else:
            skipped.append(str(path))
    # A file that is named twice keeps the first spelling of its path.
    return list({os.path.abspath(file): file for file in reversed(result)}.values())[::-1]


def is_opensim_file(file: str) -> bool:
    """Return whether a file is OpenSim's, by its name and, for XML, its beginning."""
    if not file.lower().endswith(".xml"):
        return True
    try:
        return is_opensim_xml(read_at_most(file, BEGINNING_BYTES))
    # An unreadable file is reported by the check, not skipped.
    except OsimliteError:
        return True
