"""Tests of ``translate`` on the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import osimlite
from osimlite.cli._fidelity_table import tabulate
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.geometry import Mesh
from osimlite.translate.exporters import list_exporters
from osimlite.translate.fidelity import Fidelity
from tests.cli.command import run
from tests.simulation.elements.muscle_rows import hung, muscle


def urdf_records(folder: Path) -> str:
    """Return, in one string, how the translation treats each feature that URDF cannot represent."""
    records = json.loads((folder / "fidelity.json").read_text())["records"]
    return "\n".join(record["done"] for record in records)


@pytest.fixture
def walker(tmp_path: Path) -> Path:
    osimlite.write(dynamic_walker(), tmp_path / "walker.osim")
    return tmp_path


def test_translate_writes_the_urdf_and_tells_what_is_lost(walker: Path) -> None:
    code, out, _ = run("translate", "walker.osim", "--to", "urdf", "-o", "robot", folder=walker)
    assert code == 0
    assert (walker / "robot/walker.urdf").read_text().startswith("<?xml")
    assert (walker / "robot/meshes/ellipsoid.obj").exists()
    records = json.loads((walker / "robot/fidelity.json").read_text())["records"]
    assert {"force", "gravity", "locked"} <= {record["kind"] for record in records}
    assert "a contact surface" in out and "13 links, 12 joints (7 moving)" in out
    coordinates = json.loads((walker / "robot/walker.coordinates.json").read_text())["coordinates"]
    assert '"file": "walker.urdf"' in (walker / "robot/walker.coordinates.json").read_text()
    assert [item["joint"] for item in coordinates if item["name"] == "RHip_rz"] == ["RHip_rz"]
    table = out.partition("components: ")[0].splitlines()
    assert len(table) > 10 and max(map(len, table)) <= 80 and not set("│┃┏") & set(out)


def test_translate_takes_options(walker: Path) -> None:
    code, out, _ = run("translate", "walker.osim", "--limits", "range", "--merge", folder=walker)
    assert code == 0 and "8 links, 7 joints (7 moving)" in out
    assert (
        '<joint name="RKnee_rz" type="revolute">' in (walker / "walker" / "walker.urdf").read_text()
    )


def test_translate_writes_collision_shapes_and_limits(walker: Path) -> None:
    code, _, _ = run(
        "translate",
        "walker.osim",
        "--collision",
        "--effort",
        "50",
        "--velocity",
        "7",
        folder=walker,
    )
    text = (walker / "walker" / "walker.urdf").read_text()
    assert code == 0 and "collision box of 1 x 200 x 200 m" in urdf_records(walker / "walker")
    assert "<collision " in text and 'effort="50" velocity="7"' in text


def test_folders_of_meshes_are_named_by_options_settings_and_the_environment(
    tmp_path: Path, fixtures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = osimlite.Model(name="bones")
    for name in ("ascii", "binary", "strips"):
        body = model.add(osimlite.Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        body.attach(Mesh(mesh_file=f"{name}.vtp"))
        model.add(osimlite.WeldJoint(name=f"w_{name}").between(model.ground, body))
        (tmp_path / name).mkdir()
        shutil.copy(fixtures / "meshes" / f"{name}.vtp", tmp_path / name)
    osimlite.write(model, tmp_path / "bones.osim")
    monkeypatch.setenv("OSIMLITE_GEOMETRY", "nowhere:strips")
    (tmp_path / "osimlite.toml").write_text('mesh-paths = ["binary"]\n')
    code, out, _ = run(
        "translate", "bones.osim", "--geometry", "ascii", "-o", "robot", folder=tmp_path
    )
    assert code == 0 and "VTK's format" in out
    assert sorted(path.name for path in (tmp_path / "robot/meshes").iterdir()) == [
        "ascii.obj",
        "binary.obj",
        "strips.obj",
    ]


def test_translate_writes_mjcf_and_its_account(walker: Path) -> None:
    code, out, _ = run("translate", "walker.osim", "--to", "mjcf", "-o", "native", folder=walker)
    assert code == 0 and "worst error" in out and "converted, 0 left out" in out
    account = json.loads((walker / "native/fidelity.json").read_text())
    limits = [record for record in account["records"] if record["kind"] == "limit-force"]
    assert account["target"] == "mjcf 4" and {record["how"] for record in limits} == {"approximate"}
    assert (
        set(limits[0]["errors"]) == {"force", "damping"}
        and limits[0]["errors"]["force"]["unit"] == "N m"
    )
    code, _, _ = run(
        "translate", "walker.osim", "--to", "mjcf", "--driver", "-o", "driven", folder=walker
    )
    assert code == 0
    assert sorted(path.name for path in (walker / "driven").iterdir() if path.is_file()) == [
        "fidelity.json",
        "walker.osim",
        "walker.xml",
    ]


def test_a_file_of_mujocos_is_checked_against_its_model(tmp_path: Path) -> None:
    model = hung(muscle("thelen_default"))
    model["/jointset/slide/x"].range = (0.25, 0.4)
    (tmp_path / "one.osim").write_text(osimlite.to_text(model))
    assert run("translate", "one.osim", "--to", "mjcf", "-o", "native", folder=tmp_path)[0] == 0
    code, out, _ = run(
        "translate", "one.osim", "--check", "native/one.xml", "-o", "checked", folder=tmp_path
    )
    assert code == 0 and "one.xml: root mean square errors" in out and "mu " in out
    (result,) = json.loads((tmp_path / "checked/check.json").read_text())["muscles"]
    assert (
        result["length"]["max"] < 1e-12
        and result["fiber"] == pytest.approx(1.0)
        and result["force"]["rms"] < 0.2
    )
    code, _, error = run("translate", "one.osim", "--check", "gone.xml", folder=tmp_path)
    assert code == 2 and "gone.xml: MuJoCo does not load it" in error


def test_paths_are_called_by_the_names_of_their_muscles() -> None:
    fidelity = Fidelity("arm", "mjcf")
    for name in ("BRA", "TRIlat"):
        fidelity.add("path", f"/forceset/{name}/path", "a path with a cylinder", "a tendon")
    assert list(tabulate(fidelity, "MJCF").columns[2].cells) == ["BRA and TRIlat"]


FORMATS = " or ".join(repr(name) for name in (*list_exporters("translate"), "osim"))
"""Values of `--to` as messages list them."""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("walker.osim", "--to", "sdf"), f"--to is {FORMATS}, not 'sdf'"),
        (("walker.osim", "--to", "mjcf", "--merge"), "--merge is an option of --to urdf"),
        (("walker.osim", "--mujoco", "3"), "--mujoco is an option of --to mjcf"),
        (("walker.osim", "--to", "mjcf", "--mujoco", "2"), "must be 3 or 4, not 2"),
        (("walker.osim", "--limits", "all"), "limits must be 'none' or 'range'"),
        (("walker.osim", "--effort", "0"), "a limit of effort must be a positive number, not 0"),
        (("gone.osim",), "gone.osim"),
        (
            ("walker.osim", "--geometry", "gone"),
            "gone: --geometry names a folder that does not exist",
        ),
        (("walker.osim", "-o", "walker.osim"), "cannot make a folder here"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    walker: Path, arguments: tuple[str, ...], said: str
) -> None:
    code, out, error = run("translate", *arguments, folder=walker)
    assert code == 2 and out == ""
    assert said in error and len(error.splitlines()) == 1


def test_a_model_that_is_no_mechanism_is_refused(walker: Path) -> None:
    text = (walker / "walker.osim").read_text()
    (walker / "loose.osim").write_text(
        text.replace("/bodyset/RightShank</socket_parent>", "/bodyset/RightShnk</socket_parent>")
    )
    code, _, error = run("translate", "loose.osim", "-o", "robot", folder=walker)
    assert code == 1 and "did you mean '/bodyset/RightShank'" in error
    assert not (walker / "robot").exists()
