"""A file of glTF, for Blender, slides and web pages."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.translate.exporters import Exporter

if TYPE_CHECKING:
    from osimlite.view.shown import Shown


def _write(shown: Shown, path: Path) -> str:
    return f"{shown.write_glb(path)} ({path.stat().st_size / 1e6:.1f} MB)"


EXPORTER = Exporter("glb", "view", "Write a file for Blender, slides and web pages (glTF).", _write)
