"""Machine code in files: found again, not taken when damaged or of other sources; and what is done without a folder."""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import subprocess
import sys

import pytest

pytest.importorskip("numba", reason="needs numba (extra 'sim')")

from osimlite.simulation.engines import object_code

TEXT = """
declare void @numba_never_there()
define i64 @answer(i64 %x) {
  %wrong = icmp eq i64 %x, 7
  br i1 %wrong, label %bad, label %good
bad:
  call void @numba_never_there()
  br label %good
good:
  %y = mul i64 %x, 6
  ret i64 %y
}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(object_code.FOLDER, str(tmp_path / "new" / "folder"))
    monkeypatch.setattr(object_code, "_folders", lambda: [tmp_path / "new" / "folder"])
    return tmp_path / "new" / "folder"


def run(address):
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(address)(8)


def test_what_is_stored_is_found_again(folder):
    assert object_code.load("answer", "one") is None
    assert run(object_code.keep("answer", "one", object_code.translated(TEXT), "answer")) == 48
    (kept,) = folder.iterdir()
    assert run(object_code.load("answer", "one")) == 48
    # Of other sources.
    assert object_code.load("answer", "two") is None
    assert kept.stat().st_mode & 0o077 == 0 and folder.stat().st_mode & 0o077 == 0
    code = kept.read_bytes().partition(b"\n")[2]
    fitting = {"sha256": hashlib.sha256(code).hexdigest()}
    heads = [{}, [], None, "x", fitting, *({**fitting, "symbol": it} for it in (None, 5, ["answer"], {}, "elsewhere"))]
    heads += [{**fitting, "sha256": [fitting["sha256"]], "symbol": "answer"}]
    for damaged in (
        *(kept.read_bytes()[:-8], b"", b"[" * 100_000 + b"\n" + code),
        *(json.dumps(head).encode() + b"\n" + code for head in heads),
    ):
        kept.write_bytes(damaged)
        assert object_code.load("answer", "one") is None
    assert run(object_code.keep("answer", "one", object_code.translated(TEXT), "answer")) == 48
    assert run(object_code.load("answer", "one")) == 48


def test_without_a_folder(tmp_path, monkeypatch, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setattr(object_code, "_folders", lambda: [blocked / "inside"])
    object_code._tell_once.cache_clear()
    for _ in range(2):
        assert run(object_code.keep("answer", "one", object_code.translated(TEXT), "answer")) == 48
    (told,) = caplog.messages
    assert "compiled anew in every run" in told and str(blocked) in told


@pytest.mark.parametrize("mode", [0o775, 0o757, 0o1777])
def test_code_that_others_could_have_written_is_neither_run_nor_kept(folder, caplog, mode):
    """Whoever can write there can choose a checksum that fits."""
    object_code.keep("answer", "one", object_code.translated(TEXT), "answer")
    folder.chmod(mode)
    assert object_code.load("answer", "one") is None
    object_code._tell_once.cache_clear()
    (kept,) = folder.iterdir()
    kept.unlink()
    assert run(object_code.keep("answer", "one", object_code.translated(TEXT), "answer")) == 48
    assert not list(folder.iterdir()) and f"'{folder}' can be written by others" in caplog.text


def test_folders(monkeypatch, tmp_path):
    """The one that is named, or the package's own and then the user's."""
    monkeypatch.setenv(object_code.FOLDER, str(tmp_path / "named"))
    assert list(object_code._folders()) == [tmp_path / "named"]
    monkeypatch.delenv(object_code.FOLDER)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    first, last = object_code._folders()
    assert (first.parent.name, last) == ("kernels", tmp_path / "home" / "osimlite")


def test_a_user_without_a_home(monkeypatch):
    """As in a container that runs under a number of no user."""
    for name in (object_code.FOLDER, "LOCALAPPDATA", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)

    def nowhere():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(object_code.Path, "home", nowhere)
    (only,) = object_code._folders()
    assert only.parent.name == "kernels"


def test_code_from_files_needs_no_compiler(walker):
    """With the machine code in files, the compiler is not even imported."""
    from osimlite.simulation import Simulation

    with Simulation(walker, "compiled") as simulation:
        simulation.run(0.01)
    program = (
        "import osimlite, sys; from osimlite.models.dynamic_walker import dynamic_walker; "
        "osimlite.simulate(dynamic_walker(), 0.1, engine='compiled'); print('numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=dict(os.environ))
    assert done.stdout.split() == ["False"], done.stderr
