"""What is told of a simulation in its summary, as JSON-ready data."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from osimlite.simulation.engines.protocol import Engine
from osimlite.simulation.recorder import Recorder
from osimlite.simulation.stepper import Stepper

Moment = tuple[float, list[float]]
"""Time (s) and state in the engine's order."""


def integration_summary(
    stepper: Stepper, settings: Mapping[str, Any], wall: float
) -> dict[str, Any]:
    """How a motion was followed.

    Args:
        stepper: at the end of it.
        settings: what was asked for.
        wall: how long it took, s.
    """
    return {
        "integrator": stepper.name,
        "settings": dict(settings),
        "steps": stepper.taken,
        "attempted_steps": stepper.attempted,
        "evaluations": stepper.evaluations,
        "wall_time_s": wall,
        "interrupted": stepper.ended is not None,
        "time_reached_s": stepper.time,
    }


def result_summary(
    engine: Engine, recorder: Recorder, start: Moment, end: Moment
) -> dict[str, Any]:
    """What became of a motion: its energies at both ends, when contacts began and ended, and how hard they pushed.

    Args:
        engine: that computed it.
        recorder: that watched it.
        start: its first moment.
        end: its last one.
    """
    return {
        "energy_J": {"start": energies(engine, *start), "end": energies(engine, *end)},
        "contact_events": [
            {
                "time_s": event.time,
                "contact": event.contact,
                "event": "begin" if event.begins else "end",
            }
            for event in recorder.events()
        ],
        "largest_contact_forces": {
            name: {"force_N": size, "time_s": t}
            for name, (size, t) in recorder.largest_forces().items()
        },
    }


def energies(engine: Engine, t: float, y: list[float]) -> dict[str, float]:
    """Energies at a time (s) in a state, J."""
    kinetic, gravity, stored = engine.energies(t, y)
    return {
        "kinetic": kinetic,
        "potential": gravity + stored,
        "gravity": gravity,
        "stored": stored,
        "total": kinetic + gravity + stored,
    }


def versions(engine: Engine) -> dict[str, str]:
    """Versions of what computed a motion."""
    from osimlite import __version__

    return {"osimlite": __version__, "engine": engine.version, "python": sys.version.split()[0]}
