"""Tests of glTF files: they are read according to the standard, and bodies and paths are compared with the scene."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.view.collect import build_scene
from osimlite.view.drawn_forces import DrawnForces
from osimlite.view.glb import MAX_FRAME_RATE_HZ, write_glb
from osimlite.view.motion import order_columns
from tests.view.motions import Recorded, stroll

WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Read:
    """glTF file that is read according to the standard."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.parts: dict[str, Any] = json.loads(data[20 : 20 + size])
        size_, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and size_ % 4 == 0 and 28 + size + size_ == len(data)
        self.buffer = data[28 + size :]
        assert all(part != [] for part in self.parts.values())

    def array(self, number: int) -> Any:
        entry = self.parts["accessors"][number]
        view = self.parts["bufferViews"][entry["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4"}[entry["componentType"]]
        result = np.frombuffer(self.buffer, kind, view["byteLength"] // 4, view["byteOffset"])
        return result.reshape(entry["count"], WIDTHS[entry["type"]])

    def nodes(self, name: str) -> list[int]:
        return [index for index, node in enumerate(self.parts["nodes"]) if node["name"] == name]

    def placed(self, place: int, moment: int) -> Any:
        """Return the matrix (4, 4) of a node in the scene at a frame of the animation."""
        node = dict(self.parts["nodes"][place])
        for channel in self.parts.get("animations", [{"channels": []}])[0]["channels"]:
            if channel["target"]["node"] == place:
                sampler = self.parts["animations"][0]["samplers"][channel["sampler"]]
                node[channel["target"]["path"]] = self.array(sampler["output"])[moment].tolist()
        matrix = np.eye(4)
        if "matrix" in node:
            matrix = np.array(node["matrix"]).reshape(4, 4).T
        else:
            x, y, z, w = node.get("rotation", (0, 0, 0, 1))
            assert x * x + y * y + z * z + w * w == pytest.approx(1.0, abs=1e-6)
            turn = np.array(
                (
                    (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
                    (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
                    (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
                )
            )
            matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)))
            matrix[:3, 3] = node.get("translation", (0, 0, 0))
        above = [
            k for k, other in enumerate(self.parts["nodes"]) if place in other.get("children", ())
        ]
        return self.placed(above[0], moment) @ matrix if above else matrix


def written(model, folder, motion=None, q=None):
    mechanism = build_mechanism(model)
    scene = build_scene(model, mechanism, None)
    q = mechanism.assemble({}) if q is None else q
    return scene, Read(write_glb(scene, q, motion, folder / "model.glb").read_bytes())


def test_bodies_and_shapes_move(tmp_path):
    motion = stroll()
    motion.values = motion.values + np.linspace(0.0, 7.0, len(motion.times))[:, None]
    scene, read = written(dynamic_walker(), tmp_path, motion)
    times = read.array(read.parts["animations"][0]["samplers"][0]["input"])[:, 0]
    assert len(times) == round(0.5 * MAX_FRAME_RATE_HZ) + 1
    assert (times[0], times[-1]) == (0.0, 0.5)
    values = order_columns(motion, scene.mechanism, motion.values)
    for moment in (0, 11, 30):
        q = [np.interp(times[moment], motion.times, column) for column in values.T]
        bodies = scene.compute_poses(np.array(q))
        for index, body in enumerate(scene.mechanism.bodies):
            (node,) = read.nodes(body.name)
            assert (
                np.abs(read.placed(node, moment) - bodies.transform_frame(index, np.eye(4))).max()
                < 1e-5
            )
        for item in scene.iterate_visible_items():
            shown = [read.placed(node, moment) for node in read.nodes(item.path)]
            assert (
                min(
                    np.abs(result - bodies.transform_frame(item.body, item.matrix)).max()
                    for result in shown
                )
                < 1e-4
            )
    # Players interpolate quaternions linearly, which is the short way only if neighbours have the
    # same sign.
    for channel, sampler in zip(
        *(read.parts["animations"][0][what] for what in ("channels", "samplers")), strict=True
    ):
        if channel["target"]["path"] == "rotation":
            turns = read.array(sampler["output"])
            assert (np.sum(turns[1:] * turns[:-1], axis=1) >= 0.0).all()


def test_forces_are_arrows(tmp_path):
    motion = stroll()
    scene, read = written(dynamic_walker(), tmp_path, motion)
    pushes = DrawnForces.from_motion(scene, motion, np.array([0.2]))
    bodies = scene.compute_poses(order_columns(motion, scene.mechanism, motion.values)[20])
    tips = [read.placed(place, 12) @ (0.0, 0.0, z, 1.0) for on, _, _ in pushes.locate_forces(0, bodies)
            for place in read.nodes(on.path) for z in (-0.5, 0.5)]  # fmt: skip
    for _, point, force in pushes.locate_forces(0, bodies):
        assert min(np.linalg.norm(tip[:3] - point) for tip in tips) < 1e-5
        if force.any():
            ways = [b - a for a, b in zip(tips[::2], tips[1::2], strict=True) if (a != b).any()]
            assert (
                max(way[:3] @ force / np.linalg.norm(way) / np.linalg.norm(force) for way in ways)
                > 1.0 - 1e-6
            )


def test_paths_have_as_many_pieces_as_corners(corpus, tmp_path):
    (path,) = (model.path for model in corpus if model.id == "m0005")
    model = osimlite.read(path)
    mechanism = build_mechanism(model)
    q = mechanism.default_state()[0]
    rows = np.tile(q, (3, 1))
    knee = mechanism.coordinate_index("knee_angle_r")
    rows[:, knee] = (0.0, -1.0, -2.0)
    motion = Recorded(np.array((0.0, 0.5, 1.0)), mechanism.coordinate_names, rows, 0.0 * rows)
    scene, read = written(model, tmp_path, motion)
    for place, line in ((k, line) for k, line in enumerate(scene.lines) if line.layer == "paths"):
        for moment, row in enumerate(rows):
            corners = scene.compute_poses(row).lines[place]
            pieces = [read.placed(place, moment) for place in read.nodes(line.path)]
            ends = [
                [piece @ (0.0, 0.0, z, 1.0) for z in (-0.5, 0.5)]
                for piece in pieces
                if np.abs(piece[:3, :3]).any()
            ]
            assert (
                np.abs(np.array([ends[0][0], *(end for _, end in ends)])[:, :3] - corners).max()
                < 1e-5
            )


def test_up_is_y(tmp_path):
    model = dynamic_walker()
    model.gravity = (0.0, 0.0, -9.8)
    _, read = written(model, tmp_path)
    assert read.placed(0, 0)[:3, :3] @ (0.0, 0.0, 1.0) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    assert "animations" not in read.parts
    model.gravity = (0.0, 9.8, 0.0)
    _, read = written(model, tmp_path)
    assert read.placed(0, 0)[:3, :3] @ (0.0, -1.0, 0.0) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
