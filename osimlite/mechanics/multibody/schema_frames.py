"""Resolution of frames and stations of a model to bodies."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import add_article, join_words
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody.spatial import Array, cross, make_offset, make_transform
from osimlite.schema.base import Component
from osimlite.schema.frames import (
    Body,
    Ground,
    PhysicalFrame,
    PhysicalOffsetFrame,
    StationDefinedFrame,
)
from osimlite.schema.markers import Station
from osimlite.schema.tree import Tree


class Placements:
    """Resolver of frames and stations to bodies (or ground), which are named by absolute paths."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.resolved: dict[str, tuple[str, Array]] = {}
        """Body (or ground) of each frame so far, and the frame's transform in it (4, 4), by path."""

    def resolve_frame(self, frame: PhysicalFrame) -> tuple[str, Array]:
        """Return the body of a frame, and the frame's transform in it.

        Args:
            frame: frame of the model.

        Returns:
            Path of the body (or ground), and the frame in the body (4, 4).

        Raises:
            ModelError: frames are fixed to each other in a circle, or stations do not define a
                frame.
            UnsupportedError: a frame is of an unknown class.
        """
        # Each waiting frame is fixed to the next one. A list instead of recursion, because a chain
        # of frames may be of any length.
        frame_path = self.path(frame)
        waiting = {} if frame_path in self.resolved else {frame_path: frame}
        while waiting:
            path, unresolved = next(reversed(waiting.items()))
            parent_frame = next(
                (
                    item
                    for item in self._list_parent_frames(unresolved)
                    if self.path(item) not in self.resolved
                ),
                None,
            )
            if parent_frame is None:
                self.resolved[path] = self._resolve_in_parent(unresolved, path)
                del waiting[path]
            elif (parent_path := self.path(parent_frame)) in waiting:
                raise ModelError(
                    f"the frame '{parent_path}' is fixed to itself, through {join_words(waiting)}; attach one "
                    "of these frames to a body"
                )
            else:
                waiting[parent_path] = parent_frame
        return self.resolved[frame_path]

    def _list_parent_frames(self, frame: PhysicalFrame) -> list[PhysicalFrame]:
        """Return the frames that a frame is defined by."""
        if isinstance(frame, PhysicalOffsetFrame):
            return [self.follow_socket(frame, "socket_parent")]
        if isinstance(frame, StationDefinedFrame):
            return [
                self.follow_socket(station, "socket_parent_frame")
                for station in self._list_stations(frame)
            ]
        return []

    def _resolve_in_parent(self, frame: PhysicalFrame, path: str) -> tuple[str, Array]:
        """Return the body that a frame is fixed to, and the frame in it.

        Args:
            frame: frame.
            path: path of the frame in the model, for messages.

        Returns:
            Path of the body, and transform of the frame in the body (4, 4).

        Raises:
            ModelError: the position or orientation of the frame is not finite, or its stations
                define no frame.
            UnsupportedError: the frame is of a class that osimlite does not support.
        """
        if isinstance(frame, Body | Ground):
            return path, np.eye(4)
        if isinstance(frame, PhysicalOffsetFrame):
            base, matrix = self.resolve_frame(self.follow_socket(frame, "socket_parent"))
            if not np.isfinite((*frame.translation, *frame.orientation)).all():
                raise ModelError(
                    f"the frame '{path}' has a position or orientation that is not finite; give finite numbers"
                )
            return base, matrix @ make_offset(frame.translation, frame.orientation)
        if isinstance(frame, StationDefinedFrame):
            return self._fit_frame_to_stations(frame, path)
        raise UnsupportedError(
            f"the frame '{path}' is {add_article(type(frame).__name__)}, a class that osimlite does not support"
        )

    def follow_socket(self, owner: Component, socket: str) -> PhysicalFrame:
        """Return the frame that a socket refers to.

        Args:
            owner: component with the socket.
            socket: name of the socket.

        Raises:
            UnsupportedError: the target is not a physical frame.
        """
        target = self.tree.target(owner, socket, getattr(owner, socket))
        if not isinstance(target, PhysicalFrame):
            class_name = getattr(target, "class_name", "") or type(target).__name__
            raise UnsupportedError(
                f"'{self.path(owner)}': {socket} names '{self.path(target)}', {add_article(class_name)}, "
                "a class of frames that osimlite does not support here; name a body or a PhysicalOffsetFrame"
            )
        return target

    @np.errstate(invalid="ignore")
    def resolve_station(self, station: Station) -> tuple[str, Array]:
        """Return the body of a station, and its position there.

        Args:
            station: station of the model.

        Returns:
            Path of the body (or ground), and the position in the body (3,), m.
        """
        base, matrix = self.resolve_frame(self.follow_socket(station, "socket_parent_frame"))
        return base, matrix[:3, :3] @ np.array(station.location, dtype=float) + matrix[:3, 3]

    def path(self, component: Component) -> str:
        """Return the absolute path of a component of the model."""
        path = self.tree.path_of(component)
        assert path is not None
        return path

    def _list_stations(self, frame: StationDefinedFrame) -> list[Station]:
        """Return the stations of points a, b and c and of the origin of a frame.

        Raises:
            ModelError: a socket names a component that is not a Station.
        """
        stations = []
        for socket in ("socket_point_a", "socket_point_b", "socket_point_c", "socket_origin_point"):
            target = self.tree.target(frame, socket, getattr(frame, socket))
            if not isinstance(target, Station):
                raise ModelError(
                    f"the frame '{self.path(frame)}': {socket} names '{self.path(target)}', "
                    f"{add_article(type(target).__name__)}; name a Station"
                )
            stations.append(target)
        return stations

    def _fit_frame_to_stations(self, frame: StationDefinedFrame, path: str) -> tuple[str, Array]:
        """Return the body of a frame that four stations define, and the frame in it.

        One axis is along the line from a to b, another one perpendicular to the plane abc.

        Args:
            frame: frame.
            path: path of the frame in the model, for messages.

        Returns:
            Path of the body, and transform of the frame in the body (4, 4).

        Raises:
            ModelError: the stations are fixed to different bodies, or the points a, b and c lie on
                a line.
        """
        bases, points = zip(*map(self.resolve_station, self._list_stations(frame)), strict=True)
        if len(set(bases)) > 1:
            raise ModelError(
                f"the stations of the frame '{path}' are fixed to {join_words(sorted(set(bases)))}; fix all to one body"
            )
        a, b, c, origin = points
        ab = b - a
        normal = cross(b - a, c - a)
        if not np.linalg.norm(normal) > 0.0:
            raise ModelError(
                f"point_a, point_b and point_c of the frame '{path}' lie on a line; move one off it"
            )
        # The third vector completes the two, in the order of the two axes.
        # An unknown first axis counts as x, and a second one that is not perpendicular as the next
        # axis.
        first, second = _parse_axis(frame.ab_axis), _parse_axis(frame.ab_x_ac_axis)
        first = np.eye(3)[0] if first is None else first
        if second is None or first @ second != 0.0:
            second = np.roll(np.abs(first), 1)
        vectors = [vector / np.linalg.norm(vector) for vector in (ab, normal, cross(ab, normal))]
        axes = [first, second, cross(first, second)]
        rotation = np.array(vectors).T @ np.array(axes)
        return bases[0], make_transform(rotation, origin)


def _parse_axis(word: str) -> Array | None:
    """Return the unit vector of a word like ``-y``, or None for another word.

    As in OpenSim only the sign and the first letter count.
    """
    sign, letter = (word[:1], word[1:2]) if word[:1] in ("+", "-") else ("+", word[:1])
    if letter.lower() not in ("x", "y", "z"):
        return None
    vector = np.zeros(3)
    vector["xyz".index(letter.lower())] = -1.0 if sign == "-" else 1.0
    return vector
