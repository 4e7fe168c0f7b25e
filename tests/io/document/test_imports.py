"""Check that reading imports only the modules that a file needs.

Start-up takes most of the time of a short command.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

READ = "import sys, osimlite; osimlite.read(sys.argv[1]); print(*sorted(sys.modules))"


@pytest.fixture(scope="module")
def loaded(fixtures: Path) -> set[str]:
    walker = fixtures / "walker" / "DynamicWalkerModel.osim"
    done = subprocess.run(
        [sys.executable, "-c", READ, str(walker)],
        capture_output=True,
        text=True,
        check=True,
        cwd=fixtures.parent,
    )
    return set(done.stdout.split())


def test_areas_whose_tags_do_not_occur_stay_out(loaded: set[str]) -> None:
    areas = {name.rpartition(".")[2] for name in loaded if name.startswith("osimlite.schema.")}
    # The walker has bodies, joints, contact and forces, but no muscle, path, probe or controller.
    assert not areas & {
        "actuators", "constraint_types", "contact_forces", "controller_types", "custom_joint", "metabolics", "muscles",
        "muscle_curves", "path_actuators", "path_forces", "paths", "prescribed", "probe_types", "reporters", "springs",
        "json_schema", "editing",
    }  # fmt: skip
    assert {"frames", "joints", "forces", "contact", "geometry"} <= areas


def test_heavy_packages_stay_out(loaded: set[str]) -> None:
    assert not loaded & {
        "matplotlib", "numpy", "opensim", "PIL", "pybullet", "rapidfuzz", "rich", "typer", "yaml",
        "urllib.request", "ssl", "http.client",
    }  # fmt: skip


def test_importing_the_package_alone_imports_nothing_of_weight() -> None:
    code = "import sys, osimlite; print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(done.stdout.split()) & {"pydantic", "lxml", "numpy"}


@pytest.mark.parametrize(
    ("words", "absent"),
    [
        (("--version",), {"typer", "rich", "pydantic", "lxml", "dataclasses"}),
        (("validate", "walker.osim"), {"typer", "rich", "pydantic", "lxml", "tempfile"}),
        (
            ("validate", "walker.osim", "--no-cache"),
            {"typer", "rich", "html", "osimlite.io.document.repair"},
        ),
        (
            ("validate", "walker.osim", "--no-cache"),
            {"numpy", "osimlite.mechanics.multibody.mechanism"},
        ),
        (
            ("validate", "walker.osim", "--no-cache"),
            {"osimlite.lint.table", "osimlite.lint.setup", "osimlite.io.tables.headers"},
        ),
        (("info", "walker.osim"), {"typer", "rich", "rapidfuzz", "numba", "llvmlite"}),
        (("info", "walker.osim"), {"numpy", "osimlite.mechanics.multibody.mechanism"}),
        (
            ("simulate", "walker.osim", "--to", "0.1", "-o", "r"),
            {"typer", "rich", "numba", "osimlite.lint"},
        ),
    ],
)
def test_what_a_short_command_leaves_out(
    words: tuple[str, ...], absent: set[str], fixtures: Path, tmp_path: Path
) -> None:
    (tmp_path / "walker.osim").write_bytes(
        (fixtures / "walker" / "DynamicWalkerModel.osim").read_bytes()
    )
    code = "import sys, osimlite.cli as c\ntry: c.main(sys.argv[1:])\nfinally: print(*sys.modules, file=sys.stderr)"
    for _ in range(2):
        # The second run finds the file unchanged in the cache.
        done = subprocess.run(
            [sys.executable, "-c", code, *words], cwd=tmp_path, capture_output=True, text=True, check=False,
            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")},
        )  # fmt: skip
        assert done.returncode == 0 and done.stdout
    assert not set(done.stderr.split()) & absent
