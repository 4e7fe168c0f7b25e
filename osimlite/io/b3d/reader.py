"""Reader of AddBiomechanics' files (.b3d): the header, its version, and checks that it is plausible.

The header describes the subject and how many bytes the frames of each trial take. Frames are not
read here; :class:`osimlite.io.b3d.subject.B3dTrial` reads them on demand.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from osimlite.base.files import expect_size, open_file
from osimlite.base.text import append_clause, format_count
from osimlite.errors import DocumentError
from osimlite.io.b3d.messages import HEADER, VERSION
from osimlite.io.b3d.subject import RETRY, B3dPass, B3dSubject, B3dTrial, read_at
from osimlite.io.b3d.wire import (
    BYTES,
    FIXED64,
    VARINT,
    DamagedMessageError,
    decode_message,
    split_message,
)

LENGTH_BYTES = 8
"""Size of the length of the header at the beginning of a file."""


def read_b3d(path: str | Path) -> B3dSubject:
    """Read the header of a .b3d file; frames are read at the first access.

    Args:
        path: path of the .b3d file.

    Returns:
        Subject with its header and trials.

    Raises:
        MissingFileError: the file does not exist or cannot be read.
        DocumentError: the file is damaged, or has another version than 4.
    """
    file = str(path)
    with open_file(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        length_bytes = read_at(stream, 0, min(size, LENGTH_BYTES), Path(path))
        length = int.from_bytes(length_bytes, "little", signed=True)
        if len(length_bytes) < LENGTH_BYTES or not 0 < length <= size - LENGTH_BYTES:
            raise DocumentError(
                "this is not a .b3d file, or it was cut off within its header", file=file
            )
        # 1. The header: its length is compared with the file's before memory is taken for it.
        expect_size(length, path)
        data = memoryview(read_at(stream, LENGTH_BYTES, length, Path(path)))
    try:
        _expect_version(data, file)
        header = decode_message(data, HEADER)
    except DamagedMessageError as error:
        raise DocumentError(
            append_clause(f"the header of the file is damaged: {error}", RETRY), file=file
        ) from None
    sensor, processed = header["sensor_frame_size"], header["pass_frame_size"]
    # 2. The trials: their frames follow each other without gaps.
    trials: list[B3dTrial] = []
    subject = B3dSubject(Path(path), header, sensor_frame_size=sensor, pass_frame_size=processed)
    offset = LENGTH_BYTES + length
    _expect_plausible(header, file)
    for values in header["trials"]:
        passes = tuple(B3dPass(entry["type"], entry) for entry in values["passes"])
        count = values["frame_count"]
        trials.append(
            B3dTrial(subject, values["name"], count, values["time_step"], passes, values, offset)
        )
        offset += count * (sensor + len(passes) * processed)
    # 3. Header and file must agree to the byte.
    if offset != size:
        raise DocumentError(
            f"the file has {format_count(size, 'byte')}, but its header describes {offset}; "
            f"it was cut off or is damaged; {RETRY}",
            file=file,
        )
    subject.trials = tuple(trials)
    return subject


def _expect_version(data: memoryview, file: str) -> None:
    """Raise an error unless a header has the field numbers of version 4.

    Raises:
        DocumentError: the header has no version, another version, or fields of different versions.
    """
    versions = []
    has_other_numbers = False
    for message_field in split_message(data):
        if message_field.number == 10:
            # In versions 1 and 2 field 10 holds the names of the trials, and 13 the version.
            has_other_numbers |= message_field.wire_type == BYTES
            versions += [message_field.value] if isinstance(message_field.value, int) else []
        elif message_field.number == 17 and message_field.wire_type == FIXED64:
            # In version 3 field 17 is the mass; in version 4 the name of a marker.
            versions = [3]
        elif (
            message_field.number == 13
            and message_field.wire_type == VARINT
            and isinstance(message_field.value, int)
        ):
            versions = [message_field.value]
            has_other_numbers = True
    version = versions[-1] if versions else None
    if version == VERSION and not has_other_numbers:
        return
    if version is None:
        reason = "this is not a .b3d file: its header has no version"
        if has_other_numbers:
            reason = "the file has version 1 or 2 of the format; osimlite reads version 4"
    elif version > VERSION:
        reason = f"the file has version {version} of the format; osimlite reads version 4"
    elif has_other_numbers and version == VERSION:
        reason = (
            "the header of the file is damaged: its fields are those of different versions; "
            f"{RETRY}"
        )
    else:
        reason = (
            f"the file has version {version} of the format; osimlite reads version 4, which AddBiomechanics writes "
            "since September 2023; download the subject again"
        )
    raise DocumentError(reason, file=file)


def _expect_plausible(header: Mapping[str, Any], file: str) -> None:
    """Raise an error if numbers of a header cannot be right.

    Raises:
        DocumentError: a count or size is negative, a time step is not positive and finite, custom
            values have wrong sizes, or a trial has more processing passes than the file.
    """
    problems = []
    counts = ("dof_count", "sensor_frame_size", "pass_frame_size", "emg_samples")
    problems += [f"'{name}' is {header[name]}" for name in counts if header[name] < 0]
    # Sizes of custom values must belong to their names.
    if len(header["custom_names"]) != len(header["custom_sizes"]) or any(
        size < 0 for size in header["custom_sizes"]
    ):
        problems.append("its custom values have wrong sizes")
    for index, trial in enumerate(header["trials"]):
        step = trial["time_step"]
        if trial["frame_count"] < 0 or trial["plate_count"] < 0:
            problems.append(f"trial {index} has a negative number of frames or force plates")
        elif not 0.0 < step < math.inf and trial["frame_count"]:
            problems.append(f"the time step of trial {index} is {step:g} s")
        elif len(trial["passes"]) > len(header["passes"]):
            problems.append(f"trial {index} has more processing passes than the file")
    if problems:
        raise DocumentError(f"the header of the file is damaged: {problems[0]}; {RETRY}", file=file)
