"""Tests of `tests.separate`: pytest collects the tests of ``check_*.py`` and runs them in a separate process."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(find_spec("casadi") is None, reason="needs the casadi package")

CHECKS = """
import os
import pytest

HERE = os.getpid()
CALLS = []

@pytest.mark.parametrize("case", ["one", "two", pytest.param("slow", marks=pytest.mark.full)])
def test_case(case):
    assert os.getppid() == int(os.environ["PARENT"]) or os.environ["PARENT"] == "a worker"
    assert case in ("one", "two")
    CALLS.append(case)
    assert len(CALLS) == len(set(CALLS))

def test_crash():
    os._exit(7)

def test_after_the_crash():
    assert os.getpid() == HERE

def test_failure():
    left = "spam"
    assert left == "eggs"

def test_skip():
    pytest.skip("for a reason")
"""
CONFTEST = """
import os
from tests import separate
from tests.suite import Suite

def pytest_addoption(parser):
    parser.addoption("--full", action="store_true")

def pytest_configure(config):
    config.pluginmanager.register(Suite(config.getoption("--full")))
    if not separate.is_server(config):
        os.environ["PARENT"] = "a worker" if config.getoption("numprocesses", None) else str(os.getpid())
        config.pluginmanager.register(separate)
        config.pluginmanager.register(separate.Checks(config))
"""


@pytest.fixture
def project(
    pytester: pytest.Pytester, repo: Path, monkeypatch: pytest.MonkeyPatch
) -> pytest.Pytester:
    """Return a project with files of checks."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeini(
        f"[pytest]\npythonpath = {repo}\nmarkers = full: of the full suite\naddopts = --import-mode=importlib"
    )
    pytester.makeconftest(CONFTEST)
    return pytester


@pytest.mark.parametrize("workers", ["0", pytest.param("2", marks=pytest.mark.full)])
def test_each_check_is_a_test(project: pytest.Pytester, workers: str) -> None:
    project.makepyfile(check_it=CHECKS)
    result = project.runpytest_subprocess(
        "-v", "-rs", "-p", "xdist", "-n", workers, "--dist=loadfile"
    )
    result.assert_outcomes(passed=3, failed=2, skipped=1, deselected=1)
    result.stdout.fnmatch_lines_random(
        [
            "*check_it.py::test_case[[]one]*",
            "*the process of the checks ended with 7*",
            "*'spam' == 'eggs'*",
            "SKIPPED*for a reason",
        ]
    )


@pytest.mark.full
def test_what_cannot_be_imported_is_an_error(project: pytest.Pytester) -> None:
    project.makepyfile(check_it="import no_such_module")
    result = project.runpytest_subprocess()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*No module named 'no_such_module'*"])


def test_the_server_has_the_search_paths_of_the_start(project: pytest.Pytester) -> None:
    """A module that is collected earlier may import OpenSim, which changes the search paths."""
    project.makepyfile(
        a_module="import os\nos.environ['SIMBODY_HOME'] = 'changed'",
        test_first="import a_module\ndef test_nothing(): pass",
    )
    project.mkdir("later").joinpath("check_paths.py").write_text(
        "import os\ndef test_paths(): assert os.environ.get('SIMBODY_HOME') != 'changed'"
    )
    project.runpytest_subprocess("test_first.py", "later").assert_outcomes(passed=2)
