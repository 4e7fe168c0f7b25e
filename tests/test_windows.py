"""What Windows does otherwise, as far as another system can act it."""

from __future__ import annotations

import ntpath
import os
from pathlib import Path
from typing import cast

import pytest

from osimlite.cli.simulate import _write
from osimlite.errors import OsimliteError
from osimlite.files import from_folder, write_atomically
from osimlite.lint.config import Config
from osimlite.lint.many import check_files
from osimlite.simulation import Trajectory


class Results:
    """The files of a simulation that takes no time."""

    def write(self, folder: Path) -> list[Path]:
        (folder / "states.sto").write_text("later")
        return [folder / "states.sto"]


def simulated(folder: Path) -> None:
    _write(cast(Trajectory, Results()), folder)


@pytest.mark.usefixtures("windows_files")
def test_a_file_that_is_being_read_is_written_all_the_same(tmp_path: Path) -> None:
    place = tmp_path / "states.sto"
    place.write_text("before, and longer")
    with place.open():
        write_atomically(place, "now")
        assert place.read_text() == "now"
        simulated(tmp_path)
        assert place.read_text() == "later"
    assert [*tmp_path.iterdir()] == [place]


@pytest.mark.usefixtures("windows_files")
def test_results_that_another_program_holds_are_told(tmp_path: Path) -> None:
    (tmp_path / "coordinates.png").write_text("an earlier picture")
    with (tmp_path / "coordinates.png").open(), pytest.raises(OsimliteError, match="cannot write here: Permission"):
        simulated(tmp_path)


def test_nothing_leads_from_one_drive_to_another(monkeypatch: pytest.MonkeyPatch) -> None:
    assert from_folder("/a/b/c.osim", "/a/d") == "../b/c.osim"
    monkeypatch.setattr(os.path, "relpath", ntpath.relpath)
    assert from_folder("D:/geometry/bone.vtp", "C:/models").endswith("D:/geometry/bone.vtp")


def test_files_are_checked_by_processes_that_begin_from_nothing(
    fixtures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = [str(path) for path in sorted((fixtures / "lint" / "OSIM301").glob("*.osim"))]
    alone = check_files(files, Config(), cached=False, processes=1)
    # But for Linux, processes are spawned.
    monkeypatch.setattr("sys.platform", "darwin")
    spawned = check_files(files, Config(), cached=False, processes=2)
    assert spawned.findings == alone.findings and alone.findings
