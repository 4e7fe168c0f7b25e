"""Tests of the progress line of long work: it appears on a terminal only."""

from __future__ import annotations

import io
import logging
import sys

import pytest

from osimlite.base.progress import report_progress, report_stage
from osimlite.cli import _console, _progress
from osimlite.cli._progress import motion_bar, progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Clock:
    """Clock whose time a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, _: float) -> None:
        raise AssertionError("a test does not wait")


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(_progress, "time", clock)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "80")
    line = _progress.ProgressLine()
    monkeypatch.setattr(_progress, "progress_line", line)
    monkeypatch.setattr(_progress, "listeners", _progress.ExitStack())
    monkeypatch.setattr(line, "start", lambda: _console.set_output_hook(line.make_way))
    yield clock
    _console.set_output_hook(None)


def shown(stream: io.StringIO) -> str:
    """Return the text of the line after its last update."""
    return stream.getvalue().split("\r")[-1].rstrip()


@pytest.mark.parametrize(("second", "shows"), [(0.6, True), (0.4, False)])
def test_the_line_appears_after_half_a_second(monkeypatch, clock, second, shows):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress_bar("walking", 4.0) as progress:
        clock.now = second
        progress(1.0)
        assert shown(sys.stderr) == ("walking: 25 % (1 of 4)" if shows else "")
        clock.now = second + 0.05
        progress(3.0)
        assert "75 %" not in sys.stderr.getvalue()
    # The line has been erased.
    assert shown(sys.stderr) == ""


def test_the_time_left_is_told(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with motion_bar("simulating", 2.0) as progress:
        clock.now = 3.0
        progress(0.5, 0.001)
        assert shown(sys.stderr) == "simulating: 25 % (0.5 of 2 s), steps of 0.001 s, 9 s left"
        clock.now = 6.0
        progress(0.01, 0.001)
        assert shown(sys.stderr).endswith("20 min left")


def test_the_amount_is_told_before_the_first_part_is_done(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress_bar("sweeping", 40.0):
        clock.now = 3.0
        _progress.progress_line.draw()
        assert shown(sys.stderr) == "sweeping: 0 % (0 of 40), 3 s"


def test_a_narrow_terminal_has_one_line(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("COLUMNS", "20")
    with progress_bar("a long title of some work", 4.0) as progress:
        clock.now = 1.0
        progress(1.0)
        assert shown(sys.stderr) == "a long title of som"


def test_the_line_is_removed_with_what_the_terminal_writes_behind_it(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress_bar("checking", None) as progress:
        for words in ("a long state", "short"):
            clock.now += 1.0
            progress(0.0, None, words)
        longest = max(map(len, sys.stderr.getvalue().split("\r")))
        # The blanks are longer than the line: the terminal may have written ^C behind it.
        _progress.progress_line.erase()
        assert sys.stderr.getvalue().endswith(f"\r{'':{longest + 2}}\r")


def test_output_removes_the_line_first(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    _progress.watch_command("static-optimization")
    clock.now = 2.0
    _progress.progress_line.draw()
    assert shown(sys.stderr) == "computing muscle forces: 2 s"
    out = _console.EscapingStream(io.StringIO())
    out.write("done\n")
    assert shown(sys.stderr) == ""
    # The line reappears only after another half second.
    clock.now = 2.3
    _progress.progress_line.draw()
    assert shown(sys.stderr) == ""
    report_progress("tracking", 1.0, 2.0, " s")
    clock.now = 3.0
    _progress.progress_line.draw()
    assert shown(sys.stderr) == "tracking: 50 % (1 of 2 s)"
    _progress.finish_command()
    assert shown(sys.stderr) == ""


def test_parts_of_a_task_have_their_own_progress(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress_bar("running", 3.0) as progress:
        progress(1.0)
        report_stage("writing results")
        clock.now = 3.0
        _progress.progress_line.draw()
        assert shown(sys.stderr) == "running, 1 of 3 done; writing results: 3 s"
        report_progress("computing moments", 10.0, 40.0, " frames")
        clock.now = 6.0
        report_progress("computing moments", 20.0, 40.0, " frames")
        words = "computing moments: 50 % (20 of 40 frames), 3 s left"
        assert shown(sys.stderr) == f"running, 1 of 3 done; {words}"
        # The time of a finished part does not predict the time of the next part.
        clock.now = 7.0
        report_progress("computing moments", 40.0, 40.0, " frames")
        assert shown(sys.stderr) == "running, 1 of 3 done; writing results: 7 s"


def test_a_stage_continues_after_its_parts(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress_bar("running", 1.0):
        report_stage("InverseDynamicsTool: computing")
        report_progress("computing moments", 20.0, 40.0, " frames")
        report_progress("computing moments", 40.0, 40.0, " frames")
        clock.now = 3.0
        _progress.progress_line.draw()
        assert shown(sys.stderr) == "InverseDynamicsTool: computing: 3 s"


def test_the_line_comes_back_at_once_after_another_task(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    _progress.watch_command("simulate")
    clock.now = 2.0
    with progress_bar("drawing", None):
        _progress.progress_line.draw()
    clock.now = 2.2
    _progress.progress_line.draw()
    assert shown(sys.stderr) == "simulating: 2 s"


def test_steps_of_the_tour_have_their_own_line(monkeypatch, clock, tmp_path):
    from osimlite.cli.demo import Tour

    monkeypatch.setattr(sys, "stderr", Terminal())
    _progress.watch_command("demo")
    tour = Tour(tmp_path)
    for _ in range(2):
        with tour.step("Translate it") as report_result:
            clock.now += 3.0
            _progress.progress_line.draw()
            assert shown(sys.stderr) == f"   step {tour.steps}: 3 s"
            report_result("done")
    _progress.finish_command()


def test_commands_that_wait_for_people_have_no_line(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    _progress.watch_command("lsp")
    assert not _progress.progress_line.tasks


def test_a_log_has_two_lines_of_long_work_and_none_of_short(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with progress_bar("walking", 4.0) as progress:
        for clock.now in (1.0, 9.0):
            progress(1.0)
        assert sys.stderr.getvalue() == ""
        for clock.now in (11.0, 50.0, 60.0):
            progress(2.0)
    assert sys.stderr.getvalue().splitlines() == [
        "osimlite: walking: 50 % (2 of 4), 11 s left",
        "osimlite: walking: finished in 60 s",
    ]


def test_people_see_what_the_engine_warns_of(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    log = logging.getLogger("osimlite.simulation.engines")
    monkeypatch.setattr(log, "handlers", [])
    monkeypatch.setattr(log, "level", logging.NOTSET)
    _progress.show_engine_warnings()
    log = logging.getLogger("osimlite.simulation.engines.linking")
    log.warning("kernels run as Python")
    assert sys.stderr.getvalue() == "osimlite: kernels run as Python\n"
    _progress.watch_command("run")
    log.info("compiling 3 kernels")
    clock.now = 0.7
    _progress.progress_line.draw()
    assert shown(sys.stderr) == "running: compiling 3 kernels (once per machine)"
