"""A copy as an image: from the side, the camera moves along."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.run import Simulation
from osimlite.view.collect import build_scene
from osimlite.view.picture import Camera, Style, draw_scene
from osimlite.view.scene import Scene

SIZE = 480, 360
FRAME = np.array([[-1.1, -1.1, -0.5], [1.1, 1.1, 0.5]])
"""What is seen around the first body, m."""


def picture_of(simulation: Simulation, q: Array, size: tuple[int, int] = SIZE) -> Any:
    """A pose (n,) as pixels (h, w, 3)."""
    scene: Scene = simulation.__dict__.setdefault(
        "_shown", build_scene(simulation.model, simulation.mechanism)
    )
    pose = simulation.mechanism.at(q)
    points = pose.origins[0] + FRAME
    camera = Camera.around(points, scene.up, np.array([0.15, 0.1, 1.0]), size[0] / size[1])
    return np.asarray(draw_scene(scene, q, camera, size, (), Style(scene.floor(q))).convert("RGB"))
