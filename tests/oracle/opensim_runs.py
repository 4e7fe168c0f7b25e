"""Functions that set OpenSim states and run OpenSim's integrator and inverse dynamics."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from osimlite.io.tables.storage import StoTable, read_sto


def put(coordinates: Iterable[Any], state: Any, q: Iterable[float], u: Iterable[float]) -> None:
    """Set values and speeds of OpenSim's coordinates in a state; locked coordinates keep their values."""
    for coordinate, value, speed in zip(coordinates, q, u, strict=True):
        if not coordinate.getLocked(state):
            coordinate.setValue(state, float(value), False)
        coordinate.setSpeedValue(state, float(speed))


def simulated(path: Path, to: float, accuracy: float, *, equilibrate: bool = False) -> StoTable:
    """Return the states of a model over time, integrated by OpenSim's Manager.

    Args:
        path: model file; the table is written to its folder.
        to: final time (s).
        accuracy: accuracy of the integrator.
        equilibrate: whether all muscles start in equilibrium instead of in their default states.
    """
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
    """Return the generalized forces that OpenSim's InverseDynamicsTool computes for a motion.

    Args:
        model: model file in the current folder.
        motion: file of coordinates.
        loads: file of external loads, None for none.
        to: final time (s).
        lowpass: cut-off frequency of the filter (Hz), negative for no filter.
        exclude: forces of the model that the tool ignores.
    """
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
