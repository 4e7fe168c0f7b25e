"""OSIM102, OSIM103, OSIM108 and OSIM109: objects of a wrong class, under a wrong name, or in a wrong place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from osimlite.base.text import add_article, find_nearest
from osimlite.io.document.notes import Note
from osimlite.lint.diagnostic import Consequence
from osimlite.lint.fixes import rename_tag, replace_text
from osimlite.lint.old_tags import successor
from osimlite.lint.registry import ERROR, REFUSES, RUNS, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Object
from osimlite.schema.fields import ObjectField
from osimlite.schema.model import Model
from osimlite.schema.registry import find_class, list_class_tags, list_tags
from osimlite.schema.specs import FieldSpec, get_field_specs


@rule("OSIM102", "unknown-class", severity=ERROR, fixes="both", consequences=(REFUSES, RUNS))
def report_unknown_class(subject: Subject, report: FindingCollector) -> None:
    """An object has a class that OpenSim does not have.

    Reports elements whose tag is not a class of OpenSim 4.6, in places where OpenSim expects an
    object. The tag is misspelt, has the wrong letter case, or is a class of a plug-in. The rule
    suggests a class with a similar name, if that class is allowed there and at least half of the
    elements inside are its properties.

    In a set (bodies, joints, forces ...) OpenSim rejects the file. Elsewhere it leaves the object
    out, or rejects the file as well; the message says which. If the class belongs to a plug-in,
    OpenSim must load the plug-in first. osimlite then checks the rest of the file, but not this
    object. The setting `classes` names files that declare the classes of plug-ins to osimlite.

    ```xml
    - <MarkerSet> <objects> <Merker name="asis" /> </objects> </MarkerSet>
    + <MarkerSet>
    +     <objects>
    +         <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    +     </objects>
    + </MarkerSet>
    ```
    """
    for note, owner in subject.notes_of("unknown-class"):
        description, consequence = _describe_consequence(subject, note)
        accepted_tags = (
            list_tags()
            if note.spec is None or note.spec.accepts is None
            else list_class_tags(note.spec.accepts)
        )
        suggestion = _find_nearest_class(subject, note, accepted_tags)
        message = f"OpenSim has no class '{note.word}' and {description}"
        # Classes of plug-ins are not misspelt.
        plugin = find_plugin(note.word)
        if plugin:
            message += f"; the class belongs to {plugin}: load it first; osimlite did not check this object"
        elif suggestion is None or suggestion.lower() != note.word.lower():
            # The class differs in letter case only: nothing else can be meant.
            message += (
                "; if it belongs to a plug-in, load that first; osimlite did not check this object"
            )
        is_same_word = suggestion is not None and suggestion.lower() == note.word.lower()
        fix = rename_tag(subject.source, note.number, suggestion, safe=is_same_word)
        report(
            message,
            owner,
            number=note.number,
            consequence=consequence,
            suggestion=suggestion,
            fix=fix,
        )


PLUGINS = {
    "Smith2018": "the plug-in JAM (opensim-jam)",
    "WISCO_": "the plug-in of the University of Wisconsin (opensim_htc), the predecessor of JAM",
    "UWLigament": "the plug-in of the University of Wisconsin (opensim_htc), the predecessor of JAM",
}
"""Plug-ins by the beginning of the names of their classes."""


def find_plugin(name: str) -> str:
    """Return the known plug-in that a class belongs to; an empty text for others."""
    return next((plugin for start, plugin in PLUGINS.items() if name.startswith(start)), "")


def _find_nearest_class(subject: Subject, note: Note, accepted_tags: Iterable[str]) -> str | None:
    """Return the class that a misspelt tag of an object means, or None.

    Another class is another physics, so the spelling must be a slip away: at most two letters
    missing, added, exchanged or swapped. The class may stand there, OpenSim 4.6 has it, and at
    least half of the elements inside are properties of it.
    """
    # A namespace prefix belongs to no class name.
    word = note.word.rpartition(":")[2]
    if find_plugin(word):
        return None
    released_tags = [tag for tag in accepted_tags if not _is_later(tag)]
    lower_words = {note.word.lower(), word.lower()}
    same_words = [tag for tag in released_tags if tag.lower() in lower_words]
    # The tag with the namespace prefix is compared as well, as the colon may be the slip.
    candidates = same_words or [
        tag for tag in released_tags if _is_slip(note.word, tag) or _is_slip(word, tag)
    ]
    best = find_nearest(note.word, candidates, cutoff=0) if candidates else None
    if best is None or subject.source is None:
        return best
    children = [subject.source.spans[child].tag for child in subject.source.children(note.number)]
    cls = find_class(best)
    specs = get_field_specs(cls) if cls is not None else {}
    # Elements that the class does not have point to another class.
    fitting = sum(tag in specs or _can_contain(specs, tag) or is_old(cls, tag) for tag in children)
    return best if 2 * fitting >= len(children) else None


def _is_slip(word: str, tag: str) -> bool:
    """Return whether a word is a misspelling of a tag, rather than a longer or another name."""
    from rapidfuzz.distance import OSA

    lower_word, lower_tag = word.lower(), tag.lower()
    distance = OSA.distance(lower_word, lower_tag)
    # Two letters of a short word are half of it.
    if distance > (2 if len(tag) > 6 else 1):
        return False
    # A prefix such as My or UW makes another class of it.
    return distance < 2 or not (lower_word.endswith(lower_tag) or lower_word.startswith(lower_tag))


def _is_later(tag: str) -> bool:
    """Return whether OpenSim has a class only after 4.6."""
    cls = find_class(tag)
    return cls is not None and bool(cls.since)


def is_old(cls: type[Object] | None, tag: str) -> bool:
    """Return whether a tag belonged to a class in an older version of the format."""
    return cls is not None and successor(cls, tag) is not None


def _can_contain(specs: Mapping[str, FieldSpec], tag: str) -> bool:
    """Return whether an object with these properties may contain an object of the class `tag`.

    Args:
        specs: properties of the outer object.
        tag: class of the inner object, as the file writes it.
    """
    part = find_class(tag)
    if part is None:
        return False
    return any(
        spec.accepts is not None and issubclass(part, spec.accepts) for spec in specs.values()
    )


@rule("OSIM103", "wrong-class", severity=ERROR, consequences=(REFUSES, RUNS))
def report_wrong_class(subject: Subject, report: FindingCollector) -> None:
    """An object is in a place where its class is not allowed.

    Reports objects whose class is not allowed in the set, or in the property, that contains them.

    In a set OpenSim rejects the file. Elsewhere it leaves the object out, or rejects the file as
    well; the message says which.

    ```xml
    - <MarkerSet> <objects> <Body name="foot"> <mass>1</mass> </Body> </objects> </MarkerSet>
    + <MarkerSet>
    +     <objects>
    +         <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    +     </objects>
    + </MarkerSet>
    ```
    """
    for note, owner in subject.notes_of("wrong-class"):
        assert note.spec is not None and note.spec.accepts is not None
        kinds = note.spec.accepts.__name__
        home = find_set(note.value)
        description, consequence = _describe_consequence(subject, note)
        home_hint = f"; the {note.word} belongs in the {home}" if home else ""
        holder = (
            f"{describe_object(owner)}: {note.spec.tag}"
            if note.spec.tag != "objects"
            else describe_object(owner)
        )
        report(
            f"{holder} expects {add_article(kinds)}, found {add_article(note.word)}: OpenSim "
            f"{description}{home_hint}",
            owner,
            consequence=consequence,
            number=note.number,
        )


@rule("OSIM108", "wrong-part-name", severity=ERROR, fixes="unsafe", consequences=(RUNS,))
def report_wrong_part_name(subject: Subject, report: FindingCollector) -> None:
    """The `name` of an object is not the name of its property.

    Reports objects such as `<FrameGeometry name="axes">` in a body. OpenSim finds such an object by
    its `name`, which must be the name of the property that contains the object: `frame_geometry` in
    this case.

    OpenSim ignores the object with everything inside, and uses the default of the property.

    ```xml
      <Body name="thigh">
    -     <FrameGeometry name="axes"> <scale_factors>0.5 0.5 0.5</scale_factors> </FrameGeometry>
    +     <FrameGeometry name="frame_geometry"> <scale_factors>0.5 0.5 0.5</scale_factors> </FrameGeometry>
          <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
      </Body>
    ```
    """
    for note, owner in subject.notes_of("unknown-tag"):
        spec = find_part(note, owner)
        if spec is not None:
            assert subject.source is not None
            report(
                f"OpenSim ignores this {note.word}: in {describe_object(owner)} it must have the name "
                f"'{spec.tag}'",
                owner,
                number=note.number,
                attribute="name",
                suggestion=spec.tag,
                fix=replace_text(
                    subject.source,
                    subject.position(None, number=note.number, attribute="name"),
                    spec.tag,
                    safe=False,
                ),
            )


@rule("OSIM109", "missing-wrapper", severity=ERROR, consequences=(RUNS,))
def report_missing_wrapper(subject: Subject, report: FindingCollector) -> None:
    """Members of a set are outside its `<objects>`.

    Reports objects that stand directly in a set instead of in its `<objects>`. Also reports objects
    that stand directly in a component instead of in a list such as `<coordinates>`.

    OpenSim reads only the objects inside the list, and ignores the others.

    ```xml
      <MarkerSet>
    -     <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    +     <objects>
    +         <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    +     </objects>
      </MarkerSet>
    ```
    """
    reported = set()
    notes = subject.notes_of("unknown-tag")
    standing = Counter(id(owner) for note, owner in notes if note.value is not None)
    for note, owner in notes:
        wrapper = find_wrapper(note, owner)
        if wrapper is None or id(owner) in reported:
            continue
        reported.add(id(owner))
        report(
            f"{note.word} objects of {describe_object(owner)} must be inside <{wrapper}>; OpenSim ignores this one"
            + (" and the others" if standing[id(owner)] > 1 else ""),
            owner,
            number=note.number,
            suggestion=f"<{wrapper}>",
        )


def find_wrapper(note: Note, owner: Object) -> str | None:
    """Return the list of `owner` that should contain an object placed directly in it; None without one.

    Args:
        note: note of the reader about the object.
        owner: object that contains it.
    """
    if note.value is None or find_part(note, owner) is not None:
        # Such an object has OSIM108.
        return None
    lists = (
        spec
        for spec in get_field_specs(type(owner)).values()
        if isinstance(spec.kind, ObjectField) and spec.kind.form == "list"
    )
    best = next(
        (
            spec
            for spec in lists
            # Components may stand there as well, but the specific list is what is meant.
            if spec.accepts and issubclass(note.value, spec.accepts) and spec.tag != "components"
        ),
        None,
    )
    return best.tag if best is not None else None


def find_part(note: Note, owner: Object) -> FieldSpec | None:
    """Return the property that would accept this object under its name; None without one.

    Args:
        note: note of the reader about the object.
        owner: object that contains it.
    """
    if note.value is None:
        return None
    for spec in get_field_specs(type(owner)).values():
        free = (
            isinstance(spec.kind, ObjectField)
            and spec.kind.form == "single"
            # A property that is given has its object already.
            and spec.name not in owner.model_fields_set
        )
        if free and spec.accepts is not None and issubclass(note.value, spec.accepts):
            return spec
    return None


def _describe_consequence(subject: Subject, note: Note) -> tuple[str, Consequence | None]:
    """Return what OpenSim does with an object that it cannot accept, in words and as declared."""
    spec = note.spec
    if spec is None or not isinstance(spec.kind, ObjectField):
        return "leaves the object out", RUNS
    if spec.tag == "objects":
        return "rejects the file", REFUSES
    if spec.kind.form != "single":
        return "leaves the object out", RUNS
    attributes = None if subject.source is None else subject.source.get_attributes(note.number)
    # With the name of the property OpenSim tries to make this object, and fails.
    if attributes is None or ("name" in attributes and attributes["name"].value == spec.tag):
        return "rejects the file", REFUSES
    return "leaves the object out, and fails as soon as it needs one", None


def find_set(cls: type[Object] | None) -> str | None:
    """Return the set of a model that accepts objects of a class; None without one."""
    if cls is None:
        return None
    for spec in get_field_specs(Model).values():
        members = get_field_specs(spec.accepts).get("objects") if spec.accepts is not None else None
        # Any component fits into the ComponentSet, so that set is no hint.
        member_class = (
            members.accepts if members is not None and spec.tag != "ComponentSet" else None
        )
        if member_class is not None and issubclass(cls, member_class):
            return spec.tag
    return None
