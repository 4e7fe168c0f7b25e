"""Mechanisms: trees of bodies and mobilizers that are built from models, computed with numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from osimlite.base.lazy import make_lazy_getattr
from osimlite.base.require import require

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.build import build_mechanism as build_mechanism
    from osimlite.mechanics.multibody.dynamics import Wrench as Wrench
    from osimlite.mechanics.multibody.mechanism import Mechanism as Mechanism

_NUMERIC = {
    "Mechanism": "osimlite.mechanics.multibody.mechanism",
    "Wrench": "osimlite.mechanics.multibody.dynamics",
    "build_mechanism": "osimlite.mechanics.multibody.build",
}
"""Names of this package whose modules need numpy, and these modules."""

_get = make_lazy_getattr(__name__, _NUMERIC)


def __getattr__(name: str) -> Any:
    # `from osimlite.mechanics.multibody import functions` asks for the name of a module too, before
    # it is imported. The linter needs such modules without numpy, so only the names above may ask
    # for it.
    if name in _NUMERIC:
        require("numpy", extra="sim", purpose="a mechanism")
    return _get(name)
