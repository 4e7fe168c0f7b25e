"""Check that finding the class of a property does not build unrelated classes."""

from __future__ import annotations

from osimlite.lint.rules.structure import list_homes
from osimlite.schema.base import Object
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import get_field_specs


def find_homes(classes: list[type[Object]]) -> dict[tuple[str, str], list[str]]:
    """Return the classes that declare each property, by searching all classes.

    Returns:
        Names of classes by the tag of the property and the package of the class.
    """
    declaring = {
        (tag, spec.declared_in) for cls in classes for tag, spec in get_field_specs(cls).items()
    }
    homes: dict[tuple[str, str], list[str]] = {}
    for tag, cls in declaring:
        homes.setdefault((tag, cls.__module__.rpartition(".")[0]), []).append(cls.__name__)
    return {place: sorted(names) for place, names in homes.items()}


def test_every_property_is_found_in_the_classes_that_declare_it() -> None:
    classes = [find_class(name) or Object for name in list_tags()]
    owners = {cls.__module__.rpartition(".")[0]: cls for cls in classes}
    properties = {tag for cls in classes for tag in get_field_specs(cls)}
    assert len(owners) == 3 and len(properties) > 700
    homes = find_homes(classes)
    for tag in sorted(properties):
        for package, owner in owners.items():
            assert list_homes(tag, owner) == homes.get((tag, package), [])
    assert list_homes("isDisabled", Object) == []
