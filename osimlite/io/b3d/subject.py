"""Subjects and trials of AddBiomechanics' files (.b3d).

A file holds a header and then the frames of all trials. A frame is a message of measurements
followed by one message for each processing pass of its trial. Each pass has its own model, as the
text of an .osim file. Frames are read from the file on demand, because files can be larger than
the memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from osimlite.base.files import open_file
from osimlite.base.records import dataclass, field
from osimlite.base.text import append_clause, format_count
from osimlite.errors import DocumentError, SettingError
from osimlite.io.b3d.frames import decode_frames
from osimlite.io.b3d.messages import (
    DATA_QUALITIES,
    PASS_FIELDS,
    PASS_TYPES,
    SENSOR_FIELDS,
    TRIAL_FEATURES,
    TRIAL_TYPES,
)
from osimlite.io.b3d.wire import DamagedMessageError
from osimlite.io.document.reader import read_text
from osimlite.io.nimble import list_coordinates
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model

RETRY = "download or copy the file again"
"""Next step after an error in the bytes of a file."""

BLOCK_BYTES = 16_000_000
"""Number of bytes of frames that are read at a time."""

DYNAMICS = PASS_TYPES.index("dynamics")
"""Number of the type of passes with moments and ground forces."""

MAX_START_TIME_S = 1e6
"""Largest start time that is believed; programs that did not set it wrote what was in their memory."""

VECTOR_SIZE = 3
"""Number of components of a position or force."""

WRENCH_SIZE = 6
"""Number of components of a wrench: torque, then force."""


@dataclass(frozen=True)
class B3dPass:
    """Processing pass of a trial.

    Attributes:
        type: number of the type in `PASS_TYPES`.
        header: values of the header of the pass, by the names in
            :data:`osimlite.io.b3d.messages.PASS_HEADER`.
    """

    type: int
    header: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """Type of the pass in words."""
        return _get_name(PASS_TYPES, self.type)


@dataclass(frozen=True, eq=False)
class B3dTrial:
    """Trial of a subject, or a piece of one.

    Attributes:
        subject: subject to which the trial belongs.
        name: name of the trial.
        frame_count: number of frames.
        time_step: time between two frames, s.
        passes: processing passes, in the order in which they were made.
        header: values of the header of the trial, by the names in
            :data:`osimlite.io.b3d.messages.TRIAL_HEADER`.
        offset: offset of the first frame in the file.
    """

    subject: B3dSubject = field(repr=False)
    name: str
    frame_count: int
    time_step: float
    passes: tuple[B3dPass, ...]
    header: Mapping[str, Any] = field(repr=False)
    offset: int = field(repr=False)

    @property
    def times(self) -> Array:
        """Times of the frames (n,), s; they begin where the piece begins in its recording."""
        start = float(self.header["original_start_time"])
        if not 0.0 <= start <= MAX_START_TIME_S:
            start = 0.0
        # The start has 32 bits only. Without rounding, times such as 0.30000001192092896 result.
        return np.asarray(
            round(start, 6) + self.time_step * np.arange(self.frame_count), dtype=float
        )

    @property
    def missing_forces(self) -> Array:
        """Numbers (n,) in `MISSING_FORCE_REASONS`: why the forces of a frame are not to be trusted; 0 if they are."""
        reasons = np.array(self.header["missing_forces"][: self.frame_count], dtype=int)
        # Older files have no reason for some frames.
        # Nimble takes frames without a reason for frames with external forces that were not measured.
        default_reasons = np.full(self.frame_count - len(reasons), 2)
        return np.concatenate([reasons, default_reasons])

    @property
    def type(self) -> str:
        """Type of the trial in words."""
        return _get_name(TRIAL_TYPES, self.header["type"])

    @property
    def features(self) -> tuple[str, ...]:
        """Detected features of the trial.

        Returns:
            Names of the features in words, in the order of the file.
        """
        return tuple(_get_name(TRIAL_FEATURES, number) for number in self.header["features"])

    def find_pass(self, processing_pass: int | str | None = None) -> int:
        """Return the index of a processing pass.

        Args:
            processing_pass: index, or type in words; None selects the last pass with dynamics, or
                else the last pass.

        Raises:
            SettingError: the trial has no such pass.
        """
        if processing_pass is None:
            # Dynamics is the last step that adds forces; later passes only filter.
            types = [candidate.type for candidate in self.passes]
            indices = [index for index, kind in enumerate(types) if kind == DYNAMICS]
            if not types:
                raise SettingError(f"the trial '{self.name}' has no processing passes")
            return indices[-1] if indices else len(types) - 1
        names = [candidate.name for candidate in self.passes]
        if isinstance(processing_pass, str):
            # Of passes of one type the last one counts.
            if processing_pass in names:
                return len(names) - 1 - names[::-1].index(processing_pass)
        elif 0 <= processing_pass < len(names):
            return processing_pass
        raise SettingError(
            f"the trial '{self.name}' has no processing pass '{processing_pass}'; it has: {', '.join(names)}"
        )

    def read_blocks(
        self, processing_pass: int | None = None, *, block_bytes: int = BLOCK_BYTES
    ) -> Iterator[dict[str, Array]]:
        """Yield the frames of the trial in blocks, with little memory for any number of frames.

        Args:
            processing_pass: index of the pass; None for the measurements.
            block_bytes: number of bytes to read at a time.

        Yields:
            Numbers of each field (frames, m) by the names of
            :data:`osimlite.io.b3d.messages.SENSOR_FIELDS` or `PASS_FIELDS`.

        Raises:
            DocumentError: a frame is damaged.
        """
        subject = self.subject
        # All frames of a trial have one size, so a block is read in one piece.
        stride = subject.sensor_frame_size + len(self.passes) * subject.pass_frame_size
        start, size, names = 0, subject.sensor_frame_size, SENSOR_FIELDS
        if processing_pass is not None:
            start = size + processing_pass * subject.pass_frame_size
            size, names = subject.pass_frame_size, PASS_FIELDS
        if not stride:
            return
        # At least one frame, however large.
        count = max(1, block_bytes // stride)
        with open_file(subject.path) as stream:
            for first in range(0, self.frame_count, count):
                frames = min(count, self.frame_count - first)
                content = read_at(
                    stream, self.offset + first * stride, frames * stride, subject.path
                )
                rows = np.frombuffer(content, np.uint8).reshape(frames, stride)
                try:
                    block = decode_frames(rows[:, start : start + size], names)
                    subject.check_sizes(block)
                except DamagedMessageError as error:
                    raise DocumentError(
                        append_clause(
                            f"the trial '{self.name}' is damaged in or after frame {first}: {error}",
                            RETRY,
                        ),
                        file=str(subject.path),
                    ) from None
                yield block

    def read_arrays(self, processing_pass: int | None = None) -> dict[str, Array]:
        """Read all frames of the trial at once.

        Args:
            processing_pass: index of the pass; None for the measurements.

        Returns:
            Arrays with one row per frame, by field; empty if the trial has no frames.

        Raises:
            DocumentError: the trial is damaged.
        """
        blocks = list(self.read_blocks(processing_pass))
        # A damaged file may have frames of different layouts.
        if any(block.keys() != blocks[0].keys() for block in blocks):
            raise DocumentError(
                f"the trial '{self.name}' is damaged: its frames have different fields; {RETRY}",
                file=str(self.subject.path),
            )
        return (
            {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
            if blocks
            else {}
        )

    def read_coordinates(self, processing_pass: int | str | None = None) -> StoTable:
        """Return the coordinates of the model (rad, m) over time.

        Args:
            processing_pass: index or type of the pass, see :meth:`find_pass`.

        Raises:
            DocumentError: the model does not have the coordinates of the file, or a frame is
                damaged.
        """
        return self._read_table("positions", processing_pass, "")

    def read_moments(self, processing_pass: int | str | None = None) -> StoTable:
        """Return the generalized forces of AddBiomechanics (N m, N) over time; arguments as of :meth:`read_coordinates`.

        The first six are the residuals on the root. They include the filtered accelerations of the
        file, so that inverse dynamics of the coordinates alone gives somewhat different values.
        """
        return self._read_table("moments", processing_pass, "_moment")

    def _read_table(self, name: str, processing_pass: int | str | None, ending: str) -> StoTable:
        index = self.find_pass(processing_pass)
        names = self.subject.list_coordinate_names(index)
        rows = self.read_arrays(index).get(name, np.zeros((self.frame_count, len(names))))
        labels = tuple(f"{coordinate_name}{ending}" for coordinate_name in names)
        return StoTable(self.name or "trial", self.times, labels, rows, file=str(self.subject.path))

    def read_markers(self) -> tuple[tuple[str, ...], Array]:
        """Return the measured markers; markers without a name are left out.

        Returns:
            Names (m,) and positions in ground (frames, m, 3), m; NaN where a marker was not seen.
        """
        names = self.subject.marker_names
        rows = self.read_arrays().get(
            "markers", np.full((self.frame_count, 3 * len(names)), np.nan)
        )
        positions = rows.reshape(len(rows), len(names), VECTOR_SIZE)
        # Markers without a name cannot be assigned to the model.
        indices = [index for index, name in enumerate(names) if name]
        return tuple(names[index] for index in indices), positions[:, indices]

    def read_wrenches(self, processing_pass: int | str | None = None) -> Array:
        """Return torque about the origin of ground (N m) and force (N) of the ground on each contact body.

        The components are along the axes of ground. Where a file has no wrenches, they follow from
        the forces, torques and centres of pressure, which are zero in the first and last frame.

        Args:
            processing_pass: index or type of the pass, see :meth:`find_pass`.

        Returns:
            Wrenches (frames, bodies, 6), bodies in the order of `contact_bodies`.
        """
        arrays = self.read_arrays(self.find_pass(processing_pass))
        shape = (self.frame_count, len(self.subject.contact_bodies))
        wrenches = arrays.get("contact_wrenches", np.zeros(0))
        # Files before September 2023 have points and torques, but no wrenches.
        if wrenches.any():
            return wrenches.reshape(*shape, WRENCH_SIZE)
        zero = np.zeros((self.frame_count, VECTOR_SIZE * shape[1]))
        points, torques, forces = (
            arrays.get(name, zero).reshape(*shape, VECTOR_SIZE)
            for name in ("contact_points", "contact_torques", "contact_forces")
        )
        # The moment about the origin of ground, from that about the point.
        return np.concatenate([torques + np.cross(points, forces), forces], axis=2)

    def read_ground_forces(self, processing_pass: int | str | None = None) -> StoTable:
        """Return the ground forces as the columns of an ExternalLoads file.

        For each contact body b the columns are ``ground_force_b_vx`` ... (N), ``ground_force_b_px``
        ... (m) and ``ground_torque_b_x`` ... (N m), in ground. Force, point and torque together are
        exactly the wrench of the file. Where the vertical force is large enough, the point is the
        centre of pressure on the plate, and the torque is vertical.

        Args:
            processing_pass: index or type of the pass, see :meth:`find_pass`.
        """
        wrenches = self.read_wrenches(processing_pass)
        columns = []
        labels = list[str]()
        for index, body in enumerate(self.subject.contact_bodies):
            torques, forces = np.split(wrenches[:, index], 2, axis=1)
            # ExternalLoads apply a force at a point: the centre of pressure.
            points = find_pressure_centers(torques, forces, self.plate_height)
            columns += [forces, points, torques - np.cross(points, forces)]
            name = body.rpartition("/")[2]
            for start in (
                f"ground_force_{name}_v",
                f"ground_force_{name}_p",
                f"ground_torque_{name}_",
            ):
                labels += [f"{start}{axis}" for axis in "xyz"]
        rows = np.concatenate(columns, axis=1) if columns else np.zeros((self.frame_count, 0))
        return StoTable(
            self.name or "trial", self.times, tuple(labels), rows, file=str(self.subject.path)
        )

    def read_force_plates(self) -> StoTable:
        """Return the readings of the force plates, in ground, before they were assigned to feet.

        For plate k, counted from 1, the columns are ``plate_k_force_vx`` ... (N), ``plate_k_force_px``
        ... (centre of pressure, m) and ``plate_k_torque_x`` ... (N m, about the centre of pressure).
        """
        arrays = self.read_arrays()
        count = self.header["plate_count"]
        columns = []
        labels = list[str]()
        parts = {"force_v": "plate_forces", "force_p": "plate_points", "torque_": "plate_torques"}
        for plate in range(count):
            for part, name in parts.items():
                array = arrays.get(name, np.zeros((self.frame_count, 0)))
                selected = array[:, VECTOR_SIZE * plate : VECTOR_SIZE * (plate + 1)]
                if selected.shape[1] == VECTOR_SIZE:
                    # The last plates may be missing in a damaged frame.
                    columns.append(selected)
                    labels += [f"plate_{plate + 1}_{part}{axis}" for axis in "xyz"]
        rows = np.concatenate(columns, axis=1) if columns else np.zeros((self.frame_count, 0))
        return StoTable(
            self.name or "trial", self.times, tuple(labels), rows, file=str(self.subject.path)
        )

    @property
    def plate_corners(self) -> Array:
        """Corners of the force plates (plates, 4, 3) in ground, m; no plates if they are unknown."""
        corners = np.array(self.header["plate_corners"], dtype=float)
        # Each plate has four corners of three coordinates.
        if len(corners) % 12 or not np.isfinite(corners).all() or not corners.any():
            return np.zeros((0, 4, VECTOR_SIZE))
        return corners.reshape(-1, 4, VECTOR_SIZE)

    @property
    def plate_height(self) -> float:
        """Height of the force plates in ground, m; 0 if it is unknown."""
        corners = self.plate_corners
        return float(np.median(corners[:, :, 1])) if len(corners) else 0.0


@dataclass(eq=False)
class B3dSubject:
    """Subject of a .b3d file.

    Attributes:
        path: path of the .b3d file.
        header: values of the header, by the names in :data:`osimlite.io.b3d.messages.HEADER`.
        trials: trials of the subject, in the order of the file.
        sensor_frame_size: number of bytes of the measurements of a frame.
        pass_frame_size: number of bytes of a processing pass of a frame.
    """

    path: Path
    header: Mapping[str, Any] = field(repr=False)
    trials: tuple[B3dTrial, ...] = field(default=(), repr=False)
    sensor_frame_size: int = 0
    pass_frame_size: int = 0
    _models: dict[int, Model] = field(default_factory=dict, repr=False)

    @property
    def pass_types(self) -> tuple[str, ...]:
        """Types of the processing passes; a trial can have fewer passes.

        Returns:
            Names of the types in words, one for each pass.
        """
        return tuple(_get_name(PASS_TYPES, entry["type"]) for entry in self.header["passes"])

    @property
    def model_texts(self) -> tuple[str, ...]:
        """Text of the .osim file of each processing pass.

        Returns:
            One text per pass, in the order of `pass_types`.
        """
        return tuple(entry["model_text"] for entry in self.header["passes"])

    @property
    def contact_bodies(self) -> tuple[str, ...]:
        """Names (b,) of the bodies on which the ground acts."""
        return self.header["contact_bodies"]

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Names of the measured markers; a name can be empty."""
        return self.header["marker_names"]

    @property
    def mass(self) -> float:
        """Mass of the subject, kg."""
        return self.header["mass"]

    @property
    def height(self) -> float:
        """Height of the subject, m."""
        return self.header["height"]

    @property
    # Nimble writes -1 for an unknown age.
    def age(self) -> int | None:
        """Age of the subject in years; None if it is unknown."""
        return self.header["age"] if self.header["age"] >= 0 else None

    @property
    def quality(self) -> str:
        """Quality of the data in words."""
        return _get_name(DATA_QUALITIES, self.header["quality"])

    def read_model(self, processing_pass: int = -1) -> Model:
        """Return the model of a processing pass, a new one in each call.

        Args:
            processing_pass: index of the pass; the last one by default.

        Raises:
            DocumentError: the text is not a model.
            SettingError: there is no such pass.
        """
        return self._read_shared_model(processing_pass).copy_deep()

    def _read_shared_model(self, processing_pass: int) -> Model:
        """Return the model of a processing pass; callers share it and must not change it.

        Raises:
            SettingError: the file has no processing pass with this index.
            DocumentError: the text of the model cannot be read.
        """
        count = len(self.model_texts)
        # Negative indices count from the last pass, as for lists.
        index = processing_pass + count if processing_pass < 0 else processing_pass
        if not 0 <= index < count:
            raise SettingError(
                f"the file has {count} processing passes, and none with index {processing_pass}"
            )
        if index not in self._models:
            try:
                self._models[index] = read_text(self.model_texts[index])
            except DocumentError as error:
                raise DocumentError(
                    f"the model of processing pass {index} cannot be read: {error.message}",
                    file=str(self.path),
                ) from None
        return self._models[index]

    def list_coordinate_names(self, processing_pass: int = -1) -> tuple[str, ...]:
        """Return the names of the coordinates in the order of the file.

        The file has no names. They follow from the model, in the order of Nimble.

        Args:
            processing_pass: index of the pass; the last one by default.

        Returns:
            Names, one for each column of the positions.

        Raises:
            DocumentError: the model cannot be read, or has another number of coordinates.
        """
        names = tuple(
            coordinate.name
            for coordinate in list_coordinates(self._read_shared_model(processing_pass))
        )
        if len(names) != self.header["dof_count"]:
            raise DocumentError(
                f"the frames have {format_count(self.header['dof_count'], 'coordinate')}, "
                f"but the model of the pass has {len(names)}",
                file=str(self.path),
            )
        return names

    @cached_property
    def _field_sizes(self) -> dict[str, int]:
        """Number of numbers that a field has in each frame, by its name."""
        header = self.header
        dofs = header["dof_count"]
        bodies = len(header["contact_bodies"])
        sizes = dict.fromkeys(("positions", "velocities", "accelerations", "moments"), dofs)
        sizes |= dict.fromkeys(("contact_points", "contact_torques", "contact_forces"), 3 * bodies)
        sizes |= {"contact_wrenches": 6 * bodies, "markers": 3 * len(header["marker_names"])}
        sizes |= dict.fromkeys(
            ("mass_center", "mass_center_velocity", "mass_center_acceleration"), 3
        )
        sizes |= {"emg": header["emg_samples"] * len(header["emg_names"])}
        sizes |= {"accelerometers": 3 * len(header["accelerometer_names"])}
        sizes |= {"gyroscopes": 3 * len(header["gyroscope_names"])}
        return sizes | {"exo": len(header["exo_dofs"]), "custom": sum(header["custom_sizes"])}

    def check_sizes(self, block: Mapping[str, Array]) -> None:
        """Compare the sizes of the fields of frames with the header.

        Raises:
            DamagedMessageError: a field has another size.
        """
        for name, size in self._field_sizes.items():
            if name in block and block[name].shape[1] != size:
                raise DamagedMessageError(
                    f"'{name}' has {format_count(block[name].shape[1], 'number')} instead of {size}"
                )


def read_at(stream: BinaryIO, offset: int, size: int, path: Path) -> bytes:
    """Return bytes of a file from an offset on.

    Raises:
        DocumentError: the file cannot be read, or ends before the last of the bytes.
    """
    try:
        # The position may be beyond what the system allows.
        stream.seek(offset)
        content = stream.read(size)
    except OSError as error:
        raise DocumentError(f"cannot read the file: {error.strerror}", file=str(path)) from None
    if len(content) < size:
        raise DocumentError("the file ends too early; it was cut off", file=str(path))
    return content


def _get_name(names: Sequence[str], number: int) -> str:
    """Return a word for a number; the number itself if it has none, as in files of later programs."""
    return names[number] if 0 <= number < len(names) else str(number)


MIN_PRESSURE_FORCE_N = 10.0
"""Vertical force above which a centre of pressure is computed; below it is ill-conditioned."""


def find_pressure_centers(torques: Array, forces: Array, height: float) -> Array:
    """Return centres of pressure (n, 3), m: where the torque about the horizontal axes vanishes.

    With the torque M about the origin of ground and the force F, a point at the height h has
    p_x = (M_z + h F_x) / F_y and p_z = (h F_z - M_x) / F_y. Where F_y is small, the point of the
    nearest frame with a large force is used, so that points between frames stay on the plate.

    Args:
        torques: torques about the origin of ground (n, 3), N m.
        forces: forces (n, 3), N.
        height: height of the plate, m.
    """
    points = np.zeros_like(forces)
    # Small vertical forces move the quotient by metres.
    loaded = np.flatnonzero(np.abs(forces[:, 1]) > MIN_PRESSURE_FORCE_N)
    if not len(loaded):
        return points
    vertical_forces = forces[loaded, 1]
    points[loaded, 0] = (torques[loaded, 2] + height * forces[loaded, 0]) / vertical_forces
    points[loaded, 1] = height
    points[loaded, 2] = (height * forces[loaded, 2] - torques[loaded, 0]) / vertical_forces
    frames = np.arange(len(forces))
    # Frames without load take the point of the nearest loaded frame, so that the curve has no jumps
    # to the origin.
    next_loaded = np.clip(np.searchsorted(loaded, frames), 0, len(loaded) - 1)
    previous_loaded = np.clip(next_loaded - 1, 0, len(loaded) - 1)
    is_nearer = frames - loaded[previous_loaded] <= np.abs(loaded[next_loaded] - frames)
    nearest = np.where(
        is_nearer & (loaded[previous_loaded] <= frames),
        loaded[previous_loaded],
        loaded[next_loaded],
    )
    return points[nearest]
