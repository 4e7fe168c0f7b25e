"""Check of a solution: a simulation with its controls, and how long it stays near the solution."""

from __future__ import annotations

import numpy as np

from osimlite.base.deprecation import make_deprecated_property
from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.prescribed_motion import PrescribedMotion
from osimlite.optimal.problem import Problem
from osimlite.optimal.trajectory import MocoTrajectory
from osimlite.simulation.cached_simulation import simulate

INTEGRATION_ACCURACY = 1e-7
"""Relative accuracy of the integration, well below `MATCH_TOLERANCE`."""
RECORDED_STEPS = 1000
"""Number of recorded time steps, between which linear interpolation is accurate enough."""
MATCH_TOLERANCE = 0.01
"""Difference of a coordinate, rad or m, up to which simulation and solution agree."""


@dataclass(frozen=True, eq=False)
class SimulationCheck:
    """Differences between a simulation and the solution whose controls it used.

    Attributes:
        times: times of the solution (n,), s.
        deviations: absolute difference of each coordinate (n,) by its path, rad or m.
    """

    times: Array
    deviations: dict[str, Array]

    apart = make_deprecated_property("deviations")

    @property
    def largest(self) -> Array:
        """Return the largest difference of all coordinates at each time (n,), rad or m."""
        result: Array = np.max([*self.deviations.values()], axis=0)
        return result

    @property
    def matches_until(self) -> float:
        """Return the last time, s, up to which no coordinate differs by more than `MATCH_TOLERANCE`."""
        mismatches = np.flatnonzero(self.largest > MATCH_TOLERANCE)
        return float(
            self.times[-1] if not len(mismatches) else self.times[max(mismatches[0] - 1, 0)]
        )

    def __str__(self) -> str:
        """Return the summary line of the command ``run --simulate``."""
        at_end = {path: float(column[-1]) for path, column in self.deviations.items()}
        worst_path = max(at_end, key=lambda path: at_end[path])
        return (
            f"within {MATCH_TOLERANCE:g} rad or m of the solution until {self.matches_until:.4g} s of {self.times[-1]:.4g} s; "
            f"the largest difference at the end is {at_end[worst_path]:.2g}, of '{worst_path.rpartition('/')[2]}'"
        )


def check_by_simulation(problem: Problem, trajectory: MocoTrajectory) -> SimulationCheck:
    """Simulate a model from the first state of a solution with its controls, and compare the coordinates.

    The controls are interpolated linearly between the points of the grid.

    Args:
        problem: problem with the model.
        trajectory: solution of the problem.

    Returns:
        Differences of the coordinates at the times of the solution.

    Raises:
        OsimliteError: the motion is prescribed, begins after 0 s, or has parameters; or the model
            cannot be simulated.
    """
    if isinstance(problem.functions, PrescribedMotion):
        raise OsimliteError("the motion is prescribed")
    if trajectory.times[0] != 0.0 or trajectory.parameters:
        reason = (
            "has parameters" if trajectory.parameters else f"begins at {trajectory.times[0]:g} s"
        )
        raise OsimliteError(f"the motion {reason}")
    end = float(trajectory.times[-1])
    start = {name: float(trajectory.columns[name][0]) for name in trajectory.names["states"]}
    simulated = simulate(
        problem.model,
        end,
        accuracy=INTEGRATION_ACCURACY,
        report_interval=end / RECORDED_STEPS,
        initial=start,
        controls=trajectory.table("controls"),
        folder=problem.folder,
    )
    columns = {
        info.path: simulated.values[:, k] for k, info in enumerate(simulated.mechanism.coordinates)
    }
    differences = {
        path: np.abs(
            np.interp(trajectory.times, simulated.times, columns[path])
            - trajectory.columns[f"{path}/value"]
        )
        for path in problem.functions.coordinates
    }
    return SimulationCheck(trajectory.times, differences)
