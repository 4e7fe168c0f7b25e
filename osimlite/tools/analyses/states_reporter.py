"""OpenSim's StatesReporter: all states."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import UNITS
from osimlite.schema.tools.analyses import StatesReporter
from osimlite.tools.motion import Motion, Tables

_DESCRIPTION = f"\nThis file contains the states of a model during a simulation.\n\n{UNITS}"


def compute(analysis: StatesReporter, motion: Motion, tables: Tables) -> None:
    """Write the states in OpenSim's order."""
    states = motion.histories
    tables.add(
        "states",
        "ModelStates",
        list(states),
        np.column_stack([*states.values()]),
        description=_DESCRIPTION,
    )
