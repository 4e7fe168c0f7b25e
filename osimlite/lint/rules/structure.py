"""OSIM101, OSIM104 and OSIM107: elements that are no properties, are repeated, or are in a value."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.base.text import add_article, find_nearest, format_count, join_words
from osimlite.io.document.lexical import is_read_as
from osimlite.io.document.notes import Note
from osimlite.io.document.source import Source
from osimlite.lint.diagnostic import Fix, Severity
from osimlite.lint.fixes import comment_out, remove_element, rename_tag
from osimlite.lint.old_tags import Successor, is_comment, reason_unused, successor
from osimlite.lint.registry import ERROR, INFO, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.rules.classes import find_part, find_set, find_wrapper
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_value
from osimlite.schema.base import Object
from osimlite.schema.fields import ObjectField, Reference, Value
from osimlite.schema.model import CURRENT_VERSION, Model
from osimlite.schema.registry import find_classes_mentioning
from osimlite.schema.specs import FieldSpec, get_field_specs


@rule("OSIM101", "unknown-tag", severity=ERROR, fixes="both", consequences=(RUNS,))
def report_unknown_tag(subject: Subject, report: FindingCollector) -> None:
    """An element is not a property of its object.

    Reports child elements that the class does not have: misspelt, in the wrong case, of another
    class, or of another version. Suggests the nearest correct tag.

    OpenSim ignores such an element without a message and keeps the default. With a misspelt
    `<stiffness>` a contact stiffness is 0, and the motion becomes NaN; with a misspelt `<ForceSet>`
    a model has no forces. Harmless elements are a warning: a misspelt element with the default
    value, and a property of an older version in a setup. An element that OpenSim ignores in files
    of every version, such as the `<location>` of a MovingPathPoint, is a warning, too. A
    `<Comment>` is an info. An element in a setup is also an info if it is empty, or disables
    something that is disabled anyway. If several elements have the same tag, only the first is
    reported, with the number of the others.

    ```xml
      <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    -     <mass_centre>0 -0.2 0</mass_centre>
    +     <mass_center>0 -0.2 0</mass_center>
      </Body>
    ```
    """
    groups: dict[tuple[object, ...], list[_UnknownTag]] = {}
    for note, owner in subject.notes_of("unknown-tag"):
        # Wrappers and parts have rules that say more.
        if find_wrapper(note, owner) is not None or find_part(note, owner) is not None:
            continue
        old_successor = successor(type(owner), note.word)
        if old_successor is not None:
            _report_old(subject, report, note, owner, old_successor)
            continue
        # Equal faults in many objects, such as a tag that a program writes everywhere, are one
        # finding.
        item = _describe_unknown(subject, note, owner)
        groups.setdefault((note.word, item.suggestion, item.severity), []).append(item)
    for first, *similar in groups.values():
        count_note = (
            f" (<{first.note.word}> occurs {format_count(len(similar), 'more time')} in this file)"
            if similar
            else ""
        )
        report(
            first.message + count_note,
            first.owner,
            number=first.note.number,
            suggestion=first.suggestion,
            fix=_merge_fixes([first.fix, *(similar_tag.fix for similar_tag in similar)]),
            severity=first.severity,
        )


class _UnknownTag(NamedTuple):
    """Element that is not a property, with its message."""

    note: Note
    owner: Object
    message: str
    severity: Severity
    suggestion: str | None = None
    fix: Fix | None = None


def _describe_unknown(subject: Subject, note: Note, owner: Object) -> _UnknownTag:
    """Return the message about an element that no version has as a property."""
    reason = reason_unused(type(owner), note.word)
    if reason is not None:
        fix = remove_element(subject.source, note.number)
        message = (
            f"OpenSim 4.6 ignores <{note.word}> of {describe_object(owner)} in files of all "
            f"versions: {reason}; delete it"
        )
        # Old programs write the tags of setups also where they have no value.
        is_empty = subject.model is None and _is_switched_off(subject, note.number)
        return _UnknownTag(note, owner, message, INFO if is_empty else WARNING, fix=fix)
    if is_comment(note.word):
        message = (
            f"<{note.word}> in {describe_object(owner)} is a comment written as an element; "
            "OpenSim ignores it"
        )
        return _UnknownTag(note, owner, message, INFO, fix=comment_out(subject.source, note.number))
    specs = get_field_specs(type(owner))
    # Former names are far from the present ones in spelling; they are looked up first.
    suggestion = find_nearest(_FORMER.get(note.word, note.word), specs, cutoff=70)
    # A similar spelling is no help if the content cannot stand there.
    if suggestion is not None and not _can_hold(subject, note, specs[suggestion]):
        suggestion = None
    message = f"{describe_object(owner)} has no property <{note.word}>; OpenSim ignores it"
    if suggestion is not None:
        default_text = _format_default(specs[suggestion])
        # If the object also has the correct tag, OpenSim does not use the default.
        message += (
            f" and keeps the default of {suggestion}{default_text}"
            if suggestion not in _list_explicit_tags(owner)
            else ""
        )
    elif note.value is not None:
        message += f": {add_article(note.word)} cannot stand in {add_article(type(owner).tag)}"
        # The element is a known object: say where it belongs.
        home = find_set(note.value)
        message += f"; it belongs in the {home}" if home and isinstance(owner, Model) else ""
    else:
        homes = list_homes(note.word, type(owner))
        message += f": it is a property of {join_words(homes, max_count=3)}" if homes else ""
    # Only the letter case is wrong: the fix is certain.
    is_same_word = suggestion is not None and suggestion.lower() == note.word.lower()
    # Renaming is no fix if the property is given as well: it would be there twice.
    is_missing = suggestion is not None and suggestion not in _list_explicit_tags(owner)
    fix = (
        rename_tag(subject.source, note.number, suggestion, safe=is_same_word)
        if is_missing
        else None
    )
    severity = ERROR
    # Old setups keep switched-off properties of tools that no longer have them.
    if not is_missing and subject.model is None:
        severity = INFO if _is_switched_off(subject, note.number) else WARNING
    elif (
        is_missing
        and suggestion is not None
        and _is_default(subject, note.number, specs[suggestion])
    ):
        severity = WARNING
    return _UnknownTag(note, owner, message, severity, suggestion, fix)


def _can_hold(subject: Subject, note: Note, spec: FieldSpec) -> bool:
    """Return whether the content of an element may stand in a property: text in a value, objects in a part."""
    if subject.source is None:
        return True
    children = subject.source.children(note.number)
    has_text = bool(_get_inner_text(subject, note.number).strip()) and not children
    if isinstance(spec.kind, ObjectField):
        return not has_text
    return not children


def _merge_fixes(fixes: Sequence[Fix | None]) -> Fix | None:
    """Return one fix that does what several do; None if one of them is missing."""
    existing_fixes = [fix for fix in fixes if fix is not None]
    # A single finding keeps its fix; a fix of a group must correct all.
    if len(existing_fixes) < len(fixes) or not existing_fixes:
        return existing_fixes[0] if len(fixes) == 1 and existing_fixes else None
    return Fix(
        tuple(edit for fix in existing_fixes for edit in fix.edits),
        all(fix.safe for fix in existing_fixes),
    )


def _get_inner_text(subject: Subject, number: int) -> str:
    assert subject.source is not None
    span = subject.source.spans[number]
    return subject.source.text[span.tag_end : span.inner_end]


def _is_switched_off(subject: Subject, number: int) -> bool:
    """Return whether an element is empty, or only disables something."""
    return _OFF.fullmatch(_get_inner_text(subject, number)) is not None


def _is_default(subject: Subject, number: int, spec: FieldSpec) -> bool:
    """Return whether an element has the default value of the property, so ignoring it does not matter."""
    text = _get_inner_text(subject, number)
    if isinstance(spec.kind, ObjectField):
        return spec.kind.form == "list" and not text.strip()
    return is_read_as(text, spec.kind, spec.default)


def _repeats_first(subject: Subject, owner: Object, number: int) -> bool:
    """Return whether an element has the same content as the first of its tag in the same object."""
    assert subject.source is not None and owner._index is not None
    spans, end = subject.source.spans, 0
    for first in range(owner._index + 1, number):
        # `end` passes over the descendants of each child, so that only children of the owner are
        # compared.
        if spans[first].start >= end:
            if spans[first].tag == spans[number].tag:
                return (
                    _get_inner_text(subject, first).split()
                    == _get_inner_text(subject, number).split()
                )
            end = spans[first].end
    return False


def _report_old(
    subject: Subject, report: FindingCollector, note: Note, owner: Object, successor_tag: Successor
) -> None:
    """Report a tag of an older format."""
    replacement = f"write <{successor_tag.tag}>" if successor_tag.tag is not None else ""
    advice = "; " + ", ".join(part for part in (replacement, successor_tag.hint) if part)
    version = subject.version or CURRENT_VERSION
    if version < successor_tag.since:
        # The tag fits the version, but the reader has not used this element.
        report(
            f"<{note.word}> of {describe_object(owner)} is repeated, or is in the wrong place of a "
            f"file of version {version}: OpenSim ignores it",
            owner,
            number=note.number,
        )
        return
    report(
        f"<{note.word}> of {describe_object(owner)} belongs to files before version {successor_tag.since}; "
        f"this file has version {version}, so OpenSim ignores it{advice}",
        owner,
        number=note.number,
        suggestion=successor_tag.tag,
    )


@rule("OSIM104", "duplicate-tag", severity=ERROR, fixes="safe", consequences=(RUNS,))
def report_duplicate_tag(subject: Subject, report: FindingCollector) -> None:
    """A property is given twice.

    Reports every repetition of a property in one object.

    OpenSim uses the first element and ignores the others, while a person who reads the file may
    expect the last one to count. A repetition with the same content is a warning.

    ```xml
    - <Body name="thigh"> <mass>8</mass> <mass>9</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>9</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner in subject.notes_of("duplicate-tag"):
        assert note.spec is not None
        value = getattr(owner, note.spec.name)
        used_value = ""
        if not isinstance(note.spec.kind, ObjectField):
            text = format_value(value)
            used_value = f" ('{text if len(text) <= 60 else f'{text[:57]}...'}')"
        # Two objects of different classes in a property that holds one.
        if note.word != note.spec.tag:
            report(
                f"<{note.spec.tag}> of {describe_object(owner)} holds one object; OpenSim uses "
                f"the first and ignores this {note.word}",
                owner,
                number=note.number,
                fix=remove_element(subject.source, note.number),
            )
            continue
        report(
            f"{describe_object(owner)} has <{note.word}> more than once; OpenSim uses the "
            f"first{used_value} and ignores this one",
            owner,
            number=note.number,
            fix=remove_element(subject.source, note.number),
            severity=WARNING if _repeats_first(subject, owner, note.number) else None,
        )


@rule("OSIM107", "element-in-value", severity=ERROR, consequences=(REFUSES, RUNS))
def report_element_in_value(subject: Subject, report: FindingCollector) -> None:
    """A value contains an element.

    Reports elements inside a number, a switch, a text or a reference. Also reports comments,
    processing instructions and CDATA sections in the middle of such a value. A comment before or
    after the value is harmless. A CDATA section must contain the whole value, without white space
    around a name or a number.

    OpenSim rejects the file.

    ```xml
    - <Body name="thigh"> <mass><value>8</value></mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner in subject.notes_of("child-in-value"):
        assert note.spec is not None
        # The reader marks comments, processing instructions and CDATA sections alike.
        if note.word == "!--":
            interruption = _describe_interruption(subject, note.number)
            if not interruption:
                continue
            report(
                f"there is {interruption} in the middle of {subject.describe_property(owner, note.spec)}: "
                "OpenSim rejects the file",
                owner,
                consequence=REFUSES,
                number=note.number,
            )
            continue
        report(
            f"<{note.spec.tag}> of {describe_object(owner)} is a value and cannot contain "
            f"<{note.word}>: OpenSim rejects the file",
            owner,
            consequence=REFUSES,
            number=note.number,
        )
    source = subject.source
    # The scan of CDATA sections runs only for texts that have one.
    if source is not None and "<![CDATA[" in source.text:
        for number in _find_cdata_elements(source):
            _report_cdata(subject, source, number, report)


def _describe_interruption(subject: Subject, number: int) -> str:
    """Return the markup inside a value; nothing for a CDATA section, which is reported apart."""
    inner_text = _get_inner_text(subject, number)
    if "<![CDATA[" in inner_text:
        return ""
    return "a comment" if "<!--" in inner_text else "a processing instruction"


def _find_cdata_elements(source: Source) -> Iterator[int]:
    """Yield the elements without children that hold a CDATA section."""
    holders: set[int] = set()
    starts = [span.start for span in source.spans]
    offset = source.text.find("<![CDATA[")
    while offset >= 0:
        # The element that begins last before a section holds it, unless it ends before.
        number = bisect_right(starts, offset) - 1
        if number >= 0 and offset < source.spans[number].inner_end and not source.children(number):
            holders.add(number)
        offset = source.text.find("<![CDATA[", offset + 1)
    yield from sorted(holders)


def _report_cdata(subject: Subject, source: Source, number: int, report: FindingCollector) -> None:
    """Report a value in a CDATA section, which OpenSim does not read as intended."""
    spec = _find_property(subject, source, number)
    if spec is None:
        return
    span = source.spans[number]
    inner_text = source.text[span.tag_end : span.inner_end]
    texts = [part for part in _SECTIONS.split(inner_text) if part.strip()]
    sections = _SECTION.findall(inner_text)
    position = source.position(span.tag_end + inner_text.index("<![CDATA["), len("<![CDATA["))
    # A value of several pieces is rejected, whatever the pieces are.
    if len(texts) + len(sections) > 1:
        report(
            "a CDATA section is only a part of this value: OpenSim rejects the file",
            at=position,
            consequence=REFUSES,
        )
    elif sections and not texts and sections[0] != sections[0].strip():
        if isinstance(spec.kind, Reference) and spec.kind.shape != "list":
            report(
                "OpenSim takes the white space in this CDATA section for a part of the name, and "
                "rejects the model",
                at=position,
                consequence=REFUSES,
            )
        elif (
            isinstance(spec.kind, Value)
            and spec.kind.shape == "single"
            and spec.kind.scalar != "string"
        ):
            report(
                "OpenSim does not read a value with white space around it in a CDATA section: it "
                "keeps the default, or rejects the model",
                at=position,
            )


def _find_property(subject: Subject, source: Source, number: int) -> FieldSpec | None:
    """Return the property that OpenSim reads from an element; None if it reads none."""
    span = source.spans[number]
    # The elements are numbered in document order, so the parent is the nearest earlier one that
    # ends later.
    above = next(
        (index for index in range(number - 1, -1, -1) if span.end <= source.spans[index].end), None
    )
    if above is None:
        return None
    for items in subject.by_class.values():
        for item in items:
            if item._index == above:
                specs = get_field_specs(type(item))
                old_successor = successor(type(item), span.tag)
                tag = (
                    old_successor.tag
                    if old_successor is not None and old_successor.tag is not None
                    else span.tag
                )
                spec = specs.get(tag)
                return spec if spec is not None and not isinstance(spec.kind, ObjectField) else None
    return None


_SECTION = compile_later(r"<!\[CDATA\[(.*?)\]\]>", re.DOTALL)
_SECTIONS = compile_later(r"<!\[CDATA\[.*?\]\]>|<!--.*?-->|<\?.*?>", re.DOTALL)
_OFF = compile_later(r"(?:\s++|(?:unassigned|false|-1(?:\.0*)?|0(?:\.0*)?)(?!\S))*", re.IGNORECASE)
_FORMER = {"enable_controller": "enabled"}
"""Names of properties in early releases, which OpenSim does not update in any file."""


def _list_explicit_tags(owner: Object) -> set[str]:
    return {
        spec.tag
        for spec in get_field_specs(type(owner)).values()
        if spec.name in owner.model_fields_set
    }


def _format_default(spec: FieldSpec) -> str:
    if isinstance(spec.kind, ObjectField) or spec.default in ("", (), None):
        return ""
    return f" ({format_value(spec.default)})"


def list_homes(tag: str, owner: type[Object]) -> list[str]:
    """Return the classes that have a property `tag`, without classes that inherit it from a listed one.

    In a model those of tools are left out, and the other way round.
    """
    homes = set()
    package = owner.__module__.rpartition(".")[0]
    for cls in find_classes_mentioning(tag):
        spec = get_field_specs(cls).get(tag)
        if spec is not None and spec.declared_in.__module__.rpartition(".")[0] == package:
            homes.add(spec.declared_in.__name__)
    return sorted(homes)
