"""Tests of `tests.suite`: the options ``--full`` and ``--shuffle``, and the messages of a run without them."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

CASES = """
import pytest
from tests.suite import choose, is_full

COUNT = choose(1, 3)

@pytest.mark.full
def test_slow():
    assert is_full()

@pytest.mark.parametrize("case", [1, pytest.param(2, marks=pytest.mark.full)])
def test_counts(case):
    assert COUNT == (3 if is_full() else 1)
"""

WORKERS = [
    pytest.param(["-p", "xdist", "-n", "1"], id="a worker"),
    pytest.param([], id="one process", marks=pytest.mark.full),
]


@pytest.fixture
def project(
    pytester: pytest.Pytester, repo: Path, monkeypatch: pytest.MonkeyPatch
) -> pytest.Pytester:
    """Return a project that uses the plugin of the two suites and contains CASES."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeini(
        f"[pytest]\npythonpath = {repo}\nmarkers = full: of the full suite\naddopts = --import-mode=importlib"
    )
    pytester.makeconftest(
        "from tests.suite import Suite\n"
        "def pytest_addoption(parser):\n    parser.addoption('--full', action='store_true')\n"
        "    parser.addoption('--shuffle', type=int)\n"
        "def pytest_configure(config):\n    suite = Suite(config.getoption('--full'), config.getoption('--shuffle'))\n"
        "    config.pluginmanager.register(suite)\n"
    )
    pytester.makepyfile(CASES)
    return pytester


@pytest.mark.parametrize("workers", WORKERS)
def test_tests_of_the_full_suite_are_counted_and_left_out(
    project: pytest.Pytester, workers: list[str]
) -> None:
    result = project.runpytest_subprocess(*workers)
    result.assert_outcomes(passed=1, deselected=2)
    result.stdout.fnmatch_lines(
        [
            "suite: quick*`pytest --full` runs them",
            "2 tests of the full suite are left out; `pytest --full` runs them",
        ]
    )


@pytest.mark.parametrize("workers", WORKERS)
def test_the_option_runs_all(project: pytest.Pytester, workers: list[str]) -> None:
    result = project.runpytest_subprocess("--full", *workers)
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(["suite: full"])
    result.stdout.no_fnmatch_line("*left out*")


def test_a_seed_gives_a_random_order_that_workers_share(project: pytest.Pytester) -> None:
    for name in "abc":
        project.makepyfile(**{f"test_{name}": "\n".join(f"def test_{k}(): pass" for k in range(6))})

    def order(*words: str) -> list[str]:
        result = project.runpytest_subprocess("-v", *words, "test_a.py", "test_b.py", "test_c.py")
        result.assert_outcomes(passed=18)
        return [line.split()[0] for line in result.outlines if "::" in line]

    first = order("--shuffle", "1")
    assert sorted(first) == order()
    assert order("--shuffle", "1") == first
    assert order("--shuffle", "2") != first
    # Each file stays together, though its tests are shuffled.
    assert [line[:9] for line in first] == [
        file for file in dict.fromkeys(line[:9] for line in first) for _ in range(6)
    ]
    project.runpytest_subprocess("-p", "xdist", "-n", "2", "--shuffle", "1").assert_outcomes(
        passed=19, deselected=2
    )


DEATHS = """
import ctypes
import os
import signal
import pytest

def test_before(): pass

def test_ends_its_process():
    os.kill(os.getpid(), signal.SIGKILL)

def test_between(): pass

@pytest.mark.timeout(1)
def test_hangs_in_a_library():
    # The limit of pytest-timeout comes as this signal.
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])
    ctypes.CDLL(None).sleep(100)

def test_after(): pass
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Windows has no such signals")
@pytest.mark.parametrize("workers", ["1", pytest.param("2", marks=pytest.mark.full)])
def test_a_worker_that_dies_or_hangs_costs_one_test(project: pytest.Pytester, workers: str) -> None:
    conftest = project.path / "conftest.py"
    conftest.write_text(
        conftest.read_text() + "\nimport tests.suite\ntests.suite.SECONDS_TO_END = 1.0\n"
    )
    project.makepyfile(test_dies=DEATHS, test_other="def test_other(): pass")
    words = ("-p", "xdist", "-p", "pytest_timeout", "--dist=loadfile", "--no-loadscope-reorder")
    result = project.runpytest_subprocess(
        *words, "-n", workers, "test_dies.py", "test_other.py", timeout=100
    )
    result.assert_outcomes(passed=4, failed=2)
    result.stdout.fnmatch_lines(["*crashed while running 'test_dies.py::test_hangs_in_a_library'*"])
