"""Check the table of consequences of numbers outside of their domain in OpenSim."""

from __future__ import annotations

from osimlite.lint.rules.domains import describe_consequence
from osimlite.schema.facts import NAN, REFUSED, Facts
from osimlite.schema.fields import Value
from osimlite.schema.registry import MODULES, find_class
from osimlite.schema.specs import get_field_specs
from tests.cases import of_each


def entries():
    for cls in MODULES:
        facts = known_class(cls).__dict__.get("facts", Facts())
        for fates in (facts.outside, facts.zero, facts.missing):
            yield from ((cls, name) for words in fates.values() for name in words.split())
        yield from (
            (cls, name) for name in (*facts.refused.split(), *facts.doubtful, *facts.domains)
        )


def known_class(name):
    from importlib import import_module

    return getattr(import_module(MODULES[name]), name)


@of_each([*entries()])
def test_an_entry_is_a_property_with_a_domain(entry):
    cls, name = entry
    spec = next(spec for spec in get_field_specs(known_class(cls)).values() if spec.name == name)
    assert isinstance(spec.kind, Value) and (
        spec.kind.domain or name in known_class(cls).facts.domains
    )


def test_a_derived_class_inherits_and_zero_differs_from_less():
    thelen = find_class("Thelen2003Muscle")
    limit = find_class("CoordinateLimitForce")
    assert describe_consequence(thelen, "minimum_activation", 0.0) == (REFUSED, True)
    assert describe_consequence(limit, "transition", 0.0) == (REFUSED, True)
    assert describe_consequence(limit, "transition", -1.0) == ("", False)
    assert describe_consequence(limit, "upper_stiffness", 0.0) == (NAN, True)
