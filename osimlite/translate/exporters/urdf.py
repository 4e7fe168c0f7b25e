"""URDF, for robotics."""

from __future__ import annotations

from typing import Any

from osimlite.base.choices import Choice
from osimlite.translate.exporters import Exporter


def _write(*model: Any, **choices: Any) -> Any:
    from osimlite.translate.export import to_urdf

    return to_urdf(*model, **choices)


EXPORTER = Exporter(
    "urdf",
    "translate",
    "<file>.urdf, and <file>.coordinates.json, which says how coordinates drive joints where URDF cannot",
    _write,
    (
        Choice(
            "limits", str | None, "'range' writes coordinate ranges as hard limits, which they are not in OpenSim.",
            shown="none", group="URDF",
        ),
        Choice(
            "merge", bool | None, "Make bodies that do not move relative to each other one link.", group="URDF",
            spelled=("--merge",),
        ),
        Choice(
            "collision", bool | None, "Write contact geometry as collision shapes (a half space as a large box).",
            group="URDF", spelled=("--collision",),
        ),
        Choice(
            "effort", float | None,
            "Greatest force (N, N m) of joints whose coordinate has no actuators that limit it.", shown="no limit",
            group="URDF",
        ),
        Choice("velocity", float | None, "Greatest rate (m/s, rad/s) of all joints.", shown="no limit", group="URDF"),
    ),
    usual=True,
)  # fmt: skip
