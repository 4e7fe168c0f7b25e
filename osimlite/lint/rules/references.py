"""OSIM30x: references to components that do not exist, or in a form that the property rejects."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, cast

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import add_article, find_nearest, join_words
from osimlite.io.document.source import Source
from osimlite.lint.axes import find_made_up_paths, refuses_axes
from osimlite.lint.fixes import replace_text
from osimlite.lint.registry import ERROR, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.lint.words import describe_object, find_nearest_name, pick_closest
from osimlite.schema.base import Component, Object, Unknown
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.frames import Frame
from osimlite.schema.geometry import Geometry
from osimlite.schema.resolution import normalize_path
from osimlite.schema.specs import get_reference_specs
from osimlite.schema.tree import Resolution, Use, is_a

if TYPE_CHECKING:
    from osimlite.schema.custom_joint import CustomJoint


@rule("OSIM301", "unresolved-reference", severity=ERROR, fixes="both", consequences=(REFUSES, RUNS))
def report_unresolved_reference(subject: Subject, report: FindingCollector) -> None:
    """A component names another component that does not exist.

    Resolves every reference as OpenSim does for that property. Reports references that lead to no
    component, with the force, joint or other component that contains them, and suggests the nearest
    existing name.

    OpenSim rejects the model when it connects the components. Its message does not name the line.
    For contact geometry, the message does not even name the force. If a group names a missing
    member, OpenSim leaves the member out without a message. If a metabolic probe names a missing
    muscle, OpenSim disables the probe.

    ```xml
      <HuntCrossleyForce::ContactParameters>
    -     <geometry>floor heal</geometry> <stiffness>1e6</stiffness>
    +     <geometry>floor heel</geometry> <stiffness>1e6</stiffness>
      </HuntCrossleyForce::ContactParameters>
    ```
    """
    for broken in _select_broken(subject, "missing"):
        use = broken.use
        text = broken.text
        message = (
            f"{_format_subject(subject, use)} '{text}', but there is no such "
            f"{use.reference.target if use.reference.target != 'Object' else 'object'}"
        )
        if broken.hint == "comma":
            message += "; separate the names by blanks, without commas"
        elif broken.hint == "illegal":
            message += "; a path must not contain white space, \\, * or +"
        _report_broken(subject, report, broken, message)


@rule(
    "OSIM302",
    "reference-to-wrong-type",
    severity=ERROR,
    fixes="unsafe",
    consequences=(REFUSES, RUNS),
)
def report_reference_to_wrong_type(subject: Subject, report: FindingCollector) -> None:
    """A reference leads to a component of a class that the property cannot use.

    Reports references to an existing component of another class, such as a joint in place of a
    parent frame, or a body in place of a contact geometry.

    OpenSim says that the component does not exist, and rejects the model. It accepts such a name of
    a muscle in a metabolic probe, but disables the probe.

    ```xml
    - <Marker name="asis"> <socket_parent_frame>/jointset/hip</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    for broken in _select_broken(subject, "wrong-type"):
        target = broken.other
        assert target is not None
        kind = target.class_name if isinstance(target, Unknown) else type(target).tag
        message = (
            f"{_format_subject(subject, broken.use)} '{broken.text}', which is "
            f"{add_article(kind)}, not {add_article(broken.use.reference.target)}"
        )
        fixed_contacts = (
            _list_contacts(subject, target)
            if broken.use.reference.target == "ContactGeometry"
            else []
        )
        if fixed_contacts:
            message += f"; contact geometry fixed to it: {join_words(fixed_contacts)}"
        _report_broken(subject, report, broken, message)


@rule("OSIM303", "missing-reference", severity=ERROR, consequences=(REFUSES, RUNS))
def report_missing_reference(subject: Subject, report: FindingCollector) -> None:
    """A required reference is empty.

    Reports sockets and names that are empty or not given.

    OpenSim rejects the model when it connects the components. If the name of a muscle in a metabolic
    probe is blank, it accepts the model, but disables the probe.

    ```xml
      <Marker name="asis">
          <location>0 0 0</location>
    +     <socket_parent_frame>/bodyset/pelvis</socket_parent_frame>
      </Marker>
    ```
    """
    for broken in _select_broken(subject, "empty"):
        use = broken.use
        if use.spec.name == "name":
            report(
                f"the name of {add_article(type(use.holder).tag)} is blank, expected the name of "
                f"{add_article(use.reference.target)}; OpenSim disables the whole probe",
                use.holder,
                attribute="name",
                consequence=RUNS,
            )
            continue
        is_explicit = use.spec.name in use.holder.model_fields_set
        state = "is empty" if is_explicit else "is not given"
        report(
            f"{use.spec.tag} of {_describe_holder(subject, use)} {state}, expected the name of "
            f"{add_article(use.reference.target)}",
            use.holder,
            consequence=REFUSES,
            tag=use.spec.tag,
        )


@rule("OSIM304", "reference-form", severity=ERROR, fixes="both", consequences=(REFUSES, RUNS))
def report_reference_form(subject: Subject, report: FindingCollector) -> None:
    """A reference has the wrong form: a path instead of a name, or a name instead of a path.

    Reports references that would be correct in another form: a bare name in a socket, a path
    without its leading slash, or a path where OpenSim expects a bare name. Also reports paths
    without the sets, as in files before version 4.

    OpenSim does not search for the component that is meant. It takes a bare name in a socket for a
    child of the component itself. It takes a path in `<coordinate>` of a limit force for the name
    of a coordinate. It finds neither, and rejects the model. It accepts such a name of a muscle in a
    metabolic probe, but disables the probe.

    ```xml
    - <Marker name="asis"> <socket_parent_frame>pelvis</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    for broken in _select_broken(subject, "form"):
        expected_form = (
            "a bare name" if broken.suggestion and "/" not in broken.suggestion else "a path"
        )
        if expected_form == "a path" and "/" in broken.text and not broken.text.startswith("/"):
            expected_form = "a path that begins with a slash"
        message = (
            f"{_format_subject(subject, broken.use)} '{broken.text}'; this property expects "
            f"{expected_form}"
        )
        _report_broken(subject, report, broken, message)
    for change in subject.changes:
        if change.step == "set_levels" and subject.source is not None:
            if _is_repeated(subject.source, change.number):
                # OpenSim reads the first of several connectors of one name.
                continue
            # In files of the time a name stood in an element of its own inside a connector.
            name_element = next(iter(subject.source.children(change.number)), change.number)
            position = subject.source.locate_text(name_element)
            start = subject.source.line_start(position.line) + position.column - 1
            text = subject.source.text[start : start + position.length]
            report(
                f"{change.where} names '{text}', a path as in test versions of OpenSim 4: OpenSim 4.6 "
                "finds nothing there and rejects the model; `osimlite upgrade` rewrites the path",
                at=position,
                consequence=REFUSES,
            )


def _is_repeated(source: Source, number: int) -> bool:
    """Return whether an element has the tag and the name of another before it in the same element."""
    span = source.spans[number]
    above = None
    for index in range(number):
        if source.spans[index].start < span.start and span.end <= source.spans[index].end:
            above = index
    if above is None:
        return False
    name = source.get_attributes(number).get("name")
    for index in source.children(above):
        if index >= number:
            return False
        other = source.get_attributes(index).get("name")
        names = [attribute.value for attribute in (name, other) if attribute is not None]
        if source.spans[index].tag == span.tag and len(names) == 2 and names[0] == names[1]:
            return True
    return False


@rule("OSIM305", "reference-case", severity=ERROR, fixes="safe", consequences=(REFUSES, RUNS))
def report_reference_case(subject: Subject, report: FindingCollector) -> None:
    """A reference differs from a name in letter case only.

    Reports references that match a component only if letter case is ignored.

    OpenSim compares names exactly, and rejects the model. It accepts such a name of a muscle in a
    metabolic probe, but disables the probe.

    ```xml
    - <Marker name="asis"> <socket_parent_frame>/bodyset/Pelvis</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    for broken in _select_broken(subject, "case"):
        _report_broken(
            subject,
            report,
            broken,
            f"{_format_subject(subject, broken.use)} '{broken.text}'; names are case-sensitive",
        )


class BrokenReference(NamedTuple):
    """Broken reference, with the reason, its present target, and the correct text."""

    use: Use
    text: str
    why: str
    other: Component | None = None
    suggestion: str | None = None
    hint: str = ""


def _select_broken(subject: Subject, failure: str) -> Iterator[BrokenReference]:
    """Return the broken references of one kind."""
    return (broken for broken in find_broken_references(subject) if broken.why == failure)


@cache_per_subject
def find_broken_references(subject: Subject) -> list[BrokenReference]:
    """Return every broken reference of the model."""
    return list(_iterate_broken_references(subject))


def _iterate_broken_references(subject: Subject) -> Iterator[BrokenReference]:
    """Yield each reference that does not resolve, or that is a name where OpenSim needs a path."""
    tree = subject.tree
    for use in _list_uses(subject):
        resolution = subject.resolution(use) if use.value != "" else tree.resolve(use)
        if resolution.failure is None:
            if _needs_plain_path(use) and isinstance(use.value, str):
                target_path = (
                    tree.path_of(resolution.target) if resolution.target is not None else None
                )
                if use.value != target_path:
                    yield BrokenReference(use, use.value, "form", None, target_path)
            continue
        if resolution.failure != "illegal" and (
            _is_overwritten(subject, use) or _is_made_up(subject, use)
        ):
            continue
        text = use.text
        if isinstance(use.value, str) and (resolution.failure == "empty" or _is_unassigned(use)):
            if use.reference.required and use.position is None:
                yield BrokenReference(use, text, "empty")
        elif use.reference.rule == "own-joint-coordinate" and is_a(use.owner, "CustomJoint"):
            # Often OpenSim creates such a coordinate, which another rule reports.
            if refuses_axes(cast("CustomJoint", use.owner)):
                yield _explain_reference(subject, use, text, resolution)
        elif not _is_undecided(subject, use, text) and not (
            use.position == 0 and use.reference.accepts_word(text)
        ):
            yield _explain_reference(subject, use, text, resolution)


def _is_unassigned(use: Use) -> bool:
    """Return whether the text is the word that OpenSim prints for a name that was never set."""
    return use.value == "UNASSIGNED" and use.position is None and use.spec.name != "name"


def _list_uses(subject: Subject) -> Iterator[Use]:
    """Yield every reference that must resolve; files, columns and outputs are not among them."""
    for use in subject.uses:
        if use.reference.rule not in ("file", "column", "input", "positional", "point-index"):
            yield use
    # An optional reference that OpenSim insists on anyway is not among the uses when it is
    # left out.
    for cls, items in subject.by_class.items():
        for spec in get_reference_specs(cls):
            if spec.reference.shape == "optional" and spec.reference.required:
                for item in items:
                    if getattr(item, spec.name) is None:
                        yield Use(item, subject.owner(item), spec, "")


def _explain_reference(
    subject: Subject, use: Use, text: str, resolution: Resolution
) -> BrokenReference:
    """Return why a reference does not resolve, with the text that is probably meant."""
    tree, reference = subject.tree, use.reference
    stripped = text.strip(",;")
    if stripped != text and tree.lookup(reference, stripped, use.owner).target is not None:
        return BrokenReference(use, text, "missing", None, stripped, "comma")
    valid_texts = _list_right_words(subject, use)
    last_name = text.rstrip("/").rpartition("/")[2]
    same_name = [word for word in valid_texts if word.rpartition("/")[2] == last_name]
    if same_name and resolution.failure != "wrong-type" and _differs_in_form(text, same_name):
        return _make_form_fault(use, text, same_name)
    wrong_target = resolution.wrong_target or _find_wrong_target(subject, use, text)
    if wrong_target is not None and is_a(wrong_target, reference.target):
        # A coordinate, but of another joint.
        wrong_target = None
    if wrong_target is not None and not same_name:
        return BrokenReference(
            use, text, "wrong-type", wrong_target, find_nearest(text, valid_texts, cutoff=75)
        )
    if same_name and resolution.failure == "wrong-type":
        if wrong_target is not None and text.startswith("/"):
            return BrokenReference(
                use, text, "wrong-type", wrong_target, pick_closest(text, same_name)
            )
        return _make_form_fault(use, text, same_name)
    lowered = [word for word in valid_texts if word.lower() == text.lower()]
    if lowered:
        return BrokenReference(use, text, "case", None, lowered[0])
    hint = "illegal" if resolution.failure == "illegal" else ""
    # A name that is already in the list is not suggested.
    current_values = getattr(use.holder, use.spec.name)
    used_texts = set() if isinstance(current_values, str) else set(current_values or ())
    candidates = sorted(set(valid_texts)) if used_texts else valid_texts
    suggestion = find_nearest_name(text, candidates, used_texts)
    return BrokenReference(use, text, "missing", None, suggestion, hint)


def _make_form_fault(use: Use, text: str, same_name: list[str]) -> BrokenReference:
    """Return the fault of a reference that names an object in a form that OpenSim does not resolve.

    Args:
        use: reference in the model.
        text: text of the reference.
        same_name: texts with the same last name that are valid there.
    """
    certainty = "" if len(same_name) == 1 else "several"
    return BrokenReference(use, text, "form", None, pick_closest(text, same_name), certainty)


def _list_right_words(subject: Subject, use: Use) -> list[str]:
    """Return every valid text; it is the same for all references of one kind in one component."""
    texts_by_kind = cast(
        "dict[tuple[str, str, int], list[str]]", subject.cache.setdefault("right words", {})
    )
    key = (use.reference.rule, use.reference.target, id(use.owner))
    if key not in texts_by_kind and use.reference.rule == "set-member":
        tree = subject.tree
        texts_by_kind[key] = sorted(
            {item.name for item in tree.components if tree.parent_of(item) is use.owner}
        )
    elif key not in texts_by_kind:
        texts_by_kind[key] = subject.tree.list_spellings(use)
    return texts_by_kind[key]


def _differs_in_form(text: str, candidates: list[str]) -> bool:
    """Return whether a text differs from a valid one only in missing or extra parts of the path."""
    if "/" not in text.strip("/") or any("/" not in word for word in candidates):
        return True
    return any(word.strip("/") == text.strip("/") for word in candidates)


def _find_wrong_target(subject: Subject, use: Use, text: str) -> Component | None:
    """Return a component of another class with this name or path; None without one."""
    tree = subject.tree
    at_path = tree.by_path.get(normalize_path("/" + text) or "")
    if at_path is not None and not is_a(at_path, use.reference.target):
        return at_path
    if "/" in text:
        return None
    return next(
        (item for item in tree.by_name.get(text, ()) if not is_a(item, use.reference.target)), None
    )


def _needs_plain_path(use: Use) -> bool:
    """Return whether OpenSim compares the text: a PrescribedController looks up functions by the path as written."""
    return type(use.owner).__name__ == "PrescribedController" and use.spec.tag == "socket_actuators"


def _is_made_up(subject: Subject, use: Use) -> bool:
    """Return whether a reference leads to a coordinate that OpenSim creates; another rule reports it."""
    if use.reference.target != "Coordinate" or use.reference.rule == "own-joint-coordinate":
        return False
    paths = find_made_up_paths(subject)
    if not paths or not isinstance(use.value, str):
        return False
    if use.reference.rule == "coordinate-name":
        return any(path.rpartition("/")[2] == use.value for path in paths)
    base = "" if use.value.startswith("/") else f"{subject.tree.path_of(use.owner)}/"
    return normalize_path(base + use.value) in paths


def _is_overwritten(subject: Subject, use: Use) -> bool:
    """Return whether OpenSim overwrites this reference: the frame of the geometry that a frame draws."""
    return (
        isinstance(use.holder, Geometry)
        and use.spec.tag == "socket_frame"
        and _is_drawn_by_frame(subject, use.holder)
    )


def _is_drawn_by_frame(subject: Subject, geometry: Geometry) -> bool:
    parent = subject.tree.parent_of(geometry)
    if not isinstance(parent, Frame):
        return False
    return parent.frame_geometry is geometry or any(
        item is geometry for item in parent.attached_geometry
    )


def _is_undecided(subject: Subject, use: Use, text: str) -> bool:
    """Return whether the reference may lead into an object of an unknown class."""
    if not subject.has_unknown:
        return False
    tree = subject.tree
    if use.reference.rule not in ("socket", "owner-path", "model-path"):
        return True
    if isinstance(use.owner, Unknown):
        return True
    base = tree.path_of(use.owner) or "/"
    path = normalize_path(text if text.startswith("/") else f"{base}/{text}") or ""
    while path.count("/") > 1:
        path = path.rpartition("/")[0]
        if isinstance(tree.by_path.get(path), Unknown):
            return True
    return False


def _format_subject(subject: Subject, use: Use) -> str:
    """Return the beginning of a message, such as ``HuntCrossleyForce 'foot': <geometry> names``."""
    return f"{_describe_holder(subject, use)}: <{use.spec.tag}> names"


def _describe_holder(subject: Subject, use: Use) -> str:
    return describe_object(use.holder) if use.holder.name else subject.describe(use.holder)


def _list_contacts(subject: Subject, frame: Object) -> list[str]:
    """Return the names of the contact geometry that is fixed to a frame."""
    return [
        use.owner.name
        for use in subject.uses
        if isinstance(use.owner, ContactGeometry) and subject.resolution(use).target is frame
    ]


def _report_broken(
    subject: Subject, report: FindingCollector, broken: BrokenReference, message: str
) -> None:
    """Report a broken reference at its word, with the fix if one is known."""
    use = broken.use
    value = getattr(use.holder, use.spec.name)
    earlier_values = value[: use.position] if isinstance(value, tuple) and use.position else ()
    nth = sum(1 for word in earlier_values if word == broken.text)
    # OpenSim drops what a group names wrongly and continues.
    severity = WARNING if use.reference.rule == "set-member" else None
    by_name = use.spec.name == "name"
    if by_name:
        message += "; OpenSim disables the whole probe"
    position = (
        None
        if by_name
        else subject.position(use.holder, tag=use.spec.tag, word=broken.text, nth=nth)
    )
    certain = broken.hint == "comma" or (broken.why in ("case", "form") and not broken.hint)
    # A frame deep in another component only happens to have the name.
    certain = certain and (broken.suggestion or "").count("/") < 3
    if any(
        note.owner is use.owner and note.kind in ("unknown-tag", "unknown-class")
        for note in subject.notes
    ):
        # The intended object may be in an element that OpenSim ignores.
        position = None
    report(
        message,
        use.holder,
        tag=None if by_name else use.spec.tag,
        attribute="name" if by_name else None,
        word=None if by_name else broken.text,
        nth=nth,
        suggestion=broken.suggestion,
        severity=severity,
        consequence=RUNS if by_name else REFUSES,
        fix=replace_text(subject.source, position, broken.suggestion, safe=certain),
    )
