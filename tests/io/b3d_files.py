"""Files of AddBiomechanics for tests, written according to the description of the format."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import osimlite
from osimlite.io.b3d.messages import HEADER, PASS_FIELDS, SENSOR_FIELDS
from osimlite.io.b3d.wire import Schema

BODIES = ("calcn_r", "calcn_l")
MARKERS = ("RASI", "LASI", "")
STEP_S = 0.01


def encode_varint(value: int) -> bytes:
    value &= 0xFFFF_FFFF_FFFF_FFFF
    result = bytearray()
    while value > 0x7F:
        result.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*result, value])


def encode_bytes(number: int, content: bytes) -> bytes:
    return encode_varint(number << 3 | 2) + encode_varint(len(content)) + content


def encode_message(values: Mapping[str, Any], schema: Schema) -> bytes:
    """Encode values as Protocol Buffers does.

    Fields are in order, default values are omitted, and repeated numbers are packed.
    """
    result = b""
    for number, (name, kind, repeated) in sorted(schema.items()):
        value = values.get(name, () if repeated else 0)
        if not isinstance(kind, str):
            result += b"".join(encode_bytes(number, encode_message(each, kind)) for each in value)
        elif kind == "text":
            texts = value if repeated else [value] if value else []
            result += b"".join(encode_bytes(number, text.encode()) for text in texts)
        elif repeated:
            if len(value):
                result += encode_bytes(
                    number, b"".join(_encode_number(kind, each) for each in value)
                )
        elif value:
            wire_type = {"float": 5, "double": 1}.get(kind, 0)
            result += encode_varint(number << 3 | wire_type) + _encode_number(kind, value)
    return result


def _encode_number(kind: str, value: float) -> bytes:
    if kind in ("float", "double"):
        return struct.pack("<f" if kind == "float" else "<d", value)
    return encode_varint(int(value))


def encode_frame(values: Mapping[str, Any], names: Mapping[int, str]) -> bytes:
    return b"".join(
        encode_bytes(number, np.asarray(values[name], "<f8").tobytes())
        for number, name in sorted(names.items())
        if name in values
    )


def make_walker() -> osimlite.Model:
    """Return a model of a pelvis with two legs.

    The legs are listed alternately, so that Nimble has another order of coordinates.
    """
    model = osimlite.Model(name="walker")
    inertia = (0.1, 0.1, 0.1, 0.0, 0.0, 0.0)
    ground = model.ground
    bodies = {}
    for name in ("pelvis", *BODIES, "toes_r", "toes_l", "patella_r"):
        bodies[name] = model.add(osimlite.Body(name=name, mass=2.0, inertia=inertia))
    names = ("tilt", "list", "turn", "tx", "ty", "tz")
    axes = {}
    turns = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    places = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")
    units = (*turns, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    for place, unit, name in zip(places, units, names, strict=True):
        function = osimlite.LinearFunction(coefficients=(1.0, 0.0))
        axes[place] = osimlite.TransformAxis(
            name=place, axis=unit, function=function, coordinates=(name,)
        )
    root = osimlite.CustomJoint(
        name="ground_pelvis",
        coordinates=[osimlite.Coordinate(name=name, range=(-3.0, 3.0)) for name in names],
        spatial_transform=osimlite.SpatialTransform(**axes),
    )
    model.add(root.between(ground, bodies["pelvis"]))

    def pin(
        name: str, coordinate: str, parent: str, child: str, at: tuple[float, float, float]
    ) -> None:
        joint = osimlite.PinJoint(
            name=name, coordinates=[osimlite.Coordinate(name=coordinate, range=(-1.5, 1.5))]
        )
        model.add(joint.between(bodies[parent], bodies[child], at=at))

    pin("hip_r", "hip_r_flexion", "pelvis", "calcn_r", (0.0, -0.8, 0.1))
    pin("hip_l", "hip_l_flexion", "pelvis", "calcn_l", (0.0, -0.8, -0.1))
    pin("mtp_r", "mtp_r_angle", "calcn_r", "toes_r", (0.1, 0.0, 0.0))
    pin("mtp_l", "mtp_l_angle", "calcn_l", "toes_l", (0.1, 0.0, 0.0))
    pin("patellofemoral_r", "patella_r_angle", "calcn_r", "patella_r", (0.1, 0.3, 0.0))
    model.add(
        osimlite.CoordinateCouplerConstraint(
            name="patella",
            coupled_coordinates_function=osimlite.LinearFunction(coefficients=(0.5, 0.1)),
            independent_coordinate_names=("hip_r_flexion",),
            dependent_coordinate_name="patella_r_angle",
        )
    )
    return model


NIMBLE_ORDER = (
    "tilt", "list", "turn", "tx", "ty", "tz", "hip_r_flexion", "mtp_r_angle", "hip_l_flexion", "mtp_l_angle",
)  # fmt: skip
"""Coordinates of the walker in Nimble's order: one leg after the other, without the patella."""


def make_arrays(frames: int, seed: int = 0) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return random measurements, and a processing pass with plausible contact forces.

    Args:
        frames: number of frames.
        seed: seed of the random numbers.

    Returns:
        Measured arrays and arrays of the pass, by name.
    """
    rng = np.random.default_rng(seed)
    dofs = len(NIMBLE_ORDER)
    markers = rng.normal(size=(frames, 3 * len(MARKERS)))
    markers[frames // 2, :3] = np.nan
    sensors = {"markers": markers, "emg": rng.normal(size=(frames, 4))}
    for name in ("plate_points", "plate_torques", "plate_forces"):
        sensors[name] = rng.normal(size=(frames, 6))
    times = STEP_S * np.arange(frames)[:, None]
    processed = {"positions": 0.2 * np.sin(times * np.arange(1, dofs + 1))}
    processed["positions"][:, 4] += 0.9
    for name in ("velocities", "accelerations", "moments"):
        processed[name] = rng.normal(size=(frames, dofs))
    force = rng.normal(size=(frames, 2, 3)) * 20.0 + (0.0, 300.0, 0.0)
    force[: frames // 3, 1] = 0.0
    point = rng.normal(size=(frames, 2, 3)) * 0.1
    point[:, :, 1] = 0.0
    torque = np.zeros_like(force)
    torque[:, :, 1] = 5.0 * (force[:, :, 1] > 0.0)
    moment = torque + np.cross(point, force)
    processed["contact_wrenches"] = np.concatenate([moment, force], axis=2).reshape(frames, -1)
    processed["contact_points"] = (point * (force[:, :, 1:2] > 0.0)).reshape(frames, -1)
    processed["contact_torques"] = torque.reshape(frames, -1)
    processed["contact_forces"] = force.reshape(frames, -1)
    for name in ("mass_center", "mass_center_velocity", "mass_center_acceleration"):
        processed[name] = rng.normal(size=(frames, 3))
    return sensors, processed


def make_header(model_text: str, frames: Sequence[int], passes: Sequence[int]) -> dict[str, Any]:
    """Return the header of a subject.

    Args:
        model_text: text of the model.
        frames: number of frames of each trial.
        passes: types of the processing passes.

    Returns:
        Values of the header by the names of its fields.
    """
    sensors, processed = make_arrays(1)
    trials = [
        {
            "name": f"walk/{index}",
            "frame_count": count,
            "time_step": STEP_S,
            "missing_forces": [0] * (count - 1) + [5],
            "passes": [{"type": kind, "positions_observed": [True] * 10} for kind in passes],
            "plate_count": 2,
            "plate_corners": [0.0, 0.01, 0.0, 1.0, 0.01, 0.0, 1.0, 0.01, 1.0, 0.0, 0.01, 1.0] * 2,
            "original_name": "walk",
            "split_index": index,
            "original_start_time": 0.5 * index,
            "original_start_frame": 1730176360,
            "type": 1,
            "features": [0, 3],
        }
        for index, count in enumerate(frames)
    ]
    return {
        "dof_count": len(NIMBLE_ORDER),
        "joint_count": 5,
        "sensor_frame_size": len(
            encode_frame({n: v[0] for n, v in sensors.items()}, SENSOR_FIELDS)
        ),
        "pass_frame_size": len(encode_frame({n: v[0] for n, v in processed.items()}, PASS_FIELDS)),
        "passes": [{"type": kind, "model_text": model_text} for kind in passes],
        "contact_bodies": BODIES,
        "trials": trials,
        "version": 4,
        "notes": "made for a test",
        "sex": "unknown",
        "height": 1.7,
        "mass": 70.0,
        "age": -1,
        "marker_names": MARKERS,
        "emg_names": ("vastus", "soleus"),
        "emg_samples": 2,
        "tags": ("healthy",),
        "quality": 1,
    }


def encode_file(header: bytes, frames: bytes = b"") -> bytes:
    return struct.pack("<q", len(header)) + header + frames


def make_subject(
    frames: Sequence[int] = (12, 7), passes: Sequence[int] = (0, 1), model_text: str | None = None
) -> bytes:
    """Return the content of a .b3d file.

    Args:
        frames: number of frames of each trial.
        passes: types of the processing passes.
        model_text: text of the model, None for that of `make_walker`.
    """
    text = osimlite.to_text(make_walker()) if model_text is None else model_text
    body = b""
    for index, count in enumerate(frames):
        sensors, processed = make_arrays(count, index)
        for frame in range(count):
            body += encode_frame({n: v[frame] for n, v in sensors.items()}, SENSOR_FIELDS)
            body += encode_frame({n: v[frame] for n, v in processed.items()}, PASS_FIELDS) * len(
                passes
            )
    return encode_file(encode_message(make_header(text, frames, passes), HEADER), body)


def write_subject(path: Path, *arguments: Any, **named: Any) -> Path:
    path.write_bytes(make_subject(*arguments, **named))
    return path
