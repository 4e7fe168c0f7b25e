"""Check OSIM701 and OSIM703 where the path of a mesh exists but is not a file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from osimlite import Body, Mesh, Model, PinJoint, validate, write
from osimlite.lint import Config


def test_a_folder_with_two_paths_is_named_once(tmp_path: Path, monkeypatch) -> None:
    model = Model(name="m")
    body = model.add(Body(name="b", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    body.attached_geometry.append(Mesh(name="bone", mesh_file="bone.vtp"))
    model.add(PinJoint(name="j").between(model.ground, body))
    write(model, tmp_path / "m.osim")
    monkeypatch.chdir(tmp_path)
    config = Config(select=("OSIM701",), mesh_paths=(str(tmp_path),))
    (finding,) = validate("m.osim", config=config).findings
    assert "searched . and Geometry;" in finding.message


@pytest.mark.parametrize("name", [os.devnull, "folder.vtp", "link.vtp", "Geometry"])
def test_what_is_no_file_is_not_called_by_its_own_name(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.vtp").mkdir()
    (tmp_path / "Geometry").mkdir()
    (tmp_path / "link.vtp").symlink_to("nowhere")
    model = Model(name="m")
    body = model.add(Body(name="b", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    body.attached_geometry.append(Mesh(name="bone", mesh_file=name))
    model.add(PinJoint(name="j").between(model.ground, body))
    write(model, tmp_path / "m.osim")
    (finding,) = validate(tmp_path / "m.osim", select=["OSIM701"]).findings
    assert finding.suggestion is None
    assert (
        finding.message
        == f"'{name}' of Mesh 'bone' is a folder, a device or a broken link, not a file"
    )


@pytest.mark.usefixtures("exact_names")
def test_a_file_in_other_letter_case_is_still_pointed_out(tmp_path: Path) -> None:
    (tmp_path / "bone.VTP").write_text("")
    model = Model(name="m")
    body = model.add(Body(name="b", mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
    body.attached_geometry.append(Mesh(name="bone", mesh_file="bone.vtp"))
    model.add(PinJoint(name="j").between(model.ground, body))
    write(model, tmp_path / "m.osim")
    (finding,) = validate(tmp_path / "m.osim", select=["OSIM701"]).findings
    assert finding.suggestion == "bone.VTP" and "case-sensitive file names" in finding.message
