"""OSIM113: classes and properties that the target version of OpenSim lacks."""

from __future__ import annotations

from osimlite.base.text import add_article
from osimlite.lint.history import NEWEST, find_new_properties, load_later_changes
from osimlite.lint.registry import ERROR, INFO, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION
from osimlite.schema.specs import FieldSpec


@rule("OSIM113", "newer-class", severity=ERROR)
def report_newer_class(subject: Subject, report: FindingCollector) -> None:
    """A class or a property is newer than the target version of OpenSim.

    Reports classes and properties that were added to OpenSim after the target version. Says which
    version first has them, and the earlier name of a property. The target version is 4.6, or what
    the setting `target-version` or the option `--target-version` says (4.0 to 4.6). A newer
    property that has its default value is an info. A format number that is too new is also an info,
    because no version of OpenSim rejects a file for it.

    In a set (bodies, joints, forces ...) OpenSim rejects an object of an unknown class; elsewhere
    it leaves the object out. It ignores unknown properties without a message. The format number
    alone does not show which version a file needs: it is the same from 4.0 to 4.4, and from 4.5.1
    to 4.6.

    ```xml
    - <CoordinateLinearStopForce name="stop">
    -     <socket_coordinate>/jointset/knee/knee_angle</socket_coordinate> <stiffness>100</stiffness>
    - </CoordinateLinearStopForce>
    + <SpringGeneralizedForce name="stop">
    +     <coordinate>knee_angle</coordinate> <stiffness>100</stiffness>
    + </SpringGeneralizedForce>
    ```
    """
    target = subject.config.target_version or NEWEST
    later_changes = load_later_changes(target)
    # OSIM004 reports versions newer than all releases.
    if (
        subject.source is not None
        and later_changes.format < (subject.version or 0) <= CURRENT_VERSION
    ):
        report(
            f"the file has version {subject.version}; OpenSim {target} writes version {later_changes.format}, "
            "and reads the file as if it had that version",
            number=0,
            attribute="Version",
            severity=INFO,
        )
    for cls, items in subject.by_class.items():
        first = cls.since or later_changes.classes.get(cls.tag)
        if first:
            for item in items:
                # Default objects are in no file.
                if subject.source is None or item._index is not None:
                    report(
                        f"{describe_object(item)}: OpenSim has {add_article(cls.tag)} since "
                        f"version {first}; {target} rejects it",
                        item,
                    )
            continue
        for spec, version, earlier_name in find_new_properties(cls, target):
            rename_note = f"; before it was called {earlier_name}" if earlier_name else ""
            for item in items:
                if not _is_explicit(subject, item, spec):
                    continue
                is_default = spec.factory is None and getattr(item, spec.name) == spec.default
                report(
                    f"{describe_object(item)}: OpenSim has {spec.tag} since version {version}; "
                    f"{target} ignores it{rename_note}",
                    item,
                    tag=spec.tag,
                    severity=INFO if is_default else None,
                )


def _is_explicit(subject: Subject, item: Object, spec: FieldSpec) -> bool:
    """Return whether the text gives a property under its current tag; older texts may use another."""
    if subject.source is None:
        return spec.name in item.model_fields_set
    number = subject.element_of(item, spec.tag)
    return number is not None and subject.source.spans[number].tag == spec.tag
