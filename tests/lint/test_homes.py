"""Where a property belongs is found without building the classes that have nothing to do with it."""

from __future__ import annotations

from osimlite.lint.rules.structure import list_homes
from osimlite.schema.base import Object
from osimlite.schema.registry import find_class, list_tags
from osimlite.schema.specs import get_field_specs


def find_homes(tag: str, package: str) -> list[str]:
    """Return the classes of a package that declare a property, by looking into all classes."""
    specs = (get_field_specs(find_class(name) or Object).get(tag) for name in list_tags())
    declaring = {spec.declared_in for spec in specs if spec is not None}
    return sorted(cls.__name__ for cls in declaring if cls.__module__.rpartition(".")[0] == package)


def test_every_property_is_found_in_the_classes_that_declare_it() -> None:
    classes = [find_class(name) or Object for name in list_tags()]
    owners = {cls.__module__.rpartition(".")[0]: cls for cls in classes}
    properties = {tag for cls in classes for tag in get_field_specs(cls)}
    assert len(owners) == 3 and len(properties) > 700
    for tag in sorted(properties):
        for package, owner in owners.items():
            assert list_homes(tag, owner) == find_homes(tag, package)
    assert list_homes("isDisabled", Object) == []
