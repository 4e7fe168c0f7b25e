"""What bodies look like, and points on them that are looked at: shapes as geoms without mass, markers as sites."""

from __future__ import annotations

from osimlite.robot.shapes import Ball, Box, MeshFile, Tube, Visual
from osimlite.translate.mjcf.draft import Draft, Value, add, pose

LOOKS, TOUCHES, MARKS, FRAMES = 2, 3, 4, 5
"""Groups that MuJoCo's viewer shows and hides together: shapes, contact surfaces, markers, frames."""


def add_shapes(draft: Draft) -> None:
    """Add the shapes that bodies are drawn with."""
    if not any(link.visuals for link in draft.robot.links):
        return
    looks = add(draft.section("default"), "default", class_="looks")
    add(looks, "geom", contype=0, conaffinity=0, group=LOOKS, mass=0)
    for link, element in draft.links():
        for visual in link.visuals:
            name = draft.name("geom", visual.source)
            add(
                element,
                "geom",
                class_="looks",
                name=name,
                rgba=visual.color,
                **pose(visual.origin),
                **shape(draft, visual),
            )
            draft.fidelity.translated[visual.source] = f"geom {name}"


def add_markers(draft: Draft) -> None:
    """Add a site for every marker and other station."""
    for path, (body, location) in draft.mechanism.stations.items():
        draft.fidelity.translated[path] = f"site {draft.site(path, body, location, group=MARKS)}"


def shape(draft: Draft, visual: Visual) -> dict[str, Value]:
    """The attributes of a geom that has the shape; a mesh becomes an asset, one for each file and scale."""
    match visual.shape:
        case Box(size):
            return {"type": "box", "size": [edge / 2.0 for edge in size]}
        case Ball(radius):
            return {"type": "sphere", "size": [radius]}
        case Tube(radius, length):
            return {"type": "cylinder", "size": [radius, length / 2.0]}
        case MeshFile(file, scale):
            return {"type": "mesh", "mesh": draft.mesh(file, scale)}
