"""A picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.choices import Choice
from osimlite.translate.exporters import Exporter

if TYPE_CHECKING:
    from osimlite.view.shown import Shown

SIZE = (1200, 900)
"""Width and height, pixels."""


def _write(shown: Shown, path: Path, *, at: float | None) -> str:
    return str(shown.write_picture(path, SIZE, at))


EXPORTER = Exporter(
    "screenshot",
    "view",
    "Write a picture (.png); needs no display.",
    _write,
    (
        Choice(
            "at", float | None, "The moment of the screenshot.", unit="SECONDS", shown="the first"
        ),
    ),
)
