"""The option ``--full`` of the tests, and what a run without it says."""

from __future__ import annotations

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
    """A project with our two suites and the tests above."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeini(
        f"[pytest]\npythonpath = {repo}\nmarkers = full: of the full suite\naddopts = --import-mode=importlib"
    )
    pytester.makeconftest(
        "from tests.suite import Suite\n"
        "def pytest_addoption(parser):\n    parser.addoption('--full', action='store_true')\n"
        "def pytest_configure(config):\n    config.pluginmanager.register(Suite(config.getoption('--full')))\n"
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
