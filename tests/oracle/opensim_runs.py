"""What OpenSim's own programs make of a file, or of a state."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from osimlite.io.tables.storage import StoTable, read_sto


def put(coordinates: Iterable[Any], state: Any, q: Iterable[float], u: Iterable[float]) -> None:
    """Values and speeds of OpenSim's coordinates into a state; locked ones keep their values."""
    for coordinate, value, speed in zip(coordinates, q, u, strict=True):
        if not coordinate.getLocked(state):
            coordinate.setValue(state, float(value), False)
        coordinate.setSpeedValue(state, float(speed))


def simulated(path: Path, to: float, accuracy: float, *, equilibrate: bool = False) -> StoTable:
    """The states of a model over time, from its default state, or one with all muscles in equilibrium."""
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(path))
    state = model.initSystem()
    if equilibrate:
        model.equilibrateMuscles(state)
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    manager.integrate(to)
    table = path.with_suffix(".sto")
    opensim.STOFileAdapter.write(manager.getStatesTable(), str(table))
    return read_sto(table)


def inverse_dynamics(
    model: str,
    motion: str,
    loads: str | None = None,
    *,
    to: float = 1.0,
    lowpass: float = -1.0,
    exclude: str = "ALL",
) -> StoTable:
    """The forces that a motion takes, some forces of the model left aside; files are in the current folder."""
    import opensim

    opensim.Logger.setLevelString("off")
    tool: Any = opensim.InverseDynamicsTool()
    tool.setModelFileName(model)
    tool.setCoordinatesFileName(motion)
    if loads is not None:
        tool.setExternalLoadsFileName(loads)
    tool.setStartTime(0.0)
    tool.setEndTime(to)
    tool.setLowpassCutoffFrequency(lowpass)
    tool.setOutputGenForceFileName("forces.sto")
    tool.setResultsDir(".")
    excluded = opensim.ArrayStr()
    excluded.append(exclude)
    tool.setExcludedForces(excluded)
    assert tool.run()
    return read_sto("forces.sto")
