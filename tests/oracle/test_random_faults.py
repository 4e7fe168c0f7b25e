"""Compare the linter's findings in projects with one random fault with what OpenSim's tools do.

Where OpenSim rejects the project or crashes, there must be a finding at the fault. Where it
computes the same results, no finding may claim a rejection. The quick suite has 6 faults, the full
one 40. ``OSIMLITE_FAULTS=1000 OSIMLITE_SEED=7`` sets their number and the seed.
"""

from __future__ import annotations

import json
import os
import random
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from tests.lint.project_faults import UNKNOWABLE, faults
from tests.lint.projects import Fault, Project, pendulum, walking
from tests.lint.support import Folder, in_place
from tests.oracle.opensim_tools import LOG
from tests.suite import choose

pytestmark = pytest.mark.oracle

WANTED = int(os.environ.get("OSIMLITE_FAULTS", choose("6", "40")))
SEED = int(os.environ.get("OSIMLITE_SEED", "1"))
VERDICTS = ("hangs", "crashes", "raises", "false", "changes", "tells", "nothing")
"""What OpenSim may do with a fault, worst first."""

UNSOLVED = re.compile("Optimizer could not find a solution")
"""Message of a tool that accepts the project but finds no motion for it."""

LOST = {
    "OSIM003": "a tool reads a file as the class that it wants, whatever its tag; OpenSim alone refuses the file",
    "OSIM101": "the element says other than the default; of a default that does the same the rule tells a warning",
    "OSIM102": "an object is left out; whether its work is missed shows in other projects",
    "OSIM104": "the second says other than the first; of one that says the same the rule tells a warning",
    "OSIM201": "OpenSim takes another value than is written; the results of this project do not show it",
    "OSIM203": "OpenSim takes another number than is written; the results of this project do not show it",
    "OSIM205": "nothing is smaller than NaN: a range of times that begins with it may be all there are",
    "OSIM803": "the table does not say whether it is read for angles: forces have none",
    "OSIM806": "rows are lost; whether the times of the tool need them is not said in the table",
    "OSIM807": "a row is lost, as above, with its time",
}
"""Errors about content that OpenSim loses, and why they are right although the results are equal."""

Ask = Callable[[Path, str, str], dict[str, Any]]


@pytest.fixture(scope="session")
def opensim_runs() -> Iterator[Ask]:
    """Return a function that runs a tool in a folder, given its class and its setup file."""
    command = [sys.executable, "-W", "ignore", "-m", "tests.oracle.opensim_tools"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None and process.stdout is not None

        def ask(folder: Path, kind: str, setup: str) -> dict[str, Any]:
            assert process.stdin is not None and process.stdout is not None
            process.stdin.write(
                json.dumps({"folder": str(folder), "kind": kind, "setup": setup}) + "\n"
            )
            process.stdin.flush()
            answer: dict[str, Any] = json.loads(process.stdout.readline())
            return answer

        yield ask
        process.stdin.close()


class Tools:
    """The tools of a project, run by OpenSim, with their results without a fault."""

    def __init__(self, path: Path, project: Project, ask: Ask) -> None:
        self.path, self.project, self.ask = path, project, ask
        path.mkdir()
        self.kinds = {
            name: text.elements[1].tag
            for name, text in project.documents.items()
            if re.fullmatch(r"\w*Tool|IMUPlacer|MocoStudy", text.elements[1].tag)
        }
        self.faultless = {name: self.run(name, project.texts) for name in self.kinds}
        assert all(answer["end"] == "done" for answer, _ in self.faultless.values()), self.faultless

    def run(
        self, setup: str, texts: dict[str, str | None] | dict[str, str]
    ) -> tuple[dict[str, Any], dict[str, str]]:
        """Run a setup on the given files in an empty folder.

        Returns:
            The answer of `tests.oracle.opensim_tools`, and the texts of the files that OpenSim
            wrote.
        """
        for file in sorted(self.path.rglob("*"), reverse=True):
            file.rmdir() if file.is_dir() else file.unlink()
        for name, text in texts.items():
            if text is not None:
                (self.path / name).write_bytes(text.encode())
        answer = self.ask(self.path, self.kinds[setup], setup)
        files = (file for file in self.path.rglob("*") if file.is_file() and file.name != LOG)
        written = {
            str(file.relative_to(self.path)): file.read_text(errors="replace") for file in files
        }
        return answer, {name: text for name, text in written.items() if texts.get(name) != text}

    def verdict(self, fault: Fault, draw: random.Random) -> tuple[str, str]:
        """Run up to two setups with a fault in OpenSim.

        Returns:
            The worst of the `VERDICTS`, and OpenSim's message.
        """
        asked = [
            name
            for name in self.kinds
            if name == fault.file or name in self.project.users(fault.file)
        ]
        ends = []
        for setup in draw.sample(asked, min(2, len(asked))):
            answer, written = self.run(setup, {**self.project.texts, **fault.texts})
            before, results = self.faultless[setup]
            told = [line for line in answer["log"] if line not in before["log"]]
            end, said = answer["end"], answer["message"] or "; ".join(told)
            # A solver that is still iterating has accepted the project.
            if (end == "false" and UNSOLVED.search(said)) or (
                end == "hangs" and self.kinds[setup] == "MocoStudy"
            ):
                end = "changes"
            if end == "done":
                end = (
                    "changes"
                    if not same_results(results, written)
                    else "tells"
                    if told
                    else "nothing"
                )
            ends.append((VERDICTS.index(end), f"{setup}: {said}"))
        if not ends:
            return "nothing", "no tool uses it"
        worst, said = min(ends)
        return VERDICTS[worst], said


def same_results(before: dict[str, str], after: dict[str, str]) -> bool:
    """Return whether files hold the same words and numbers, ignoring the headers of tables."""
    return before.keys() == after.keys() and all(
        _same(before[name], after[name]) for name in before
    )


def _same(before: str, after: str) -> bool:
    words, others = (text.rpartition("endheader")[2].split() for text in (before, after))
    return len(words) == len(others) and all(map(_close, words, others))


def _close(word: str, other: str) -> bool:
    if word == other:
        return True
    try:
        return abs(float(word) - float(other)) <= 1e-6 * max(1.0, abs(float(word)))
    except ValueError:
        return False


@pytest.mark.timeout(7200)
@pytest.mark.parametrize("project", [walking, pendulum], ids=["walking", "pendulum"])
def test_what_opensim_refuses_is_found(project, opensim_runs, tmp_path):
    (tmp_path / "lint").mkdir()
    folder = Folder(tmp_path / "lint", project())
    tools = Tools(tmp_path / "opensim", folder.project, opensim_runs)
    draw = random.Random(SEED)
    counts: Counter[tuple[str, str, str]] = Counter()
    wrong = []
    for fault in islice(faults(folder.project, draw), WANTED // 2):
        verdict, said = tools.verdict(fault, draw)
        findings = folder.found(fault)
        result = in_place(fault, findings)
        worst = (
            "error"
            if any(f.severity == "error" for f in result)
            else "finding"
            if result
            else "none"
        )
        counts[fault.kind, verdict, worst] += 1
        refused = verdict in ("hangs", "crashes", "raises", "false")
        if (
            refused or (verdict == "changes" and (fault.sure or fault.kind not in UNKNOWABLE))
        ) and not result:
            wrong.append(
                f"MISSED {verdict} {fault.kind} {fault.what}\n  {said[:300]}\n  {sorted(fault.places)}"
            )
            wrong += [f"  elsewhere: {f}" for f in findings[:2]]
        alarms = [f for f in result if f.severity == "error" and f.code not in LOST]
        if verdict == "nothing" and alarms:
            wrong.append(f"ALARM {fault.kind} {fault.what}\n  {said[:300]}")
            wrong += [f"  {f}" for f in alarms]
    print(*(f"{number:5d} {' '.join(key)}" for key, number in sorted(counts.items())), sep="\n")
    assert not wrong, f"{counts}\n" + "\n".join(wrong)
