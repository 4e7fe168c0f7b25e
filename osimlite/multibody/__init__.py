"""From model to mechanism: a tree of bodies and mobilizers, its kinematics and dynamics in numpy."""

from __future__ import annotations

from osimlite._require import require

require("numpy", extra="sim", purpose="a mechanism")

from osimlite.multibody.build import build_mechanism  # noqa: E402
from osimlite.multibody.dynamics import Wrench  # noqa: E402
from osimlite.multibody.mechanism import Mechanism  # noqa: E402

__all__ = ["Mechanism", "Wrench", "build_mechanism"]
