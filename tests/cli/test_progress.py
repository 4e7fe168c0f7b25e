"""What long work tells on a terminal, and nowhere else."""

from __future__ import annotations

import io
import logging
import sys
from types import SimpleNamespace

import pytest

from osimlite.cli import _progress
from osimlite.cli._progress import progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("stream", "second", "shows"),
    [(Terminal, 1.5, True), (Terminal, 0.5, False), (io.StringIO, 1.5, False)],
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


def test_people_see_what_the_engine_warns_of(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    log = logging.getLogger("osimlite.simulation.engines")
    monkeypatch.setattr(log, "handlers", [])
    _progress.show_engine_warnings()
    logging.getLogger("osimlite.simulation.engines.linking").warning("kernels run as Python")
    assert sys.stderr.getvalue() == "osimlite: kernels run as Python\n"
