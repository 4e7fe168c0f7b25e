"""Reader of URDF with a file of coordinates that does not use osimlite: it computes the poses of all bodies."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ElementTree
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def evaluate(law: Mapping[str, Any], x: Sequence[float]) -> float:
    """Evaluate a function of the file of coordinates."""
    match law["type"]:
        case "constant":
            return law["value"]
        case "linear":
            return law["slope"] * x[0] + law["start"]
        case "weighted-sum":
            return (
                sum(weight * value for weight, value in zip(law["weights"], x, strict=True))
                + law["start"]
            )
        case "polynomial":
            return _polynomial(law["coefficients"], x[0])
        case "sine":
            return law["amplitude"] * math.sin(law["omega"] * x[0] + law["phase"]) + law["offset"]
        case "step":
            (start, end), (first, last) = law["x"], law["y"]
            t = min(max((x[0] - start) / (end - start), 0.0), 1.0)
            return first + (last - first) * (10.0 * t**3 - 15.0 * t**4 + 6.0 * t**5)
        case "multivariate-polynomial":
            terms = zip(law["coefficients"], law["powers"], strict=True)
            return sum(
                c * math.prod(v**p for v, p in zip(x, powers, strict=True)) for c, powers in terms
            )
        case "scaled":
            return law["scale"] * evaluate(law["function"], x)
        case "piecewise-linear":
            return float(_lines(law["x"], law["y"], x[0]))
        case "piecewise-constant":
            return law["y"][max(bisect_right(law["x"], x[0]) - 1, 0)]
        case "piecewise-polynomial":
            place = bisect_right(law["x"], x[0])
            return _polynomial(law["pieces"][place], x[0] - law["x"][max(place - 1, 0)])
        case "ellipsoid-point":
            a, b = x[0], x[1]
            normal = (math.sin(b), -math.sin(a) * math.cos(b), math.cos(a) * math.cos(b))
            return law["radius"] * normal[law["component"]]
        case "arc-point":
            a, b = (angle + start for angle, start in zip(x, law["neutral"], strict=True))
            t = math.acos(math.cos(a) * math.cos(b))
            s = (1.0 - math.cos(t)) / (t * math.sin(t))
            return (
                law["length"]
                * (-s * math.sin(b), math.sin(t) / t, s * math.sin(a) * math.cos(b))[
                    law["component"]
                ]
            )
    raise ValueError(law["type"])


def _polynomial(coefficients: Sequence[float], t: float) -> float:
    return sum(coefficient * t**power for power, coefficient in enumerate(coefficients))


def _lines(xs: Sequence[float], ys: Sequence[float], x: float) -> float:
    k = min(max(bisect_right(xs, x) - 1, 0), len(xs) - 2)
    return ys[k] + (ys[k + 1] - ys[k]) / (xs[k + 1] - xs[k]) * (x - xs[k])


class Reader:
    """Reader of a URDF with its file of coordinates."""

    def __init__(self, urdf: str, coordinates: str) -> None:
        self.root = ElementTree.fromstring(urdf)
        self.data = json.loads(coordinates)

    def coupled(self, q: Mapping[str, float]) -> dict[str, float]:
        """Return values by path that fulfil the couplers; later couplers may depend on earlier ones."""
        values = dict(q)
        for _ in self.data["couplers"]:
            for coupler in self.data["couplers"]:
                others = [values[path] for path in coupler["independent"]]
                values[coupler["dependent"]] = evaluate(coupler["function"], others)
        return values

    def joint_values(self, q: Mapping[str, float]) -> dict[str, float]:
        """Return the values F(q) of all moving joints by name."""
        return {
            joint["name"]: evaluate(joint["function"], [q[path] for path in joint["coordinates"]])
            for joint in self.data["joints"]
        }

    def mimicked(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the values of joints that mimic others in the URDF, from the values of their leaders."""
        result = {}
        for joint in self.root.iterfind("joint"):
            mimic = joint.find("mimic")
            if mimic is not None:
                slope, start = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
                result[joint.get("name", "")] = slope * values[mimic.get("joint", "")] + start
        return result

    def body_poses(self, q):
        """Return the pose (4, 4) in ground of every body, by path."""
        values = self.joint_values(q)
        joints = list(self.root.iterfind("joint"))
        children = {joint.find("child").get("link") for joint in joints}
        (root,) = {link.get("name") for link in self.root.iterfind("link")} - children
        placed = {root: np.eye(4)}
        while len(placed) <= len(joints):
            for joint in joints:
                parent, child = joint.find("parent").get("link"), joint.find("child").get("link")
                if parent in placed and child not in placed:
                    placed[child] = placed[parent] @ _origin(joint) @ _motion(joint, values)
        return {body["path"]: placed[body["link"]] @ body["frame"] for body in self.data["bodies"]}


def _numbers(text):
    return np.array([float(word) for word in text.split()])


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    k = np.cross(np.eye(3), axis / np.linalg.norm(axis))
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k


def _origin(joint):
    origin = joint.find("origin")
    roll, pitch, yaw = _numbers(origin.get("rpy"))
    x, y, z = np.eye(3)
    result = np.eye(4)
    result[:3, :3] = _turn(z, yaw) @ _turn(y, pitch) @ _turn(x, roll)
    result[:3, 3] = _numbers(origin.get("xyz"))
    return result


def _motion(joint, values):
    result, kind = np.eye(4), joint.get("type")
    if kind != "fixed":
        axis, value = _numbers(joint.find("axis").get("xyz")), values[joint.get("name")]
        if kind == "prismatic":
            result[:3, 3] = axis * value
        else:
            result[:3, :3] = _turn(axis, value)
    return result
