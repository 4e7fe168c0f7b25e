"""Check that no code in the current folder is executed, even by packages while they are imported."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import osimlite
from osimlite.base.require import SAFE_PATH, leave_current_folder, protect_processes, require

ROOT = Path(osimlite.__file__).parents[1]
# Names of modules that osimlite or its libraries import.
MODULES = (
    "ctypes",
    "numpy",
    "json",
    "textwrap",
    "subprocess",
    "yaml",
    "lxml",
    "casadi",
    "random",
    "signal",
)


@pytest.fixture
def trap(tmp_path: Path) -> Path:
    """Return a folder from an untrusted source, with modules of many names and settings of packages."""
    for name in MODULES:
        (tmp_path / f"{name}.py").write_text(
            f"open({str(tmp_path / 'EXECUTED')!r}, 'a').write('{name} ')\n"
        )
    (tmp_path / ".numba_config.yaml").write_text("- no settings\n")
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    return tmp_path


def call(folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != SAFE_PATH}
    command = [sys.executable, "-m", "osimlite", *map(str, words)]
    return subprocess.run(
        command,
        cwd=folder,
        env={**environment, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )


@pytest.mark.full
def test_doctor_executes_nothing_of_the_folder(trap: Path) -> None:
    done = call(trap, "doctor")
    assert done.returncode in (0, 1) and "Traceback" not in done.stderr
    assert not (trap / "EXECUTED").exists()


@pytest.mark.parametrize("words", [("--to", "mjcf", "--check")], ids=" ".join)
def test_translate_executes_nothing_of_the_folder(
    trap: Path, repo: Path, words: tuple[str, ...]
) -> None:
    pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")
    shutil.copy(repo / "fixtures" / "pipelines" / "pendulum" / "model.osim", trap / "m.osim")
    done = call(trap, "translate", "m.osim", *words, "-o", "out")
    assert "Traceback" not in done.stderr
    assert not (trap / "EXECUTED").exists()


def test_ipopt_reads_no_options_of_the_folder(trap: Path, repo: Path) -> None:
    """Options of Ipopt may name a file to write to and a library to load."""
    # Do not import CasADi here: it cannot be loaded together with OpenSim.
    if find_spec("casadi") is None:
        pytest.skip("needs casadi (extra 'casadi')")
    for name in ("slide.omoco", "slide.osim", "slide_guess.sto", "slide_states.sto"):
        shutil.copy(repo / "fixtures" / "setups" / name, trap / name)
    (trap / "ipopt.opt").write_text(
        "output_file written.txt\nfile_print_level 5\nhsllib ./library.so\n"
    )
    done = call(trap, "run", "slide.omoco", "-o", "out")
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0)
    assert not (trap / "written.txt").exists() and not (trap / "EXECUTED").exists()


def test_packages_are_imported_from_another_folder(
    trap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(trap)
    monkeypatch.syspath_prepend("")
    monkeypatch.delenv(SAFE_PATH, raising=False)
    before = list(sys.path)
    with leave_current_folder():
        assert Path.cwd() != trap and "" not in sys.path
        assert os.environ[SAFE_PATH] == "1"
        sys.path.insert(0, "/added")
    assert Path.cwd() == trap and sys.path == ["/added", *before]
    assert SAFE_PATH not in os.environ
    # Requiring a module that is loaded already costs no time.
    assert require("json", extra="x", purpose="x") is sys.modules["json"]


def test_processes_do_not_look_into_their_folder(
    trap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(SAFE_PATH, raising=False)
    protect_processes()
    subprocess.run([sys.executable, "-c", "import textwrap, random"], cwd=trap, check=True)
    assert not (trap / "EXECUTED").exists()
