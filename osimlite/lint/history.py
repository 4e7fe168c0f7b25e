"""Classes and properties that each release of OpenSim added; ``schemas/history.py`` extracts them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import join_words
from osimlite.errors import OsimliteError
from osimlite.schema.base import Object
from osimlite.schema.model import CURRENT_VERSION
from osimlite.schema.specs import FieldSpec, get_field_specs

NEWEST = "4.6"
"""Release of OpenSim whose classes osimlite declares."""


class LaterChanges(NamedTuple):
    """Classes and properties that releases after a given one added.

    `format` is the newest version of documents that the release writes. `classes` has the first
    release of each class by its tag. `properties` has the first release of each property and its
    earlier name, if any, by class and tag.
    """

    format: int
    classes: dict[str, str]
    properties: dict[str, list[str]]


class NewProperty(NamedTuple):
    """Property that is newer than a release, the first release with it, and its earlier name."""

    spec: FieldSpec
    since: str
    before: str


@cache
def load_later_changes(release: str) -> LaterChanges:
    """Return the additions of the releases of OpenSim after one.

    Raises:
        OsimliteError: the release is unknown.
    """
    if release == NEWEST:
        return LaterChanges(CURRENT_VERSION, {}, {})
    import json

    history: dict[str, dict[str, Any]] = json.loads(
        Path(__file__).with_suffix(".json").read_text(encoding="utf-8")
    )
    if release not in history["formats"]:
        raise OsimliteError(
            f"unknown release of OpenSim '{release}'; known are {join_words(history['formats'], max_count=20)}"
        )
    numbers = _parse_release(release)
    return LaterChanges(
        history["formats"][release],
        {
            tag: release_added
            for tag, release_added in history["classes"].items()
            if _parse_release(release_added) > numbers
        },
        {
            name: change
            for name, change in history["properties"].items()
            if _parse_release(change[0]) > numbers
        },
    )


@cache
def find_new_properties(cls: type[Object], release: str) -> list[NewProperty]:
    """Return the properties of a class that are newer than a release."""
    later = load_later_changes(release).properties
    names = {
        spec: (f"{spec.declared_in.tag}.{tag}", f"{cls.tag}.{tag}")
        for tag, spec in get_field_specs(cls).items()
    }
    changes = (
        (spec, later.get(base_key) or later.get(class_key))
        for spec, (base_key, class_key) in names.items()
    )
    return [
        NewProperty(spec, result[0], "".join(result[1:]))
        for spec, result in changes
        if result is not None
    ]


def _parse_release(release: str) -> tuple[int, ...]:
    return tuple(map(int, release.split(".")))
