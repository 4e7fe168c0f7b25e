"""Compare ElasticFoundationForce with a live OpenSim 4.6 at random states."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite import ContactHalfSpace, ContactMesh, ContactSphere
from osimlite.schema.contact_forces import ElasticFoundationForce
from osimlite.schema.contact_types import ContactEllipsoid
from tests.simulation.meshes import WRITERS, ball, block

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, STATES, carrier, compare  # noqa: E402

MATERIAL = {
    "dissipation": 0.3,
    "static_friction": 0.8,
    "dynamic_friction": 0.4,
    "viscous_friction": 0.2,
}


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return carrier(request.param)


def foundation(name, surfaces, stiffness):
    force = ElasticFoundationForce(name=name, transition_velocity=0.3)
    for surface, k in zip(surfaces, stiffness, strict=True):
        force.contact_parameters.objects.append(
            ElasticFoundationForce.ContactParameters(geometry=(surface,), stiffness=k, **MATERIAL)
        )
    return force


def meshes(model, kinds, tmp_path, sizes=(0.5, 0.4, 0.6)):
    result = []
    for number, (frame, kind) in enumerate(
        zip(("/bodyset/b1/f1", "/bodyset/b2", "/bodyset/b0"), kinds, strict=False)
    ):
        shape = block if number % 2 else ball
        WRITERS[kind](
            tmp_path / f"mesh{number}{kind}", *shape(np.array(sizes) * (1.0 + 0.3 * number))
        )
        place = {"location": (0.1, 0.05, -0.1), "orientation": (0.4, -0.2, 0.7 * number)}
        result.append(
            ContactMesh(
                name=f"m{number}", socket_frame=frame, filename=f"mesh{number}{kind}", **place
            )
        )
    model.add(*result)
    return result


@pytest.mark.parametrize(
    "kinds", [(".obj", ".vtp"), (".stl", ".stla")], ids=["polygons", "triangles"]
)
@pytest.mark.parametrize("carried", ["/ground", "/bodyset/b0/f0"])
def test_meshes_on_a_plane(model, carried, kinds, tmp_path):
    plane = ContactHalfSpace(
        name="plane", socket_frame=carried, location=(0, -0.3, 0), orientation=(0.1, 0.2, -1.4)
    )
    model.add(plane)
    for number, mesh in enumerate(meshes(model, kinds, tmp_path)):
        model.add(foundation(f"contact{number}", (mesh, plane), (1e4, 0.0)))
    assert 0 < compare(model, tmp_path) <= STATES * 2 * 12


def test_meshes_on_spheres_and_what_touches_nothing(model, tmp_path):
    sphere = ContactSphere(
        name="sphere", socket_frame="/ground", location=(0.3, 0.1, 0), radius=0.6
    )
    egg = ContactEllipsoid(name="egg", socket_frame="/ground", radii=(1.0, 1.2, 0.9))
    plane = ContactHalfSpace(
        name="plane", socket_frame="/ground", location=(0, 5, 0), orientation=(0, 0, 1.5)
    )
    model.add(sphere, egg, plane)
    result = meshes(model, (".obj", ".vtp"), tmp_path)
    # In an ElasticFoundationForce neither the ellipsoid nor surfaces without a mesh make contact.
    model.add(foundation("contact", (*result, sphere, egg), (1e4, 2e4, 0.0, 0.0)))
    model.add(foundation("nothing", (sphere, egg), (1e4, 0.0)))
    assert compare(model, tmp_path) > 0


@pytest.mark.parametrize("kinds", [(".obj", ".obj", ".stl"), (".vtp", ".stl", ".obj")])
def test_meshes_on_meshes(model, kinds, tmp_path):
    result = meshes(model, kinds, tmp_path)
    model.add(foundation("contact", result, (1e4, 2e4, 5e3)))
    assert compare(model, tmp_path) > 0


def test_a_mesh_within_a_mesh_touches_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model = carrier(JOINTS["pin, slider, universal"])
    WRITERS[".obj"](tmp_path / "large.obj", *ball((9.0, 9.0, 9.0)))
    large = ContactMesh(name="large", socket_frame="/ground", filename="large.obj")
    model.add(large)
    (small,) = meshes(model, (".obj",), tmp_path)
    model.add(foundation("contact", (small, large), (1e4, 1e4)))
    assert compare(model, tmp_path) == 0
