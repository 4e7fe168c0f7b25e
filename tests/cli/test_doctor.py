"""Tests of ``doctor``, which describes the installation."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import tomllib
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

from osimlite import write
from osimlite.base.require import DISTRIBUTIONS
from osimlite.cli.doctor import (
    EXTRAS,
    NEEDS,
    Package,
    doctor,
    examine_package,
    find_extra,
    list_purposes,
    list_requirements,
)
from osimlite.errors import MissingFileError
from osimlite.io.document.data import write_data
from osimlite.models.dynamic_walker import dynamic_walker

ROOT = Path(__file__).parents[2]


def run(*arguments: str) -> tuple[int, str]:
    application = Typer()
    application.command()(doctor)
    done = CliRunner().invoke(application, list(arguments), env={"COLUMNS": "200"})
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


def test_every_extra_has_a_purpose() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    assert {*extras, ""} - {*EXTRAS} == {"all", "dev", "fast"}
    result = list_purposes(list_requirements())
    assert all(result[extra] for extra in EXTRAS)
    assert sorted(use for uses in result.values() for use in uses) == sorted(NEEDS)
    assert (
        "translate" in result["sim"]
        and "view --screenshot" in result["view"]
        and "simulate --gui" in result["bullet"]
    )


def test_a_use_belongs_to_the_first_extra_that_brings_all_it_needs() -> None:
    wanted = {
        "": ["lxml"],
        "sim": ["numpy"],
        "view": ["numpy", "pillow"],
        "more": ["numpy", "pillow"],
    }
    result = list_purposes(wanted)
    assert (
        "validate" in result[""]
        and "kinematics" in result["sim"]
        and "view --screenshot" in result["view"]
    )
    assert not any("optimize" in uses for uses in result.values())


MODULES = {"pillow": "PIL", "pyyaml": "yaml", "rerun-sdk": "rerun"}
"""Import name of each package whose import name differs from its distribution name."""

EXAMPLES = {
    "build": "build dynamic-walker -o built.osim",
    "validate": "validate w.osim --no-cache",
    "format": "format --check w.osim",
    "upgrade": "upgrade w.osim -o new.osim",
    "diff": "diff w.osim w.osim",
    "info": "info w.osim",
    "translate": "translate w.osim",
    "convert": "convert w.osim --to urdf",
    "simulate": "simulate w.osim --to 0.005",
    "kinematics": "kinematics w.osim m.mot",
    "inverse-dynamics": "inverse-dynamics w.osim m.mot",
    "run": "run setup.xml",
    "view": "view w.osim --html v.html",
    "gait": "gait w.osim --to 0.05",
    "simulate --engine bullet": "simulate w.osim --to 0.005 --engine bullet",
    "simulate --plot": "simulate w.osim --to 0.02 --plot",
    "view --screenshot": "view w.osim --screenshot v.png",
    "simulate --animate": "simulate w.osim --to 0.02 --animate",
    "models as YAML": "build w.yaml -o built.osim",
    "sweep": "sweep w.osim --vary RHip_rz=0:0.1:2 --to 0.005",
    "optimize": "optimize w.osim --objective distance --vary RHip_rz=0:1 --vary LHip_rz=0:1 --budget 8 --to 0.005",
}

SLOW = {
    "gait", "optimize", "simulate --animate", "simulate --engine bullet", "simulate --plot", "sweep",
    "view --screenshot",
}  # fmt: skip
"""Uses that only the full suite tries, because each starts several processes that load large libraries."""

SCRIPT = """
import sys
from importlib.machinery import PathFinder
absent, find = set(sys.argv[1].split(",")), PathFinder.find_spec
PathFinder.find_spec = lambda name, *more: None if name.partition(".")[0] in absent else find(name, *more)
from osimlite.cli import main
main(sys.argv[2:])
"""


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("work")
    model = dynamic_walker()
    write(model, place / "w.osim")
    write_data(model, place / "w.yaml")
    (place / "setup.xml").write_text(
        "<OpenSimDocument Version='40600'><InverseDynamicsTool><model_file>w.osim</model_file>"
        "<coordinates_file>m.mot</coordinates_file></InverseDynamicsTool></OpenSimDocument>"
    )
    rows = "".join(f"0.{k} 0\n" for k in range(9))
    (place / "m.mot").write_text(
        f"m\nversion=1\nnRows=9\nnColumns=2\nendheader\ntime Pelvis_tx\n{rows}"
    )
    return place


def call(words: str, absent: set[str], folder: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, ",".join(absent), *words.split()],
        capture_output=True, text=True, encoding="utf-8", cwd=folder, check=False, timeout=200,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    "use", [pytest.param(use, marks=pytest.mark.full) if use in SLOW else use for use in EXAMPLES]
)
def test_what_is_needed_is_enough_and_is_needed(work: Path, use: str) -> None:
    every = {MODULES.get(name, name) for names in NEEDS.values() for name in names} | {
        "scipy",
        "distributed",
    }
    needed = {MODULES.get(name, name) for name in NEEDS[use]}
    # Matplotlib itself imports Pillow and numpy, so they must not be blocked.
    brought = {"PIL", "numpy"} if "matplotlib" in needed else set()
    if needed - {*filter(find_spec, needed)}:
        pytest.skip(f"needs {', '.join(sorted(needed))}")
    code, told = call(EXAMPLES[use], every - needed - brought, work)
    # A short walk has no gait cycle, so `gait` ends with 1.
    assert code == (1 if use == "gait" else 0), told
    for name in needed:
        code, told = call(EXAMPLES[use], {name}, work)
        assert (
            code == 2
            and DISTRIBUTIONS.get(name, name) in told
            and "pip install" in told
            and told.count("\n") == 1
        ), told


def test_packages_of_the_plain_installation() -> None:
    assert {"lxml", "pydantic", "typer"} <= {*list_requirements()[""]}


def test_what_is_examined() -> None:
    assert examine_package("lxml") == Package("lxml", metadata.version("lxml"), "")
    assert examine_package("no-such-package-of-ours") == Package("no-such-package-of-ours", "", "")


def test_what_lies_in_the_current_folder_is_not_executed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lxml.py").write_text("raise SystemExit('executed')")
    monkeypatch.chdir(tmp_path)
    assert examine_package("lxml") == Package("lxml", metadata.version("lxml"), "")


def test_a_package_that_cannot_be_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "torn.py").write_text("raise OSError('libtorn.so: wrong ELF class')\n")
    info = tmp_path / "torn-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: torn\nVersion: 1.0\n")
    (info / "top_level.txt").write_text("torn\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert examine_package("torn") == Package("torn", "1.0", "OSError: libtorn.so: wrong ELF class")
    monkeypatch.setattr(
        "osimlite.cli.doctor.list_requirements", lambda: {"": ["torn"], "sim": ["no-such-package"]}
    )
    code, text = run(str(tmp_path))
    assert code == 1
    assert "torn 1.0 cannot be loaded: OSError: libtorn.so: wrong ELF class" in text
    assert "pip install 'osimlite[sim]'" in text


def test_where_meshes_are_looked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("osimlite.cli.doctor.list_requirements", lambda: {"": ["lxml"]})
    bones, more = tmp_path / "bones", tmp_path / "more"
    for folder, names in ((bones, ("a.vtp", "b.STL", "readme.txt")), (more, ())):
        folder.mkdir()
        for name in names:
            (folder / name).touch()
    (tmp_path / "osimlite.toml").write_text('mesh-paths = ["bones"]\n')
    monkeypatch.setenv("OSIMLITE_GEOMETRY", str(more))
    (tmp_path / "model.osim").touch()
    code, text = run(str(tmp_path / "model.osim"))
    assert code == 0
    lines = [line.strip() for line in text.splitlines()]
    assert f"settings: {tmp_path / 'osimlite.toml'}" in lines
    searched = lines[lines.index("mesh folders, in the order of the search:") + 1 :][:4]
    assert searched == [
        f"{tmp_path}: no mesh files",
        f"{tmp_path / 'Geometry'}: does not exist",
        f"{bones}: 2 mesh files",
        f"{more}: no mesh files",
    ]


def test_a_model_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match=r"none.osim: there is no such file or folder"):
        run(str(tmp_path / "none.osim"))


@pytest.mark.skipif(os.name == "nt", reason="needs a shell script as the program")
def test_an_interrupt_does_not_wait_for_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slow = tmp_path / "python"
    slow.write_text("#!/bin/sh\nexec sleep 30\n", encoding="utf-8")
    slow.chmod(0o755)
    monkeypatch.setattr("osimlite.cli.doctor.list_requirements", lambda: {"": ["lxml", "rich"]})
    monkeypatch.setattr(sys, "executable", str(slow))
    main_thread = threading.main_thread().ident
    assert main_thread is not None
    interrupt = threading.Timer(0.5, signal.pthread_kill, (main_thread, signal.SIGINT))
    interrupt.start()
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        doctor()
    assert time.monotonic() - started < 10.0
    # After the interruption no thread may start another slow process: this examination must be
    # quick.
    started = time.monotonic()
    assert examine_package("lxml").name == "lxml"
    assert time.monotonic() - started < 10.0


def test_a_source_tree_that_is_not_installed_knows_no_extra(monkeypatch):
    def requires(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("osimlite.cli.doctor.metadata.requires", requires)
    assert find_extra("lxml") is None and find_extra("matplotlib", "plot") is None
