"""From mechanism to motion: force elements, engines, time steppers, trajectories and their files."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from osimlite.simulation.run import Simulation as Simulation
    from osimlite.simulation.run import simulate as simulate
    from osimlite.simulation.storage import StoTable as StoTable
    from osimlite.simulation.storage import read_sto as read_sto
    from osimlite.simulation.storage import write_sto as write_sto
    from osimlite.simulation.table_stream import stream_table as stream_table
    from osimlite.simulation.trajectory import Trajectory as Trajectory

_PUBLIC = {
    "Simulation": "run",
    "simulate": "run",
    "StoTable": "storage",
    "read_sto": "storage",
    "write_sto": "storage",
    "stream_table": "table_stream",
    "Trajectory": "trajectory",
}


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'osimlite.simulation' has no attribute '{name}'")
    return getattr(import_module(f"osimlite.simulation.{_PUBLIC[name]}"), name)
