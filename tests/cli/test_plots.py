"""Tests of ``--plot`` of the commands that compute."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import write_sto
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.source import make_model
from tests.cli.command import run
from tests.labs import change, copy_lab

pytest.importorskip("matplotlib", reason="needs matplotlib (extra 'plot')")


@pytest.fixture
def walk(tmp_path):
    """Write the walker and a motion of it, and return the folder."""
    osimlite.write(dynamic_walker(), tmp_path / "walker.osim")
    times = np.linspace(0.0, 0.5, 26)
    rows = np.column_stack([times, 20.0 * np.sin(9.0 * times), -20.0 * np.sin(9.0 * times)])
    columns = ("Pelvis_tx", "RHip_rz", "LHip_rz")
    write_sto(tmp_path / "walk.mot", "walk", times, columns, rows.tolist(), in_degrees=True)
    return tmp_path


def pictures(folder: Path) -> set[str]:
    for path in folder.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
    return {path.name for path in folder.glob("*.png")}


def test_recorded_motions_are_drawn(walk):
    done = run("kinematics", "walker.osim", "walk.mot", "-o", "k", "--plot", folder=walk)
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith(f"drew {Path('k', 'bodies.png')}\n")
    # The walker has no markers, so there is no picture of markers.
    assert pictures(walk / "k") == {"bodies.png"}
    done = run("inverse-dynamics", "walker.osim", "walk.mot", "-o", "i", "--plot", folder=walk)
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith(f"drew {Path('i', 'inverse_dynamics.png')}\n")
    assert pictures(walk / "i") == {"inverse_dynamics.png"}


def test_without_the_option_nothing_is_drawn(walk):
    run("kinematics", "walker.osim", "walk.mot", "-o", "k", folder=walk)
    assert pictures(walk / "k") == set()


def test_muscle_forces_are_drawn(tmp_path):
    osimlite.write(make_model("arm"), tmp_path / "arm.osim")
    model = osimlite.read(tmp_path / "arm.osim")
    names = osimlite.mechanism(model).coordinate_names
    times = np.linspace(0.0, 0.4, 21)
    rows = [[10.0 + 20.0 * t for _ in names] for t in times]
    write_sto(tmp_path / "a.mot", "a", times, names, rows, in_degrees=True)
    done = run("static-optimization", "arm.osim", "a.mot", "-o", "s", "--plot", folder=tmp_path)
    assert "Traceback" not in done.err and "pictures into s" in done.out
    assert {"StaticOptimization_activation.png", "StaticOptimization_force.png"} <= pictures(
        tmp_path / "s"
    )


def copy_kinematics(folder: Path) -> None:
    """Copy the setup of a body kinematics analysis and restrict it to the mass centre, so that results fill few pages."""
    copy_lab("unbalanced", folder)
    change(folder / "kin.xml", ("all center_of_mass", "center_of_mass"))


@pytest.mark.parametrize("more", [pytest.param((), marks=pytest.mark.full), ("-o", "out")])
def test_setups_are_drawn_into_folders_of_their_own(tmp_path, more):
    copy_kinematics(tmp_path)
    done = run("run", "kin.xml", *more, "--plot", folder=tmp_path)
    assert done.code == 0, done.err
    folder = tmp_path / (more[1] if more else "") / "kin-plots"
    assert pictures(folder)
    done = run("run", "kin.xml", "so.xml", "--plot", "--workers", "2", folder=tmp_path)
    assert done.code == 2 and "--plot runs setups one after the other" in done.err


@pytest.mark.parametrize("more", [(), pytest.param(("-o", "out"), marks=pytest.mark.full)])
def test_setups_of_the_same_name_are_drawn_into_different_folders(tmp_path, more):
    for name in "ab":
        copy_kinematics(tmp_path / name)
    done = run("run", "a/kin.xml", "b/kin.xml", *more, "--plot", folder=tmp_path)
    assert done.code == 0, done.err
    for name in "ab":
        assert pictures(tmp_path / (more[1] if more else "") / name / "kin-plots")


def test_sweeps_are_drawn(walk):
    pytest.importorskip("pyarrow", reason="needs pyarrow (extra 'sweep')")
    words = ("--vary", "RHip_rz=0.2:0.4:2", "--vary", "Pelvis_tx/speed=0:1:2", "--to", "0.05")
    done = run("sweep", "walker.osim", *words, "--plot", "-o", "runs.parquet", folder=walk)
    assert (done.code, done.err) == (0, "") and done.out.endswith("drew runs.png\n")
    assert pictures(walk) == {"runs.png"}


def test_pages_of_an_earlier_simulation_are_removed(walk):
    words = ("simulate", "walker.osim", "--to", "0.05", "-o", "r")
    # Later simulations remove pages of earlier ones from the folder, whether or not they draw.
    assert run(*words, folder=walk).code == 0
    for page in (2, 3):
        (walk / "r" / f"states-{page}.png").write_bytes(b"\x89PNG")
    (walk / "r" / "mine-2.png").write_bytes(b"\x89PNG")
    assert run(*words, "--plot", folder=walk).code == 0
    assert {name for name in pictures(walk / "r") if "-" in name} == {"mine-2.png"}
