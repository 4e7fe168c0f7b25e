"""From model to mechanism: a tree of bodies and mobilizers, what the kernels find of it in numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from osimlite._lazy import imported_when_used
from osimlite._require import require

if TYPE_CHECKING:
    from osimlite.multibody.build import build_mechanism as build_mechanism
    from osimlite.multibody.dynamics import Wrench as Wrench
    from osimlite.multibody.mechanism import Mechanism as Mechanism

_get = imported_when_used(
    __name__,
    {
        "Mechanism": "osimlite.multibody.mechanism",
        "Wrench": "osimlite.multibody.dynamics",
        "build_mechanism": "osimlite.multibody.build",
    },
)


def __getattr__(name: str) -> Any:
    # The linter asks which joint carries which body, without numpy.
    if not name.startswith("_"):
        require("numpy", extra="sim", purpose="a mechanism")
    return _get(name)
