"""Folder with a project for tests of random faults."""

from __future__ import annotations

import os
from pathlib import Path

from osimlite.io.document.source import Source
from osimlite.lint.diagnostic import Finding
from osimlite.lint.engine import load_subject, make_subject, run_rules
from osimlite.lint.fixes import apply_fixes
from tests.lint.projects import Fault, Project


class Folder:
    """Folder with the files of a project, in which a test changes one fault at a time."""

    def __init__(self, path: Path, project: Project) -> None:
        self.path = path
        self.project = project
        for name, text in project.texts.items():
            (path / name).write_bytes(text.encode())
        self.now = 0

    def check(self, *files: str) -> list[Finding]:
        """Return the findings in those of the files that exist."""
        return [
            f
            for name in files
            if (self.path / name).exists()
            for f in run_rules(load_subject(str(self.path / name)))
        ]

    def put(self, texts: dict[str, str | None]) -> None:
        # The cache recognises files by size and time. Files of equal size that are written within
        # one tick of the clock would look unchanged.
        self.now += 1
        for name, text in texts.items():
            if text is None:
                (self.path / name).unlink()
            else:
                (self.path / name).write_bytes(text.encode())
                os.utime(self.path / name, (self.now, self.now))

    def found(self, fault: Fault) -> list[Finding]:
        """Return the findings with a fault, in the file that it changes and in the files that refer to it."""
        self.put(fault.texts)
        files = {fault.file, *self.project.users(fault.file), *(file for file, _ in fault.places)}
        try:
            # Ignore missing mesh files, which the project does not contain.
            return [f for f in self.check(*sorted(files)) if f.code != "OSIM701"]
        finally:
            self.put({name: self.project.texts[name] for name in fault.texts})


def in_place(fault: Fault, findings: list[Finding]) -> list[Finding]:
    """Return the findings at a position where the fault may be reported."""
    return [f for f in findings if (Path(str(f.file)).name, f.line) in fault.places]


LINT = Path(__file__).resolve().parents[2] / "fixtures" / "lint"


MOTION = b"knee\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\ntime\tknee\thip\n0\t1\t2\n0.1\t1\t3\n0.2\t1\t4\n"


MARKERS = (LINT / "leg.trc").read_bytes().replace(b"Z3\t\n", b"Z3\n")


# Faults in a motion or marker file: name, valid content, pattern and its replacement.
BROKEN = [
    ("count", MOTION, rb"nRows=3", b"nRows=2"),
    ("count-of-columns", MOTION, rb"nColumns=3", b"nColumns=4"),
    ("count-missing", MOTION, rb"nRows=3", b"nRows="),
    ("count-without-its-mark", MOTION, rb"nColumns=3", b"nColumns3"),
    ("true", MOTION, rb"=yes", b"=true"),
    ("case-of-a-key", MOTION, rb"inDegrees", b"indegrees"),
    ("case-of-the-end", MOTION, rb"endheader", b"EndHeader"),
    ("no-end", MOTION, rb"endheader\n", b""),
    ("time", MOTION, rb"time", b"Time"),
    ("no-count-of-columns", MOTION.replace(b"inDegrees=yes\n", b""), rb"nColumns=3\n", b""),
    ("blank-lines", MOTION.replace(b"=1", b"=3", 1), rb"(?<=0.1\t1\t3\n)", b"\n\n"),
    ("mark", MARKERS, rb"^", b"\xef\xbb\xbf"),
    ("key", MARKERS, rb"NumMarkers", b"NumMarker"),
    ("count-of-markers", MARKERS, rb"(\d+\t\d+\t\d+\t)\d+\t", rb"\g<1>77\t"),
    ("frame", MARKERS, rb"Frame#", b"Frame"),
    ("axis", MARKERS, rb"Y2", b"Y1"),
    ("no-axes", MARKERS, rb"\t\tX1.*\n", b""),
    ("units", MARKERS, rb"\tmm?\t", lambda match: match[0].upper()),
    ("last-tabs", MARKERS, rb"(?m)^(\d.*\d)\t*$(?=\n\d|\n\Z)", rb"\1\t\t\t"),
]


def mend(name: str, data: bytes, *, unsafe: bool = False) -> bytes:
    for _ in range(5):
        source = Source(data, name)
        data, count = apply_fixes(source, run_rules(make_subject(source)), unsafe=unsafe)
        if not count:
            break
    return data
