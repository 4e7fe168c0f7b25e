"""Tests of installing with and without a C++ compiler, each in a separate environment; they take a minute."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile

import pytest

from osimlite.mechanics.codegen.toolchain import find_compiler

pytestmark = pytest.mark.full

WALK = (
    "import sys; from osimlite.models.dynamic_walker import dynamic_walker; import osimlite; "
    "walk = osimlite.simulate(dynamic_walker(), 0.1, engine='compiled'); "
    "print(walk.summary['versions']['engine'], walk.values[-1].tolist()[:2]); "
    "assert not {'numba', 'scipy'} & {*sys.modules}"
)


def build(repo, folder, environment):
    """Build a wheel of the source tree in the build's isolated environment, and return its path."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "--wheel-dir",
        str(folder),
        str(repo),
    ]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel


def install(wheel, folder):
    """Unpack a wheel, and return environment variables with which Python imports it before other packages."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return {**os.environ, "PYTHONPATH": str(folder)}


def walk(environment, folder):
    done = subprocess.run(
        [sys.executable, "-c", WALK],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def version(environment, folder):
    command = [sys.executable, "-m", "osimlite", "--version", "-v"]
    return subprocess.run(
        command, env=environment, cwd=folder, capture_output=True, text=True, check=True
    ).stdout


@pytest.fixture
def without_compiler(tmp_path):
    """Return the environment variables of a machine without a compiler."""
    bare = {name: value for name, value in os.environ.items() if name not in ("CXX", "PYTHONPATH")}
    return {**bare, "PATH": str(tmp_path / "nothing"), "XDG_CACHE_HOME": str(tmp_path / "cache")}


@pytest.mark.timeout(900)
def test_a_wheel_without_a_compiler_is_pure_python(repo, tmp_path, without_compiler):
    wheel = build(repo, tmp_path / "dist", without_compiler)
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        assert not [name for name in archive.namelist() if "native" in name]
    environment = {
        **without_compiler,
        **install(wheel, tmp_path / "site"),
        "PATH": without_compiler["PATH"],
    }
    environment["OSIMLITE_KERNELS"] = ""
    text = version(environment, tmp_path)
    assert "installed without a library of kernels" in text and "no C++ compiler was found" in text


@pytest.mark.timeout(1800)
@pytest.mark.skipif(find_compiler() is None, reason="no C++ compiler is installed")
def test_a_wheel_with_a_compiler_needs_nothing_else(repo, tmp_path, without_compiler):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    wheel = build(repo, tmp_path / "dist", environment)
    assert "-py3-none-" in wheel.name and not wheel.name.endswith("-any.whl")
    environment = {**install(wheel, tmp_path / "site"), "PATH": without_compiler["PATH"]}
    text = version(environment, tmp_path)
    assert "kernels run from the compiled library" in text and str(tmp_path) in text
    compiled, warnings = walk({**environment, "OSIMLITE_KERNELS": "library"}, tmp_path)
    assert compiled.startswith("compiled library") and not warnings
    python, _ = walk({**environment, "OSIMLITE_KERNELS": "python"}, tmp_path)
    assert compiled.partition("[")[2] == python.partition("[")[2]
