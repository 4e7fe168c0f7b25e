"""The robot as a file for Bullet: what has to be so that Bullet reads it as it is meant."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from osimlite.base.records import replace
from osimlite.errors import SimulationError
from osimlite.simulation.robot.principal_axes import principal_axes
from osimlite.simulation.robot.robot import Link, Robot
from osimlite.simulation.robot.urdf import urdf_text


def robot_text(robot: Robot) -> str:
    """The robot as URDF, with inertias that Bullet does not set to zero."""
    links = [
        replace(link, inertia=link.inertia + excess(link) * np.eye(3))
        if excess(link) > 0.0
        else link
        for link in robot.links
    ]
    return urdf_text(replace(robot, links=tuple(links)), visuals=True)


def excess(link: Link) -> float:
    """What to add to each principal moment of inertia so that Bullet does not set them to zero; 0 if they are fine."""
    moments = [float(moment) for moment in principal_axes(link.inertia)[0]]
    low, middle, high = sorted(moments)
    return high if high > low + middle or low < 0.0 else 0.0


def require_masses(robot: Robot) -> None:
    """SimulationError if the last link of a chain has no mass: nothing decides how its joint moves."""
    carriers = {joint.parent for joint in robot.joints}
    links = {link.name: link for link in robot.links}
    for joint in robot.joints:
        if joint.child not in carriers and links[joint.child].mass == 0.0:
            body = next(iter(links[joint.child].bodies), joint.child)
            raise SimulationError(
                f"the body '{body}' has no mass and carries none, so that nothing decides how the joint "
                f"'{joint.source}' moves; give it mass and inertia, or lock the coordinates of the joint"
            )


@contextmanager
def temporary_file(text: str, files: Mapping[str, bytes]) -> Iterator[str]:
    """A URDF file with the mesh files that it names beside it."""
    with tempfile.TemporaryDirectory(prefix="osimlite-") as folder:
        for name, content in {"robot.urdf": text.encode(), **files}.items():
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        yield str(Path(folder, "robot.urdf"))
