"""Mutation check: how many small faults in the package the tests find.

A mutant is one operator, constant or branch of the source changed at random. For each one the tests
that run its line are called, in a copy of the repository, until the first failure. ``--record``
runs the quick suite once under coverage and writes which tests run which lines (its further words
go to pytest; records of several folders add up). A line that no test runs may be compiled, and the
tests of its package's folder are called, as for all lines without a record.

    python benchmarks/mutants.py --record lines.sqlite
    python benchmarks/mutants.py --lines lines.sqlite --count 200 --seed 1 >quick.txt
    python benchmarks/mutants.py --lines lines.sqlite --full --again quick.txt

The last command tries the mutants that have survived with all tests of the files that were called.
A mutant of a kernel changes its digest: it is compiled anew, or runs as Python where no compiler is
found.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from importlib.util import cache_from_source
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = (
    "schema", "io", "lint", "mechanics", "simulation", "tools", "optimal", "translate"
)  # fmt: skip
OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"), ast.Or: ("or", "and"), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
}  # fmt: skip
"""Text of an operator, and what replaces it."""
MAX_TESTS = 40
"""Tests called for one mutant, those of its own package first, and of these the ones that run least."""


class Mutant(NamedTuple):
    """One change of one line: `start` and `end` are offsets into the bytes of the file."""

    file: str
    line: int
    start: int
    end: int
    old: str
    new: str


def find_mutants(file: str, text: str) -> Iterator[Mutant]:
    """Yield all mutants of a module."""
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def offset(line: int, column: int) -> int:
        return starts[line - 1] + column

    data = text.encode()

    def between(left: ast.expr, right: ast.expr, operator: ast.AST) -> Iterator[Mutant]:
        if type(operator) not in OPERATORS:
            return
        old, new = OPERATORS[type(operator)]
        assert left.end_lineno is not None and left.end_col_offset is not None
        start = offset(left.end_lineno, left.end_col_offset)
        place = data.find(old.encode(), start, offset(right.lineno, right.col_offset))
        if place >= 0:
            yield Mutant(file, left.end_lineno, place, place + len(old), old, new)

    for node in _code_nodes(ast.parse(text)):
        if isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, node.op)
        elif isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from between(node.left, node.comparators[0], node.ops[0])
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            assert node.end_lineno is not None and node.end_col_offset is not None
            start, end = (
                offset(node.lineno, node.col_offset),
                offset(node.end_lineno, node.end_col_offset),
            )
            new = str(not node.value) if isinstance(node.value, bool) else repr(node.value + 1)
            yield Mutant(file, node.lineno, start, end, data[start:end].decode(), new)
        elif isinstance(node, ast.If | ast.IfExp | ast.While):
            test = node.test
            assert test.end_lineno is not None and test.end_col_offset is not None
            start, end = (
                offset(test.lineno, test.col_offset),
                offset(test.end_lineno, test.end_col_offset),
            )
            old = data[start:end].decode()
            yield Mutant(file, test.lineno, start, end, old, f"(not ({old}))")


def _code_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes inside of functions: what runs on import is seen by every test."""
    for child in ast.walk(node):
        if isinstance(child, ast.FunctionDef):
            for statement in child.body:
                yield from ast.walk(statement)


def choose_mutants(packages: Sequence[str], count: int, seed: int) -> list[Mutant]:
    """Return mutants in equal shares of the packages."""
    draw, result = random.Random(seed), []
    for number in range(count):
        package = packages[number % len(packages)]
        files = sorted(path for path in (ROOT / "osimlite" / package).rglob("*.py"))
        for _ in range(1000):
            path = draw.choice(files)
            file = path.relative_to(ROOT).as_posix()
            mutants = sorted(set(find_mutants(file, path.read_text(encoding="utf-8"))))
            if not mutants:
                continue
            mutant = draw.choice(mutants)
            if mutant not in result:
                result.append(mutant)
                break
    return result


class Lines:
    """Which tests run which lines: the contexts of a coverage file."""

    def __init__(self, file: Path) -> None:
        # As documented in "Coverage.py database schema"; its own reader needs minutes for so many.
        self.data = sqlite3.connect(file)
        self.files: dict[str, list[int]] = {}
        for number, name in self.data.execute("select id, path from file"):
            # Several where tests call a package that is installed elsewhere.
            key = Path(name).as_posix().rpartition("/osimlite/")[2]
            self.files.setdefault(key, []).append(number)
        self.size = {
            _test_of(context): size
            for context, size in self.data.execute(
                "select context, count(*) from arc join context on context_id = context.id group by context_id"
            )
        }

    def tests_of(self, mutant: Mutant) -> list[str]:
        """Return the tests that run the line of a mutant.

        Those of its package come first. Of these the ones that run few lines come first, for they
        are the quickest.
        """
        tests = {
            _test_of(context)
            for number in self.files.get(mutant.file.removeprefix("osimlite/"), ())
            for (context,) in self.data.execute(
                "select distinct context from arc join context on context_id = context.id"
                " where file_id = ? and (fromno = ? or tono = ?)",
                (number, mutant.line, mutant.line),
            )
        } - {""}
        package = mutant.file.split("/")[1]
        return sorted(
            tests, key=lambda test: (f"/{package}/" not in test, self.size.get(test, 0), test)
        )[:MAX_TESTS]


def _test_of(context: str) -> str:
    """Return the test of a context: what the plugin switched to, or what a command has inherited."""
    return re.sub(r" \((setup|call|teardown)\)(\|.*)?$", "", context.removeprefix("|"))


def neighbours(mutant: Mutant) -> list[str]:
    """Return the test files of the package of a mutant, those with the name of its module first."""
    parts = Path(mutant.file).with_suffix("").parts[1:]
    folder = ROOT / "tests" / parts[0]
    files = folder.rglob("test_*.py") if folder.is_dir() else (ROOT / "tests").glob("test_*.py")
    names = [path.relative_to(ROOT).as_posix() for path in files]
    return sorted(names, key=lambda name: (parts[-1] not in name, name))[:8]


def copy_repository(folder: Path) -> None:
    """Copy what git knows of, as it is now, and the library of kernels into a folder."""
    listed = ["git", "ls-files", "-z"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    # Without the library each kernel is compiled when it is first called.
    native = ROOT / "osimlite" / "native"
    shutil.copytree(native, folder / "osimlite" / "native", dirs_exist_ok=True)


class Trials:
    """Calls of tests with mutants in place, in a copy of the repository."""

    def __init__(self, folder: Path, *, full: bool, seconds: float) -> None:
        self.folder = folder
        self.full = full
        self.seconds = seconds
        self.failing: set[str] = set()
        self.passing: set[str] = set()

    def try_mutant(self, mutant: Mutant, tests: Sequence[str]) -> tuple[str, str]:
        """Call tests with a mutant in place.

        Returns:
            ``killed`` (a test fails that passes without the mutant), ``survived``, ``timed out`` or
            ``untested``; and the test that fails.
        """
        path = self.folder / mutant.file
        before = path.read_bytes()
        changed = before[: mutant.start] + mutant.new.encode() + before[mutant.end :]
        while True:
            tests = [test for test in tests if test not in self.failing]
            _replace_source(path, changed)
            try:
                outcome, failed = self.call(tests)
            finally:
                _replace_source(path, before)
            if outcome != "killed" or not failed or self._passes(failed):
                return outcome, failed
            if failed not in tests:
                # A test of a file that was called as a whole: only the file can be left out.
                self.failing.add(failed.partition("::")[0])

    def _passes(self, test: str) -> bool:
        """Say whether a test passes without any mutant."""
        if test not in self.passing:
            (self.failing if self.call([test])[0] == "killed" else self.passing).add(test)
        return test in self.passing

    def call(self, tests: Sequence[str]) -> tuple[str, str]:
        """Call tests until the first failure, and return the outcome and the test that fails."""
        if not tests:
            return "untested", ""
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "CI": "1"}
        options = ["-x", "-q", "-n0", "-p", "no:cacheprovider", *(["--full"] if self.full else [])]
        try:
            done = subprocess.run(
                [sys.executable, "-m", "pytest", *options, *tests], cwd=self.folder, env=environment,
                capture_output=True, timeout=self.seconds, check=False, text=True, errors="replace",
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return "timed out", ""
        lost = re.findall(r"^ERROR: not found: \S*?/(tests/.*)$", done.stderr, re.MULTILINE)
        if lost:
            # A case whose name depends on the run, such as the path of its temporary folder.
            return self.call([test for test in tests if test not in lost])
        failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", done.stdout, re.MULTILINE)
        # 0: all pass. 5: pytest has collected no test.
        outcome = {0: "survived", 5: "untested"}.get(done.returncode, "killed")
        return outcome, failed.group(1) if failed else ""


def _replace_source(path: Path, content: bytes) -> None:
    """Write a module, and remove its byte code.

    Python takes byte code as current if the size of the source and the second of its last change
    agree, which a mutant of the same length within a second does not alter.
    """
    path.write_bytes(content)
    Path(cache_from_source(str(path))).unlink(missing_ok=True)


RECORDING = """[run]
source_pkgs = osimlite
branch = true
parallel = true
data_file = {file}
context = ${{PYTEST_CURRENT_TEST-}}
patch = subprocess
"""
"""Coverage of each process that a run starts.

A command that a test starts inherits the variable with the name of that test. The tests of
`check_*.py` run in one process for many, whose context the plugin switches.
"""


def record(file: Path, words: Sequence[str]) -> int:
    """Run tests of the quick suite under coverage, with the name of each test as context.

    Args:
        file: what is recorded; records that it has of other tests are kept.
        words: further arguments of pytest, such as folders; the whole suite without them.

    Returns:
        The exit code of pytest.
    """
    from coverage import Coverage

    with tempfile.TemporaryDirectory() as place:
        configuration = Path(place) / "coverage.ini"
        data = Path(place) / "lines"
        configuration.write_text(RECORDING.format(file=data), encoding="utf-8")
        environment = {
            **os.environ,
            "COVERAGE_PROCESS_START": str(configuration),
            "PYTEST_PLUGINS": "benchmarks.mutants",
            "PYTHONPATH": os.pathsep.join(
                [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
            ),
        }
        # Each test takes about three times as long as without.
        command = [sys.executable, "-m", "pytest", "-q", "-o", "timeout=1200", *words]
        code = subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode
        parts = sorted(str(part) for part in Path(place).glob("lines.*"))
        before = [str(file)] if file.exists() else []
        coverage = Coverage(data_file=str(data), branch=True)
        coverage.combine([*before, *parts])
        coverage.save()
        shutil.move(data, file)
    return code


def pytest_runtest_logstart(nodeid: str) -> None:
    """Record the lines that run from here as those of this test."""
    coverage = _running_coverage()
    if coverage is not None:
        coverage.switch_context(nodeid)


def pytest_unconfigure() -> None:
    """Write what has been recorded: processes of tests are ended without a chance to do so."""
    coverage = _running_coverage()
    if coverage is not None:
        coverage.stop()
        coverage.save()
        coverage.start()


def _running_coverage() -> Any:
    """Return the coverage that this process was started under, or None."""
    if "COVERAGE_PROCESS_START" not in os.environ:
        return None
    from coverage import Coverage

    return Coverage.current()


def main() -> int:
    """Print a line for each mutant, and the share that the tests kill."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--record", type=Path, help="write which tests run which lines (needs coverage), and stop"
    )
    parser.add_argument("--lines", type=Path, help="such a record")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--packages", default=",".join(PACKAGES))
    parser.add_argument("--full", action="store_true", help="call the tests of the full suite too")
    parser.add_argument(
        "--again", type=Path, help="try the survivors in what an earlier call printed"
    )
    parser.add_argument("--part", default="1/1", help="try the first of two halves: 1/2")
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="time limit of the tests of one mutant"
    )
    words, others = parser.parse_known_args()
    if others and not words.record:
        parser.error(f"unknown arguments: {' '.join(others)}")
    if words.record:
        return record(words.record, others)
    lines = Lines(words.lines) if words.lines else None
    mutants = choose_mutants(words.packages.split(","), words.count, words.seed)
    if words.again:
        tried = words.again.read_text(encoding="utf-8").splitlines()
        left = {
            line.partition(" tests  ")[2]
            for line in tried
            if line.startswith(("survived", "untested"))
        }
        mutants = [mutant for mutant in mutants if _describe(mutant) in left]
    part, parts = map(int, words.part.split("/"))
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as place:
        copy_repository(Path(place))
        trials = Trials(Path(place), full=words.full, seconds=words.seconds)
        for mutant in mutants[part - 1 :: parts]:
            tests = (lines.tests_of(mutant) if lines else []) or neighbours(mutant)
            if words.full:
                tests = list(dict.fromkeys(test.partition("::")[0] for test in tests))
            start = time.monotonic()
            outcome, test = trials.try_mutant(mutant, tests)
            counts[outcome] += 1
            duration = f"{time.monotonic() - start:5.0f} s  {len(tests):2d} tests  "
            print(f"{outcome:9} {duration}{_describe(mutant)}", flush=True)
            if test:
                print(f"    by {test}", flush=True)
    found = counts["killed"] + counts["timed out"]
    print(f"{found} of {sum(counts.values())} killed: {dict(counts)}")
    return 0


def _describe(mutant: Mutant) -> str:
    return f"{mutant.file}:{mutant.line}  {' '.join(mutant.old.split())} -> {' '.join(mutant.new.split())}"


if __name__ == "__main__":
    raise SystemExit(main())
