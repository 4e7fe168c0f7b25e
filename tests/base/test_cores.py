"""Tests of `count_cores`, the number of cores that this process may use."""

from __future__ import annotations

import os
import sys

import pytest

from osimlite.base.cores import count_cores


@pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux tells which cores a process was given"
)
def test_only_cores_that_this_process_was_given_count() -> None:
    given = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(given)})
        assert count_cores() == 1
    finally:
        os.sched_setaffinity(0, given)


def test_elsewhere_all_that_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setattr("os.cpu_count", lambda: 7)
    assert count_cores() == 7


def test_nobody_else_asks() -> None:
    from pathlib import Path

    import osimlite

    package = Path(osimlite.__file__).parent
    asking = [
        file for file in package.rglob("*.py") if "cpu_count" in file.read_text(encoding="utf-8")
    ]
    assert [file.name for file in asking] == ["cores.py"]
