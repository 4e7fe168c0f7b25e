"""Merging of links that do not move relative to each other."""

from __future__ import annotations

import numpy as np

from osimlite.base.records import replace
from osimlite.mechanics.multibody.spatial import Array, skew_matrix
from osimlite.simulation.robot.robot import Robot, RobotLink


def merge_fixed(robot: Robot) -> Robot:
    """Return a robot without fixed joints: links behind them become part of the links before them.

    A massless link between two joints takes the name of the body that it receives. Links that are
    fixed to ground become part of the root link; their mass is left out, since the root does not
    move.

    Args:
        robot: the robot.
    """
    links = {link.name: link for link in robot.links}
    # For every link, the link it became part of and its frame there.
    home: dict[str, tuple[str, Array]] = {robot.links[0].name: (robot.links[0].name, np.eye(4))}
    joints = []
    names = {name: name for name in links}
    for joint in robot.joints:
        base, start = home[joint.parent]
        if joint.kind != "fixed":
            joints.append(replace(joint, parent=base, origin=start @ joint.origin))
            home[joint.child] = (joint.child, np.eye(4))
            continue
        child_frame = start @ joint.origin
        home[joint.child] = (base, child_frame)
        base_link = links[base]
        is_root = base == robot.links[0].name
        if not base_link.bodies:
            names[base] = joint.child
        links[base] = _weld_links(base_link, links[joint.child], child_frame, massless=is_root)
    remaining_names = [link.name for link in robot.links if home[link.name][0] == link.name]
    return replace(
        robot,
        links=tuple(replace(links[name], name=names[name]) for name in remaining_names),
        joints=tuple(
            replace(joint, parent=names[joint.parent], child=names[joint.child]) for joint in joints
        ),
    )


def _weld_links(
    link: RobotLink, other: RobotLink, other_frame: Array, *, massless: bool
) -> RobotLink:
    """Return a link with another one welded to it.

    Args:
        link: the link.
        other: the other link.
        other_frame: frame of the other link in the first (4, 4).
        massless: whether the mass of the other link is left out.
    """
    turn = other_frame[:3, :3]
    shift = other_frame[:3, 3]
    visuals, collisions = (
        tuple(replace(shape, origin=other_frame @ shape.origin) for shape in shapes)
        for shapes in (other.visuals, other.collisions)
    )
    bodies = {path: other_frame @ frame for path, frame in other.bodies.items()}
    merged = replace(
        link,
        visuals=link.visuals + visuals,
        collisions=link.collisions + collisions,
        bodies={**link.bodies, **bodies},
    )
    if massless:
        return merged
    mass = link.mass + other.mass
    center = turn @ other.center + shift
    middle = (link.mass * link.center + other.mass * center) / mass if mass > 0.0 else np.zeros(3)
    inertia = _about(link.inertia, link.mass, link.center - middle) + _about(
        turn @ other.inertia @ turn.T, other.mass, center - middle
    )
    return replace(merged, mass=mass, center=middle, inertia=inertia)


def _about(inertia: Array, mass: float, arm: Array) -> Array:
    """Return an inertia about another point, by the parallel axis theorem.

    Args:
        inertia: inertia about the mass centre (3, 3), kg·m².
        mass: mass, kg.
        arm: mass centre relative to the point (3,), m.
    """
    cross = skew_matrix(arm)
    return inertia - mass * cross @ cross
