"""Typed references: a field's type says what it may name and by which of OpenSim's rules the text is resolved.

The rules themselves are in :mod:`osimlite.schema.tree`. In Python every such field also takes the component itself.
"""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import Component
from osimlite.schema.fields import Reference

Named = str | Component

FrameSocket = Annotated[Named, Reference("socket", "Frame")]
PhysicalFrameSocket = Annotated[Named, Reference("socket", "PhysicalFrame")]

TransformInput = Annotated[str, Reference("input", "Transform", required=False)]

CoordinateName = Annotated[Named, Reference("coordinate-name", "Coordinate")]
ContactGeometryNames = Annotated[
    tuple[Named, ...], Reference("contactgeometry-path-or-name", "ContactGeometry", "list", required=False)
]
SetMemberNames = Annotated[tuple[Named, ...], Reference("set-member", "Object", "list", required=False, legacy=True)]
FileName = Annotated[str, Reference("file", "file", required=False)]
