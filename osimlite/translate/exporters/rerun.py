"""A recording for the viewer of Rerun."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.translate.exporters import Exporter

if TYPE_CHECKING:
    from osimlite.view.shown import Shown


def _write(shown: Shown, path: Path) -> str:
    return f"{shown.write_rrd(path)} ({path.stat().st_size / 1e6:.1f} MB); look at it with: rerun {path}"


EXPORTER = Exporter("rerun", "view", "Write a recording for the Rerun viewer (.rrd).", _write)
