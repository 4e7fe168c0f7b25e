"""Images of the pose of a model, seen from the side by a camera that moves along."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.run import Simulation
from osimlite.view.collect import build_scene
from osimlite.view.picture import Camera, Style, draw_scene
from osimlite.view.scene import Scene

IMAGE_SIZE = 480, 360
"""Width and height of an image (pixels)."""
VIEW_BOX_M = np.array([[-1.1, -1.1, -0.5], [1.1, 1.1, 0.5]])
"""Opposite corners of the box around the first body that the image shows (m)."""


def draw_pose(simulation: Simulation, q: Array, size: tuple[int, int] = IMAGE_SIZE) -> Any:
    """Draw a pose.

    Args:
        simulation: simulation with the model; it caches the geometry for later images.
        q: coordinates (n,).
        size: width and height (pixels).

    Returns:
        Pixels (height, width, 3).
    """
    # Loading the geometry takes much longer than drawing it.
    scene: Scene = simulation.__dict__.setdefault(
        "_shown", build_scene(simulation.model, simulation.mechanism)
    )
    pose = simulation.mechanism.at(q)
    points = pose.origins[0] + VIEW_BOX_M
    # Almost from the side, a little from above and in front, so that both legs are visible.
    camera = Camera.from_points(points, scene.up, np.array([0.15, 0.1, 1.0]), size[0] / size[1])
    return np.asarray(
        draw_scene(scene, q, camera, size, (), Style(scene.find_floor_height(q))).convert("RGB")
    )
