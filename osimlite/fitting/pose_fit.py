"""Fit of poses to measurements by the compiled kernel."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.progress import divide_rows
from osimlite.base.records import replace
from osimlite.errors import SimulationError
from osimlite.fitting.pose_layout import (
    CoordinateTarget,
    FitLayout,
    MarkerTarget,
    SensorTarget,
    separate_couplers,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.pose_fit import UNASSEMBLED, UNCONVERGED, UNSEEN
from osimlite.mechanics.kernels.pose_record import FIT
from osimlite.mechanics.multibody.constraints import Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.constrained import find_free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.linking import Code
from osimlite.simulation.system import System


class FittedPoses(NamedTuple):
    """Poses that fit measurements."""

    values: Array  # values of all coordinates (t, n), rad and m
    places: Array  # positions of the markers (t, m, 3), m
    # Rotation vectors of the sensors from their measurements (t, k, 3), in ground, rad; NaN if not
    # measured.
    turns: Array
    # Half the weighted means of squared distances of markers and of squared angles of sensors,
    # plus half the weighted squares of the deviations from target values (t,).
    costs: Array
    steps: Array  # Newton steps (t,)
    # Frames without measurements, which have the pose of the frame before.
    unseen: tuple[int, ...]
    unsettled: tuple[int, ...]  # frames in which the solver did not converge


class PoseFit:
    """Fit of poses to measurements; each frame starts from the one before.

    Locked coordinates stay at their default values, clamped ones in their ranges. Prescribed
    coordinates follow their functions. Coordinates that couplers determine are substituted.

    Args:
        mechanism: mechanism whose poses are fitted.
        markers: points with measured positions.
        sensors: frames with measured orientations.
        goals: coordinates with target values.
        constraints: whether the constraints of the mechanism hold.
        code: compiler of the kernels; by default the best that is installed.

    Attributes:
        markers: number of markers.
        sensors: number of sensors.
        measured: count of the numbers that are measured in a frame.
        order: indices in the mechanism of the coordinates to find.
        width: count of the numbers of a frame: positions, orientations, targets, and values of
            locked and prescribed coordinates.
        result_size: count of the numbers in a result: values, marker positions, rotation vectors of the
            sensors, cost, steps and status.

    Raises:
        UnsupportedError: the kernels do not support a joint, a function or a constraint.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        markers: Sequence[MarkerTarget],
        sensors: Sequence[SensorTarget] = (),
        goals: Sequence[CoordinateTarget] = (),
        *,
        constraints: bool = True,
        code: Code | None = None,
    ) -> None:
        self.mechanism = mechanism
        self.markers = len(markers)
        self.measured = 3 * len(markers) + 9 * len(sensors)
        infos = list(mechanism.coordinates)
        self._input_coordinates: dict[int, SmoothFunction | None] = {}
        free_coordinates = set(find_free_coordinates(mechanism))
        for index, info in enumerate(infos):
            # Their values change from frame to frame or from fit to fit; as inputs they need no new
            # kernel.
            if index in free_coordinates and (info.locked or info.prescribed is not None):
                self._input_coordinates[index] = None if info.locked else info.prescribed
                infos[index] = replace(info, locked=False, prescribed=None)
        active_constraints = [
            constraint
            for constraint in mechanism.constraints
            if not isinstance(constraint, Lock | PrescribedCoordinate)
        ] * constraints
        fixed_coordinates = {
            index
            for index in range(len(infos))
            if index not in free_coordinates or index in self._input_coordinates
        }
        self._couplers, other_constraints = separate_couplers(active_constraints, fixed_coordinates)
        # A target of a coordinate that cannot move has no effect.
        self._goals = [
            number for number, goal in enumerate(goals) if goal.coordinate not in fixed_coordinates
        ]
        unlocked = replace(
            mechanism, coordinates=tuple(infos), constraints=tuple(other_constraints)
        )
        self.system = _System(unlocked, Forces(()), code=code)
        self.order = list(self.system.order)
        placements = LinkMap(
            unlocked, {index: k for k, index in enumerate(self.order)}, self.system.placements
        )
        active_goals = [goals[number] for number in self._goals]
        self.layout = FitLayout(
            self.system,
            placements,
            markers,
            sensors,
            active_goals,
            list(self._input_coordinates),
            self._couplers,
        )
        self._history = self.layout.work[self.layout.ints[FIT.HISTORY] :]
        self.width = self.measured + len(active_goals) + len(self._input_coordinates)
        self.sensors = len(sensors)
        self.result_size = len(self.order) + 3 * (len(markers) + len(sensors)) + 3

    def set_pose(self, q: Array) -> None:
        """Start from the values (n,) of all coordinates."""
        # The solver extrapolates from earlier frames, which a jump makes useless.
        self._history[0] = 0.0
        self.system.set_pose(q)

    def fit_frames(
        self, measured: Array, times: Sequence[float] | Array | None = None, q: Array | None = None
    ) -> FittedPoses:
        """Return the poses that fit the measurements of frames, starting from the latest pose.

        Args:
            measured: measurements (t, ...) of t frames: positions of the markers in ground, m,
                rotation matrices of the sensors by rows, and target values of coordinates, rad or
                m; NaN where something was not measured.
            times: times of the frames for prescribed coordinates, s; zero by default.
            q: values (n,) of all coordinates to start from; by default the latest pose.

        Raises:
            SimulationError: no pose satisfies the constraints.
        """
        if q is not None:
            self.set_pose(q)
        count = len(measured)
        free_count = len(self.order)
        measured_rows = measured.reshape(count, -1)
        frames = np.empty((count, self.width))
        result = np.empty((count, self.result_size))
        frames[:, : self.measured] = measured_rows[:, : self.measured]
        frames[:, self.measured : self.measured + len(self._goals)] = measured_rows[
            :, self.measured :
        ][:, self._goals]
        self.fill_prescribed(
            frames, np.zeros(count) if times is None else np.asarray(times, dtype=float)
        )
        for rows in divide_rows("fitting the motion", count):
            # The workspace carries the last poses from call to call.
            self.bind_arrays(frames[rows], result[rows])(rows.stop - rows.start)
        status = result[:, -1]
        if (status == UNASSEMBLED).any():
            raise self.create_constraint_error(int(np.argmax(status == UNASSEMBLED)))
        values = np.tile(self.mechanism.values({}), (count, 1))
        values[:, self.order] = result[:, :free_count]
        vectors = result[:, free_count:-3].reshape(count, -1, 3)
        unseen, unsettled = (
            tuple(np.flatnonzero(status == code).tolist()) for code in (UNSEEN, UNCONVERGED)
        )
        positions = vectors[:, : self.markers]
        rotations = vectors[:, self.markers :]
        return FittedPoses(
            values, positions, rotations, result[:, -3], result[:, -2], unseen, unsettled
        )

    def bind_arrays(self, frames: Array, results: Array) -> Callable[[int], int]:
        """Return a function that fits a number of frames in fixed arrays.

        Args:
            frames: frames (t, width), which the caller keeps alive.
            results: results (t, found), which the caller keeps alive.
        """
        shape = self.layout
        return self.system.bind_arrays(shape.ints, shape.numbers, shape.work, frames, results)

    def fill_prescribed(self, frames: Array, moments: Array) -> None:
        """Write the values of locked and prescribed coordinates into frames.

        Args:
            frames: frames (t, width), changed in place.
            moments: times (t,), s.
        """
        columns = frames[:, self.width - len(self._input_coordinates) :]
        for column, (index, function) in enumerate(self._input_coordinates.items()):
            if function is None:
                columns[:, column] = self.mechanism.coordinates[index].default_value
            else:
                columns[:, column] = [
                    function.evaluate(np.array((t,)))[0] for t in moments.tolist()
                ]

    def create_single_frame_fit(self) -> SingleFrameFit:
        """Return a fit of single frames without target values."""
        return SingleFrameFit(self)

    def create_constraint_error(self, frame: int) -> SimulationError:
        """Return the error for a frame in which no pose satisfies the constraints."""
        names = ", ".join(
            constraint.name
            for constraint in self.mechanism.constraints
            if not isinstance(constraint, Lock)
        )
        return SimulationError(
            f"no pose of '{self.mechanism.name}' near that of frame {frame + 1} satisfies its "
            f"constraints ({names}); "
            "change default values, or disable constraints"
        )


class _System(System):
    """Engine of the mechanism without substituted coordinates."""

    entries = ("evaluate", "fit_frames")

    def set_pose(self, q: Array) -> None:
        """Set the values of the coordinates."""
        self._y[: len(self.order)] = q[list(self.order)]

    def bind_arrays(self, *arrays: Floats | Ints) -> Callable[[int], int]:
        """Return a function that fits a number of frames; the caller keeps the arrays alive."""
        flat_arrays = [array.reshape(-1) for array in arrays]
        arguments = self.program.ints, self.numbers, self._w, self._y, self._f
        return self.program.code.bind_entry("fit_frames", *arguments, *flat_arrays)


class SingleFrameFit:
    """Fit of one frame at a time that allocates nothing but the result."""

    def __init__(self, fit: PoseFit) -> None:
        self._fit = fit
        self._values = fit.mechanism.values({}).copy()
        self._row = np.empty(fit.width)
        self._result = np.empty(fit.result_size)
        self._run = fit.bind_arrays(self._row, self._result)
        free_count = len(fit.order)
        end = len(fit.order) + 3 * fit.markers
        self._measured_values = self._row[: fit.measured]
        self._q = self._result[:free_count]
        self.places: Array = self._result[free_count:end].reshape(-1, 3)
        self.turns: Array = self._result[end:-3].reshape(-1, 3)

    def __call__(self, measured: Array, time: float) -> Array:
        """Return the values (n,) of all coordinates that fit one frame.

        Args:
            measured: positions of the markers, m, then rotation matrices of the sensors by rows.
            time: time, s.
        """
        self._measured_values[:] = measured
        self._fit.fill_prescribed(self._row[None], np.array((time,)))
        self._run(1)
        if self._result[-1] == UNASSEMBLED:
            raise self._fit.create_constraint_error(0)
        values = self._values.copy()
        values[self._fit.order] = self._q
        return values
