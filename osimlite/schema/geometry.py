"""Decorative geometry: the appearance of frames. It has no effect on the motion."""

from typing import Annotated

from osimlite.schema.base import Component, Object, make_default
from osimlite.schema.fields import Flag, Unnamed, Value, Vec3, real, vec3
from osimlite.schema.references import FileName, FrameSocket, TransformInput


class SurfaceProperties(Object):
    """Appearance of a surface in viewers."""

    representation: Annotated[int, Value("int", choices=(-1, 0, 1, 2, 3))] = 3
    """0 is hidden, 1 points, 2 wireframe, 3 filled, -1 the choice of the viewer."""
    texture: Annotated[str | None, Value("string", "optional")] = None
    """Name of a texture; viewers may ignore it."""


class Appearance(Object):
    """Colour, opacity and visibility."""

    visible: Flag = True
    """Whether viewers draw the component."""
    opacity: Annotated[float, real(domain="0 to 1")] = 1.0
    """Opacity from 0 (transparent) to 1 (opaque)."""
    color: Annotated[Vec3, vec3(domain="0 to 1")] = (1.0, 1.0, 1.0)
    """Red, green and blue."""
    surface_properties: Unnamed[SurfaceProperties] = make_default(SurfaceProperties)
    """Whether points, edges or faces are drawn."""


# OpenSim drops shapes of unknown classes with a line in its log, and simulates the rest.
class Geometry(Component, abstract=True):
    """A shape drawn in the frame that owns it."""

    # OpenSim replaces it by `..` in shapes that a frame owns, so that a wrong path does no harm
    # there.
    socket_frame: FrameSocket = ""
    """Frame in which the shape is drawn; OpenSim sets the one that owns it."""
    input_transform: TransformInput = ""
    """Output that gives the pose of the shape in ground, instead of a frame."""
    scale_factors: Annotated[Vec3, vec3()] = (1.0, 1.0, 1.0)
    """Factors of the size along the axes X, Y and Z of the frame."""
    appearance: Unnamed[Appearance] = make_default(Appearance)
    """Colour, opacity and style of the shape."""


class FrameGeometry(Geometry):
    """The three axes of a frame."""

    scale_factors: Annotated[Vec3, vec3()] = (0.2, 0.2, 0.2)
    display_radius: Annotated[float, real(domain=">= 0")] = 0.004
    """Thickness of the three arrows, as the radius of their shafts."""


class Mesh(Geometry):
    """A surface read from a file (.vtp, .stl or .obj)."""

    mesh_file: FileName = ""
    """File of the surface, searched beside the model and in geometry folders; it may be missing."""


class ModelDisplayHints(Object):
    """Kinds of components of a model that a viewer should show."""

    show_wrap_geometry: Flag = True
    """Whether surfaces that paths wrap around are drawn."""
    show_contact_geometry: Flag = True
    """Whether contact surfaces are drawn."""
    show_path_geometry: Flag = True
    """Whether the paths of muscles and springs are drawn."""
    show_path_points: Flag = True
    """Whether the points that paths run through are drawn."""
    show_markers: Flag = True
    """Whether markers are drawn."""
    show_stations: Flag = False
    """Whether stations that are no markers are drawn."""
    marker_color: Annotated[Vec3, vec3(domain="0 to 1")] = (1.0, 0.6, 0.8)
    """Red, green and blue of the markers."""
    show_frames: Flag = False
    """Whether the axes of frames are drawn."""
    show_labels: Flag = False
    """Whether names are shown beside the components."""
    show_forces: Flag = True
    """Whether forces are drawn as arrows or lines."""
    show_debug_geometry: Flag = False
    """Whether geometry for debugging is drawn."""


class ModelVisualPreferences(Object):
    """Preferences of a viewer for this model."""

    model_display_hints: Unnamed[ModelDisplayHints] = make_default(ModelDisplayHints)
    """Kinds of components that a viewer draws."""
