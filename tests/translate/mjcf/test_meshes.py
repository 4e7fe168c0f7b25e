"""Tests of meshes that MuJoCo rejects: they are left out of the file, and a record says why."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from osimlite import (
    ContactHalfSpace,
    ContactMesh,
    ElasticFoundationContactParameters,
    ElasticFoundationForce,
    Mesh,
    Model,
    to_mjcf,
)
from osimlite.schema.geometry_types import Cylinder, Ellipsoid
from tests.simple_models import make_pendulum


def format_tetrahedron(size: str) -> str:
    """Return an OBJ file with three edges of this length (m) along the axes."""
    points = f"v 0 0 0\nv {size} 0 0\nv 0 {size} 0\nv 0 0 {size}\n"
    return points + "f 3 2 1\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


MESHES = {
    "point.obj": format_tetrahedron("0"),
    "line.obj": "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3\nf 2 3 4\n",
    "triangle.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "square.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n",
    "tilted_square.obj": "v 9 0.1 0\nv 9.7 0.8 0\nv 9 0.1 1\nv 9.7 0.8 1\nf 1 2 3\nf 2 4 3\n",
    "speck.obj": format_tetrahedron("1e-9"),
    "tetrahedron.obj": format_tetrahedron("1"),
    "triangle.stl": """\
solid triangle
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid triangle
""",
}
REASONS = {
    "point.obj": "different corners",
    "line.obj": "m^2",
    "triangle.obj": "different corners",
    "speck.obj": "m^2",
    "triangle.stl": "different corners",
}
FLAT = ("square.obj", "tilted_square.obj")


def export_records(model: Model, folder: Path) -> dict[str, list[str]]:
    """Return what was done with each component that is not exact, in a file that MuJoCo accepts."""
    for name, content in MESHES.items():
        (folder / name).write_text(content, encoding="utf-8")
    mjcf = to_mjcf(model, folder=folder)
    mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    records: dict[str, list[str]] = {}
    for record in mjcf.fidelity:
        records.setdefault(record.component, []).append(record.done)
    return records


@pytest.mark.parametrize("file", MESHES)
def test_a_drawn_mesh_is_left_out_if_mujoco_rejects_it(file: str, tmp_path: Path) -> None:
    model = make_pendulum()
    model["/bodyset/bob"].attach(Mesh(mesh_file=file))
    records = export_records(model, tmp_path)
    left_out = [done for items in records.values() for done in items if "left out" in done]
    if file in REASONS:
        (reason,) = left_out
        assert REASONS[file] in reason
    else:
        assert not left_out


@pytest.mark.parametrize("file", MESHES)
def test_a_contact_mesh_is_left_out_if_mujoco_rejects_it(file: str, tmp_path: Path) -> None:
    model = make_pendulum()
    model.add(ContactMesh(name="mesh", socket_frame="/bodyset/bob", filename=file))
    model.add(ContactHalfSpace(name="floor", socket_frame="/ground"))
    force = ElasticFoundationForce(name="force")
    parameters = ElasticFoundationContactParameters(geometry=["mesh", "floor"], stiffness=1e6)
    force.contact_parameters.objects.append(parameters)
    model.add(force)
    records = export_records(model, tmp_path)
    if file in REASONS or file in FLAT:
        assert records["/contactgeometryset/mesh"][-1].startswith("left out: ")
        assert "its convex hull" not in records["/contactgeometryset/mesh"]
        assert records["/forceset/force"] == [
            "left out: no two of its surfaces on different bodies are in the file"
        ]
    else:
        assert records["/contactgeometryset/mesh"] == ["its convex hull"]
        assert not records["/forceset/force"][0].startswith("left out")


@pytest.mark.parametrize("factor", [0.0, 1e-320, 1e-200, 1e-9, 1e-8, 1e-7, 1e-6, 1e30, 1e308])
@pytest.mark.parametrize("stretched_axes", [1, 2, 3])
def test_shapes_of_any_scale_are_drawn_or_left_out(
    factor: float, stretched_axes: int, tmp_path: Path
) -> None:
    factors = [factor] * stretched_axes + [1.0] * (3 - stretched_axes)
    scale = (factors[0], factors[1], factors[2])
    model = make_pendulum()
    for shape in (
        Mesh(mesh_file="tetrahedron.obj", scale_factors=scale),
        Ellipsoid(radii=(0.1, 0.2, 0.3), scale_factors=scale),
        Cylinder(radius=0.1, half_height=0.2, scale_factors=scale),
    ):
        model["/bodyset/bob"].attach(shape)
    export_records(model, tmp_path)
