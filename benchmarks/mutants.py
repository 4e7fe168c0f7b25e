"""Mutation check: how many small faults in the package the tests find.

A mutant is one operator, constant or branch of the source changed at random. For each one the tests
that run its line are called, in a copy of the repository, until the first failure. ``--record``
runs the quick suite once under coverage and writes which tests run which lines. Without such a
record the tests of the package's own folder are called, which take longer and may miss those
elsewhere.

    python benchmarks/mutants.py --record lines.sqlite python benchmarks/mutants.py --lines
    lines.sqlite --count 60 --seed 1 [--full] [--packages lint,schema]

A mutant of a kernel changes its digest: it is compiled anew, or runs as Python where no compiler is
found.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = (
    "schema", "io", "lint", "mechanics", "simulation", "tools", "optimal", "translate"
)  # fmt: skip
COPIED = (
    "osimlite",
    "tests",
    "fixtures",
    "schemas",
    "benchmarks",
    "docs",
    "pyproject.toml",
    "README.md",
    "editors",
)
OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"), ast.Or: ("or", "and"), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
}  # fmt: skip
"""Text of an operator, and what replaces it."""
MAX_TESTS = 40
"""Tests called for one mutant, those of its own package first."""


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


def choose_mutants(
    packages: Sequence[str], count: int, seed: int, lines: Lines | None
) -> list[Mutant]:
    """Return mutants in equal shares of the packages; with a record, of lines that some test runs."""
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
            if mutant not in result and (lines is None or lines.tests_of(mutant)):
                result.append(mutant)
                break
    return result


class Lines:
    """Which tests run which lines: the contexts of a coverage file."""

    def __init__(self, file: Path) -> None:
        from coverage import CoverageData  # comes with pytest-cov

        self.data = CoverageData(str(file))
        self.data.read()
        self.files = {
            Path(name).as_posix().rpartition("/osimlite/")[2]: name
            for name in self.data.measured_files()
        }

    def tests_of(self, mutant: Mutant) -> list[str]:
        """Return the tests that run the line of a mutant, those of its package first."""
        name = self.files.get(mutant.file.removeprefix("osimlite/"))
        contexts = self.data.contexts_by_lineno(name).get(mutant.line, []) if name else []
        tests = sorted({context.partition("|")[0] for context in contexts if context})
        package = mutant.file.split("/")[1]
        return sorted(tests, key=lambda test: (f"/{package}/" not in test, test))[:MAX_TESTS]


def neighbours(mutant: Mutant) -> list[str]:
    """Return the test files of the package of a mutant, those with the name of its module first."""
    parts = Path(mutant.file).with_suffix("").parts[1:]
    folder = ROOT / "tests" / parts[0]
    files = folder.rglob("test_*.py") if folder.is_dir() else (ROOT / "tests").glob("test_*.py")
    names = [path.relative_to(ROOT).as_posix() for path in files]
    return sorted(names, key=lambda name: (parts[-1] not in name, name))[:8]


def try_mutant(
    mutant: Mutant, tests: Sequence[str], folder: Path, *, full: bool, seconds: float
) -> str:
    """Call tests with a mutant in place.

    Returns:
        ``killed`` (a test fails), ``survived``, ``timed out`` or ``untested``.
    """
    if not tests:
        return "untested"
    path = folder / mutant.file
    before = path.read_bytes()
    path.write_bytes(before[: mutant.start] + mutant.new.encode() + before[mutant.end :])
    environment = {**os.environ, "PYTHONPATH": str(folder), "CI": "1"}
    options = ["-x", "-q", "-n0", "-p", "no:cacheprovider", *(["--full"] if full else [])]
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=folder, env=environment, capture_output=True, timeout=seconds, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return "timed out"
    finally:
        path.write_bytes(before)
    # 5: pytest has collected no test.
    return {0: "survived", 5: "untested"}.get(done.returncode, "killed")


def record(file: Path) -> int:
    """Run the quick suite under coverage, with the name of each test as context."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "--cov=osimlite",
        "--cov-context=test",
        "--cov-report=",
    ]
    return subprocess.run(
        command, cwd=ROOT, env={**os.environ, "COVERAGE_FILE": str(file)}, check=False
    ).returncode


def main() -> int:
    """Print a line for each mutant, and the share that the tests kill."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--record", type=Path, help="write which tests run which lines (needs pytest-cov), and stop"
    )
    parser.add_argument("--lines", type=Path, help="such a record")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--packages", default=",".join(PACKAGES))
    parser.add_argument("--full", action="store_true", help="call the tests of the full suite too")
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="time limit of the tests of one mutant"
    )
    words = parser.parse_args()
    if words.record:
        return record(words.record)
    lines = Lines(words.lines) if words.lines else None
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name in COPIED:
            if (ROOT / name).is_dir():
                shutil.copytree(
                    ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__")
                )
            elif (ROOT / name).exists():
                shutil.copy(ROOT / name, folder / name)
        for mutant in choose_mutants(words.packages.split(","), words.count, words.seed, lines):
            tests = lines.tests_of(mutant) if lines else neighbours(mutant)
            start = time.monotonic()
            outcome = try_mutant(mutant, tests, folder, full=words.full, seconds=words.seconds)
            counts[outcome] += 1
            duration = f"{time.monotonic() - start:5.0f} s  {len(tests):2d} tests"
            print(
                f"{outcome:9} {duration}  {mutant.file}:{mutant.line}  {mutant.old} -> {mutant.new}",
                flush=True,
            )
    tried = counts["killed"] + counts["survived"]
    others = f"{counts['timed out']} timed out, {counts['untested']} untested"
    print(f"{counts['killed']} of {tried} killed, {others}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
