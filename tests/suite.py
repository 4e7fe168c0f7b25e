"""Pytest plugin for the quick and the full suite: the options ``--full`` and ``--shuffle``.

It also ends a process in which a test hangs, and makes pytest-xdist continue after the end of a
worker.
"""

from __future__ import annotations

import faulthandler
import gc
import random
from collections.abc import Generator, Sequence
from types import SimpleNamespace
from typing import Any

import pytest
from _pytest.faulthandler import fault_handler_stderr_fd_key

from tests import separate
from tests.quick_cases import QUICK_CASES, QUICK_STRIDES

HOW = "`pytest --full` runs them"
SECONDS_TO_END = 60.0
"""Time (s) that a test may take to end after its timeout, in addition to a fifth of its limit."""
_ANSWER = "tests_of_the_full_suite"
_state = {"full": False, "deselected": 0}


def is_full() -> bool:
    """Return whether the full suite runs; this is known before test modules are imported, also in workers."""
    return _state["full"] is True


def choose(quick: Any, full: Any) -> Any:
    """Return `quick` in the quick suite and `full` in the full one, for example sizes, counts or durations."""
    return full if is_full() else quick


class Suite:
    """Pytest plugin that deselects tests marked ``full`` unless the option ``--full`` is set."""

    def __init__(self, full: bool, seed: int | None = None) -> None:
        _state["full"] = full
        self.seed = seed

    def pytest_report_header(self) -> str:
        """Name the suite; the number of tests follows at the end, because workers collect them after this header."""
        order = "" if self.seed is None else f"; in random order {self.seed}"
        if is_full():
            return f"suite: full{order}"
        return f"suite: quick, without the tests marked `full`; {HOW}{order}"

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(
        self, config: pytest.Config, items: list[pytest.Item]
    ) -> None:
        """Deselect the tests of the full suite."""
        if not separate.is_server(config):
            # In the server of `check_*.py`, the process that requests tests has already selected
            # and ordered them.
            _mark_cases(config, items)
            if self.seed is not None:
                items[:] = shuffle_tests(items, self.seed)
        if is_full():
            return
        slow = [item for item in items if item.get_closest_marker("full")]
        if slow:
            items[:] = [item for item in items if not item.get_closest_marker("full")]
            config.hook.pytest_deselected(items=slow)
        _state["deselected"] = len(slow)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Exclude imported modules and collected tests from garbage collection.

        These objects live as long as the process, and far outnumber those of a single test.
        """
        if not separate.is_server(session.config):
            gc.freeze()

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> Any:
        """Return a scheduler that continues when a worker dies."""
        from tests.scheduling import make_scheduler

        return make_scheduler(config, log)

    @pytest.hookimpl(optionalhook=True, wrapper=True)
    def pytest_timeout_set_timer(
        self, item: pytest.Item, settings: Any
    ) -> Generator[None, Any, Any]:
        """End the process some time after pytest-timeout should have ended the test.

        Pytest-timeout raises an exception in Python code, which never happens while a library
        hangs.
        """
        if settings.timeout > 0:
            faulthandler.dump_traceback_later(
                1.2 * settings.timeout + SECONDS_TO_END,
                file=item.config.stash[fault_handler_stderr_fd_key],
                exit=True,
            )
        return (yield)

    @pytest.hookimpl(optionalhook=True, wrapper=True)
    def pytest_timeout_cancel_timer(self, item: pytest.Item) -> Generator[None, Any, Any]:
        """Cancel the end of the process: the test has ended in time."""
        faulthandler.cancel_dump_traceback_later()
        return (yield)

    def pytest_report_collectionfinish(self) -> list[str]:
        """Report the number of deselected tests if this process has collected them itself."""
        return _describe(_state["deselected"])

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Send the number of deselected tests from a worker of pytest-xdist to the process that reports."""
        output = getattr(session.config, "workeroutput", None)
        if output is not None:
            output[_ANSWER] = _state["deselected"]

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Receive the number of deselected tests from a worker; all workers collect the same tests."""
        _state["deselected"] = getattr(node, "workeroutput", {}).get(_ANSWER, _state["deselected"])

    def pytest_terminal_summary(self, terminalreporter: Any, config: pytest.Config) -> None:
        """Print the number of deselected tests, also in pytest's last line."""
        if getattr(config.option, "numprocesses", None):
            # Pytest counts only tests that are deselected in its own process.
            terminalreporter.stats.setdefault(
                "deselected", [SimpleNamespace()] * _state["deselected"]
            )
            for line in _describe(_state["deselected"]):
                terminalreporter.write_line(line)


def shuffle_tests(items: Sequence[pytest.Item], seed: int) -> list[pytest.Item]:
    """Return the tests in a random order of files, with a random order in each file.

    The tests of a file stay together because they share fixtures. Every worker must get the same
    order, so the order depends on the seed alone.
    """
    draw = random.Random(seed)
    files: dict[str, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.nodeid.partition("::")[0], []).append(item)
    for tests in files.values():
        draw.shuffle(tests)
    return [item for name in draw.sample(list(files), len(files)) for item in files[name]]


def _mark_cases(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the cases of expensive tests that the quick suite leaves out.

    Raises:
        UsageError: a case that the quick suite should run does not exist.
    """
    seen: dict[str, set[str]] = {}
    counts: dict[str, int] = {}
    for item in items:
        function, _, case = item.nodeid.partition("[")
        counts[function] = counts.get(function, -1) + 1
        if counts[function] % QUICK_STRIDES.get(function, 1):
            item.add_marker("full")
        if function in QUICK_CASES:
            seen.setdefault(function, set()).add(case.removesuffix("]"))
            if case.removesuffix("]") not in QUICK_CASES[function]:
                item.add_marker("full")
    if not any("::" in str(word) for word in config.args):
        for function, cases in seen.items():
            lost = set(QUICK_CASES[function]) - cases
            if lost and cases != {"absent"}:
                raise pytest.UsageError(
                    f"tests/quick_cases.py: {function} has no case {', '.join(sorted(lost))}"
                )


def _describe(count: int) -> list[str]:
    tests = "1 test of the full suite is" if count == 1 else f"{count} tests of the full suite are"
    return [f"{tests} left out; {HOW}"] if count else []
