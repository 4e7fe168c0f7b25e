"""Check a kit of docs/adoption again.

Usage: python benchmarks/adoption.py opensim-org-opensim-models CLONE

Counts what the linter finds by the settings of the kit, applies its patches one by one, tells which
findings each takes away, and asks OpenSim what it reads before and after. The clone must be at the
commit of the kit; in the end it is as it was.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from osimlite.base.files import TABLE_SUFFIXES
from osimlite.lint import Config, Finding
from osimlite.lint.many import check_files
from osimlite.lint.project_files import find_project_files

KITS = Path(__file__).resolve().parents[1] / "docs" / "adoption"
AS_BEFORE = "OpenSim 4.6 reads: as before"
SECONDS = 120
NEAR = 1e-12


def git(*arguments: object) -> str:
    """Run git in the working folder; returns what it prints."""
    return subprocess.run(
        ["git", *map(str, arguments)], check=True, capture_output=True, text=True
    ).stdout.strip()


def findings_of(kit: Path) -> list[Finding]:
    """What the workflow of a kit checks, without its baseline."""
    paths = re.findall(
        r"^ +paths: (.+)$", (kit / "models.yml").read_text(encoding="utf-8"), re.MULTILINE
    )
    return list(
        check_files(find_project_files(paths[0].split(), only_ours=True), Config()).findings
    )


def counted(findings: Iterable[Finding]) -> Counter[str]:
    """How often each rule speaks."""
    return Counter(finding.code for finding in findings)


def shown(counts: Counter[str], form: str = "") -> str:
    """Rules and how often they speak, in one line."""
    return ", ".join(f"{code} {count:{form}}" for code, count in sorted(counts.items()) if count)


@contextmanager
def settings_of(kit: Path) -> Iterator[None]:
    """The settings of a kit in the working folder."""
    shutil.copy(kit / "osimlite.toml", ".")
    try:
        yield
    finally:
        os.remove("osimlite.toml")


def read(file: str) -> dict[str, Any]:
    """What OpenSim makes of a file: its print or its numbers; of a model also where its bodies are and its rates."""
    import opensim

    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    if file.lower().endswith(".trc"):
        markers = opensim.MarkerData(file)
        frames = [markers.getFrame(i) for i in range(markers.getNumFrames())]
        seen = [frame.getMarker(i) for frame in frames for i in range(markers.getNumMarkers())]
        return {
            "print": len(frames),
            "numbers": [marker.get(axis) for marker in seen for axis in range(3)],
        }
    if file.lower().endswith(TABLE_SUFFIXES):
        table = opensim.Storage(file)
        labels = [table.getColumnLabels().get(i) for i in range(table.getColumnLabels().size())]
        rows = [table.getStateVector(i) for i in range(table.getSize())]
        cells = [
            [row.getTime(), *(row.getData().get(i) for i in range(row.getSize()))] for row in rows
        ]
        return {
            "print": [labels, [len(row) for row in cells]],
            "numbers": [cell for row in cells for cell in row],
        }
    if not file.lower().endswith(".osim"):
        found = opensim.OpenSimObject.makeObjectFromFile(file)
        return {"print": None if found is None else found.dump()}
    model = opensim.Model(file)
    state = model.initSystem()
    model.realizeAcceleration(state)
    bodies = model.getBodySet()
    places = [bodies.get(i).getPositionInGround(state) for i in range(bodies.getSize())]
    numbers = [place.get(axis) for place in places for axis in range(3)]
    return {"print": model.dump(), "numbers": numbers + state.getYDot().to_numpy().tolist()}


def read_apart(file: str) -> dict[str, Any]:
    """The same from a process of its own, which may crash, and from a copy of the folder, into which OpenSim writes."""
    with TemporaryDirectory() as folder:
        copy = shutil.copytree(Path(file).parent, Path(folder) / "copy") / Path(file).name
        command = [sys.executable, __file__, "--read", str(copy)]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=SECONDS, cwd=copy.parent
        )
    if done.returncode:
        return {"print": f"refused: {' '.join(done.stderr.strip().splitlines()[-2:])}"}
    return json.loads(done.stdout)


def differences(before: dict[str, Any], after: dict[str, Any]) -> tuple[int, int]:
    """How many lines of OpenSim's print are others, and how many numbers by more than 1e-12; NaN is as good as NaN."""
    was, now = (Counter(str(found["print"]).splitlines()) for found in (before, after))
    lines = (
        0 if before["print"] == after["print"] else max((was - now).total(), (now - was).total(), 1)
    )
    one, other = (np.array(found.get("numbers", [])) for found in (before, after))
    if one.shape != other.shape:
        return lines, max(one.size, other.size)
    return lines, int(np.sum(~np.isclose(one, other, rtol=NEAR, atol=NEAR, equal_nan=True)))


def main(name: str, clone: str) -> int:
    kit = (KITS / name).resolve()
    os.chdir(clone)
    (commit,) = set(
        re.findall(r"\b[0-9a-f]{40}\b", (kit / "README.md").read_text(encoding="utf-8"))
    )
    assert git("rev-parse", "HEAD") == commit, f"the kit is for {commit}"
    wrong = 0
    applied: list[Path] = []
    with settings_of(kit):
        findings = findings_of(kit)
        severities = Counter(str(finding.severity) for finding in findings)
        print(", ".join(f"{count} {severity}" for severity, count in sorted(severities.items())))
        print(shown(counted(findings)))
        try:
            for patch in sorted(kit.glob("*.patch")):
                files = [
                    line.split("\t")[2] for line in git("apply", "--numstat", patch).splitlines()
                ]
                before = [read_apart(file) for file in files]
                git("apply", "--check", patch)
                git("apply", patch)
                applied.append(patch)
                lines, numbers = map(
                    sum, zip(*map(differences, before, map(read_apart, files)), strict=True)
                )
                same = lines == numbers == 0
                as_told = same == (AS_BEFORE in patch.read_text(encoding="utf-8", errors="replace"))
                wrong += not as_told
                earlier, findings = findings, findings_of(kit)
                change = counted(findings)
                change.subtract(counted(earlier))
                how = (
                    "read as before"
                    if same
                    else f"{lines} lines and {numbers} numbers are read otherwise"
                )
                print(f"{patch.name}: {len(files)} files, {shown(change, '+d')}; {how}", end="")
                print("" if as_told else ", WHICH IT DOES NOT SAY")
            print(f"left: {shown(counted(findings))}")
        finally:
            for patch in reversed(applied):
                git("apply", "-R", patch)
    return min(wrong, 1)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--read"]:
        print(json.dumps(read(sys.argv[2])))
    elif len(sys.argv) != 3:
        sys.exit(__doc__)
    else:
        sys.exit(main(*sys.argv[1:]))
