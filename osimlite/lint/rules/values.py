"""OSIM20x: numbers and switches that OpenSim ignores or reads in part."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from osimlite.base.text import find_nearest, join_words
from osimlite.io.document.lexical import (
    UncleanText,
    is_read_as,
    parse_flag,
    parse_integer,
    parse_real,
    split_words,
)
from osimlite.io.document.notes import Note
from osimlite.lint.diagnostic import Consequence
from osimlite.lint.fixes import replace_text
from osimlite.lint.registry import ERROR, FAILS, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_value
from osimlite.schema.base import Object
from osimlite.schema.fields import Value, real
from osimlite.schema.specs import FieldSpec, get_field_specs

KEEPS_DEFAULT = "OpenSim keeps the default"
"""Consequence of an unreadable value after which OpenSim continues, in messages."""

_SEPARATORS = ",;"
"""Separators of numbers in other languages and programs."""
_ONE_NUMBER = real()
_DECIMAL_COMMA = re.compile(r"[+-]?\d+(?:,\d+)?")


@rule("OSIM201", "unreadable-value", severity=ERROR, fixes="safe", consequences=(REFUSES, RUNS))
def report_unreadable_value(subject: Subject, report: FindingCollector) -> None:
    """A value has a form that OpenSim cannot read.

    Reports text that OpenSim cannot read: words where a number belongs, `yes` for a switch, commas
    or brackets between the numbers of a vector.

    OpenSim writes a line to its log, ignores the value and keeps the default. A locked coordinate
    is then free, for example, or a contact sphere is at the origin. If OpenSim reads the intended
    value anyway, such as false for `no`, the finding is a warning.

    ```xml
    - <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <location>0, -0.2, 0</location>
    + <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <location>0 -0.2 0</location>
          <radius>0.05</radius> </ContactSphere>
    ```
    """
    for note, owner, spec, kind in _find_value_notes(
        subject, "unreadable", "ignored", "too-few", "too-many"
    ):
        # If only the count is wrong, OSIM202 reports it.
        if note.kind.startswith("too-") and _are_readable(note.word, kind):
            continue
        text = _get_text(owner, spec)
        better = _make_readable(text, kind)
        used_value = spec.default if note.value is None and not kind.legacy else note.value
        report(
            f"{subject.describe_property(owner, spec)} is '{text}', expected "
            f"{kind.words()}{_describe_foreign_characters(text)}: "
            f"{_describe_used_value(note, owner, spec, kind)}",
            owner,
            number=note.number,
            word=note.word,
            consequence=_get_consequence(note, spec, kind),
            suggestion=better,
            fix=replace_text(subject.source, subject.position(owner, tag=spec.tag), better)
            # A value of several lines may hold comments, which a replacement would lose.
            if "\n" not in text
            else None,
            # If OpenSim happens to read the intended value, the motion is right.
            severity=WARNING
            if better is not None and is_read_as(better, kind, used_value)
            else None,
        )


@rule("OSIM202", "wrong-count", severity=ERROR, consequences=(REFUSES, RUNS))
def report_wrong_count(subject: Subject, report: FindingCollector) -> None:
    """A value has too many or too few numbers.

    Reports vectors and lists whose length differs from that of the property.

    If there are too few numbers, OpenSim uses the default. If there are too many, it uses the first
    ones, or the default.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, kind in _find_value_notes(subject, "too-many", "too-few"):
        # Words that cannot be read have OSIM201.
        if not _are_readable(note.word, kind):
            continue
        count = len(split_words(note.word))
        report(
            f"{subject.describe_property(owner, spec)} expects {kind.words()}, found {count}: "
            f"{_describe_used_value(note, owner, spec, kind)}",
            owner,
            tag=spec.tag,
            consequence=_get_consequence(note, spec, kind),
        )


@rule("OSIM203", "cut-number", severity=ERROR, fixes="unsafe", consequences=(RUNS,))
def report_cut_number(subject: Subject, report: FindingCollector) -> None:
    """OpenSim reads only the beginning of a number.

    Reports numbers with trailing characters: a decimal comma (`1,5`), a unit (`5kg`), a fraction
    (`1/3`), hexadecimal digits (`0x10`), Fortran's exponent (`1d3`).

    OpenSim reads the longest beginning that is a number and ignores the rest without a message:
    `1,5` is 1, `0x10` is 0. If only a separator follows, as in `0.1, 0.5`, OpenSim reads the
    intended number, and the finding is a warning.

    ```xml
    - <Body name="thigh"> <mass>8,5</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8.5</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, _ in _find_value_notes(subject, "cut"):
        report(
            f"{subject.describe_property(owner, spec)}: OpenSim reads '{note.word}' as "
            f"{format_value(_read_beginning(note.word))}",
            owner,
            number=note.number,
            word=note.word,
            suggestion=(better := _complete_number(note.word)),
            fix=replace_text(
                subject.source,
                subject.position(owner, tag=spec.tag, word=note.word),
                better,
                safe=False,
            ),
            severity=WARNING if better == note.word.rstrip(_SEPARATORS) else None,
        )


@rule("OSIM204", "empty-value", severity=ERROR, consequences=(REFUSES, RUNS, FAILS))
def report_empty_value(subject: Subject, report: FindingCollector) -> None:
    """An element that should hold a value is empty.

    Reports empty numbers, vectors and switches, and empty elements that should contain an object.
    Optional properties may be empty.

    OpenSim usually writes a line to its log and keeps the default; the finding is then a warning. It
    is an error in two cases. The mass of a body has no default, and numbers of older setup classes
    have none either, such as `initial_time` of AnalyzeTool: OpenSim rejects the file. If an object
    is missing, OpenSim fails as soon as it needs one.

    ```xml
      <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    -     <mass_center></mass_center>
    +     <mass_center>0 -0.2 0</mass_center>
      </Body>
    ```
    """
    for note, owner, spec, kind in _find_value_notes(subject, "empty"):
        if kind.shape != "optional":
            report(
                f"{subject.describe_property(owner, spec)} is empty, expected {kind.words()}: "
                f"{_describe_used_value(note, owner, spec, kind)}",
                owner,
                number=note.number,
                consequence=REFUSES,
                # OpenSim keeps the default of most values without a message.
                severity=ERROR if _is_refused(note, spec, kind) else WARNING,
            )
    for note in subject.notes:
        note_spec = note.spec
        if (
            note.kind == "empty"
            and note.owner is not None
            and note_spec is not None
            and note_spec.accepts is not None
        ):
            report(
                f"<{note_spec.tag}> of {describe_object(note.owner)} is empty: OpenSim then has no "
                f"{note_spec.accepts.tag} there, not even the default, and fails as soon as it needs one; "
                "leave the element out",
                note.owner,
                consequence=FAILS,
                number=note.number,
            )


def _find_value_notes(
    subject: Subject, *kinds: str
) -> Iterator[tuple[Note, Object, FieldSpec, Value]]:
    # What is left of a value with elements inside means nothing, and what OpenSim rejects has no
    # default.
    broken = {note.number for note in subject.notes if note.kind == "child-in-value"}
    broken.update(refusal.number for refusal in subject.refusals)
    for note in subject.notes:
        spec = note.spec
        if note.kind not in kinds or note.number in broken or note.owner is None or spec is None:
            continue
        if isinstance(spec.kind, Value):
            yield note, note.owner, spec, spec.kind


def _read_beginning(word: str) -> object:
    try:
        return parse_real(word)
    except UncleanText as unclean:
        return unclean.value


def _are_readable(text: str, kind: Value) -> bool:
    """Return whether every word is readable, so that only their number is wrong."""
    readers: dict[str, Callable[[str], object]] = {
        "double": parse_real,
        "int": parse_integer,
        "bool": parse_flag,
        "string": str,
    }
    parse = readers[kind.scalar]
    try:
        for word in split_words(text):
            parse(word)
    except UncleanText:
        return False
    return True


def _get_text(owner: Object, spec: FieldSpec) -> str:
    raw = owner.layout.raw.get(spec.name) if owner.layout is not None else None
    return " ".join(split_words(raw[1])) if raw else ""


def _is_refused(note: Note, spec: FieldSpec, kind: Value) -> bool:
    """Return whether OpenSim rejects a file for a value that it cannot read."""
    # `note.value` is what OpenSim reads instead, if it continues.
    return note.value is None and (
        kind.legacy or (spec.tag == "mass" and spec.default != spec.default)
    )


def _get_consequence(note: Note, spec: FieldSpec, kind: Value) -> Consequence:
    """Return what OpenSim does because of a value that it cannot read."""
    return REFUSES if _is_refused(note, spec, kind) else RUNS


def _describe_used_value(note: Note, owner: Object, spec: FieldSpec, kind: Value) -> str:
    """Return which value OpenSim uses instead."""
    if note.value is not None:
        return f"OpenSim reads {format_value(note.value)}"
    if kind.legacy:
        return "OpenSim rejects the file"
    if spec.tag == "mass" and spec.default != spec.default:
        return "without a mass OpenSim rejects the file"
    return f"{KEEPS_DEFAULT}, {format_value(get_field_specs(type(owner))[spec.tag].default)}"


def _describe_foreign_characters(text: str) -> str:
    """Return which characters of a number only look like ASCII; empty without any."""
    # Such characters come from PDF files and word processors.
    foreign = [character for character in dict.fromkeys(text) if not character.isascii()]
    if not foreign:
        return ""
    import unicodedata

    names = [
        f"U+{ord(letter):04X} ({unicodedata.name(letter, 'without a name').lower()})"
        for letter in foreign
    ]
    return f", but the text contains {join_words(names, max_count=3)}"


def _make_readable(text: str, kind: Value) -> str | None:
    """Return the value as OpenSim would read it, if it is obvious; otherwise None."""
    if kind.scalar == "bool":
        flag_words = {"yes": "true", "on": "true", "1": "true", "no": "false", "off": "false"}
        # A slip such as "ture" is taken for the nearest word.
        return flag_words.get(text.lower()) or find_nearest(text.lower(), ("true", "false"))
    if kind.scalar == "double":
        # Brackets and separators of other languages, and invisible characters.
        plain = _replace_digits(text)
        words = re.sub(r"[,;()\[\]{}~\u200b\ufeff]", " ", plain).split()
        try:
            for word in words:
                float(word)
        except ValueError:
            return None
        # One plain number would not have been unreadable.
        candidates = [words] if len(words) > 1 or not text.isascii() else []
        if re.search(r"\d,\d", plain) and all(map(_DECIMAL_COMMA.fullmatch, plain.split())):
            candidates.append(plain.replace(",", ".").split())
        possible = [words for words in candidates if _has_valid_count(words, kind)]
        # A comma may separate numbers or be a decimal comma; only the count can tell.
        if len(possible) == 1:
            return " ".join(possible[0])
    return None


def _has_valid_count(words: list[str], kind: Value) -> bool:
    if kind.size is not None:
        return len(words) == kind.size
    return kind.least <= len(words) and (kind.most is None or len(words) <= kind.most)


def _replace_digits(text: str) -> str:
    """Return the text with minus signs and digits of other scripts replaced by ASCII."""
    import unicodedata

    # NFKC maps wide and other digits to ASCII; hyphens and dashes are left to the table.
    return unicodedata.normalize("NFKC", text).translate(
        dict.fromkeys((0x2010, 0x2011, 0x2012, 0x2013, 0x2212), "-")
    )


def _complete_number(word: str) -> str | None:
    """Return the intended number, if it is obvious; otherwise None."""
    plain = word.rstrip(_SEPARATORS)
    if plain != word and is_read_as(plain, _ONE_NUMBER, _read_beginning(word)):
        return plain
    # A comma with digits on both sides is a decimal comma.
    comma = re.fullmatch(r"([+-]?\d+),(\d+)", word)
    if comma:
        return f"{comma[1]}.{comma[2]}"
    # Fortran writes "1d3" for double precision.
    if re.fullmatch(r"[+-]?[\d.]+[dD][+-]?\d+", word):
        return re.sub("[dD]", "e", word)
    if re.fullmatch(r"0[xX][0-9a-fA-F]+", word):
        return str(int(word, 16))
    unit = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:[a-zA-Z]+|°|%)", word)
    return unit[1] if unit else None
