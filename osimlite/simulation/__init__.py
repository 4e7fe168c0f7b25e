"""From mechanism to motion: force elements, engines, time steppers, trajectories and their files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.base.lazy import make_lazy_getattr

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable as StoTable
    from osimlite.io.tables.storage import read_sto as read_sto
    from osimlite.io.tables.storage import write_sto as write_sto
    from osimlite.io.tables.table_stream import stream_table as stream_table
    from osimlite.simulation.cached_simulation import simulate as simulate
    from osimlite.simulation.options import Options as Options
    from osimlite.simulation.run import Simulation as Simulation
    from osimlite.simulation.trajectory import Interrupted as Interrupted
    from osimlite.simulation.trajectory import Trajectory as Trajectory

__getattr__ = make_lazy_getattr(
    __name__,
    {
        "Interrupted": "osimlite.simulation.trajectory",
        "Options": "osimlite.simulation.options",
        "Simulation": "osimlite.simulation.run",
        "StoTable": "osimlite.io.tables.storage",
        "Trajectory": "osimlite.simulation.trajectory",
        "read_sto": "osimlite.io.tables.storage",
        "simulate": "osimlite.simulation.cached_simulation",
        "stream_table": "osimlite.io.tables.table_stream",
        "write_sto": "osimlite.io.tables.storage",
    },
)
