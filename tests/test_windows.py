"""Tests of the behaviour on Windows, as far as another system can imitate it."""

from __future__ import annotations

import errno
import io
import json
import ntpath
import os
import sys
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from pathlib import Path, PureWindowsPath
from typing import Any, cast

import numpy as np
import pytest

from osimlite import validate
from osimlite.base.files import get_relative_path, write_atomically
from osimlite.base.pools import LocalPool
from osimlite.cli import main
from osimlite.cli._console import wants_colour
from osimlite.cli.simulate import write_results
from osimlite.errors import OsimliteError
from osimlite.lint.baseline import write_baseline
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Finding, Report, Severity
from osimlite.lint.many import check_files
from osimlite.lint.reporters import render
from osimlite.simulation import Trajectory


class Results:
    """Simulation results that are written without a simulation."""

    def write(self, folder: Path) -> list[Path]:
        (folder / "states.sto").write_text("later")
        return [folder / "states.sto"]


def simulated(folder: Path) -> None:
    write_results(cast(Trajectory, Results()), folder)


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
    with (
        (tmp_path / "coordinates.png").open(),
        pytest.raises(OsimliteError, match="cannot write here: Permission"),
    ):
        simulated(tmp_path)


def test_nothing_leads_from_one_drive_to_another(monkeypatch: pytest.MonkeyPatch) -> None:
    assert get_relative_path("/a/b/c.osim", "/a/d") == "../b/c.osim"
    monkeypatch.setattr(os.path, "relpath", ntpath.relpath)
    assert get_relative_path("D:/geometry/bone.vtp", "C:/models").endswith("D:/geometry/bone.vtp")


def test_files_are_checked_by_processes_that_begin_from_nothing(
    fixtures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = [str(path) for path in sorted((fixtures / "lint" / "OSIM301").glob("*.osim"))]
    alone = check_files(files, Config(), cached=False, processes=1)
    # Only Linux forks processes; other systems spawn them.
    monkeypatch.setattr("sys.platform", "darwin")
    spawned = check_files(files, Config(), cached=False, processes=2)
    assert spawned.findings == alone.findings and alone.findings


def test_a_script_that_processes_run_anew_is_told_where_a_sweep_begins() -> None:
    class Ending(ThreadPoolExecutor):
        def submit(self, *work: object, **words: object) -> Future[Any]:
            future: Future[Any] = Future()
            future.set_exception(BrokenExecutor())
            return future

    pool = LocalPool(Ending(1), cast(Any, None), 1)
    pool.submit(0, np.zeros(1))
    with pytest.raises(OsimliteError, match="start the sweep under if __name__ == '__main__':"):
        pool.result()


def test_a_library_call_starts_no_processes_that_would_run_the_callers_script_anew(
    fixtures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("osimlite.lint.many.MIN_PARALLEL_BYTES", 0)
    monkeypatch.delattr("concurrent.futures.ProcessPoolExecutor")
    assert validate(fixtures / "lint" / "OSIM301").checked > 1


@pytest.mark.parametrize("number", [errno.EINVAL, errno.EPIPE])
def test_who_reads_our_output_may_go(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    class Gone(io.StringIO):
        def write(self, text: str) -> int:
            raise OSError(number, "so says the system")

        def fileno(self) -> int:
            return kept

    kept = os.dup(1)
    monkeypatch.setattr(sys, "stdout", Gone())
    with pytest.raises(SystemExit) as ended:
        main(["rule", "OSIM301"])
    os.close(kept)
    assert ended.value.code == 1


def test_an_old_console_is_shown_no_codes_of_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR", "TERM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert wants_colour()
    monkeypatch.setattr("os.name", "nt")
    for is_old in (True, False):
        monkeypatch.setattr("rich.console.detect_legacy_windows", lambda is_old=is_old: is_old)
        assert wants_colour() is not is_old


def test_other_programs_are_told_paths_with_slashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("osimlite.lint.reporters.interchange.PurePath", PureWindowsPath)
    monkeypatch.setattr("osimlite.lint.baseline.Path", PureWindowsPath)
    report = Report(
        [
            Finding("OSIM101", "x", Severity.ERROR, "no", file)
            for file in ("models\\a b.osim", "C:\\models\\leg.osim")
        ]
    )
    results = json.loads(render(report, "sarif"))["runs"][0]["results"]
    places = [
        result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for result in results
    ]
    assert places == ["models/a%20b.osim", "file:///C:/models/leg.osim"]
    write_baseline(tmp_path / "baseline.json", report)
    assert "models/a b.osim" in (tmp_path / "baseline.json").read_text()
