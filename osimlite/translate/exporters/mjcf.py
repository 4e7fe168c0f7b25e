"""MJCF, for MuJoCo."""

from __future__ import annotations

from typing import Any

from osimlite.base.choices import Choice
from osimlite.translate.exporters import Exporter


def _write(*model: Any, **choices: Any) -> Any:
    from osimlite.translate.mjcf.export import to_mjcf

    return to_mjcf(*model, **choices)


EXPORTER = Exporter(
    "mjcf",
    "translate",
    "<file>.xml for MuJoCo",
    _write,
    (
        Choice("mujoco", int | None, "The version to write for, 3 or 4.", shown="4", group="MJCF"),
        Choice(
            "contact", str | None,
            "'native' writes contact forces as contacts of MuJoCo's own law, 'none' leaves them out.", shown="native",
            group="MJCF",
        ),
        Choice(
            "fit", str | None,
            "'wraps' fits what tendons go around to the paths, 'force' muscles too (up to a minute).", shown="none",
            group="MJCF",
        ),
        Choice(
            "spline", str | None,
            "What joints follow that move by splines: a 'quartic', or 'series': a quartic of a quartic.",
            shown="series", group="MJCF",
        ),
        Choice(
            "driver", bool | None,
            "Write what osimlite.mjcf.Driver moves by OpenSim's own laws: the file itself has no forces.",
            group="MJCF", spelled=("--driver",),
        ),
    ),
)  # fmt: skip
