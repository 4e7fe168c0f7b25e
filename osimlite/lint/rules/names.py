"""OSIM31x: names of components."""

from __future__ import annotations

from osimlite.base.text import format_count, join_words
from osimlite.io.document.notes import NoteKind
from osimlite.io.document.source import Source
from osimlite.io.document.spans import Span
from osimlite.lint.registry import ERROR, INFO, REFUSES, WARNING, FindingCollector, rule
from osimlite.lint.rules.references import BrokenReference, find_broken_references
from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Component, Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.sets import ModelComponentSet
from osimlite.schema.tree import ILLEGAL_CHARACTERS, is_a

_ILLEGAL = frozenset(ILLEGAL_CHARACTERS)

LEFT_OUT: tuple[NoteKind, ...] = (
    "unknown-tag",
    "unknown-class",
    "wrong-class",
    "second-object",
    "ignored",
)
"""Notes about elements that OpenSim leaves out with all that is in them."""


@rule("OSIM311", "duplicate-name", severity=ERROR)
def report_duplicate_name(subject: Subject, report: FindingCollector) -> None:
    """Two sibling components have the same name.

    Reports the second of two components that have the same name and the same parent. The message
    says which name OpenSim gives to the second, and which components refer to the name.

    OpenSim renames the second component by adding a number. All references to the name lead to the
    first component: both feet then touch the ground with the same sphere.

    ```xml
      <MarkerSet>
          <objects>
              <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    -         <Marker name="asis"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </Marker>
    +         <Marker name="trochanter"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </Marker>
          </objects>
      </MarkerSet>
    ```
    """
    tree = subject.tree
    for renamed in tree.renamed:
        item = renamed.component
        # A component without a name in the file has no expected name.
        if not item.name or not subject.has_explicit_name(item) or isinstance(item, Unknown):
            continue
        users = list(_find_holders(subject).get(id(renamed.first), ()))
        message = (
            f"another {describe_object(renamed.first)} has the same parent; OpenSim renames this "
            f"one to '{renamed.name}'"
        )
        if users:
            message += (
                f", and {join_words(users, max_count=3)} then {'uses' if len(users) == 1 else 'use'} the "
                "first"
            )
        report(message, item, attribute="name", suggestion=None)


@rule("OSIM312", "illegal-name", severity=ERROR, before=(30500, WARNING), consequences=(REFUSES,))
def report_illegal_name(subject: Subject, report: FindingCollector) -> None:
    r"""The name of a component contains an illegal character.

    Reports white space, `/`, `\`, `*` and `+` in the names of components.

    Names are the parts of paths, which must not contain these characters: OpenSim rejects the file.
    In files older than version 30500, OpenSim removes all white space from names. But from
    references it removes only white space at both ends. A reference to 'right asis' then finds
    nothing, because the component is now called 'rightasis'. OpenSim rejects the file, unless only
    groups and controllers have such references. If nothing refers to the name, the finding is an
    info.

    ```xml
    - <Marker name="right asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    + <Marker name="right_asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    # Almost every model passes this test of all its names at once.
    components = subject.tree.components
    all_names = "".join([component.name for component in components])
    if not any(character in all_names for character in ILLEGAL_CHARACTERS):
        components = []
    for component in components:
        if _ILLEGAL.isdisjoint(component.name):
            continue
        illegal_characters = [
            character
            for character in dict.fromkeys(component.name)
            if character in ILLEGAL_CHARACTERS
        ]
        character_list = join_words(
            [
                "white space" if character.isspace() else f"'{character}'"
                for character in illegal_characters
            ]
        )
        report(
            f"the name of {describe_object(component)} contains {character_list}: OpenSim rejects the file",
            component,
            attribute="name",
            suggestion="".join(
                "_" if character in illegal_characters else character
                for character in component.name
            ),
            severity=ERROR,
        )
    # In a file this old OpenSim fixes the name, but not what names it.
    for change in subject.changes:
        if change.step == "names" and subject.source is not None:
            position = subject.source.locate_attribute(change.number, "name")
            start = subject.source.line_start(position.line) + position.column - 1
            name = subject.source.text[start : start + position.length]
            if any(character.isspace() for character in name) and not name.startswith("<"):
                better = "".join(name.split())
                # OpenSim removes white space at the ends of references, too.
                has_inner_space = len(name.split()) > 1
                users = (
                    list_old_references(subject, subject.source, name) if has_inner_space else []
                )
                is_used = has_inner_space and subject.source.text.count(name) > 1
                frame = subject.source.spans[change.number].tag in ("Body", "Ground")
                consequence = f"OpenSim changes it to '{better}'" + (
                    ", but keeps the white space where others use the name" if is_used else ""
                )
                if users:
                    consequence = f"OpenSim changes it to '{better}', but not in <{users[0]}>, and rejects the file"
                if frame:
                    consequence = (
                        "OpenSim creates frames of that name for the joints and rejects them"
                    )
                report(
                    f"the name '{name}' contains white space: in a file of version "
                    f"{subject.version} {consequence}",
                    at=position,
                    suggestion=better,
                    severity=ERROR if frame or users else None if is_used else INFO,
                )


def list_old_references(subject: Subject, source: Source, name: str) -> list[str]:
    """Return the tags of elements of an old document that OpenSim refuses if nothing has the name they give.

    Args:
        subject: check target with the notes of the reader.
        source: text of the document.
        name: name with white space, which OpenSim removes from the name but not from references.
    """
    # Almost no document has such a name, so the import is delayed until one is found.
    from osimlite.io.document.upgrade.version_3_structure import NAME_LIST_TAGS, TEXT_TAGS

    collapsed_name = " ".join(name.split())
    # Elements that OpenSim ignores refer to nothing.
    left_out = [
        source.spans[note.number] for kind in LEFT_OUT for note, _ in subject.notes_of(kind)
    ]
    result: list[str] = []
    owners: list[Span] = []
    for span in source.spans:
        while owners and owners[-1].end <= span.start:
            owners.pop()
        inner_text = source.text[span.tag_end : span.inner_end]
        text = " ".join(inner_text.split())
        is_reference = collapsed_name == text or (
            span.tag in NAME_LIST_TAGS and f" {collapsed_name} " in f" {text} "
        )
        # OpenSim ignores unresolved names in groups and most controllers.
        harmless = span.tag == "members" or (
            span.tag in ("actuator_list", "muscle_list")
            and not (owners and owners[-1].tag == "PrescribedController")
        )
        if (
            is_reference
            and not harmless
            and span.tag not in TEXT_TAGS
            and not any(other.start <= span.start < other.end for other in left_out)
        ):
            result.append(span.tag)
        owners.append(span)
    return result


@rule("OSIM313", "missing-name", severity=WARNING)
def report_missing_name(subject: Subject, report: FindingCollector) -> None:
    """A component has no name.

    Reports members of sets, and coordinates, without a name or with an empty one. If the file also
    has an unresolved reference that may mean this component, the finding is an error.

    OpenSim names such a component after its class, in lower case. References by the intended name
    fail, and the columns of results are named `body` or `pinjoint`.

    ```xml
    - <Marker> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    tree = subject.tree
    # What the file does not name has got a name while it was upgraded, as OpenSim does. It is
    # checked if references are unresolved.
    renamed = subject.upgraded and any(
        broken.why in ("missing", "form") for broken in find_broken_references(subject)
    )
    for component in tree.components:
        if component.name and not (renamed and not subject.has_explicit_name(component)):
            continue
        if isinstance(component, (Model, ModelComponentSet)):
            continue
        is_joint_frame = isinstance(component, PhysicalOffsetFrame) and isinstance(
            tree.parent_of(component), Joint
        )
        if not is_joint_frame and not _is_named_by_users(subject, component):
            continue
        missing_names = _list_missing_names(subject, component)
        if not missing_names and (is_joint_frame or component.name):
            continue
        last_name = _get_last_part(tree.path_of(component) or "")
        message = f"this {type(component).tag} has no name; OpenSim names it '{last_name}'"
        if missing_names:
            count = format_count(
                sum(
                    _get_last_part(b.text) == missing_names[0]
                    for b in _find_fixable_references(subject, component)
                ),
                "reference",
            )
            message += (
                f", while {count} to '{missing_names[0]}' {'leads' if count.startswith('1 ') else 'lead'} "
                "nowhere"
            )
        report(
            message,
            component,
            attribute="name",
            severity=ERROR if missing_names else None,
            suggestion=missing_names[0] if len(missing_names) == 1 else None,
        )


def _is_named_by_users(subject: Subject, component: Component) -> bool:
    """Return whether users choose the name of a component, so that its absence is an omission.

    They name coordinates of joints, members of sets, and members of lists such as the additional
    frames of a component. Components that stand for one property, such as the path of a muscle,
    have the name of the property.
    """
    # The reader made this component; the file has no element that could have a name.
    if subject.source is not None and component._index is None:
        return False
    parent = subject.tree.parent_of(component)
    if isinstance(component, Coordinate):
        return isinstance(parent, Joint)
    if isinstance(parent, ModelComponentSet):
        return True
    return parent is not None and any(item is component for item in parent.subcomponents)


def _find_fixable_references(subject: Subject, component: Component) -> list[BrokenReference]:
    """Return the broken references that this component would resolve if it had the right name."""
    parent = subject.tree.parent_of(component)
    result = []
    for broken in find_broken_references(subject):
        use = broken.use
        # Of a group OpenSim drops what is missing, and a probe it switches off: neither needs the
        # name to load.
        if use.reference.rule == "set-member" or use.spec.name == "name":
            continue
        if not is_a(component, use.reference.target):
            continue
        if isinstance(parent, Joint) and not isinstance(component, Coordinate):
            # A joint names its own frames, where a frame elsewhere of that name is of no use.
            is_fixable = (
                use.owner is parent and "/" not in broken.text and broken.why in ("missing", "form")
            )
        else:
            sibling_path = (
                f"{subject.path(component).rpartition('/')[0]}/{_get_last_part(broken.text)}"
            )
            is_fixable = broken.why == "missing" and (
                "/" not in broken.text or broken.text == sibling_path
            )
        if is_fixable:
            result.append(broken)
    return result


def _list_missing_names(subject: Subject, component: Component) -> list[str]:
    """Return the unresolved names that a component of this class could have."""
    return list(
        dict.fromkeys(
            _get_last_part(broken.text) for broken in _find_fixable_references(subject, component)
        )
    )


def _get_last_part(text: str) -> str:
    return text.rpartition("/")[2]


@cache_per_subject
def _find_holders(subject: Subject) -> dict[int, dict[str, None]]:
    """Return the components that refer to each component, by its identity."""
    holders: dict[int, dict[str, None]] = {}
    for use in subject.uses:
        if use.reference.rule not in ("file", "column", "input"):
            holders.setdefault(id(subject.resolution(use).target), {})[
                describe_object(use.owner)
            ] = None
    return holders
