"""Check a kit of docs/adoption against its project and against OpenSim.

    python benchmarks/adoption.py opensim-org-opensim-models CLONE

A kit has settings of the linter, a workflow and patches for a public project. CLONE is a clone of
the project at the commit of the kit; at the end it is as before.

The script lints the project with the settings of the kit and prints the number of findings. Then it
applies the patches one by one. For each it prints which findings disappear, and whether OpenSim
reads the changed files as before. A patch says in its text whether it does; the exit code is 1 if
one of them is wrong.
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
from osimlite.base.text import format_count
from osimlite.lint import Config, Finding
from osimlite.lint.many import check_files
from osimlite.lint.project_files import find_project_files

KITS = Path(__file__).resolve().parents[1] / "docs" / "adoption"
"""Folder of all kits."""

UNCHANGED_NOTE = "OpenSim 4.6 reads: as before"
"""Line of a patch after which OpenSim reads the same from the files."""

TIME_LIMIT_S = 120
"""Time limit (s) for OpenSim to read a file."""

NUMBER_TOLERANCE = 1e-12
"""Relative and absolute tolerance of numbers that OpenSim reads or computes."""


def run_git(*arguments: object) -> str:
    """Run git in the working folder, and return its output."""
    return subprocess.run(
        ["git", *map(str, arguments)], check=True, capture_output=True, text=True
    ).stdout.strip()


def read_commit(kit: Path) -> str:
    """Return the commit of the project for which a kit was made; its README.md names only one."""
    text = (kit / "README.md").read_text(encoding="utf-8")
    (commit,) = set(re.findall(r"\b[0-9a-f]{40}\b", text))
    return commit


def check_commit(kit: Path) -> None:
    """Stop if the clone in the working folder is not at the commit of a kit."""
    commit = read_commit(kit)
    assert run_git("rev-parse", "HEAD") == commit, f"the kit is for {commit}"


def find_findings(kit: Path) -> list[Finding]:
    """Lint the files that the workflow of a kit checks, without its baseline."""
    workflow = (kit / "models.yml").read_text(encoding="utf-8")
    paths = re.findall(r"^ +paths: (.+)$", workflow, re.MULTILINE)
    files = find_project_files(paths[0].split(), only_ours=True)
    return list(check_files(files, Config()).findings)


def count_rules(findings: Iterable[Finding]) -> Counter[str]:
    """Return the number of findings of each rule."""
    return Counter(finding.code for finding in findings)


def format_counts(counts: Counter[str], number_format: str = "") -> str:
    """Return rules and numbers of findings in one line, without rules that have none."""
    return ", ".join(
        f"{code} {count:{number_format}}" for code, count in sorted(counts.items()) if count
    )


@contextmanager
def use_settings(kit: Path) -> Iterator[None]:
    """Put the linter's settings of a kit into the working folder for a while."""
    shutil.copy(kit / "osimlite.toml", ".")
    try:
        yield
    finally:
        # The clone must be as before.
        os.remove("osimlite.toml")


def read_file(file: str) -> dict[str, Any]:
    """Read a file with OpenSim.

    Returns:
        Under "print" what OpenSim prints of the object, or labels and row lengths of a table. Under
        "numbers" the values of a table, or the positions of bodies and the state derivative of a
        model.
    """
    import opensim

    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    suffix = file.lower()
    if suffix.endswith(".trc"):
        return read_marker_file(opensim.MarkerData(file))
    if suffix.endswith(TABLE_SUFFIXES):
        return read_table(opensim.Storage(file))
    if suffix.endswith(".osim"):
        return read_model(opensim.Model(file))
    content = opensim.OpenSimObject.makeObjectFromFile(file)
    return {"print": None if content is None else content.dump()}


def read_marker_file(markers: Any) -> dict[str, Any]:
    """Return the number of frames and all coordinates of an OpenSim ``MarkerData``.

    Returns:
        Entries "print" and "numbers" as in `read_file`.
    """
    frames = [markers.getFrame(i) for i in range(markers.getNumFrames())]
    points = [frame.getMarker(i) for frame in frames for i in range(markers.getNumMarkers())]
    return {
        "print": len(frames),
        "numbers": [point.get(axis) for point in points for axis in range(3)],
    }


def read_table(table: Any) -> dict[str, Any]:
    """Return the labels and the numbers of an OpenSim ``Storage``.

    Returns:
        Entries "print" and "numbers" as in `read_file`.
    """
    labels = [table.getColumnLabels().get(i) for i in range(table.getColumnLabels().size())]
    vectors = [table.getStateVector(i) for i in range(table.getSize())]
    rows = [
        [vector.getTime(), *(vector.getData().get(i) for i in range(vector.getSize()))]
        for vector in vectors
    ]
    return {
        "print": [labels, [len(row) for row in rows]],
        "numbers": [number for row in rows for number in row],
    }


def read_model(model: Any) -> dict[str, Any]:
    """Return what an OpenSim ``Model`` prints, and what it computes at its default state.

    Returns:
        Entries "print" and "numbers" as in `read_file`.
    """
    state = model.initSystem()
    model.realizeAcceleration(state)
    bodies = model.getBodySet()
    positions = [bodies.get(i).getPositionInGround(state) for i in range(bodies.getSize())]
    numbers = [position.get(axis) for position in positions for axis in range(3)]
    # A model may print as before and still compute something else.
    return {"print": model.dump(), "numbers": numbers + state.getYDot().to_numpy().tolist()}


def read_in_process(file: str) -> dict[str, Any]:
    """Read a file with OpenSim in a process of its own, because OpenSim may crash.

    Returns:
        The entries of `read_file`, or under "print" the error.
    """
    # OpenSim writes files beside those that it reads; the folder is copied to keep the clone clean.
    with TemporaryDirectory() as folder:
        copy = shutil.copytree(Path(file).parent, Path(folder) / "copy") / Path(file).name
        process = subprocess.run(
            [sys.executable, __file__, "--read", str(copy)],
            capture_output=True,
            text=True,
            check=False,
            timeout=TIME_LIMIT_S,
            cwd=copy.parent,
        )
    if process.returncode:
        return {"print": f"refused: {' '.join(process.stderr.strip().splitlines()[-2:])}"}
    return json.loads(process.stdout)


def count_differences(before: dict[str, Any], after: dict[str, Any]) -> tuple[int, int]:
    """Count the differences of a file that OpenSim has read twice.

    Args:
        before: result of `read_file` before a change.
        after: result of `read_file` after it.

    Returns:
        The number of lines of OpenSim's print that differ, and the number of numbers that differ by
        more than `NUMBER_TOLERANCE`; NaN equals NaN.
    """
    line_count = 0
    if before["print"] != after["print"]:
        lines_before = Counter(str(before["print"]).splitlines())
        lines_after = Counter(str(after["print"]).splitlines())
        removed = (lines_before - lines_after).total()
        added = (lines_after - lines_before).total()
        # Lines in another order are one difference.
        line_count = max(removed, added, 1)
    numbers_before = np.array(before.get("numbers", []))
    numbers_after = np.array(after.get("numbers", []))
    if numbers_before.shape != numbers_after.shape:
        return line_count, max(numbers_before.size, numbers_after.size)
    is_close = np.isclose(
        numbers_before,
        numbers_after,
        rtol=NUMBER_TOLERANCE,
        atol=NUMBER_TOLERANCE,
        # A number that stays undefined is no difference.
        equal_nan=True,
    )
    return line_count, int(np.sum(~is_close))


def list_changed_files(patch: Path) -> list[str]:
    """Return the files that a patch changes."""
    # Each line has the numbers of added and deleted lines, and the file.
    return [line.split("\t")[2] for line in run_git("apply", "--numstat", patch).splitlines()]


def check_patch(
    patch: Path, kit: Path, findings: list[Finding], before: list[dict[str, Any]]
) -> tuple[list[Finding], bool]:
    """Print the effects of a patch that has been applied, and compare them with its note.

    Args:
        patch: patch of the kit.
        kit: folder of the kit.
        findings: findings before the patch.
        before: result of `read_in_process` for each changed file before the patch.

    Returns:
        The findings after the patch, and whether the patch says correctly if OpenSim reads the
        files as before.
    """
    files = list_changed_files(patch)
    after = [read_in_process(file) for file in files]
    differences = [count_differences(*pair) for pair in zip(before, after, strict=True)]
    line_count = sum(lines for lines, _ in differences)
    number_count = sum(numbers for _, numbers in differences)
    is_unchanged = line_count == number_count == 0
    note = patch.read_text(encoding="utf-8", errors="replace")
    is_right = is_unchanged == (UNCHANGED_NOTE in note)
    new_findings = find_findings(kit)
    change = count_rules(new_findings)
    change.subtract(count_rules(findings))
    effect = (
        "OpenSim reads the same"
        if is_unchanged
        else f"OpenSim reads {format_count(line_count, 'line')} and "
        f"{format_count(number_count, 'number')} differently"
    )
    contradiction = "" if is_right else ", WHICH THE PATCH DOES NOT SAY"
    print(
        f"{patch.name}: {format_count(len(files), 'file')}, {format_counts(change, '+d')}; "
        f"{effect}{contradiction}"
    )
    return new_findings, is_right


def check_kit(name: str, clone: str) -> int:
    """Check the findings and all patches of a kit.

    Args:
        name: folder of the kit in docs/adoption.
        clone: folder of the clone, which becomes the working folder.

    Returns:
        The exit code: 1 if a patch says something wrong, 0 otherwise.
    """
    kit = (KITS / name).resolve()
    os.chdir(clone)
    check_commit(kit)
    exit_code = 0
    applied: list[Path] = []
    with use_settings(kit):
        findings = find_findings(kit)
        severities = Counter(str(finding.severity) for finding in findings)
        print(", ".join(f"{count} {severity}" for severity, count in sorted(severities.items())))
        print(format_counts(count_rules(findings)))
        try:
            # The later patches change the files that the earlier ones have changed.
            for patch in sorted(kit.glob("*.patch")):
                before = [read_in_process(file) for file in list_changed_files(patch)]
                # All parts of the patch must fit before any file changes.
                run_git("apply", "--check", patch)
                run_git("apply", patch)
                applied.append(patch)
                findings, is_right = check_patch(patch, kit, findings, before)
                if not is_right:
                    exit_code = 1
            print(f"left: {format_counts(count_rules(findings))}")
        finally:
            # A later patch may change the lines of an earlier one.
            for patch in reversed(applied):
                run_git("apply", "-R", patch)
    return exit_code


def main() -> int:
    """Run the command line."""
    arguments = sys.argv[1:]
    if arguments[:1] == ["--read"]:
        # This is the process of `read_in_process`.
        print(json.dumps(read_file(arguments[1])))
        return 0
    if len(arguments) != 2:
        sys.exit(__doc__)
    return check_kit(*arguments)


if __name__ == "__main__":
    sys.exit(main())
