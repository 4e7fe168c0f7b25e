"""OSIM20x: numbers and switches that OpenSim drops or cuts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from osimlite.base.text import find_nearest, join_words
from osimlite.io.document.lexical import Unclean, flag, reads_as, real, split, whole
from osimlite.io.document.notes import Note
from osimlite.lint.fixes import replaced
from osimlite.lint.registry import ERROR, WARNING, FindingSink, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called, shown
from osimlite.schema.base import Object
from osimlite.schema.fields import Value
from osimlite.schema.specs import FieldSpec, field_specs

KEEPS_DEFAULT = "OpenSim keeps the default"
"""What a message says of a value that OpenSim cannot read, where it goes on."""


@rule("OSIM201", "unreadable-value", severity=ERROR, mends="safe")
def unreadable_value(subject: Subject, report: FindingSink) -> None:
    """A value is no number, no switch, or not written as OpenSim reads it.

    Reports text that OpenSim cannot read: words where a number belongs, `yes` for a switch, commas
    or brackets between the numbers of a vector.

    OpenSim writes a line to its log, drops the value and keeps the default. A locked coordinate
    comes loose, a contact sphere sits at the origin. Where OpenSim takes what was plainly meant all
    the same, as false for `no`, it is a warning.

    ```xml
    - <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <location>0, -0.2, 0</location>
    + <ContactSphere name="heel"> <socket_frame>/bodyset/shank</socket_frame> <location>0 -0.2 0</location>
          <radius>0.05</radius> </ContactSphere>
    ```
    """
    for note, owner, spec, kind in _value_notes(
        subject, "unreadable", "ignored", "too-few", "too-many"
    ):
        if note.kind.startswith("too-") and _all_read(note.word, kind):
            continue
        text = _text(owner, spec)
        better = _readable(text, kind)
        taken = spec.default if note.value is None and not kind.legacy else note.value
        report(
            f"{subject.titled(owner, spec)} is '{text}', not {kind.words()}{_foreign(text)}: "
            f"{_kept(note, owner, spec, kind)}",
            owner,
            number=note.number,
            word=note.word,
            suggestion=better,
            fix=replaced(subject.source, subject.position(owner, tag=spec.tag), better)
            if "\n" not in text
            else None,
            severity=WARNING if better is not None and reads_as(better, kind, taken) else None,
        )


@rule("OSIM202", "wrong-count", severity=ERROR)
def wrong_count(subject: Subject, report: FindingSink) -> None:
    """A value has too many or too few numbers.

    Reports vectors and lists with another count than the property has.

    Of too few numbers OpenSim keeps none and takes the default; of too many it takes the first
    ones, or none.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, kind in _value_notes(subject, "too-many", "too-few"):
        if not _all_read(note.word, kind):
            continue
        count = len(split(note.word))
        report(
            f"{subject.titled(owner, spec)} takes {kind.words()}, not {count}: {_kept(note, owner, spec, kind)}",
            owner,
            tag=spec.tag,
        )


@rule("OSIM203", "cut-number", severity=ERROR, mends="unsafe")
def cut_number(subject: Subject, report: FindingSink) -> None:
    """OpenSim reads only the beginning of a number.

    Reports numbers with something behind them: a decimal comma (`1,5`), a unit (`5kg`), a fraction
    (`1/3`), hexadecimal digits (`0x10`), Fortran's exponent (`1d3`).

    OpenSim takes the longest beginning that is a number and ignores the rest in silence: `1,5` is
    1, `0x10` is 0.

    ```xml
    - <Body name="thigh"> <mass>8,5</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8.5</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner, spec, _ in _value_notes(subject, "cut"):
        report(
            f"{subject.titled(owner, spec)}: OpenSim reads '{note.word}' as {shown(_beginning(note.word))}",
            owner,
            number=note.number,
            word=note.word,
            suggestion=(better := _whole_number(note.word)),
            fix=replaced(
                subject.source,
                subject.position(owner, tag=spec.tag, word=note.word),
                better,
                safe=False,
            ),
        )


@rule("OSIM204", "empty-value", severity=ERROR)
def empty_value(subject: Subject, report: FindingSink) -> None:
    """An element that should hold a value is empty.

    Reports empty numbers, vectors and switches, and elements in which an object should stand.
    Properties that may be left out may also be empty.

    OpenSim writes a line to its log and keeps the default: that is a warning. The mass of a body
    has no default, nor have numbers of setups of older classes, as `initial_time` of AnalyzeTool:
    OpenSim refuses the file. Where an object should stand OpenSim then has none, and fails as soon
    as it needs one. Both are errors.

    ```xml
      <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    -     <mass_center></mass_center>
    +     <mass_center>0 -0.2 0</mass_center>
      </Body>
    ```
    """
    for note, owner, spec, kind in _value_notes(subject, "empty"):
        if kind.shape != "optional":
            report(
                f"{subject.titled(owner, spec)} is empty, not {kind.words()}: {_kept(note, owner, spec, kind)}",
                owner,
                number=note.number,
                severity=ERROR if _is_refused(note, spec, kind) else WARNING,
            )
    for note in subject.notes:
        held = note.spec
        if (
            note.kind == "empty"
            and note.owner is not None
            and held is not None
            and held.accepts is not None
        ):
            report(
                f"<{held.tag}> of {called(note.owner)} is empty: OpenSim then has no {held.accepts.tag} there, not "
                "even the default, and fails where it needs one; leave the element out",
                note.owner,
                number=note.number,
            )


def _value_notes(subject: Subject, *kinds: str) -> Iterator[tuple[Note, Object, FieldSpec, Value]]:
    # What is left of a value with elements inside means nothing, and what OpenSim refuses has no
    # default.
    broken = {note.number for note in subject.notes if note.kind == "child-in-value"}
    broken.update(refusal.number for refusal in subject.refusals)
    for note in subject.notes:
        spec = note.spec
        if note.kind not in kinds or note.number in broken or note.owner is None or spec is None:
            continue
        if isinstance(spec.kind, Value):
            yield note, note.owner, spec, spec.kind


def _beginning(word: str) -> object:
    try:
        return real(word)
    except Unclean as unclean:
        return unclean.value


def _all_read(text: str, kind: Value) -> bool:
    """Whether every word is one of its kind, so that only their count is wrong."""
    readers: dict[str, Callable[[str], object]] = {
        "double": real,
        "int": whole,
        "bool": flag,
        "string": str,
    }
    reads = readers[kind.scalar]
    try:
        for word in split(text):
            reads(word)
    except Unclean:
        return False
    return True


def _text(owner: Object, spec: FieldSpec) -> str:
    raw = owner.layout.raw.get(spec.name) if owner.layout is not None else None
    return " ".join(split(raw[1])) if raw else ""


def _is_refused(note: Note, spec: FieldSpec, kind: Value) -> bool:
    """Return whether OpenSim refuses to load a file for a value that it cannot read."""
    return note.value is None and (
        kind.legacy or (spec.tag == "mass" and spec.default != spec.default)
    )


def _kept(note: Note, owner: Object, spec: FieldSpec, kind: Value) -> str:
    """What OpenSim goes on with."""
    if note.value is not None:
        return f"OpenSim takes {shown(note.value)}"
    if kind.legacy:
        return "OpenSim refuses to load the file"
    if spec.tag == "mass" and spec.default != spec.default:
        return "without a mass OpenSim refuses to load the file"
    return f"{KEEPS_DEFAULT}, {shown(field_specs(type(owner))[spec.tag].default)}"


def _foreign(text: str) -> str:
    """Which characters of a number cannot be told from others by looking at them."""
    odd = [character for character in dict.fromkeys(text) if not character.isascii()]
    if not odd:
        return ""
    import unicodedata

    names = [f"U+{ord(c):04X} ({unicodedata.name(c, 'without a name').lower()})" for c in odd]
    return f" (there is {join_words(names, most=3)} in it)"


def _readable(text: str, kind: Value) -> str | None:
    """The same value as OpenSim would read it, if that is plain."""
    if kind.scalar == "bool":
        known = {"yes": "true", "on": "true", "1": "true", "no": "false", "off": "false"}
        return known.get(text.lower()) or find_nearest(text.lower(), ("true", "false"))
    if kind.scalar == "double":
        words = re.sub(r"[,;()\[\]{}~\u200b\ufeff]", " ", _plain_digits(text)).split()
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            return None
        if (len(words) > 1 or not text.isascii()) and (
            kind.size is None or len(numbers) == kind.size
        ):
            return " ".join(words)
    return None


def _plain_digits(text: str) -> str:
    """The text with minus signs and digits of word processors and other scripts as ASCII has them."""
    import unicodedata

    return unicodedata.normalize("NFKC", text).translate(
        dict.fromkeys((0x2010, 0x2011, 0x2012, 0x2013, 0x2212), "-")
    )


def _whole_number(word: str) -> str | None:
    """The number that was meant, if that is plain."""
    comma = re.fullmatch(r"([+-]?\d+),(\d+)", word)
    if comma:
        return f"{comma[1]}.{comma[2]}"
    if re.fullmatch(r"[+-]?[\d.]+[dD][+-]?\d+", word):
        return re.sub("[dD]", "e", word)
    if re.fullmatch(r"0[xX][0-9a-fA-F]+", word):
        return str(int(word, 16))
    unit = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:[a-zA-Z]+|°|%)", word)
    return unit[1] if unit else None
