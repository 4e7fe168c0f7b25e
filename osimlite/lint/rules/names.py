"""OSIM31x: what components are called."""

from __future__ import annotations

from osimlite.base.text import format_count, join_words
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingSink, rule
from osimlite.lint.rules.references import Broken, broken_references
from osimlite.lint.subject import Subject, once
from osimlite.lint.words import called
from osimlite.schema.base import Component, Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.sets import ModelComponentSet
from osimlite.schema.tree import ILLEGAL_CHARACTERS, is_a

_ILLEGAL = frozenset(ILLEGAL_CHARACTERS)


@rule("OSIM311", "duplicate-name", severity=ERROR)
def duplicate_name(subject: Subject, report: FindingSink) -> None:
    """Two components beside each other have the same name.

    Reports the second of two siblings with one name, with the name OpenSim gives it and with those
    who name it.

    OpenSim renames the second and adds a number. Everything that was meant to name it leads to the
    first: both feet then touch the ground with the same sphere.

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
        # Of what has no name in the file nobody expects one.
        if not item.name or not subject.names_itself(item) or isinstance(item, Unknown):
            continue
        users = list(_holders(subject).get(id(renamed.first), ()))
        message = f"another {called(renamed.first)} stands beside this one; OpenSim renames this to '{renamed.name}'"
        if users:
            message += f", and {join_words(users, most=3)} then {'uses' if len(users) == 1 else 'use'} the first"
        report(message, item, attribute="name", suggestion=None)


@rule("OSIM312", "illegal-name", severity=ERROR, before=(30500, WARNING))
def illegal_name(subject: Subject, report: FindingSink) -> None:
    """The name of a component has a character that names cannot have.

    Reports white space, `/`, `\\`, `*` and `+` in the names of components.

    Names are the parts of paths; OpenSim refuses to load the file. Of files older than version
    30500 it takes white space out of the names by itself, and not out of what refers to them: a
    muscle or a marker is then not found.

    ```xml
    - <Marker name="right asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    + <Marker name="right_asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    # Almost every model is done with when its names are looked at all at once.
    components = subject.tree.components
    together = "".join([component.name for component in components])
    if not any(character in together for character in ILLEGAL_CHARACTERS):
        components = []
    for component in components:
        if _ILLEGAL.isdisjoint(component.name):
            continue
        bad = [
            character
            for character in dict.fromkeys(component.name)
            if character in ILLEGAL_CHARACTERS
        ]
        shown = join_words(
            ["white space" if character.isspace() else f"'{character}'" for character in bad]
        )
        report(
            f"the name of {called(component)} has {shown} in it: OpenSim refuses to load the file",
            component,
            attribute="name",
            suggestion="".join(
                "_" if character in bad else character for character in component.name
            ),
            severity=ERROR,
        )
    # In a file this old OpenSim mends the name, but not what names it.
    for change in subject.changes:
        if change.step == "names" and subject.source is not None:
            place = subject.source.of_attribute(change.number, "name")
            start = subject.source.line_start(place.line) + place.column - 1
            name = subject.source.text[start : start + place.length]
            if any(character.isspace() for character in name) and not name.startswith("<"):
                better = "".join(name.split())
                used = subject.source.text.count(name) > 1
                frame = subject.source.spans[change.number].tag in ("Body", "Ground")
                fate = f"OpenSim makes it '{better}'" + (
                    ", and not where others use it" if used else ""
                )
                if frame:
                    fate = "OpenSim makes frames of that name for the joints and refuses them"
                report(
                    f"the name '{name}' has white space in it: in a file of version {subject.version} {fate}",
                    at=place,
                    suggestion=better,
                    severity=ERROR if frame else None if used else INFO,
                )


@rule("OSIM313", "missing-name", severity=WARNING)
def missing_name(subject: Subject, report: FindingSink) -> None:
    """A component that others name by its name has none.

    Reports members of sets, and coordinates, without a name or with an empty one. It is an error if
    something names a component that is missing, which may be this one.

    OpenSim calls such a component after its class, in lower case. Nothing can name it by what the
    author had in mind, and the columns of results are called `body` or `pinjoint`.

    ```xml
    - <Marker> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    + <Marker name="asis"> <socket_parent_frame>/bodyset/pelvis</socket_parent_frame> </Marker>
    ```
    """
    tree = subject.tree
    # What the file does not name has got a name while it was upgraded, as OpenSim does. It is
    # looked at if others name what is not there.
    renamed = subject.upgraded and any(
        broken.why in ("missing", "form") for broken in broken_references(subject)
    )
    for component in tree.components:
        if component.name and not (renamed and not subject.names_itself(component)):
            continue
        if isinstance(component, (Model, ModelComponentSet)):
            continue
        frame = isinstance(component, PhysicalOffsetFrame) and isinstance(
            tree.parent_of(component), Joint
        )
        if not frame and not _should_have_name(subject, component):
            continue
        wanted = _wanted_names(subject, component)
        if not wanted and (frame or component.name):
            continue
        last = _last(tree.path_of(component) or "")
        message = f"this {type(component).tag} has no name; OpenSim calls it '{last}'"
        if wanted:
            count = format_count(
                sum(_last(b.text) == wanted[0] for b in _leading_nowhere(subject, component)),
                "reference",
            )
            message += f", while {count} to '{wanted[0]}' {'leads' if count.startswith('1 ') else 'lead'} nowhere"
        report(
            message,
            component,
            attribute="name",
            severity=ERROR if wanted else None,
            suggestion=wanted[0] if len(wanted) == 1 else None,
        )


def _should_have_name(subject: Subject, component: Component) -> bool:
    if subject.source is not None and component._index is None:
        return False
    parent = subject.tree.parent_of(component)
    if isinstance(component, Coordinate):
        return isinstance(parent, Joint)
    if isinstance(parent, ModelComponentSet):
        return True
    return parent is not None and any(item is component for item in parent.subcomponents)


def _leading_nowhere(subject: Subject, component: Component) -> list[Broken]:
    """The broken references that a component of this class would mend if it had the right name."""
    parent = subject.tree.parent_of(component)
    result = []
    for broken in broken_references(subject):
        use = broken.use
        # Of a group OpenSim drops what is missing, and a probe it switches off: neither needs the
        # name to load.
        if use.reference.rule == "set-member" or use.spec.name == "name":
            continue
        if not is_a(component, use.reference.target):
            continue
        if isinstance(parent, Joint) and not isinstance(component, Coordinate):
            # A joint names its own frames, where a frame elsewhere of that name is of no use.
            near = (
                use.owner is parent and "/" not in broken.text and broken.why in ("missing", "form")
            )
        else:
            beside = f"{subject.path(component).rpartition('/')[0]}/{_last(broken.text)}"
            near = broken.why == "missing" and ("/" not in broken.text or broken.text == beside)
        if near:
            result.append(broken)
    return result


def _wanted_names(subject: Subject, component: Component) -> list[str]:
    """Names that are missing and that a component of this class would bear."""
    return list(
        dict.fromkeys(_last(broken.text) for broken in _leading_nowhere(subject, component))
    )


def _last(text: str) -> str:
    return text.rpartition("/")[2]


@once
def _holders(subject: Subject) -> dict[int, dict[str, None]]:
    """Who holds a reference that leads to a component, by its identity."""
    known: dict[int, dict[str, None]] = {}
    for use in subject.uses:
        if use.reference.rule not in ("file", "column", "input"):
            known.setdefault(id(subject.resolution(use).target), {})[called(use.owner)] = None
    return known
