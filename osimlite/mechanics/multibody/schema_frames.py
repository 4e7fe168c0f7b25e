"""Where the frames and stations of a model are: which body they are fixed to, and their transform there."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import join_words
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
    """Follows frames of frames down to bodies (or ground), each named by its absolute path."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.found: dict[str, tuple[str, Array]] = {}
        """The body (or ground) that each frame is fixed to so far, and where it is there (4, 4)."""

    def resolve_frame(self, frame: PhysicalFrame) -> tuple[str, Array]:
        """The body (or ground) that a frame is fixed to, and the frame's transform (4, 4) there.

        Raises:
            ModelError: frames are fixed to each other in a circle, or stations do not define a
                frame.
            UnsupportedError: a frame of another class.
        """
        # Each frame that waits is fixed to the next one; a chain of them may be of any length.
        wanted = self.path(frame)
        waiting = {} if wanted in self.found else {wanted: frame}
        while waiting:
            path, last = next(reversed(waiting.items()))
            below = next(
                (
                    item
                    for item in self._list_parent_frames(last)
                    if self.path(item) not in self.found
                ),
                None,
            )
            if below is None:
                self.found[path] = self._place_frame(last, path)
                del waiting[path]
            elif (place := self.path(below)) in waiting:
                raise ModelError(
                    f"the frame '{place}' is fixed to itself, through {join_words(waiting)}; fix it to a body"
                )
            else:
                waiting[place] = below
        return self.found[wanted]

    def _list_parent_frames(self, frame: PhysicalFrame) -> list[PhysicalFrame]:
        """The frames that a frame is laid on."""
        if isinstance(frame, PhysicalOffsetFrame):
            return [self.follow_socket(frame, "socket_parent")]
        if isinstance(frame, StationDefinedFrame):
            return [
                self.follow_socket(station, "socket_parent_frame")
                for station in self._list_stations(frame)
            ]
        return []

    def _place_frame(self, frame: PhysicalFrame, path: str) -> tuple[str, Array]:
        if isinstance(frame, Body | Ground):
            return path, np.eye(4)
        if isinstance(frame, PhysicalOffsetFrame):
            base, matrix = self.resolve_frame(self.follow_socket(frame, "socket_parent"))
            if not np.isfinite((*frame.translation, *frame.orientation)).all():
                raise ModelError(
                    f"the frame '{path}' has a place or turning that is not finite; give numbers"
                )
            return base, matrix @ make_offset(frame.translation, frame.orientation)
        if isinstance(frame, StationDefinedFrame):
            return self._fit_frame_to_stations(frame, path)
        raise UnsupportedError(
            f"the frame '{path}' is a {type(frame).__name__}, which osimlite cannot place"
        )

    def follow_socket(self, owner: Component, socket: str) -> PhysicalFrame:
        """The frame that a socket of `owner` leads to."""
        target = self.tree.target(owner, socket, getattr(owner, socket))
        if not isinstance(target, PhysicalFrame):
            kind = getattr(target, "class_name", "") or type(target).__name__
            raise UnsupportedError(
                f"'{self.path(owner)}': {socket} names '{self.path(target)}', a {kind}, "
                "which osimlite cannot place; name a body or a PhysicalOffsetFrame"
            )
        return target

    @np.errstate(invalid="ignore")
    def resolve_station(self, station: Station) -> tuple[str, Array]:
        """The body (or ground) that a station is fixed to, and its place (3,) there."""
        base, matrix = self.resolve_frame(self.follow_socket(station, "socket_parent_frame"))
        return base, matrix[:3, :3] @ np.array(station.location, dtype=float) + matrix[:3, 3]

    def path(self, component: Component) -> str:
        """The absolute path of a component of the model."""
        path = self.tree.path_of(component)
        assert path is not None
        return path

    def _list_stations(self, frame: StationDefinedFrame) -> list[Station]:
        """Points a, b, c and the origin of a frame."""
        stations = []
        for socket in ("socket_point_a", "socket_point_b", "socket_point_c", "socket_origin_point"):
            target = self.tree.target(frame, socket, getattr(frame, socket))
            if not isinstance(target, Station):
                raise ModelError(
                    f"the frame '{self.path(frame)}': {socket} names '{self.path(target)}', a {type(target).__name__}; "
                    "name a Station"
                )
            stations.append(target)
        return stations

    def _fit_frame_to_stations(self, frame: StationDefinedFrame, path: str) -> tuple[str, Array]:
        bases, points = zip(*map(self.resolve_station, self._list_stations(frame)), strict=True)
        if len(set(bases)) > 1:
            raise ModelError(
                f"the stations of the frame '{path}' are fixed to {join_words(sorted(set(bases)))}; fix all to one body"
            )
        a, b, c, origin = points
        along, across = b - a, cross(b - a, c - a)
        if not np.linalg.norm(across) > 0.0:
            raise ModelError(
                f"point_a, point_b and point_c of the frame '{path}' lie on a line; move one off it"
            )
        # The third vector completes the two, in the order of the two axes.
        first, second = _parse_axis(frame.ab_axis), _parse_axis(frame.ab_x_ac_axis)
        first = np.eye(3)[0] if first is None else first
        if second is None or first @ second != 0.0:
            second = np.roll(np.abs(first), 1)
        vectors = [
            vector / np.linalg.norm(vector) for vector in (along, across, cross(along, across))
        ]
        axes = [first, second, cross(first, second)]
        rotation = np.array(vectors).T @ np.array(axes)
        return bases[0], make_transform(rotation, origin)


def _parse_axis(word: str) -> Array | None:
    """The unit vector that a word like ``-y`` names, by its first letter as in OpenSim; None for another word."""
    sign, letter = (word[:1], word[1:2]) if word[:1] in ("+", "-") else ("+", word[:1])
    if letter.lower() not in ("x", "y", "z"):
        return None
    vector = np.zeros(3)
    vector["xyz".index(letter.lower())] = -1.0 if sign == "-" else 1.0
    return vector
