"""Tests of contact of meshes in machine code against the PyBullet engine."""

from __future__ import annotations

import pytest

import osimlite
from osimlite import ContactMesh, ContactSphere
from osimlite.errors import UnsupportedError
from osimlite.schema.contact_forces import ElasticFoundationForce
from osimlite.simulation.elements.foundation import Springs
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.plan import plan
from tests.simulation.force_cases import chain, floor
from tests.simulation.meshes import ball, block, write_obj
from tests.simulation.support import assert_same, engines, states, thrown


def touching(surfaces) -> ElasticFoundationForce:
    force = ElasticFoundationForce(name="contact", transition_velocity=0.3)
    for index, surface in enumerate(surfaces):
        force.contact_parameters.objects.append(
            ElasticFoundationForce.ContactParameters(
                geometry=(surface.name,),
                stiffness=1e5 * (1 + index),
                dissipation=0.3,
                static_friction=0.8,
                dynamic_friction=0.4,
                viscous_friction=0.2,
            )
        )
    return force


def meshes(folder):
    write_obj(folder / "ball.obj", *ball((0.5, 0.4, 0.6)))
    write_obj(folder / "block.obj", *block((0.4, 0.5, 0.3)))
    place = {"location": (0.1, 0.05, -0.1), "orientation": (0.4, -0.2, 0.7)}
    return (
        ContactMesh(name="m", socket_frame="/bodyset/b1", filename="ball.obj", **place),
        ContactMesh(name="n", socket_frame="/bodyset/b3", filename="block.obj", **place),
    )


def test_on_a_plane_and_a_sphere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model, (one, two) = chain(), meshes(tmp_path)
    stone = ContactSphere(
        name="stone", socket_frame="/bodyset/b0", location=(0.2, 0.3, 0.1), radius=0.7
    )
    plane = floor()
    model.add(plane, stone, one, two)
    for name, surfaces in (
        ("first", (one, plane, stone)),
        ("second", (stone, two)),
        ("third", (plane, two)),
    ):
        force = touching(surfaces)
        force.name = name
        model.add(force)
    mechanism, ours, theirs = engines(model)
    with theirs:
        assert assert_same(mechanism, ours, theirs, 20) == 0b1111


def test_meshes_on_each_other(tmp_path, monkeypatch):
    """Machine code calls Python for contact between meshes; exceptions there must reach the caller."""
    monkeypatch.chdir(tmp_path)
    model, surfaces = chain(), meshes(tmp_path)
    for surface in surfaces:
        surface.location = (0, 0, 0)
    model.add(*surfaces, touching(surfaces))
    mechanism, ours, theirs = engines(model)
    with theirs:
        assert assert_same(mechanism, ours, theirs, 20) == 0b1

    near = [(t, ours.state.pack(q, u)) for t, q, u in states(mechanism, 20)]
    t, y = next(moment for moment in near if ours.find_touching_contacts(*moment))

    def wrong(*_):
        raise ZeroDivisionError("in Python")

    monkeypatch.setattr(Springs, "load", wrong)
    with pytest.raises(ZeroDivisionError, match="in Python"):
        ours.compute_derivative(t, y)


def test_a_motion(tmp_path):
    model = thrown(tmp_path, dissipation=0.5, friction=0.5)
    model.force_set.objects[0].contact_parameters.objects[0].geometry = ("floor", "shell")
    theirs, ours = (
        osimlite.simulate(model, 0.4, engine, accuracy=1e-8, folder=tmp_path)
        for engine in ("bullet", "compiled")
    )
    assert ours.values[-1] == pytest.approx(theirs.values[-1], abs=1e-6)
    result, expected = (item.summary["contact_events"] for item in (ours, theirs))
    assert [event["event"] for event in result] == [event["event"] for event in expected] != []
    assert result[0]["time_s"] == pytest.approx(expected[0]["time_s"], abs=1e-7)
    name = "contact.egg.torque.Z"
    assert ours.forces[name] == pytest.approx(theirs.forces[name], abs=1e-3)


def test_what_is_computed_in_python_has_no_derivatives(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model, surfaces = chain(), meshes(tmp_path)
    force = touching(surfaces)
    force.name = "push"
    model.add(*surfaces, force)
    with pytest.raises(UnsupportedError, match="/forceset/push' is computed in Python"):
        osimlite.tangents(model)
    made = plan(model, {"/bodyset/b1/mass": (1.0, 3.0)}, measures=("energy",), to=0.01)
    with pytest.raises(UnsupportedError, match="/forceset/push' is computed in Python"):
        registry.make_gradients(made).evaluate([2.0], [0])
