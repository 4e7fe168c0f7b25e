"""OSIM1xx: attributes, text and blocks without meaning, or with an unexpected meaning."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import isfinite

from osimlite.base.patterns import compile_later
from osimlite.base.text import append_clause, find_nearest
from osimlite.io.document.lexical import ABSENT, UncleanText, make_converter
from osimlite.io.document.names import ATTRIBUTE
from osimlite.io.document.source import Source
from osimlite.io.document.spans import blank_comments
from osimlite.lint.fixes import remove_attribute, remove_element, remove_text
from osimlite.lint.registry import ERROR, INFO, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Component
from osimlite.schema.fields import Value
from osimlite.schema.forces import Force
from osimlite.schema.specs import get_field_specs


@rule("OSIM105", "unknown-attribute", severity=ERROR, fixes="safe", consequences=(RUNS,))
def report_unknown_attribute(subject: Subject, report: FindingCollector) -> None:
    """An element has an attribute without meaning.

    Reports all attributes of objects except `name` and `file`. An attribute of an element that is
    not an object is a warning. Attributes of XML itself (`xmlns`, and all with a colon) are an
    info.

    OpenSim ignores such attributes: properties are elements, not attributes. When osimlite writes a
    model, it keeps attributes of objects, and loses attributes of other elements.

    ```xml
    - <Marker name="asis" fixed="true"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> <fixed>true</fixed> </Marker>
    ```
    """
    for note, owner in subject.notes_of("unknown-attribute"):
        attribute_name = note.word
        message = f"OpenSim ignores the attribute '{attribute_name}' of {describe_object(owner)}"
        # The author meant a property, and wrote it as an attribute.
        if attribute_name in get_field_specs(type(owner)):
            message += f"; write <{attribute_name}>{note.value}</{attribute_name}> inside"
        suggestion = (
            "name"
            if find_nearest(attribute_name, ["name", "file"]) == "name" and not owner.name
            else None
        )
        fix = (
            remove_attribute(subject.source, note.number, attribute_name)
            if suggestion is None
            else None
        )
        # Namespaces are added by editors and do no harm.
        is_of_xml = _is_xml_attribute(attribute_name)
        report(
            message,
            owner,
            at=subject.attribute_name(note.number, attribute_name),
            severity=INFO if is_of_xml else None,
            suggestion=suggestion,
            fix=None if is_of_xml else fix,
        )
    for element_index, tag, attribute_name in _find_ignored_attributes(subject):
        is_of_xml = _is_xml_attribute(attribute_name)
        report(
            f"OpenSim ignores the attribute '{attribute_name}' of <{tag}>; osimlite loses it when the model "
            "is written",
            at=subject.attribute_name(element_index, attribute_name),
            severity=INFO if is_of_xml else WARNING,
            fix=None
            if is_of_xml
            else remove_attribute(subject.source, element_index, attribute_name),
        )


def _is_xml_attribute(attribute: str) -> bool:
    """Return whether an attribute belongs to XML itself."""
    return attribute == "xmlns" or ":" in attribute


def _find_ignored_attributes(subject: Subject) -> Iterator[tuple[int, str, str]]:
    """Yield every attribute without meaning on elements that are not objects.

    Args:
        subject: model or setup under check.

    Yields:
        Index of the element in the text, its tag, and the name of the attribute.
    """
    source = subject.source
    if source is None or not source.attributes:
        return
    # The reader has noted the unknown attributes of objects, as pairs of element and name; the
    # rule reports them from these notes.
    noted_attributes = {
        (note.number, note.word) for note in subject.notes if note.kind == "unknown-attribute"
    }
    # Elements that OpenSim does not read have a finding of another rule, and all that is inside
    # them is skipped.
    unread_elements = {note.number for note in subject.notes if note.kind in _UNREAD_KINDS}
    unread_end = 0
    for element_index, span in enumerate(source.spans):
        if span.start < unread_end:
            continue
        if element_index in unread_elements:
            unread_end = span.end
            continue
        start_tag = source.text[span.start : span.tag_end]
        for match in ATTRIBUTE.finditer(start_tag) if "=" in start_tag else ():
            attribute_name = match["name"]
            # The root has a version; other elements may have a name, or the file of an included
            # object.
            known_names = ("Version",) if element_index == 0 else ("name", "file")
            if (
                attribute_name not in known_names
                and (element_index, attribute_name) not in noted_attributes
            ):
                yield element_index, span.tag, attribute_name


@rule("OSIM106", "stray-text", severity=WARNING, fixes="safe")
def report_stray_text(subject: Subject, report: FindingCollector) -> None:
    """There is text between elements.

    Reports text in places where OpenSim expects only elements.

    OpenSim ignores the text without a message. It is often the rest of a tag: a value that lost its
    element, or half a comment.

    ```xml
    - <Body name="thigh"> mass 8 <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    + <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia> </Body>
    ```
    """
    source = subject.source
    if source is None or not source.spans:
        return
    # Text inside a value that also has elements is reported by OSIM107.
    in_values = [
        (source.spans[note.number].start, source.spans[note.number].end)
        for note in subject.notes
        if note.kind == "child-in-value"
    ]
    for start, stray in sorted(_find_stray_texts(source)):
        # Text outside the root is worse, and has another rule.
        if (
            any(value_start < start < value_end for value_start, value_end in in_values)
            or start >= source.spans[0].end
        ):
            continue
        text = stray.splitlines()[0]
        # A byte-order mark is invisible.
        text_description = "U+FEFF (a byte-order mark)" if text == "\ufeff" else f"'{text}'"
        fix = remove_text(source, start, start + len(stray))
        report(
            f"OpenSim ignores the text {text_description} between elements",
            at=source.position(start, len(text)),
            fix=fix,
        )


def _find_stray_texts(source: Source) -> Iterator[tuple[int, str]]:
    """Yield the offset of each text beside elements, and the text; comments do not count."""
    if source.mixed is None:
        # A ">" inside a value of an attribute would end the tag for the patterns.
        plain = _QUOTED.sub(lambda match: match[0].replace(">", "_"), blank_comments(source.text))
        # Both patterns may find the same text, hence the set.
        for start, end in {
            match.span(1) for pattern in (_AFTER, _BEFORE) for match in pattern.finditer(plain)
        }:
            yield start, plain[start:end].rstrip()
        return
    for number in source.mixed:
        text_start, inner_end = source.spans[number].tag_end, source.spans[number].inner_end
        child_spans = [source.spans[child] for child in source.children(number)]
        # Text stands before each child, and after the last one: hence the pair of the inner end.
        for text_end, next_start in (
            *((span.start, span.end) for span in child_spans),
            (inner_end, inner_end),
        ):
            plain = blank_comments(source.text[text_start:text_end])
            if text := plain.strip():
                yield text_start + plain.index(text), text
            text_start = next_start


@rule("OSIM110", "defaults", severity=WARNING, fixes="safe", consequences=(REFUSES,))
def report_defaults_block(subject: Subject, report: FindingCollector) -> None:
    """The file has a `<defaults>` block.

    Reports `<defaults>` blocks: a warning if the block has content, an info if it is empty. The
    finding is an error if an object of a tool in the block (such as CMC_Joint) has a value that
    OpenSim cannot read: OpenSim then rejects the file.

    Each object in the block replaces the defaults of its class in the running program, for this
    file and for all files loaded later. The meaning of a model then depends on the files loaded
    before it. osimlite applies the block to its own file only.

    ```xml
    - <defaults> <Marker name="default"> <fixed>true</fixed> </Marker> </defaults>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> <fixed>true</fixed> </Marker>
    ```
    """
    model, source = subject.model, subject.source
    if model is None or source is None or b"<defaults" not in source.data:
        return
    number = subject.element_of(model, "defaults")
    if number is not None and source.children(number):
        report(
            "<defaults> changes the defaults of every model that OpenSim loads later",
            model,
            # OpenSim registers the defaults for all models of the process.
            number=number,
        )
        for child in source.children(number):
            tag = source.spans[child].tag
            for name, kind in _TOOL_CLASSES.get(tag, {}).items():
                value = source.child(child, name)
                if value is not None and (
                    expected_content := _describe_unreadable(source, value, kind)
                ):
                    report(
                        f"<{name}> of the {tag} in <defaults> is not {expected_content}: OpenSim rejects "
                        "the file",
                        model,
                        number=value,
                        severity=ERROR,
                    )
    elif number is not None:
        fix = remove_element(source, number)
        report("<defaults> is empty; delete it", model, number=number, severity=INFO, fix=fix)


@rule("OSIM111", "force-outside-set", severity=INFO)
def report_force_outside_set(subject: Subject, report: FindingCollector) -> None:
    """Forces are outside the ForceSet.

    Reports forces, actuators and muscles in the `<components>` of the model or of one of its
    components, or in the ComponentSet. Each such list is reported once.

    Such forces act on the model. But OpenSim searches for forces, actuators and muscles only in the
    ForceSet. Controllers, probes, static optimization and CMC do not find a muscle that is
    elsewhere.

    ```xml
    - <components>
          <SpringGeneralizedForce name="spring"> <coordinate>knee_angle</coordinate> </SpringGeneralizedForce>
    - </components>
    ```
    """
    # One finding for each place, since a model may hold all its muscles there.
    forces_by_owner: dict[int, list[Component]] = {}
    for force in subject.find_instances(Force):
        above = subject.tree.parent_of(force)
        if above is not None and subject.model is not None and above is not subject.model.force_set:
            forces_by_owner.setdefault(id(above), []).append(force)
    for forces in forces_by_owner.values():
        first_force = forces[0]
        other_count = len(forces) - 1
        others_text = f" and {other_count} more" if other_count else ""
        report(
            f"{describe_object(first_force)}{others_text} {'are' if other_count else 'is'} outside the ForceSet: "
            f"{'they act' if other_count else 'it acts'}, but tools that list the forces or muscles of the "
            "model do not find " + ("them" if other_count else "it"),
            first_force,
            attribute="name",
        )


@rule("OSIM112", "not-upgradable", severity=ERROR, consequences=(REFUSES,))
def report_not_upgradable(subject: Subject, report: FindingCollector) -> None:
    """OpenSim cannot upgrade an old document.

    Reports missing or unreadable content without which OpenSim cannot upgrade a document of an
    older version. Examples are a body without `<Joint>`, a marker without `<body>`, and a connector
    without a name. Others are a transform that is not six finite numbers, and a display preference
    that is not a whole number.

    OpenSim rejects the file. `osimlite upgrade` is more lenient, and writes the current format.

    ```document
      <OpenSimDocument Version="30000">
          <Model name="post">
              <BodySet>
                  <objects>
                      <Body name="ground"> <mass>0</mass> <Joint /> </Body>
                      <Body name="post">
                          <mass>1</mass> <mass_center>0 0 0</mass_center>
                          <inertia_xx>0.1</inertia_xx> <inertia_yy>0.1</inertia_yy> <inertia_zz>0.1</inertia_zz>
                          <Joint>
                              <WeldJoint name="weld">
    -                             <parent_body>ground</parent_body> <location_in_parent>0 one 0</location_in_parent>
    +                             <parent_body>ground</parent_body> <location_in_parent>0 1 0</location_in_parent>
                              </WeldJoint>
                          </Joint>
                      </Body>
                  </objects>
              </BodySet>
          </Model>
      </OpenSimDocument>
    ```
    """
    if subject.sure_until is not None:
        # The missing part may be after the syntax error.
        return
    reported_numbers = {note.number for note in subject.notes if note.kind == "child-in-value"}
    for refusal in subject.refusals:
        # OSIM107 reports what makes the value unreadable.
        if refusal.number in reported_numbers:
            continue
        report(
            append_clause(
                refusal.message,
                f"OpenSim cannot upgrade this document of version {subject.version} and rejects it",
                separator=":",
            ),
            number=refusal.number,
        )


def _describe_unreadable(source: Source, number: int, kind: str) -> str:
    """Return the content that OpenSim expects in an element, for messages; empty if it can read it.

    Args:
        source: text of the document.
        number: index of the element in the text.
        kind: expected content: "text", "number" or "numbers".
    """
    span = source.spans[number]
    children = source.children(number)
    texts = [
        text_piece
        for text_piece in _COMMENT.split(source.text[span.tag_end : span.inner_end])
        if text_piece.strip()
    ]
    if children or len(texts) > 1:
        return "a value"
    text = "".join(texts)
    try:
        if kind == "number":
            make_converter(Value("double", legacy=True))(text)
        elif kind == "numbers":
            numbers = make_converter(Value("double", "list", legacy=True))(text)
            return "" if all(map(isfinite, numbers)) else "a list of finite numbers"
    except UncleanText as unclean:
        if kind == "numbers":
            return "a list of finite numbers"
        # OpenSim reads the first of several numbers, if it is a number, and of a word the
        # beginning.
        return "" if unclean.value is not ABSENT and isfinite(unclean.value) else "a number"
    return ""


_COMMENT = compile_later("<!--.*?-->", re.DOTALL)
"""XML comment."""
_TOOL_CLASSES = {
    "CMC_Joint": dict.fromkeys(["on", "wrt_body", "express_body", "active", "coordinate"], "text")
    | dict.fromkeys(["weight", "kp", "kv", "ka", "r0", "r1", "r2"], "numbers")
    | {"limit": "number"},
}
"""Expected content of each property by class of tools; old files have defaults of these classes."""
_UNREAD_KINDS = frozenset(
    ("unknown-tag", "unknown-class", "wrong-class", "wrong-name", "duplicate-tag")
)
"""Kinds of notes about elements that OpenSim does not read."""
_QUOTED = compile_later(r"=\s*+(?:\"[^\"<]*>[^\"<]*\"|'[^'<]*>[^'<]*')")
"""Value of an attribute that contains a ">"."""
# A tag is looked for from the last "<" before its ">": else the time would be that of all open
# ones.
_AFTER = compile_later(r"(?:</[^<>]+>|/>)\s*+([^<]++)")
_BEFORE = compile_later(r"<[^/!?<>][^<>]*+(?<!/)>\s*+([^<]++)<(?![/!?])")
