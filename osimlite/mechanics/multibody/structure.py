"""Structure of a mechanism: bodies, coordinates, frames and constraints, found by their names.

Arrays have one number per coordinate, in the order of OpenSim's CoordinateSet.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, field
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import ModelError, SettingError
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.extremes import methods_of_any_numbers
from osimlite.mechanics.multibody.parts import (
    GROUND,
    CoordinateInfo,
    FramePlacement,
    MobileBody,
    StationPlacement,
)
from osimlite.mechanics.multibody.spatial import Array

MAX_NAMED_COORDINATES = 8
"""Number of coordinates that a message about an unknown one lists."""
Values = ArrayLike | Mapping[str, float]
"""One number per coordinate: an array in coordinate order, or numbers by coordinate name."""


@methods_of_any_numbers
@dataclass(frozen=True, eq=False)
class MechanismStructure:
    """Parts of a mechanism, found by their names.

    Attributes:
        name: name of the model.
        bodies: bodies, each after the one that carries it.
        coordinates: coordinates, in the order of all arrays.
        gravity: acceleration of gravity in ground (3,), m/s².
        frames: frames that are fixed to a body or to ground, by absolute path.
        constraints: constraints besides the joints; those of locked and prescribed coordinates are
            inserted before them.
        stations: markers and other stations, by absolute path.
        assembly_accuracy: ten times the accepted position error of constraints in an assembled pose
            (m or rad).
    """

    name: str
    bodies: tuple[MobileBody, ...]
    coordinates: tuple[CoordinateInfo, ...]
    gravity: Array = field(default_factory=lambda: np.array((0.0, -9.80665, 0.0)))
    frames: Mapping[str, FramePlacement] = field(default_factory=dict)
    constraints: tuple[ConstraintEquations, ...] = ()
    stations: Mapping[str, StationPlacement] = field(default_factory=dict)
    assembly_accuracy: float = 1e-9

    def __post_init__(self) -> None:
        for index, body in enumerate(self.bodies):
            if not GROUND <= body.parent < index:
                raise ModelError(
                    f"body '{body.name}' stands before the body that carries it; sort the bodies from ground outwards"
                )
        indices = sorted(index for body in self.bodies for index in body.mobilizer.coordinates)
        if indices != list(range(len(self.coordinates))):
            raise ModelError(
                f"the joints of '{self.name}' do not share out its coordinates one by one"
            )
        # Locked and prescribed coordinates are constraints like any others.
        coordinate_constraints: list[ConstraintEquations] = []
        for index, info in enumerate(self.coordinates):
            if info.locked:
                coordinate_constraints.append(Lock(index, info.path))
            elif info.prescribed is not None:
                coordinate_constraints.append(
                    PrescribedCoordinate(index, info.prescribed, info.path)
                )
        object.__setattr__(self, "constraints", (*coordinate_constraints, *self.constraints))

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names in the order of all arrays; coordinates that share a name have their paths.

        Returns:
            Names or paths, one per coordinate.
        """
        counts = Counter(info.name for info in self.coordinates)
        return tuple(
            info.name if counts[info.name] == 1 else info.path for info in self.coordinates
        )

    def coordinate_index(self, name: str) -> int:
        """Return the index of a coordinate.

        Args:
            name: absolute path, or a name that no other coordinate has.

        Raises:
            ModelError: the name is unknown or ambiguous.
        """
        try:
            return self._coordinate_indices[name]
        except KeyError:
            same_named = [info.path for info in self.coordinates if info.name == name]
            if same_named:
                raise ModelError(
                    f"'{self.name}' has several coordinates '{name}'; write {' or '.join(same_named)}"
                ) from None
            names = self.coordinate_names
            name_list = join_words(names, max_count=MAX_NAMED_COORDINATES)
            suggestion = suggest_name(name, names) or (f"; it has {name_list}" if names else "")
            raise ModelError(f"'{self.name}' has no coordinate '{name}'{suggestion}") from None

    def placement(self, name: str) -> FramePlacement:
        """Return the body index and transform of a frame, a body or ground.

        Args:
            name: absolute path; for a body or ground also the name.

        Raises:
            ModelError: the name is unknown.
        """
        try:
            return self._placements[name]
        except KeyError:
            suggestion = suggest_name(name, self._placements)
            raise ModelError(f"'{self.name}' has no body or frame '{name}'{suggestion}") from None

    def values(self, q: Values) -> Array:
        """Return coordinate values as an array (n,)."""
        return self._convert_to_array(q, "value", self._default_values)

    def speeds(self, u: Values) -> Array:
        """Return generalized speeds as an array (n,)."""
        return self._convert_to_array(u, "speed", self._default_speeds)

    @cached_property
    def _coordinate_indices(self) -> dict[str, int]:
        indices = {info.path: index for index, info in enumerate(self.coordinates)}
        indices.update((name, index) for index, name in enumerate(self.coordinate_names))
        return indices

    @cached_property
    def _placements(self) -> dict[str, FramePlacement]:
        identity = np.eye(4)
        placements = {name: FramePlacement(GROUND, identity) for name in ("ground", "/ground")}
        for index, body in enumerate(self.bodies):
            placements[body.name] = placements[body.path] = FramePlacement(index, identity)
        return placements | dict(self.frames)

    @cached_property
    def _default_values(self) -> tuple[float, ...]:
        return tuple(info.default_value for info in self.coordinates)

    @cached_property
    def _default_speeds(self) -> tuple[float, ...]:
        return tuple(info.default_speed for info in self.coordinates)

    @cached_property
    def _zeros(self) -> Array:
        return np.zeros(len(self.coordinates))

    @cached_property
    def _unit(self) -> Array:
        """Unit matrix, for speeds that are rates; it cannot be written to."""
        unit = np.eye(len(self.coordinates))
        unit.flags.writeable = False
        return unit

    def _resolve_station(self, frame: str, station: ArrayLike) -> tuple[int, Array]:
        """Return the body of a frame, and a point of the frame in the body (3,), m.

        Args:
            frame: name of a frame or body.
            station: point in the frame (3,), m.
        """
        body, frame_in_body = self.placement(frame)
        point: Array = (
            frame_in_body[:3, :3] @ make_vector(station, "station") + frame_in_body[:3, 3]
        )
        return body, point

    def _convert_to_array(
        self, values: Values, quantity: str, defaults: Sequence[float] = ()
    ) -> Array:
        """Return values of coordinates as an array (n,).

        Args:
            values: array, or numbers by coordinate name.
            quantity: description of one number, for messages.
            defaults: values of omitted names; zeros if empty.

        Raises:
            ModelError: a name is unknown, or the number of values is wrong.
            SettingError: a value is not a number.
        """
        count = len(self.coordinates)
        # The usual case, in which simulations call, is not converted.
        if type(values) is np.ndarray and values.shape == (count,) and values.dtype == float:
            return values
        if isinstance(values, Mapping):
            result = np.array(defaults, dtype=float) if defaults else np.zeros(count)
            for name, value in values.items():
                index = self.coordinate_index(name)
                try:
                    result[index] = float(value)
                except (TypeError, ValueError):
                    raise SettingError(
                        f"coordinate '{name}' takes one number as its {quantity}, not {value!r}"
                    ) from None
            return result
        try:
            result = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise SettingError(
                f"'{self.name}' takes one {quantity} for each of its coordinates ({count}), as numbers"
            ) from None
        if result.shape != (count,):
            raise ModelError(
                f"'{self.name}' takes one {quantity} for each of its coordinates ({count}), in their order; "
                f"got {_describe_shape(result)}"
            )
        return result


def make_vector(values: ArrayLike, quantity: str) -> Array:
    """Return three numbers as an array (3,).

    Args:
        values: three numbers.
        quantity: noun for these numbers, for messages.

    Raises:
        ModelError: `values` does not have three numbers.
    """
    result = np.asarray(values, dtype=float)
    if result.shape != (3,):
        raise ModelError(f"a {quantity} has 3 numbers; got {_describe_shape(result)}")
    return result


def _describe_shape(values: Array) -> str:
    return " × ".join(str(size) for size in values.shape) or "a single one"
