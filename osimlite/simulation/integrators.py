"""The integrators with error control, and what they start with."""

from __future__ import annotations

from math import inf

from osimlite.base.text import or_known
from osimlite.errors import SettingError

MERSON = "merson"
INTEGRATORS = {
    MERSON: "RungeKuttaMerson",
    "euler2": "SemiExplicitEuler2",
    "adams": "Adams",
    "bdf": "BDF",
    "rosenbrock": "Rosenbrock",
}
"""The integrators with error control by the names that users give, which their kernels have, with
their own names: two of Simbody's, of which OpenSim takes the first, and those for stiff motion.
"""

DEFAULT_ACCURACY = 1e-3
LOOSE = 1e-2
"""The loosest accuracy that keeps motions near the model's own.

The walker ends within 0.01 rad of it after a second, by every integrator; at 0.1 it is 0.05 rad off
by Rosenbrock's method and 0.07 by Merson's.
"""
"""What OpenSim's Manager uses where no accuracy was set."""

INITIAL_STEP = 0.01
"""First step tried, s: a tenth of Simbody's default time scale."""
NO_BOUNDS = 0.0, inf
"""Of the lengths of steps, s."""


def check_integrator(name: str) -> None:
    """SettingError if there is no such integrator."""
    if name not in INTEGRATORS:
        raise SettingError(f"there is no integrator '{name}'{or_known(name, INTEGRATORS)}")
