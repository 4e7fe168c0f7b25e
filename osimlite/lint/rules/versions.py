"""OSIM113: what another version of OpenSim has not."""

from __future__ import annotations

from osimlite.lint.history import NEWEST, later_than, new_properties
from osimlite.lint.registry import ERROR, INFO, FindingSink, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import a, called
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION
from osimlite.schema.specs import FieldSpec


@rule("OSIM113", "newer-class", severity=ERROR)
def newer_class(subject: Subject, report: FindingSink) -> None:
    """OpenSim has a class or a property only after the version that is aimed at.

    Reports objects of classes, and properties, that OpenSim has only after 4.6, or after the
    version that the setting `target-version`, or the option `--target-version`, names: one of 4.0
    to 4.6. Says which version has them first, and what a property was called before. Properties
    that say no more than the default are told for information, and so is a number of the format
    that is too new: no OpenSim refuses a file for it.

    In a set (bodies, joints, forces ...) OpenSim refuses to load an object of an unknown class;
    elsewhere it leaves the object out. Unknown properties it drops without a word. The number of
    the format hardly tells: from 4.0 to 4.4 and from 4.5.1 to 4.6 it is the same.

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
    later = later_than(target)
    # What is newer than all is told by OSIM004.
    if subject.source is not None and later.format < (subject.version or 0) <= CURRENT_VERSION:
        report(
            f"the file has the format {subject.version}, OpenSim {target} writes {later.format} and takes it for that",
            number=0,
            attribute="Version",
            severity=INFO,
        )
    for cls, items in subject.by_class.items():
        first = cls.since or later.classes.get(cls.tag)
        if first:
            for item in items:
                # What is there by default stands in no file.
                if subject.source is None or item._index is not None:
                    report(
                        f"{called(item)}: OpenSim has {a(cls.tag)} from version {first} on; {target} refuses it",
                        item,
                    )
            continue
        for spec, version, before in new_properties(cls, target):
            was = f"; before it was called {before}" if before else ""
            for item in items:
                if not _is_given(subject, item, spec):
                    continue
                is_default = spec.factory is None and getattr(item, spec.name) == spec.default
                report(
                    f"{called(item)}: OpenSim has {spec.tag} from version {version} on; {target} drops it{was}",
                    item,
                    tag=spec.tag,
                    severity=INFO if is_default else None,
                )


def _is_given(subject: Subject, item: Object, spec: FieldSpec) -> bool:
    """Whether the text gives a property under its very tag; an older text may have it under another."""
    if subject.source is None:
        return spec.name in item.model_fields_set
    number = subject.element_of(item, spec.tag)
    return number is not None and subject.source.spans[number].tag == spec.tag
