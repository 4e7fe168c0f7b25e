"""Tests of the timing harness with a fake clock: order of the runs, warm-up, ratios."""

import io
import sys

import pytest
from rich.console import Console

from benchmarks._pair import Pair, print_pairs, time_command_pair, time_pair


class FakeClock:
    """Clock that advances only by the durations of `work`."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def work(self, log, name, durations):
        remaining = iter(durations)

        def run():
            log.append(name)
            self.now += next(remaining)

        return run


def test_runs_in_turn_drops_the_warm_up_and_divides_inside_each_pair():
    clock, log = FakeClock(), []
    result = time_pair(
        "walk",
        ours=clock.work(log, "A", [9.0, 1.0, 2.0, 4.0]),
        theirs=clock.work(log, "B", [9.0, 2.0, 8.0, 2.0]),
        rounds=3,
        warmup=1,
        clock=clock,
    )
    assert log == ["A", "B"] * 4
    assert result == Pair("walk", ours=(1.0, 2.0, 4.0), theirs=(2.0, 8.0, 2.0))
    assert result.ratios == (0.5, 0.25, 2.0)


def test_refuses_to_measure_nothing():
    with pytest.raises(ValueError, match="at least 1 round"):
        time_pair("none", ours=lambda: None, theirs=lambda: None, rounds=0)


def test_the_table_says_time_in_milliseconds_and_the_median_of_ratios_not_the_ratio_of_medians():
    out = io.StringIO()
    # The medians are 2 ms and 2 ms, so their ratio would be 1; the median of the ratios is 0.5.
    print_pairs(
        "Title",
        [Pair("walk", ours=(0.001, 0.002, 0.004), theirs=(0.002, 0.008, 0.002))],
        console=Console(file=out, width=100, color_system=None),
    )
    row = next(line for line in out.getvalue().splitlines() if "walk" in line)
    assert [cell.strip() for cell in row.strip("│ ").split("│")] == [
        "walk", "1 / 2", "2 / 2", "0.50", "0.25", "2.00", "3",
    ]  # fmt: skip


def test_commands_are_whole_processes_run_in_turn(tmp_path):
    log = tmp_path / "log"

    def writes(letter):
        return [sys.executable, "-S", "-c", f"open({str(log)!r}, 'a').write({letter!r})"]

    result = time_command_pair("process", ours=writes("A"), theirs=writes("B"), rounds=2, warmup=1)
    assert log.read_text() == "ABABAB"
    assert len(result.ours) == len(result.theirs) == 2
    assert min(result.ours + result.theirs) > 0


def test_a_command_line_is_split_as_a_shell_would(tmp_path):
    target = tmp_path / "with space"
    line = f"{sys.executable} -S -c \"open('{target}', 'w').write('x')\""
    time_command_pair("line", ours=line, theirs=line, rounds=1, warmup=0)
    assert target.read_text() == "x"


def test_a_failing_command_is_told_with_its_own_words():
    fails = [sys.executable, "-S", "-c", "raise SystemExit('no such model')"]
    with pytest.raises(RuntimeError, match="exit code 1: no such model"):
        time_command_pair("fails", ours=fails, theirs=fails)
