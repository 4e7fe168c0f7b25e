"""Shapes of bodies as geoms without mass, a camera, and markers as sites."""

from __future__ import annotations

import numpy as np

from osimlite.mechanics.multibody.spatial import cross
from osimlite.simulation.robot.robot import Ball, Box, MeshFile, Tube, Visual
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf.draft import (
    MjcfDraft,
    Untranslatable,
    Value,
    add_element,
    format_pose,
)

SHAPE_GROUP = 2
"""Group of shapes; MuJoCo's viewer shows or hides a group at a time, and shows 0 to 2 at first."""
CONTACT_GROUP = 3
"""Group of contact surfaces."""
MARKER_GROUP = 4
"""Group of markers."""
FRAME_GROUP = 5
"""Group of frames."""


def add_shapes(draft: MjcfDraft) -> None:
    """Add the shapes with which bodies are drawn."""
    # A class without users would be a remark of MuJoCo.
    if not any(link.visuals for link in draft.robot.links):
        return
    shape_default = add_element(draft.get_section("default"), "default", class_="looks")
    # Shapes neither collide nor have mass: inertia is that of the bodies.
    add_element(shape_default, "geom", contype=0, conaffinity=0, group=SHAPE_GROUP, mass=0)
    for link, element in draft.iterate_links():
        for visual in link.visuals:
            try:
                shape = format_shape(draft, visual)
            except Untranslatable as error:
                draft.fidelity.add("visual", visual.source, "a mesh", f"{LEFT_OUT}: {error}")
                continue
            name = draft.make_name("geom", visual.source)
            add_element(
                element,
                "geom",
                class_="looks",
                name=name,
                rgba=visual.color,
                **format_pose(visual.origin),
                **shape,
            )
            draft.fidelity.translated[visual.source] = f"geom {name}"


def add_camera(draft: MjcfDraft) -> None:
    """Add a camera that shows the default pose upright.

    Up is z in MuJoCo, and y in models of OpenSim.
    """
    state = draft.mechanism.at(draft.default_state[0])
    origins = np.array(
        [
            np.zeros(3),
            *(state.transform(index)[:3, 3] for index in range(len(draft.mechanism.bodies))),
        ]
    )
    lowest, highest = origins.min(axis=0), origins.max(axis=0)
    # Without gravity the axes of OpenSim are assumed.
    gravity = (
        draft.mechanism.gravity if draft.mechanism.gravity.any() else np.array((0.0, -1.0, 0.0))
    )
    gravity = gravity / np.abs(gravity).max()
    up = -gravity / np.linalg.norm(gravity)
    # Any horizontal axis that is not parallel to up.
    right = np.eye(3)[0] if abs(up[0]) < 0.9 else np.eye(3)[1]
    right = right - (right @ up) * up
    right /= np.linalg.norm(right)
    # Far enough to see everything in the default field of view.
    position = 0.5 * (lowest + highest) + (1.0 + float(np.linalg.norm(highest - lowest))) * cross(
        right, up
    )
    # MuJoCo's default headlight leaves bones dark.
    add_element(
        add_element(draft.root, "visual"),
        "headlight",
        ambient=(0.4, 0.4, 0.4),
        diffuse=(0.6, 0.6, 0.6),
    )
    add_element(
        draft.get_section("worldbody"), "camera", name="side", pos=position, xyaxes=(*right, *up)
    )


def add_markers(draft: MjcfDraft) -> None:
    """Add a site for every marker and other station."""
    for path, (body, location) in draft.mechanism.stations.items():
        draft.fidelity.translated[path] = (
            f"site {draft.add_site(path, body, location, group=MARKER_GROUP)}"
        )


def format_shape(draft: MjcfDraft, visual: Visual) -> dict[str, Value]:
    """Return the attributes of a geom with a shape.

    A mesh is an asset, one for each file and scale.

    Args:
        draft: MJCF under construction.
        visual: shape to draw.

    Returns:
        Attributes by name.

    Raises:
        Untranslatable: MuJoCo rejects the mesh.
    """
    match visual.shape:
        case Box(size):
            return {"type": "box", "size": [edge / 2.0 for edge in size]}
        case Ball(radius):
            return {"type": "sphere", "size": [radius]}
        case Tube(radius, length):
            return {"type": "cylinder", "size": [radius, length / 2.0]}
        case MeshFile(file, scale):
            return {"type": "mesh", "mesh": draft.add_mesh(file, scale)}
