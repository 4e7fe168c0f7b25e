"""Tests of ``sweep``, ``optimize`` and other commands that vary parameters."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import osimlite
from osimlite.cli import main

pytest.importorskip("scipy", reason="needs scipy (extra 'sweep')")
pq = pytest.importorskip("pyarrow.parquet", reason="needs pyarrow (extra 'sweep')")


@pytest.fixture
def folder(tmp_path: Path, fixtures: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    osimlite.write(
        osimlite.read(fixtures / "walker" / "DynamicWalkerModel.osim"), tmp_path / "walker.osim"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words: str) -> int:
    try:
        main(list(words))
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def test_a_grid(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "sweep",
        "walker.osim",
        "--vary",
        "RHip_rz=20deg:40deg:3",
        "--vary",
        "platform_rz=-10deg:-5deg:2",
    ]
    assert (
        run(
            *words,
            "--to",
            "0.4",
            "--measure",
            "distance",
            "--measure",
            "RHip_rz/speed",
            "-o",
            "grid.parquet",
        )
        == 0
    )
    shown = capsys.readouterr().out
    assert "6 runs" in shown and "6 done" in shown and "grid.parquet" in shown
    table = pq.read_table("grid.parquet")
    assert table.column_names == [
        "run", "RHip_rz", "platform_rz", "status", "reason", "time", "distance", "RHip_rz/speed",
    ]  # fmt: skip
    assert table.num_rows == 6


def test_parameters_and_stops(folder: Path) -> None:
    words = [
        "sweep",
        "dynamic-walker",
        "-p",
        "slope=8",
        "--vary",
        "thigh_length=0.35:0.45",
        "--samples",
        "4",
    ]
    assert run(*words, "--stop-below", "Pelvis_ty=70cm", "--sampler", "lhs", "--seed", "3") == 0
    table = pq.read_table("results.parquet").to_pydict()
    assert set(table["reason"]) <= {None, "Pelvis_ty below 0.7"} and len(table["run"]) == 4


def test_parameters_may_be_whole_numbers_or_have_no_default(folder: Path) -> None:
    Path("made.py").write_text(
        "from osimlite.models.dynamic_walker import dynamic_walker\n\n\n"
        "def make(steep, count: int = 1):\n    return dynamic_walker(slope=steep * range(3)[count])\n"
    )
    words = ["sweep", "made.py", "--to", "0.05", "--measure", "RHip_rz/value"]
    assert run(*words, "--vary", "count=1:2:2", "-p", "steep=4", "-o", "count.parquet") == 0
    assert pq.read_table("count.parquet")["status"].to_pylist() == ["done", "done"]
    assert run(*words, "--vary", "steep=4:8:2", "-o", "steep.parquet") == 0
    assert pq.read_table("steep.parquet")["steep"].to_pylist() == [4.0, 8.0]
    ends = [
        pq.read_table(f"{name}.parquet")["RHip_rz/value"].to_pylist() for name in ("count", "steep")
    ]
    assert ends[0] == ends[1] and ends[0][0] != ends[0][1]


def test_a_search(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    words = [
        "optimize",
        "walker.osim",
        "--objective",
        "distance",
        "--vary",
        "RHip_rz=0:60deg",
        "--vary",
        "LHip_rz=-1:0",
    ]
    assert run(*words, "--to", "0.4", "--budget", "12", "--popsize", "6") == 0
    shown = capsys.readouterr().out
    summary = json.loads((folder / "optimum" / "summary.json").read_text())
    assert f"distance {summary['value']:.6g}" in shown and summary["evaluations"] == 12
    assert osimlite.validate(str(folder / "optimum" / "best.osim")).ok


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sweep", "walker.osim"], "name the quantities to vary"),
        (["sweep", "walker.osim", "--vary", "RHip_rz"], "--vary takes"),
        (
            ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "-o", "b.csv"],
            "name the file 'b.parquet'",
        ),
        (["sweep", "walker.osim", "--vary", "RHip_rz=20deg:40:3"], "a unit at one end only"),
        (["sweep", "walker.osim", "--vary", "RHip_rx=0:1"], "did you mean 'RHip_rz'"),
        (["sweep", "walker.osim", "--vary", "RHip_rz=0:1"], "--samples"),
        (["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "-p", "a=1"], "has no parameters"),
        (
            ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "--stop-below", "RHip_rz=low"],
            "--stop-below takes",
        ),
        (["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "--stop-below", "RHip=0"], "RHip"),
        (
            ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "--stop-below", "Pelvis_ty=30deg"],
            "in m, cm or mm",
        ),
        (
            ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "--stop-above", "RHip_rz=2m"],
            "in deg or rad",
        ),
        (
            ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "--stop-above", "platform_rz=2"],
            "is locked",
        ),
        (
            ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "-o", "walker.osim/r.parquet"],
            "a file, not a folder",
        ),
        (["sweep", "walker.osim", "--vary", "RHip_rz=0:1:3", "-o", "."], "folder"),
        (["sweep", "dynamic-walker", "--vary", "slope=1:5:2", "-p", "slope=2"], "slope"),
        (
            ["optimize", "walker.osim", "--objective", "speed", "--vary", "RHip_rz=0:1"],
            "no measure 'speed'",
        ),
        (
            ["optimize", "none.osim", "--objective", "distance", "--vary", "RHip_rz=0:1"],
            "none.osim",
        ),
    ],
)
def test_what_is_wrong_is_one_sentence(
    words: list[str], said: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = run(*words)
    error = capsys.readouterr().err
    assert code == 2, error
    assert error.startswith("osimlite: ") and said in error and error.count("\n") == 1
    assert [path.name for path in folder.iterdir()] == ["walker.osim"]


def test_results_of_another_sweep_are_spared(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", "walker.osim", "--to", "0.05", "-o", "r.parquet", "--vary"]
    assert run(*words, "RHip_rz=0:0.1:2") == 0
    before = Path("r.parquet").read_bytes()
    assert run(*words, "RHip_rz=0:0.1:2") == 0 and Path("r.parquet").read_bytes() == before
    capsys.readouterr()
    assert run(*words, "RHip_rz=0:0.2:3") == 2
    assert "--force" in capsys.readouterr().err and Path("r.parquet").read_bytes() == before
    assert (
        run(*words, "RHip_rz=0:0.2:3", "--force") == 0 and pq.read_table("r.parquet").num_rows == 3
    )
    Path("r.parquet").write_text("mine")
    assert run(*words, "RHip_rz=0:0.2:3") == 2 and Path("r.parquet").read_text() == "mine"


def test_degrees_that_are_taken_for_radians_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", "walker.osim", "--to", "0.01", "--stop-below", "RHip_rz=-400deg"]
    for asked, degrees in (
        (["--vary", "RHip_rz=20:40:2"], "20deg"),
        (["--vary", "RHip_rz=0:1:2", "--stop-above", "LHip_rz=80"], "80deg"),
    ):
        assert run(*words, *asked) == 2
        (told,) = capsys.readouterr().err.splitlines()
        assert f"did you mean {degrees}?" in told and "rad after the number" in told
    assert run(*words, "--vary", "RHip_rz=20rad:40rad:2", "--stop-above", "LHip_rz=80rad") == 0


def test_what_looks_like_markup_is_shown_as_it_is(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("own.py").write_text("def picky(run):\n    raise ValueError('[/x] is no [red] :bug:')\n")
    words = ["sweep", "walker.osim", "--vary", "RHip_rz=0:1:2", "--to", "0.05"]
    assert run(*words, "--measure", "own.py:picky", "-o", "a[b]") == 1
    shown = " ".join(capsys.readouterr().out.split())
    assert "ValueError: [/x] is no [red] :bug:" in shown and "a[b]" in shown


def test_long_names_are_shown_whole(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    paths = [f"/forceset/{side}FootForce/contact_parameters/static_friction" for side in "RL"]
    ranges = [word for path in paths for word in ("--vary", f"{path}=0.5:0.9")]
    assert (
        run(
            "optimize",
            "walker.osim",
            "--objective",
            "distance",
            "--to",
            "0.05",
            "--budget",
            "2",
            *ranges,
        )
        == 0
    )
    names = "".join(line.partition("  ")[0] for line in capsys.readouterr().out.splitlines())
    assert all(path in names for path in paths) and "…" not in names


def test_a_sweep_of_failures_fails(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run("sweep", "walker.osim", "--vary", "/bodyset/Pelvis/mass=-3:-1:3", "--to", "0.05") == 1
    )
    told = capsys.readouterr()
    assert told.out.count("1 run: ") == 3 and told.err == "osimlite: every run failed\n"
    assert pq.read_table("results.parquet")["status"].to_pylist() == ["failed"] * 3


def test_without_a_sliding_coordinate_there_is_no_distance(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = osimlite.Model(name="pendulum")
    bob = model.add(
        osimlite.Body(name="bob", mass=1.0, mass_center=[0, -1, 0], inertia=[1, 1, 1, 0, 0, 0])
    )
    model.add(
        osimlite.PinJoint(name="pin", coordinates=[osimlite.Coordinate(name="q")]).between(
            model.ground, bob
        )
    )
    osimlite.write(model, "pendulum.osim")
    words = ["sweep", "pendulum.osim", "--vary", "q=0:1:2", "--to", "0.05"]
    assert run(*words) == 0
    assert "distance" not in pq.read_table("results.parquet").column_names
    assert run(*words, "--measure", "distance", "-o", "d.parquet") == 2
    assert "no distance" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform != "linux", reason="only here may a file's name be any bytes")
def test_results_may_have_a_name_that_is_no_utf_8(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "sweep",
        "walker.osim",
        "--to",
        "0.01",
        "--vary",
        "RHip_rz=0:0.1:2",
        "-o",
        "caf\udce9.parquet",
    ]
    assert run(*words) == 0 and run(*words) == 0
    assert "caf\\xe9.parquet" in capsys.readouterr().out
    with open("caf\udce9.parquet", "rb") as stream:
        assert pq.read_table(stream).num_rows == 2
