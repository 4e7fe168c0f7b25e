"""Mutation testing: how many small changes of the package do the tests detect?

    python benchmarks/mutants.py --record lines.sqlite
    python benchmarks/mutants.py --lines lines.sqlite --count 200 --seed 1 >quick.txt
    python benchmarks/mutants.py --lines lines.sqlite --count 200 --seed 1 --full --again quick.txt

A mutant is the source with one operator, constant or condition changed at random. For each mutant,
the tests that run its line are called in a copy of the repository, until the first failure. The
mutant is *killed* if a test fails that passes without it; otherwise it *survives*.

The first command runs the quick suite once under coverage and records which tests run which lines.
Its further arguments go to pytest; records of several folders are merged. The second command tries
mutants. Without a record, and for a line that no test runs in Python (it may be compiled), the
tests of the package are called. The third command, which needs the same number and seed, tries the
survivors of the second one again, with all tests of the same files, including those of the full
suite.

Each mutant has a line with its outcome, the time, the number of tests, and the change; the next
line has the test that failed. The last line has the number of killed mutants. A mutant of a kernel
changes its digest, so that it is compiled again, or runs in Python if there is no compiler.
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
PACKAGES = ("schema", "io", "lint", "mechanics", "simulation", "tools", "optimal", "translate")
"""Packages whose mutants are tried by default."""

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
}
"""Text of each operator, and the text that replaces it."""

# A central line is run by thousands of tests.
MAX_TESTS = 40
"""Largest number of tests that are called for one mutant."""

MAX_TEST_FILES = 8
"""Largest number of test files that are called for a mutant without recorded tests."""

MAX_DRAWS = 1000
"""Number of modules that are drawn to find a mutant that was not selected before."""


class Mutant(NamedTuple):
    """Change of one place in a module."""

    file: str
    """Path of the module in the repository."""
    line: int
    """Number of the line, from 1."""
    start: int
    """Offset of the first changed byte in the file."""
    end: int
    """Offset after the last changed byte."""
    old: str
    new: str


def find_mutants(file: str, text: str) -> Iterator[Mutant]:
    """Find all mutants of a module.

    Args:
        file: path of the module in the repository.
        text: text of the module.

    Yields:
        Mutants of operators, numbers and conditions inside functions.
    """
    source = _Source(file, text)
    for node in _iterate_nodes(ast.parse(text)):
        if isinstance(node, ast.BinOp):
            yield from source.mutate_operator(node.left, node.right, node.op)
        elif isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from source.mutate_operator(node.left, node.comparators[0], node.ops[0])
        elif isinstance(node, ast.BoolOp):
            yield from source.mutate_operator(node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            is_bool = isinstance(node.value, bool)
            new = str(not node.value) if is_bool else repr(node.value + 1)
            yield source.replace_node(node, new)
        elif isinstance(node, ast.If | ast.IfExp | ast.While):
            old = source.get_text(node.test)
            yield source.replace_node(node.test, f"(not ({old}))")


class _Source:
    """Text of a module, with positions of its syntax nodes in bytes.

    Args:
        file: path of the module in the repository.
        text: text of the module.
    """

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        # Columns of syntax nodes count bytes, not characters.
        self.data = text.encode()
        self.line_starts = [0]
        for line in self.data.splitlines(keepends=True):
            self.line_starts.append(self.line_starts[-1] + len(line))

    def get_range(self, node: ast.expr) -> tuple[int, int]:
        """Return the offsets of a node in the file.

        Returns:
            Offset of the first byte, and offset after the last one.
        """
        assert node.end_lineno is not None and node.end_col_offset is not None
        start = self.line_starts[node.lineno - 1] + node.col_offset
        return start, self.line_starts[node.end_lineno - 1] + node.end_col_offset

    def get_text(self, node: ast.expr) -> str:
        """Return the text of a node."""
        start, end = self.get_range(node)
        return self.data[start:end].decode()

    def replace_node(self, node: ast.expr, new: str) -> Mutant:
        """Return the mutant that replaces the text of a node."""
        start, end = self.get_range(node)
        return Mutant(self.file, node.lineno, start, end, self.get_text(node), new)

    def mutate_operator(
        self, left: ast.expr, right: ast.expr, operator: ast.AST
    ) -> Iterator[Mutant]:
        """Find the mutant of an operator.

        Args:
            left: operand before the operator.
            right: operand after it.
            operator: syntax node of the operator, which has no position itself.

        Yields:
            The mutant, unless the operator has none.
        """
        if type(operator) not in OPERATORS:
            return
        old, new = OPERATORS[type(operator)]
        assert left.end_lineno is not None
        _, start = self.get_range(left)
        end, _ = self.get_range(right)
        offset = self.data.find(old.encode(), start, end)
        if offset >= 0:
            yield Mutant(self.file, left.end_lineno, offset, offset + len(old), old, new)


def _iterate_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the syntax nodes inside functions: every test would detect changes outside of them."""
    for child in ast.walk(node):
        if isinstance(child, ast.FunctionDef):
            for statement in child.body:
                yield from ast.walk(statement)


def choose_mutants(packages: Sequence[str], count: int, seed: int) -> list[Mutant]:
    """Return random mutants, equally many of each package.

    Args:
        packages: names of the packages.
        count: number of mutants.
        seed: seed of the random numbers.
    """
    draw = random.Random(seed)
    result: list[Mutant] = []
    for number in range(count):
        package = packages[number % len(packages)]
        files = sorted(path for path in (ROOT / "osimlite" / package).rglob("*.py"))
        for _ in range(MAX_DRAWS):
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
    """Record of the tests that run each line: the contexts of a coverage file.

    Args:
        file: coverage file that `--record` wrote.
    """

    def __init__(self, file: Path) -> None:
        # The tables are documented in "Coverage.py database schema". The reader of coverage needs
        # minutes for a file of this size.
        self.data = sqlite3.connect(file)
        self.files: dict[str, list[int]] = {}
        for number, name in self.data.execute("select id, path from file"):
            # A module has several entries if tests call a package that is installed elsewhere.
            key = Path(name).as_posix().rpartition("/osimlite/")[2]
            self.files.setdefault(key, []).append(number)
        self.sizes = {
            _find_test_name(context): size
            for context, size in self.data.execute(
                "select context, count(*) from arc join context on context_id = context.id"
                " group by context_id"
            )
        }

    def find_tests(self, mutant: Mutant) -> list[str]:
        """Return the tests that run the line of a mutant.

        Tests of its package come first, and of these the ones that run few lines, since they are
        the quickest.
        """
        tests = {
            _find_test_name(context)
            for number in self.files.get(mutant.file.removeprefix("osimlite/"), ())
            for (context,) in self.data.execute(
                "select distinct context from arc join context on context_id = context.id"
                " where file_id = ? and (fromno = ? or tono = ?)",
                (number, mutant.line, mutant.line),
            )
        } - {""}
        package = mutant.file.split("/")[1]

        def compute_rank(test: str) -> tuple[bool, int, str]:
            return f"/{package}/" not in test, self.sizes.get(test, 0), test

        return sorted(tests, key=compute_rank)[:MAX_TESTS]


def _find_test_name(context: str) -> str:
    """Return the test of a context, without its phase and the context of a parent process."""
    return re.sub(r" \((setup|call|teardown)\)(\|.*)?$", "", context.removeprefix("|"))


def find_package_tests(mutant: Mutant) -> list[str]:
    """Return test files of the package of a mutant, first those with the name of its module."""
    parts = Path(mutant.file).with_suffix("").parts[1:]
    folder = ROOT / "tests" / parts[0]
    files = folder.rglob("test_*.py") if folder.is_dir() else (ROOT / "tests").glob("test_*.py")
    names = [path.relative_to(ROOT).as_posix() for path in files]
    return sorted(names, key=lambda name: (parts[-1] not in name, name))[:MAX_TEST_FILES]


def copy_repository(folder: Path) -> None:
    """Copy the tracked files in their present state, and the library of kernels, into a folder."""
    command = ["git", "ls-files", "-z"]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    # Without the library, each kernel would be compiled at its first call.
    native = ROOT / "osimlite" / "native"
    shutil.copytree(native, folder / "osimlite" / "native", dirs_exist_ok=True)


class Trials:
    """Calls of tests with mutants, in a copy of the repository.

    Args:
        folder: folder of the copy.
        full: whether to call the tests of the full suite too.
        seconds: time limit of the tests of one mutant (s).
    """

    def __init__(self, folder: Path, *, full: bool, seconds: float) -> None:
        self.folder = folder
        self.full = full
        self.seconds = seconds
        self.failing: set[str] = set()
        self.passing: set[str] = set()

    def try_mutant(self, mutant: Mutant, tests: Sequence[str]) -> tuple[str, str]:
        """Call tests with a mutant in place of the original.

        Args:
            mutant: mutant to try.
            tests: names of tests or of test files.

        Returns:
            ``killed`` (a test fails that passes without the mutant), ``survived``, ``timed out`` or
            ``untested``; and the name of the test that fails.
        """
        path = self.folder / mutant.file
        before = path.read_bytes()
        changed = before[: mutant.start] + mutant.new.encode() + before[mutant.end :]
        while True:
            tests = [test for test in tests if test not in self.failing]
            _replace_source(path, changed)
            try:
                outcome, failed = self.call_tests(tests)
            finally:
                _replace_source(path, before)
            if outcome != "killed" or not failed or self._passes(failed):
                return outcome, failed
            if failed not in tests:
                # All tests of this file were called, and only the complete file can be left out.
                self.failing.add(failed.partition("::")[0])

    def _passes(self, test: str) -> bool:
        """Return whether a test passes without any mutant."""
        if test not in self.passing:
            outcome, _ = self.call_tests([test])
            names = self.failing if outcome == "killed" else self.passing
            names.add(test)
        return test in self.passing

    def call_tests(self, tests: Sequence[str]) -> tuple[str, str]:
        """Call tests until the first failure.

        Args:
            tests: names of tests or of test files.

        Returns:
            Outcome, as of `try_mutant`, and the name of the test that fails.
        """
        if not tests:
            return "untested", ""
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "CI": "1"}
        options = ["-x", "-q", "-n0", "-p", "no:cacheprovider", *(["--full"] if self.full else [])]
        try:
            done = subprocess.run(
                [sys.executable, "-m", "pytest", *options, *tests],
                cwd=self.folder,
                env=environment,
                capture_output=True,
                timeout=self.seconds,
                check=False,
                text=True,
                errors="replace",
            )
        except subprocess.TimeoutExpired:
            return "timed out", ""
        missing = re.findall(r"^ERROR: not found: \S*?/(tests/.*)$", done.stderr, re.MULTILINE)
        if missing:
            # The names of some cases differ in every run, for example with a temporary folder.
            return self.call_tests([test for test in tests if test not in missing])
        failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", done.stdout, re.MULTILINE)
        # Exit code 0: all tests pass; 5: pytest has collected no test.
        outcome = {0: "survived", 5: "untested"}.get(done.returncode, "killed")
        return outcome, failed.group(1) if failed else ""


def _replace_source(path: Path, content: bytes) -> None:
    """Write a module, and remove its byte code.

    Python takes byte code as current if the size of the source and the second of its last change
    agree, which a mutant of the same length within a second does not alter.
    """
    path.write_bytes(content)
    Path(cache_from_source(str(path))).unlink(missing_ok=True)


COVERAGE_SETTINGS = """[run]
source_pkgs = osimlite
branch = true
parallel = true
data_file = {file}
context = ${{PYTEST_CURRENT_TEST-}}
patch = subprocess
"""
"""Settings of coverage for every process of a run.

A command that a test starts inherits the environment variable with the name of the test, which is
its context. Tests of `check_*.py` share one process, whose context the plugin below changes.
"""


def record_lines(file: Path, words: Sequence[str]) -> int:
    """Run tests of the quick suite under coverage, with the name of each test as context.

    Args:
        file: file of the record; new records are added to those that it has.
        words: further arguments of pytest, for example folders; the complete suite if empty.

    Returns:
        Exit code of pytest.
    """
    from coverage import Coverage

    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        configuration = folder / "coverage.ini"
        data = folder / "lines"
        configuration.write_text(COVERAGE_SETTINGS.format(file=data), encoding="utf-8")
        environment = {
            **os.environ,
            "COVERAGE_PROCESS_START": str(configuration),
            "PYTEST_PLUGINS": "benchmarks.mutants",
            "PYTHONPATH": os.pathsep.join(
                [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
            ),
        }
        # Under coverage, a test takes about three times as long.
        command = [sys.executable, "-m", "pytest", "-q", "-o", "timeout=1200", *words]
        code = subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode
        # Every process has written a file of its own.
        parts = sorted(str(part) for part in folder.glob("lines.*"))
        before = [str(file)] if file.exists() else []
        coverage = Coverage(data_file=str(data), branch=True)
        coverage.combine([*before, *parts])
        coverage.save()
        shutil.move(data, file)
    return code


def pytest_runtest_logstart(nodeid: str) -> None:
    """Record the following lines as those of this test, as a hook of pytest."""
    coverage = _find_coverage()
    if coverage is not None:
        coverage.switch_context(nodeid)


def pytest_unconfigure() -> None:
    """Write the record of this process, as a hook of pytest.

    Processes that run tests end in a way that does not let coverage do this at exit.
    """
    coverage = _find_coverage()
    if coverage is not None:
        coverage.stop()
        coverage.save()
        coverage.start()


def _find_coverage() -> Any:
    """Return the coverage that measures this process, or None."""
    if "COVERAGE_PROCESS_START" not in os.environ:
        return None
    from coverage import Coverage

    return Coverage.current()


def create_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--record", type=Path, help="write which tests run which lines (needs coverage), and stop"
    )
    parser.add_argument("--lines", type=Path, help="record of an earlier run with --record")
    parser.add_argument("--count", type=int, default=60, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random numbers")
    parser.add_argument(
        "--packages", default=",".join(PACKAGES), help="packages to change, with commas between"
    )
    parser.add_argument("--full", action="store_true", help="also call tests of the full suite")
    parser.add_argument(
        "--again", type=Path, help="output of an earlier run, whose survivors are tried"
    )
    parser.add_argument(
        "--part", default="1/1", help="part of the mutants to try, for example 1/2 for one half"
    )
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="time limit of the tests of one mutant, s"
    )
    return parser


def read_survivors(file: Path) -> set[str]:
    """Return the descriptions of the mutants that no test killed, from the output of a run."""
    return {
        line.partition(" tests  ")[2]
        for line in file.read_text(encoding="utf-8").splitlines()
        if line.startswith(("survived", "untested"))
    }


def try_mutants(
    mutants: Sequence[Mutant], lines: Lines | None, *, full: bool, seconds: float
) -> Counter[str]:
    """Try mutants, and print a line for each.

    Args:
        mutants: mutants to try.
        lines: record of the tests that run each line, or None.
        full: whether to call all tests of the files, including those of the full suite.
        seconds: time limit of the tests of one mutant (s).

    Returns:
        Number of mutants with each outcome.
    """
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as temporary:
        copy_repository(Path(temporary))
        trials = Trials(Path(temporary), full=full, seconds=seconds)
        for mutant in mutants:
            tests = (lines.find_tests(mutant) if lines else []) or find_package_tests(mutant)
            if full:
                # The record has no tests of the full suite, but they are in the same files.
                tests = list(dict.fromkeys(test.partition("::")[0] for test in tests))
            start = time.monotonic()
            outcome, test = trials.try_mutant(mutant, tests)
            counts[outcome] += 1
            duration = f"{time.monotonic() - start:5.0f} s  {len(tests):2d} tests  "
            print(f"{outcome:9} {duration}{_describe_mutant(mutant)}", flush=True)
            if test:
                print(f"    by {test}", flush=True)
    return counts


def main() -> int:
    """Record lines or try mutants, and return the exit code."""
    parser = create_parser()
    options, others = parser.parse_known_args()
    if others and not options.record:
        parser.error(f"unknown arguments: {' '.join(others)}")
    if options.record:
        return record_lines(options.record, others)
    lines = Lines(options.lines) if options.lines else None
    mutants = choose_mutants(options.packages.split(","), options.count, options.seed)
    if options.again:
        survivors = read_survivors(options.again)
        mutants = [mutant for mutant in mutants if _describe_mutant(mutant) in survivors]
        if survivors and not mutants:
            parser.error(f"{options.again} has other mutants; give its --count and --seed")
    part, parts = map(int, options.part.split("/"))
    counts = try_mutants(
        mutants[part - 1 :: parts], lines, full=options.full, seconds=options.seconds
    )
    # An endless loop is a difference that tests detect.
    killed = counts["killed"] + counts["timed out"]
    print(f"{killed} of {sum(counts.values())} killed: {dict(counts)}")
    return 0


def _describe_mutant(mutant: Mutant) -> str:
    """Return file, line and change of a mutant on one line, as `read_survivors` finds it."""
    old = " ".join(mutant.old.split())
    new = " ".join(mutant.new.split())
    return f"{mutant.file}:{mutant.line}  {old} -> {new}"


if __name__ == "__main__":
    raise SystemExit(main())
