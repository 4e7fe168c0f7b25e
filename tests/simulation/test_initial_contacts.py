"""Tests of contacts that are inside each other when a simulation starts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.lint import validate
from osimlite.lint.diagnostic import Severity
from osimlite.simulation.elements import force_elements
from osimlite.simulation.initial_contacts import DeepContact, find_deep_contacts
from tests.simple_models import make_single_body


def find(model: osimlite.Model) -> list[DeepContact]:
    mechanism = osimlite.mechanism(model)
    q = np.array([coordinate.default_value for coordinate in mechanism.coordinates])
    return find_deep_contacts(force_elements(model, mechanism), mechanism, q, 0.0)


@pytest.mark.parametrize("name", ["fail-01-example", "fail-01-sunk", "pass-example"])
def test_depths_are_those_of_the_rule(fixtures: Path, name: str) -> None:
    model = osimlite.read(fixtures / "lint" / "OSIM521" / f"{name}.osim")
    findings = validate(model, select="OSIM521").findings
    contacts = find(model)
    assert len(contacts) == len(findings) == name.count("fail")
    for contact, finding in zip(contacts, findings, strict=True):
        assert f"'{contact.sphere}' starts {1000 * contact.depth:.3g} mm inside" in finding.message
        assert f"'{contact.surface}'" in finding.message
        assert contact.is_sunk == (finding.severity == Severity.WARNING)


def test_a_smooth_contact_and_two_spheres() -> None:
    """The sphere of radius 0.1 m is 0.03 m above the plane y = 0, and 0.05 m beside another."""
    model = make_single_body(osimlite.FreeJoint(name="j"), body="b")
    ball = osimlite.ContactSphere(
        name="ball", socket_frame="/bodyset/b", radius=0.1, location=(0.0, 0.03, 0.0)
    )
    floor = osimlite.ContactHalfSpace(
        name="floor", socket_frame="/ground", orientation=(0.0, 0.0, -1.5707963267948966)
    )
    wall = osimlite.ContactSphere(
        name="wall", socket_frame="/ground", radius=0.2, location=(0.25, 0.03, 0.0)
    )
    for surface in (ball, floor, wall):
        model.add(surface)
    model.add(
        osimlite.SmoothSphereHalfSpaceForce(
            name="smooth", socket_sphere=ball, socket_half_space=floor
        )
    )
    parameters = osimlite.HuntCrossleyContactParameters(geometry=(ball, wall), stiffness=1e6)
    contact = osimlite.HuntCrossleyForce(name="hard")
    contact.contact_parameters.objects.append(parameters)
    model.add(contact)
    assert [(item.sphere, item.surface) for item in find(model)] == [
        ("ball", "floor"),
        ("ball", "wall"),
    ]
    assert [item.depth for item in find(model)] == pytest.approx([0.07, 0.05])
