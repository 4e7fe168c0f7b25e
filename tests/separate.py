"""Collection of ``check_*.py``: tests that run in a second process, next to the process that collects them.

OpenSim contains a library of the same name as CasADi's, and one process cannot load both. Tests of
functions that need CasADi are therefore in files ``check_*.py``. The process that collects such
files starts a server (``python -m tests.separate``), which collects and runs their tests. Each of
them is a test with its own name, marks and duration. The server keeps running, so that it imports
modules once.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Generator, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.search_paths import restore_search_paths

ROOT = Path(__file__).resolve().parent.parent
# Name of the plugin by which pytest in the server is recognized.
_SERVER = "osimlite-check-server"
# Key of the distribution mode in the input of a worker of pytest-xdist.
_DIST = "osimlite-dist"


class ServerDiedError(Exception):
    """The server ended while it ran or collected tests."""


class CheckServer:
    """Process that collects and runs the tests of ``check_*.py``."""

    def __init__(self, folder: Path) -> None:
        self.log = tempfile.TemporaryFile()  # noqa: SIM115
        paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        # A collected test module may have imported OpenSim.
        restore_search_paths()
        # With the variables of pytest-xdist, pytest in the server would act as a worker.
        variables = {
            name: value for name, value in os.environ.items() if not name.startswith("PYTEST_XDIST")
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.separate"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            text=True,
            encoding="utf-8",
            cwd=folder,
            env={**variables, "PYTHONPATH": os.pathsep.join(paths)},
        )
        atexit.register(self.close)

    def ask(self, *words: str) -> Iterator[Any]:
        """Run pytest with these arguments in the server, and yield its reports as they arrive."""
        assert self.process.stdin is not None and self.process.stdout is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(json.dumps(words) + "\n")
            self.process.stdin.flush()
        for line in self.process.stdout:
            answer = json.loads(line)
            if answer is None:
                return
            yield answer
        self.process.wait()
        self.log.seek(0)
        end = self.log.read().decode(errors="replace")[-4000:]
        raise ServerDiedError(
            f"the process of the checks ended with {self.process.returncode}\n{end}"
        )

    def close(self) -> None:
        """End the process, even in the middle of a test."""
        atexit.unregister(self.close)
        self.process.kill()
        self.process.communicate()
        self.log.close()


class Checks:
    """Pytest plugin that collects ``check_*.py`` and runs their tests in a server."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self._server: CheckServer | None = None
        self._collected: dict[Path, list[dict[str, Any]]] = {}
        self._reports: dict[str, list[Any]] = {}
        self._requested: set[str] = set()
        self._running: Iterator[Any] = iter(())

    @property
    def server(self) -> CheckServer:
        """Server, which is started at the first access."""
        if self._server is None:
            self._server = CheckServer(self.config.rootpath)
        return self._server

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Send the distribution mode to a worker of pytest-xdist, whose own option always says `no`."""
        node.workerinput[_DIST] = self.config.getoption("dist")

    @pytest.hookimpl(wrapper=True)
    def pytest_collect_file(
        self, file_path: Path, parent: pytest.Collector
    ) -> Generator[None, Any, Any]:
        """Let the server collect a file of checks; pytest must not collect it as well if it is named explicitly."""
        collectors = yield
        if not file_path.match("check_*.py"):
            return collectors
        return [CheckFile.from_parent(parent, path=file_path, checks=self)]

    def collect(self, path: Path) -> list[dict[str, Any]]:
        """Return name, line and marks of each test in a file.

        Raises:
            CollectError: the server reports an error, for example because the file cannot be
                imported.
        """
        if path not in self._collected:
            # Collect all files of a folder at once: each call of pytest takes half a second.
            files = sorted(path.parent.glob("check_*.py"))
            self._collected.update({file: [] for file in files})
            try:
                for answer in self.server.ask("--collect-only", "--full", *map(str, files)):
                    self._collected[Path(answer["path"])].append(answer)
            except ServerDiedError as error:
                self.drop_server()
                raise pytest.Collector.CollectError(str(error)) from None
        for answer in self._collected[path]:
            if "error" in answer:
                raise pytest.Collector.CollectError(answer["error"])
        return self._collected[path]

    def reports(self, item: CheckItem) -> list[Any]:
        """Return pytest's reports of one test: start its file in the server, or wait for it if the file is running."""
        name = item.name
        key = item.nodeid
        try:
            if key not in self._requested:
                self._run(
                    [other for other in self._with(item) if other.nodeid not in self._reports]
                )
            while not any(report["when"] == "teardown" for report in self._reports.get(key, ())):
                report = next(self._running)
                self._reports.setdefault(report["nodeid"], []).append(report)
        except StopIteration:
            raise ServerDiedError(f"the process of the checks has not run {name}") from None
        except ServerDiedError:
            self.drop_server()
            raise
        return self._reports[key]

    def _with(self, item: CheckItem) -> list[pytest.Item]:
        """Return the tests of the same file that this process will run, including this test."""
        if getattr(self.config, "workerinput", {_DIST: "loadfile"})[_DIST] not in (
            "loadfile",
            "loadscope",
        ):
            # Without distribution by files, other workers run some of these tests.
            return [item]
        return [
            other
            for other in item.session.items
            if isinstance(other, CheckItem) and other.path == item.path
        ]

    def _run(self, items: Sequence[pytest.Item]) -> None:
        for report in self._running:
            # The remaining tests of the previous file finish first; their reports are saved.
            self._reports.setdefault(report["nodeid"], []).append(report)
        self._requested.update(item.nodeid for item in items)
        options = ["--full"] if self.config.getoption("--full", False) else []
        self._running = self.server.ask(*options, *(item.nodeid for item in items))

    def drop_server(self) -> None:
        """Remove a server that has died; the next test starts another one."""
        self._running = iter(())
        self._requested = set(self._reports)
        if self._server is not None:
            self._server.close()
            self._server = None

    def pytest_unconfigure(self) -> None:
        """End the server."""
        self.drop_server()


class CheckFile(pytest.File):
    """File of tests that run in the server."""

    def __init__(self, *, checks: Checks, **words: Any) -> None:
        super().__init__(**words)
        self.checks = checks

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the tests of this file.

        Raises:
            Skipped: CasADi is not installed.
        """
        if find_spec("casadi") is None:
            raise pytest.skip.Exception("needs the casadi package", allow_module_level=True)
        for answer in self.checks.collect(self.path):
            item: CheckItem = CheckItem.from_parent(self, name=answer["name"], line=answer["line"])
            for mark in answer["marks"]:
                item.add_marker(mark)
            yield item


class CheckItem(pytest.Item):
    """Test that runs in the server."""

    parent: CheckFile

    def __init__(self, *, line: int, **words: Any) -> None:
        super().__init__(**words)
        self.line = line
        # The server applies the time limit; this process may also wait for other tests there.
        self.add_marker(pytest.mark.timeout(0))

    def runtest(self) -> None:
        """Do nothing: the reports come from the server."""

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return file, line and name of the test."""
        return self.path, self.line, self.name

    def run(self) -> list[pytest.TestReport]:
        """Run the test in the server, and return its reports."""
        try:
            reports = self.parent.checks.reports(self)
        except ServerDiedError as error:
            return [
                pytest.TestReport(self.nodeid, self.location, {}, "failed", str(error), "call"),
                pytest.TestReport(self.nodeid, self.location, {}, "passed", None, "teardown"),
            ]
        for data in reports:
            if data["outcome"] == "skipped" and isinstance(data["longrepr"], list):
                # JSON has no tuples, but pytest requires one here.
                data["longrepr"] = tuple(data["longrepr"])
        return [
            self.config.hook.pytest_report_from_serializable(config=self.config, data=data)
            for data in reports
        ]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """Forward the server's reports of a check; this process does no setup for it."""
    if not isinstance(item, CheckItem):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for report in item.run():
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


class Answers:
    """Pytest plugin of the server that writes collected tests and reports as lines of JSON."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream
        self.config: pytest.Config | None = None

    def pytest_configure(self, config: pytest.Config) -> None:
        """Save the configuration, whose hooks serialize reports."""
        self.config = config

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Write the collected tests if only collection was requested."""
        if session.config.option.collectonly:
            for item in session.items:
                marks = sorted(
                    {mark.name for mark in item.iter_markers()} & {"full", "oracle", "corpus"}
                )
                self.write(
                    {
                        "path": str(item.path),
                        "name": item.name,
                        "line": item.location[1] or 0,
                        "marks": marks,
                    }
                )

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Write why a file cannot be collected."""
        if report.failed:
            assert self.config is not None
            path = self.config.rootpath / report.nodeid.partition("::")[0]
            self.write({"path": str(path), "error": str(report.longrepr)})

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Write the report of one phase of one test."""
        assert self.config is not None
        self.write(
            self.config.hook.pytest_report_to_serializable(config=self.config, report=report)
        )

    def write(self, answer: Any) -> None:
        """Write an object as one line."""
        self.stream.write(json.dumps(answer, default=str) + "\n")
        self.stream.flush()


def is_server(config: pytest.Config) -> bool:
    """Return whether this pytest runs in the server."""
    return config.pluginmanager.has_plugin(_SERVER)


def serve() -> None:
    """Run pytest for each line of JSON on standard input; a line ``null`` ends its reports."""
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
    # The reports contain what pytest prints. Libraries print to the file descriptor, so it is
    # redirected.
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
    answers = Answers(stream)

    class Server:
        """Pytest plugin that registers `answers` under the name that `is_server` looks for."""

        def pytest_addoption(self, pluginmanager: pytest.PytestPluginManager) -> None:
            pluginmanager.register(answers, _SERVER)

    for line in sys.stdin:
        words = json.loads(line)
        pytest.main(
            ["-p", "xdist", "-n0", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", *words],
            plugins=[Server()],
        )
        answers.write(None)


if __name__ == "__main__":
    serve()
