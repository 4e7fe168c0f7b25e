"""A mechanism and what is measured of it, laid out for the kernel that finds the poses that fit best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from osimlite.base.records import replace
from osimlite.errors import SimulationError
from osimlite.fitting.pose_layout import FitLayout, Goal, Marker, Sensor, substituted
from osimlite.mechanics.kernels import pose_record as fit
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.pose_fit import APART, STUCK, UNSEEN
from osimlite.mechanics.multibody.constraints import Lock, Prescribed
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.constrained import free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.linking import Code
from osimlite.simulation.system import System


class Poses(NamedTuple):
    """Poses that were found."""

    values: Array  # of all coordinates (t, n), rad and m
    places: Array  # of the markers in these poses (t, m, 3), m
    turns: Array  # of the sensors from where they were measured (t, k, 3), in ground, rad; NaN where one was not
    # half the weighted means of the squared distances of the markers and of the squared angles of
    # the sensors, and the squares of the goals (t,)
    costs: Array
    steps: Array  # Newton steps that were taken (t,)
    # frames of which nothing was measured: they have the pose of the frame before
    unseen: tuple[int, ...]
    unsettled: tuple[int, ...]  # frames in which the search ended before the best pose was certain


class PoseFit:
    """Finds poses that fit measurements, each from the one before.

    Locked coordinates stay at their defaults, clamped ones in their ranges; prescribed ones follow
    their functions, and what a coupler gives is substituted.

    Args:
        mechanism: whose poses.
        markers: places that are measured.
        sensors: rotations that are measured.
        goals: coordinates that are to have values.
        constraints: whether those of the mechanism hold.
        code: what runs the kernels; the best that is installed if left out.

    Attributes: markers: how many there are. sensors: likewise. measured: count of the numbers of
        their places and rotations. order: places in the mechanism of the coordinates that are
        found. width: count of the numbers of one frame: the markers' places, the rotations, the
        goals, and what is held. found: count of those that the kernel finds: the values, the
        markers' places, the sensors' turns, cost, steps, and an ending.

    Raises:
        UnsupportedError: a joint, a function or a constraint that the kernels do not know.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        markers: Sequence[Marker],
        sensors: Sequence[Sensor] = (),
        goals: Sequence[Goal] = (),
        *,
        constraints: bool = True,
        code: Code | None = None,
    ) -> None:
        self.mechanism, self.markers, self.measured = (
            mechanism,
            len(markers),
            3 * len(markers) + 9 * len(sensors),
        )
        infos = list(mechanism.coordinates)
        self._held: dict[int, Function | None] = {}
        free = set(free_coordinates(mechanism))
        for place, info in enumerate(infos):
            if place in free and (info.locked or info.prescribed is not None):
                self._held[place] = None if info.locked else info.prescribed
                infos[place] = replace(info, locked=False, prescribed=None)
        acting = [
            item for item in mechanism.constraints if not isinstance(item, Lock | Prescribed)
        ] * constraints
        fixed = {place for place in range(len(infos)) if place not in free or place in self._held}
        self._couplers, others = substituted(acting, fixed)
        # A goal of a coordinate that cannot move changes nothing.
        self._goals = [number for number, goal in enumerate(goals) if goal.coordinate not in fixed]
        unlocked = replace(mechanism, coordinates=tuple(infos), constraints=tuple(others))
        self.system = _System(unlocked, Forces(()), code=code)
        self.order = list(self.system.order)
        places = Places(
            unlocked, {place: k for k, place in enumerate(self.order)}, self.system.placements
        )
        kept = [goals[number] for number in self._goals]
        self.layout = FitLayout(
            self.system, places, markers, sensors, kept, list(self._held), self._couplers
        )
        self._history = self.layout.work[self.layout.ints[fit.HISTORY] :]
        self.width = self.measured + len(kept) + len(self._held)
        self.sensors, self.found = (
            len(sensors),
            len(self.order) + 3 * (len(markers) + len(sensors)) + 3,
        )

    def start(self, q: Array) -> None:
        """Begin anew, at the values (n,) of all coordinates."""
        self._history[0] = 0.0
        self.system.start(q)

    def fit(
        self, measured: Array, times: Sequence[float] | Array | None = None, q: Array | None = None
    ) -> Poses:
        """Fit frames (t, ...) of what is measured, from the pose that was found last on.

        Args: measured: of each frame the places of the markers, the rotations by rows, the values
            of the goals; NaN where something was not seen. times: of the frames, s, for prescribed
            coordinates; zeros if left out. q: values (n,) of all coordinates to begin anew with.

        Raises:
            SimulationError: no pose fulfils the constraints.
        """
        if q is not None:
            self.start(q)
        count, free = len(measured), len(self.order)
        given = measured.reshape(count, -1)
        frames, result = np.empty((count, self.width)), np.empty((count, self.found))
        frames[:, : self.measured] = given[:, : self.measured]
        frames[:, self.measured : self.measured + len(self._goals)] = given[:, self.measured :][
            :, self._goals
        ]
        self.fill_held(frames, np.zeros(count) if times is None else np.asarray(times, dtype=float))
        self.bound(frames, result)(count)
        status = result[:, -1]
        if (status == APART).any():
            raise self.apart(int(np.argmax(status == APART)))
        values = np.tile(self.mechanism.values({}), (count, 1))
        values[:, self.order] = result[:, :free]
        vectors = result[:, free:-3].reshape(count, -1, 3)
        unseen, unsettled = (
            tuple(np.flatnonzero(status == what).tolist()) for what in (UNSEEN, STUCK)
        )
        places, turns = vectors[:, : self.markers], vectors[:, self.markers :]
        return Poses(values, places, turns, result[:, -3], result[:, -2], unseen, unsettled)

    def bound(self, frames: Array, found: Array) -> Callable[[int], int]:
        """What fits a number of frames of arrays that the caller keeps, as the kernel takes them."""
        shape = self.layout
        return self.system.bound(shape.ints, shape.numbers, shape.work, frames, found)

    def fill_held(self, frames: Array, moments: Array) -> None:
        """Put the values of what is held at some times (t,), s, into rows (t, width) for the kernel."""
        columns = frames[:, self.width - len(self._held) :]
        for column, (place, function) in enumerate(self._held.items()):
            if function is None:
                columns[:, column] = self.mechanism.coordinates[place].default_value
            else:
                columns[:, column] = [
                    function.evaluate(np.array((t,)))[0] for t in moments.tolist()
                ]

    def frame(self) -> Frame:
        """What fits one frame at a time, from the pose that was found last on; there are no goals."""
        return Frame(self)

    def apart(self, frame: int) -> SimulationError:
        """The error for a frame that no pose fits in which the constraints hold."""
        names = ", ".join(
            item.name for item in self.mechanism.constraints if not isinstance(item, Lock)
        )
        return SimulationError(
            f"no pose of '{self.mechanism.name}' near that of frame {frame + 1} keeps its constraints ({names}); "
            "change default values, or leave constraints out"
        )


class _System(System):
    """The mechanism without what is substituted."""

    entries = ("evaluate", "fit_frames")

    def start(self, q: Array) -> None:
        """Put it into a pose."""
        self._y[: len(self.order)] = q[list(self.order)]

    def bound(self, *arrays: Floats | Ints) -> Callable[[int], int]:
        """What fits a number of frames, from the pose that it is in; the caller keeps the arrays."""
        flat = [array.reshape(-1) for array in arrays]
        own = self.program.ints, self.numbers, self._w, self._y, self._f
        return self.program.code.bound("fit_frames", *own, *flat)


class Frame:
    """Fits one frame at a time without making arrays of its own, see :meth:`PoseFit.frame`."""

    def __init__(self, fit: PoseFit) -> None:
        self._fit, self._values = fit, fit.mechanism.values({}).copy()
        self._row, self._found = np.empty(fit.width), np.empty(fit.found)
        self._run = fit.bound(self._row, self._found)
        free, end = len(fit.order), len(fit.order) + 3 * fit.markers
        self._given, self._q = self._row[: fit.measured], self._found[:free]
        self.places: Array = self._found[free:end].reshape(-1, 3)
        self.turns: Array = self._found[end:-3].reshape(-1, 3)

    def __call__(self, measured: Array, time: float) -> Array:
        """The values (n,) of all coordinates for places of markers and then rotations of sensors, at a time (s)."""
        self._given[:] = measured
        self._fit.fill_held(self._row[None], np.array((time,)))
        self._run(1)
        if self._found[-1] == APART:
            raise self._fit.apart(0)
        values = self._values.copy()
        values[self._fit.order] = self._q
        return values
