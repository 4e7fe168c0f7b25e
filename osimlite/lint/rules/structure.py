"""OSIM1xx: elements and attributes that OpenSim passes over, or that stand in the wrong place."""

from __future__ import annotations

import re
from collections.abc import Sequence

from osimlite.document.lexical import reads_as
from osimlite.document.notes import Note
from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.fixes import renamed, replaced, without_element
from osimlite.lint.old_tags import Successor, successor
from osimlite.lint.subject import Subject
from osimlite.lint.words import a, called, shown
from osimlite.schema.base import Object
from osimlite.schema.fields import Held
from osimlite.schema.model import CURRENT_VERSION, Model
from osimlite.schema.registry import class_for, tags
from osimlite.schema.specs import FieldSpec, field_specs
from osimlite.text import listed, nearest


@rule("OSIM101", "unknown-tag", severity=ERROR, mends="both")
def unknown_tag(subject: Subject, found: Found) -> None:
    """An element is no property of the object it stands in.

    ## What it does
    Reports child elements that their class does not have: misspelt, in the wrong case, of another class, or of another
    version. Names the nearest right tag.

    ## Why is this bad
    OpenSim drops such an element without a word and keeps the default. A misspelt `<stiffness>` of a contact is 0, and
    the motion becomes NaN; a misspelt `<ForceSet>` is a model without forces. A setup may hold what older versions
    understood: that is a warning, or an information if the element is empty or switches off what is off anyway. A
    misspelt element that says what the default is anyway is a warning too.

    ## Example
    ```xml
    <Body name="thigh"> <mass>8</mass> <mass_centre>0 -0.2 0</mass_centre> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8</mass> <mass_center>0 -0.2 0</mass_center> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner in _of_kind(subject, "unknown-tag"):
        if _other_rule(note, owner):
            continue
        specs = field_specs(type(owner))
        old = successor(type(owner), note.word)
        if old is not None:
            _report_old(subject, found, note, owner, old)
            continue
        suggestion = nearest(note.word, specs, cutoff=70)
        message = f"{called(owner)} has no property <{note.word}>; OpenSim ignores it"
        if suggestion is not None:
            kept = _default_of(specs[suggestion])
            message += f" and keeps the default of {suggestion}{kept}" if suggestion not in _present(owner) else ""
        elif note.value is not None:
            message += f": {a(note.word)} cannot stand in {a(type(owner).tag)}"
            home = _set_for(note.value)
            message += f"; it belongs in the {home}" if home and isinstance(owner, Model) else ""
        else:
            homes = _homes(note.word, type(owner))
            message += f": it is a property of {listed(homes, most=3)}" if homes else ""
        same = suggestion is not None and suggestion.lower() == note.word.lower()
        free = suggestion is not None and suggestion not in _present(owner)
        fix = renamed(subject.source, note.number, suggestion, safe=same) if free else None
        severity = ERROR
        if not free and subject.model is None:
            severity = INFO if _asks_for_nothing(subject, note.number) else WARNING
        elif free and suggestion is not None and _is_default(subject, note.number, specs[suggestion]):
            severity = WARNING
        found(message, owner, number=note.number, suggestion=suggestion, fix=fix, severity=severity)


def _inside(subject: Subject, number: int) -> str:
    assert subject.source is not None
    span = subject.source.spans[number]
    return subject.source.text[span.tag_end : span.inner_end]


def _asks_for_nothing(subject: Subject, number: int) -> bool:
    """Whether an element is empty, or says no more than that something is off."""
    return _OFF.fullmatch(_inside(subject, number)) is not None


def _is_default(subject: Subject, number: int, spec: FieldSpec) -> bool:
    """Whether an element says what its property is anyway, so that it does not matter that OpenSim ignores it."""
    text = _inside(subject, number)
    if isinstance(spec.kind, Held):
        return spec.kind.form == "list" and not text.strip()
    return reads_as(text, spec.kind, spec.default)


def _is_said_again(subject: Subject, owner: Object, number: int) -> bool:
    """Whether an element holds the same as the first of its tag in the same object."""
    assert subject.source is not None and owner._index is not None
    spans, end = subject.source.spans, 0
    for first in range(owner._index + 1, number):
        if spans[first].start >= end:
            if spans[first].tag == spans[number].tag:
                return _inside(subject, first).split() == _inside(subject, number).split()
            end = spans[first].end
    return False


def _report_old(subject: Subject, found: Found, note: Note, owner: Object, old: Successor) -> None:
    """Say that a tag is one of an older format."""
    instead = f"write <{old.tag}>" if old.tag is not None else ""
    words = "; " + ", ".join(part for part in (instead, old.hint) if part)
    version = subject.version or CURRENT_VERSION
    found(
        f"<{note.word}> of {called(owner)} belongs to files before version {old.since}; in one of version {version} "
        f"OpenSim ignores it{words}",
        owner,
        number=note.number,
        suggestion=old.tag,
    )


@rule("OSIM102", "unknown-class", severity=ERROR, mends="both")
def unknown_class(subject: Subject, found: Found) -> None:
    """An object is of a class that OpenSim does not have.

    ## What it does
    Reports elements that should be objects and are of no class of OpenSim 4.6: misspelt, in the wrong case, or of a
    plug-in. Names the nearest class that may stand there.

    ## Why is this bad
    In a set (bodies, joints, forces ...) OpenSim refuses to load the file; elsewhere it leaves the object out. Of a
    plug-in, OpenSim must have loaded that plug-in first; the rest of the file is checked all the same. With the file
    that the setting `classes` names, osimlite knows the classes of a plug-in as well.

    ## Example
    ```xml
    <MarkerSet> <objects> <Merker name="asis" /> </objects> </MarkerSet>
    ```

    ## Use instead
    ```xml
    <MarkerSet>
        <objects>
            <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
        </objects>
    </MarkerSet>
    ```
    """
    for note, owner in _of_kind(subject, "unknown-class"):
        fate = _fate(subject, note)
        accepted = _acceptable(note.spec)
        suggestion = nearest(note.word, accepted) or nearest(note.word, tags(), cutoff=80)
        message = f"OpenSim has no class '{note.word}' and {fate}"
        if suggestion is None:
            message += "; if it belongs to a plug-in, load that first: nothing in it was checked"
        same = suggestion is not None and suggestion.lower() == note.word.lower()
        fix = renamed(subject.source, note.number, suggestion, safe=same)
        found(message, owner, number=note.number, suggestion=suggestion, fix=fix)


@rule("OSIM103", "wrong-class", severity=ERROR)
def wrong_class(subject: Subject, found: Found) -> None:
    """An object of a known class stands where that class may not stand.

    ## What it does
    Reports members of a set, or of another property, that are of a class the property does not take.

    ## Why is this bad
    In a set OpenSim refuses to load the file; elsewhere it leaves the object out.

    ## Example
    ```xml
    <MarkerSet> <objects> <Body name="foot"> <mass>1</mass> </Body> </objects> </MarkerSet>
    ```

    ## Use instead
    ```xml
    <MarkerSet>
        <objects>
            <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
        </objects>
    </MarkerSet>
    ```
    """
    for note, owner in _of_kind(subject, "wrong-class"):
        assert note.spec is not None and note.spec.accepts is not None
        kinds = note.spec.accepts.__name__
        home = _set_for(note.value)
        where = f"; it belongs in the {home}" if home else ""
        holder = f"{called(owner)}: {note.spec.tag}" if note.spec.tag != "objects" else called(owner)
        found(
            f"{holder} takes {a(kinds)}, not {a(note.word)}: OpenSim {_fate(subject, note)}{where}",
            owner,
            number=note.number,
        )


@rule("OSIM104", "duplicate-tag", severity=ERROR, mends="safe")
def duplicate_tag(subject: Subject, found: Found) -> None:
    """A property is given twice.

    ## What it does
    Reports every element after the first of the same property in one object.

    ## Why is this bad
    OpenSim takes the first and ignores the rest, while a reader expects the last one to hold. One that says the same
    as the first is a warning.

    ## Example
    ```xml
    <Body name="thigh"> <mass>8</mass> <mass>9</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>9</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner in _of_kind(subject, "duplicate-tag"):
        assert note.spec is not None
        value = getattr(owner, note.spec.name)
        taken = "" if isinstance(note.spec.kind, Held) else f", {shown(value)},"
        if note.word != note.spec.tag:
            found(
                f"<{note.spec.tag}> of {called(owner)} holds one object; OpenSim takes the first and ignores this "
                f"{note.word}",
                owner,
                number=note.number,
                fix=without_element(subject.source, note.number),
            )
            continue
        found(
            f"{called(owner)} has <{note.word}> more than once; OpenSim takes the first{taken} and ignores this one",
            owner,
            number=note.number,
            fix=without_element(subject.source, note.number),
            severity=WARNING if _is_said_again(subject, owner, note.number) else None,
        )


@rule("OSIM107", "element-in-value", severity=ERROR)
def element_in_value(subject: Subject, found: Found) -> None:
    """A value has an element inside.

    ## What it does
    Reports elements inside a number, a switch, a text or a reference, and comments and CDATA sections in the middle of
    one. A comment before or after it does no harm.

    ## Why is this bad
    OpenSim refuses to load the file.

    ## Example
    ```xml
    <Body name="thigh"> <mass><value>8</value></mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    for note, owner in _of_kind(subject, "child-in-value"):
        assert note.spec is not None
        if note.word == "!--":
            found(
                f"there is a comment in the middle of {subject.titled(owner, note.spec)}: OpenSim refuses the file",
                owner,
                number=note.number,
            )
            continue
        found(
            f"<{note.spec.tag}> of {called(owner)} is a value and cannot hold <{note.word}>: OpenSim refuses the file",
            owner,
            number=note.number,
        )
    source = subject.source
    if source is not None and "<![CDATA[" in source.text:
        for match in _CDATA.finditer(source.text):
            if match[1].strip() or match[2].strip():
                place = source.position(match.start() + 1 + len(match[1]), len("<![CDATA["))
                found("a CDATA section is only a part of this value: OpenSim refuses the file", at=place)


@rule("OSIM108", "wrong-part-name", severity=ERROR, mends="unsafe")
def wrong_part_name(subject: Subject, found: Found) -> None:
    """A part of an object has a name other than that of its property.

    ## What it does
    Reports objects such as `<FrameGeometry name="axes">`: a property that holds one object finds it by its name.

    ## Why is this bad
    OpenSim does not take the object and goes on with the default: everything inside is lost.

    ## Example
    ```xml
    <Body name="thigh">
        <FrameGeometry name="axes"> <scale_factors>0.5 0.5 0.5</scale_factors> </FrameGeometry>
        <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    </Body>
    ```

    ## Use instead
    ```xml
    <Body name="thigh">
        <FrameGeometry name="frame_geometry"> <scale_factors>0.5 0.5 0.5</scale_factors> </FrameGeometry>
        <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
    </Body>
    ```
    """
    for note, owner in _of_kind(subject, "unknown-tag"):
        spec = _part_for(note, owner)
        if spec is not None:
            assert subject.source is not None
            found(
                f"{called(owner)} takes its {spec.tag} by that name; OpenSim ignores this {note.word}",
                owner,
                number=note.number,
                attribute="name",
                suggestion=spec.tag,
                fix=replaced(
                    subject.source, subject.position(None, number=note.number, attribute="name"), spec.tag, safe=False
                ),
            )


@rule("OSIM109", "missing-wrapper", severity=ERROR)
def missing_wrapper(subject: Subject, found: Found) -> None:
    """Members of a set do not stand in its `<objects>`.

    ## What it does
    Reports objects that stand directly in a set or in the object that should list them.

    ## Why is this bad
    OpenSim looks for members inside `<objects>` only, and ignores these.

    ## Example
    ```xml
    <MarkerSet>
        <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    </MarkerSet>
    ```

    ## Use instead
    ```xml
    <MarkerSet>
        <objects>
            <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
        </objects>
    </MarkerSet>
    ```
    """
    reported = set()
    for note, owner in _of_kind(subject, "unknown-tag"):
        wrapper = _wrapper_for(note, owner)
        if wrapper is None or id(owner) in reported:
            continue
        reported.add(id(owner))
        found(
            f"{called(owner)} holds {note.word} objects inside <{wrapper}> only; OpenSim ignores this one"
            + (" and the others" if _more_without_wrapper(subject, owner) else ""),
            owner,
            number=note.number,
            suggestion=f"<{wrapper}>",
        )


_OFF = re.compile(r"(?:\s+|(?:unassigned|false|-1(?:\.0*)?|0(?:\.0*)?)(?!\S))*+", re.IGNORECASE)
_CDATA = re.compile(r">([^<>]*)<!\[CDATA\[.*?\]\]>([^<]*)(?=<)", re.DOTALL)


def _of_kind(subject: Subject, kind: str) -> list[tuple[Note, Object]]:
    return [(note, note.owner) for note in subject.notes if note.kind == kind and note.owner is not None]


def _other_rule(note: Note, owner: Object) -> bool:
    return _wrapper_for(note, owner) is not None or _part_for(note, owner) is not None


def _wrapper_for(note: Note, owner: Object) -> str | None:
    """The list of `owner` that an object standing directly in it belongs in."""
    if note.value is None or _part_for(note, owner) is not None:
        return None
    lists = (s for s in field_specs(type(owner)).values() if isinstance(s.kind, Held) and s.kind.form == "list")
    best = next((s for s in lists if s.accepts and issubclass(note.value, s.accepts) and s.tag != "components"), None)
    return best.tag if best is not None else None


def _part_for(note: Note, owner: Object) -> FieldSpec | None:
    """The one-object property that takes the class of this element, if it would only be called right."""
    if note.value is None:
        return None
    for spec in field_specs(type(owner)).values():
        free = isinstance(spec.kind, Held) and spec.kind.form == "single" and spec.name not in owner.model_fields_set
        if free and spec.accepts is not None and issubclass(note.value, spec.accepts):
            return spec
    return None


def _more_without_wrapper(subject: Subject, owner: Object) -> bool:
    return sum(1 for note, other in _of_kind(subject, "unknown-tag") if other is owner and note.value is not None) > 1


def _present(owner: Object) -> set[str]:
    return {spec.tag for spec in field_specs(type(owner)).values() if spec.name in owner.model_fields_set}


def _default_of(spec: FieldSpec) -> str:
    if isinstance(spec.kind, Held) or spec.default in ("", (), None):
        return ""
    return f" ({shown(spec.default)})"


def _homes(tag: str, owner: type[Object]) -> list[str]:
    """Classes that have a property `tag`; a class is left out where one it derives from has it.

    In a model those of tools are left out, and the other way round.
    """
    homes, package = set(), owner.__module__.rpartition(".")[0]
    for name in tags():
        cls = class_for(name)
        spec = field_specs(cls).get(tag) if cls is not None else None
        if spec is not None and spec.declared_in.__module__.rpartition(".")[0] == package:
            homes.add(spec.declared_in.__name__)
    return sorted(homes)


def _fate(subject: Subject, note: Note) -> str:
    """What OpenSim does with an object it cannot take."""
    spec = note.spec
    if spec is None or not isinstance(spec.kind, Held):
        return "leaves the object out"
    if spec.tag == "objects":
        return "refuses to load the file"
    if spec.kind.form != "single":
        return "leaves the object out"
    attributes = None if subject.source is None else subject.source.attributes_of(note.number)
    if attributes is None or ("name" in attributes and attributes["name"].value == spec.tag):
        return "refuses to load the file"
    return "leaves the object out, and fails where it needs one"


def _acceptable(spec: FieldSpec | None) -> Sequence[str]:
    if spec is None or spec.accepts is None:
        return tags()
    return [tag for tag in tags() if (cls := class_for(tag)) is not None and issubclass(cls, spec.accepts)]


def _set_for(cls: type[Object] | None) -> str | None:
    """The set of a model that takes objects of a class."""
    if cls is None:
        return None
    for spec in field_specs(Model).values():
        members = field_specs(spec.accepts).get("objects") if spec.accepts is not None else None
        taken = members.accepts if members is not None and spec.tag != "ComponentSet" else None
        if taken is not None and issubclass(cls, taken):
            return spec.tag
    return None
