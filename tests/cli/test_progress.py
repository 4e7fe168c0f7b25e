"""What long work tells on a terminal, and nowhere else."""

from __future__ import annotations

import io
import logging
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from osimlite.cli import _progress
from osimlite.cli._progress import progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("stream", "second", "shows"), [(Terminal, 1.5, True), (Terminal, 0.5, False), (io.StringIO, 1.5, False)]
)
def test_bar(monkeypatch, stream, second, shows):
    clock = iter((0.0, second, second + 0.05, second + 0.2))
    monkeypatch.setattr(_progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", stream())
    with progress_bar("walking", 4.0) as progress:
        progress(1.0)
        if shows:
            progress(3.0)
    text = sys.stderr.getvalue()
    assert ("walking" in text and "25 %" in text) is shows
    # Two calls within a tenth of a second draw once.
    assert "75 %" not in text
    assert shows or not text


def test_who_waits_for_the_compiler_sees_how_far_it_is(monkeypatch):
    clock = iter((0.0, 0.1, 1.5, 3.0))
    monkeypatch.setattr(_progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    log = logging.getLogger("osimlite.simulation.engines.machine_code")
    monkeypatch.setattr(log, "handlers", [])
    monkeypatch.setattr(log, "level", log.level)
    _progress.tell_of_compiling()
    for part in (0.0, 0.25, 1.0):
        log.info("a law", extra={"part": part})
    text = sys.stderr.getvalue()
    assert text.count("it takes some ten seconds") == 1 and "25 %" in text and "100 %" in text


@pytest.mark.parametrize("is_terminal", [True, False])
def test_who_waits_for_the_compiler_is_told_once(tmp_path, is_terminal):
    pytest.importorskip("numba", reason="needs numba (extra 'sim')")
    pty = pytest.importorskip("pty", reason="needs terminals as POSIX has them")
    ours, theirs = pty.openpty()
    script = (
        "import sys; from osimlite.cli import main; sys.argv = ['osimlite', 'build', 'dynamic-walker', '-o', '-']\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "from osimlite.simulation.engines.machine_code import address_of\n"
        "address_of('place_drift'), address_of('contact_places')\n"
    )
    run = [sys.executable, "-c", script]
    kept = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    for words in (["compiling the engine"] if is_terminal else [], []):
        done = subprocess.run(
            run, env=kept, stdout=subprocess.PIPE, stderr=theirs if is_terminal else subprocess.PIPE, check=True
        )
        os.write(theirs, b"end\n")
        text = os.read(ours, 10_000).decode() + (done.stderr or b"").decode()
        assert text.count("osimlite: ") == len(words) and all(word in text for word in words), text
