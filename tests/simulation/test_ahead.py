"""Machine code that another process makes."""

from __future__ import annotations

import os
import sys
import time

import pytest

from osimlite.simulation.engines import ahead, linking, object_code

pytestmark = pytest.mark.skipif(not linking.has_compiler(), reason="numba is not installed")


def test_code_is_there_some_time_later(monkeypatch, tmp_path):
    monkeypatch.setenv(object_code.FOLDER, str(tmp_path / "code"))
    ahead.begin(["watch"])
    (process,) = ahead._begun
    assert process.wait(timeout=120.0) == 0
    (file,) = (tmp_path / "code").iterdir()
    assert file.name.startswith("watch-")


def test_only_one_process_compiles(monkeypatch, tmp_path):
    monkeypatch.setattr(object_code, "_folders", lambda: [tmp_path])
    with object_code.alone() as first, object_code.alone() as second:
        assert (first, second) == (True, False)
    with object_code.alone() as again:
        assert again


def test_what_a_process_left_behind_stops_nobody_for_long(monkeypatch, tmp_path):
    monkeypatch.setattr(object_code, "_folders", lambda: [tmp_path])
    (tmp_path / "compiling").touch()
    with object_code.alone() as first:
        assert not first
    old = time.time() - object_code.LONGEST - 10.0
    os.utime(tmp_path / "compiling", (old, old))
    with object_code.alone() as first:
        assert first


def test_where_code_can_be_kept_nowhere_nobody_compiles(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setattr(object_code, "_folders", lambda: [tmp_path / "file" / "inside"])
    with object_code.alone() as first:
        assert not first


def test_a_program_that_is_no_python_compiles_itself(monkeypatch):
    assert ahead.is_possible()
    monkeypatch.setattr(sys, "executable", "/opt/editor")
    assert not ahead.is_possible()


def test_what_is_missing_is_noted(monkeypatch):
    from osimlite.simulation.engines import machine_code

    monkeypatch.setattr(machine_code, "is_at_hand", lambda name: name != "watch")
    code = ahead.Later()
    assert code.chosen_for(["evaluate"]) is linking.COMPILED and not code.missing
    assert code.chosen_for(["evaluate", "watch"]) is linking.PYTHON and code.missing == ["watch"]
