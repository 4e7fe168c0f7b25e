"""Polylines of paths around their surfaces, for drawing."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from osimlite.mechanics.kernels.layout import ITEM, LINK_WORK, MODEL
from osimlite.mechanics.kernels.pointers import Ints
from osimlite.mechanics.kernels.table import LAW_NUMBERS
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.engines.linking import Code, select_code

MOTION_LAWS = "evaluate", "constrained_dynamics", "project"
"""Laws that advance a mechanism; polylines do not use them."""
SPEED_LAWS = "move_ball", "move_drift"
"""Laws of speeds that only moment arms use."""
CONSTRAINT_LAWS = "prescribe", "bind_bodies", "factorise_law", "minimum_norm_law"
"""Laws of constraints that only moment arms use."""


@runtime_checkable
class TraceablePath(Protocol):
    """Path whose polyline around its surfaces the kernels can compute."""

    @property
    def trace(self) -> str:
        """Name of the kernel that traces the path."""

    @property
    def curves(self) -> tuple[str, ...]:
        """Names of the kernels that the tracing kernel calls; their addresses follow the item of the path.

        Returns:
            Names in the order of the surfaces.
        """

    @property
    def corners(self) -> int:
        """Largest number of corners of the polyline."""

    @property
    def start(self) -> tuple[int, Array]:
        """Index of the body in which the path starts, and the position of its first point there (3,), m.

        Returns:
            Index of the body (-1 for ground), and the position (3,), m.
        """

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the force records of the path.

        Args:
            link_map: links and offsets of the packed mechanism.

        Returns:
            The records; the last one is the path, those before it are its points and surfaces.
        """


class Polylines:
    """A mechanism with paths, packed for the kernels that trace them.

    Args:
        mechanism: mechanism on which the paths depend.
        routes: paths to trace.

    Attributes:
        program: the packed mechanism.
        bound: whether moment arms include coupled coordinates.
        structure: integers, with indices of laws in place of addresses.
        laws: names of the laws by index; index 0 is no law.
        numbers: numbers of the mechanism and of the paths.
        items: offsets of the paths in the structure.
        traces: index of the law that traces each path.
        most_corners: largest number of corners of a path.
        work: length of the work vector.
    """

    def __init__(self, mechanism: Mechanism, routes: Sequence[TraceablePath]) -> None:
        program = self.program = mechanism.program
        self.laws = [""]
        self.items = list[int]()
        self.traces = list[int]()
        ints = [*program.model]
        numbers = [*program.reals]
        self.work = program.model[MODEL.WORK_SIZE]
        self.most_corners = 0
        self.bound = bool(routes) and not all(
            isinstance(item, Lock) for item in mechanism.constraints
        )
        # Paths need only positions. Leaving out the other kernels keeps the JavaScript of the
        # viewer small.
        unused = {
            *MOTION_LAWS,
            *(() if routes else SPEED_LAWS),
            *(() if self.bound else CONSTRAINT_LAWS),
        }
        for name in program.laws:
            # Numbers of laws instead of addresses: JavaScript has none, and `_linked` replaces them
            # here.
            ints[MODEL.LAWS + LAW_NUMBERS[name]] = 0 if name in unused else self._number_law(name)
        self._calls: list[int] = []
        for route in routes:
            offset = len(ints)
            for item in route.make_records(program.tree.link_map):
                offset = len(ints)
                ints += [
                    self._number_law(item.kernel, offset),
                    len(numbers),
                    self.work,
                    0,
                    *item.ints,
                ]
                numbers += item.numbers
                self.work += item.record_size
            self.items.append(offset)
            self.traces.append(self._number_law(route.trace))
            for curve in route.curves:
                ints.append(self._number_law(curve, len(ints)))
            self.most_corners = max(self.most_corners, route.corners)
        self.structure = np.array(ints, dtype=np.int64)
        self.numbers = np.array(numbers)
        self._w = np.zeros(self.work)
        self._y = np.zeros(2 * len(program.order))
        self._f = np.zeros(3 * self.most_corners)
        # The first body of each link.
        links, bodies = np.unique(program.links[:-1], return_index=True)
        self._bodies = bodies[links >= 0]

    def _number_law(self, name: str, offset: int | None = None) -> int:
        """Return the index of a kernel in `laws`, and append it if it is new.

        Args:
            name: name of the kernel, "" for none.
            offset: offset in the structure that needs the address of the kernel.
        """
        if name not in self.laws:
            self.laws.append(name)
        if name and offset is not None:
            self._calls.append(offset)
        return self.laws.index(name)

    @cached_property
    def _linked(self) -> tuple[Code, Ints]:
        """Code that runs the laws, and the structure with their addresses."""
        code, ints = select_code(), self.structure.copy()
        code.make_ready(
            [self.laws[k] for k in dict.fromkeys((*ints[self._calls].tolist(), *self.traces))]
        )
        for offset in self._calls:
            ints[offset] = code.get_address(self.laws[ints[offset]])
        return code, ints

    def trace(self, q: Array, rotations: Array, origins: Array) -> list[Array]:
        """Return the corners of each path in ground, for given poses of the bodies.

        On a surface, corners are 0.15 rad apart.

        Args:
            q: coordinate values (n,).
            rotations: rotations of the bodies in ground (b, 3, 3).
            origins: origins of the bodies in ground (b, 3), m.

        Returns:
            Corners (k, 3) of each path from end to end, m.
        """
        code, ints = self._linked
        s, (bodies, order) = self.structure, (self._bodies, self.program.order)
        # The kernels take positions of links. They follow from one body of each link, so that the
        # poses can come from anywhere, for example from a viewer.
        links = self._w[s[MODEL.WORK_LINK] :][: LINK_WORK.SIZE * len(bodies)].reshape(
            -1, LINK_WORK.SIZE
        )
        frames = self.program.frames[bodies]
        link_rotations = rotations[bodies] @ frames[:, :3, :3].swapaxes(1, 2)
        links[:, LINK_WORK.ROTATION : LINK_WORK.ROTATION + 9] = link_rotations.reshape(-1, 9)
        links[:, LINK_WORK.POSITION : LINK_WORK.POSITION + 3] = (
            origins[bodies] - (link_rotations @ frames[:, :3, 3:])[:, :, 0]
        )
        self._y[: len(q)] = q[order]
        arguments = ints, self.numbers, self._w, self._y, self._f
        result = []
        for item, trace in zip(self.items, self.traces, strict=True):
            code.get_entry(self.laws[self.structure[item + ITEM.LAW]])(*arguments, item)
            count = code.get_entry(self.laws[trace])(*arguments, item)
            result.append(self._f[: 3 * count].reshape(-1, 3).copy())
        return result
