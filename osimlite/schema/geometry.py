"""Decorative geometry: what a frame looks like. It has no effect on the motion."""

from typing import Annotated

from osimlite.schema.base import Component, Object, made
from osimlite.schema.fields import Flag, Unnamed, Value, Vec3, real, vec3
from osimlite.schema.references import FileName, FrameSocket, TransformInput


class SurfaceProperties(Object):
    """How a surface is drawn: 0 not at all, 1 as points, 2 as wireframe, 3 filled, -1 as the viewer likes."""

    representation: Annotated[int, Value("int", choices=(-1, 0, 1, 2, 3))] = 3
    texture: Annotated[str | None, Value("string", "optional")] = None


class Appearance(Object):
    """Colour, opacity and visibility."""

    visible: Flag = True
    opacity: Annotated[float, real(domain="0 to 1")] = 1.0
    color: Annotated[Vec3, vec3(domain="0 to 1")] = (1.0, 1.0, 1.0)
    surface_properties: Unnamed[SurfaceProperties] = made(SurfaceProperties)


class Geometry(Component, abstract=True):
    """A shape drawn in the frame that owns it."""

    socket_frame: FrameSocket = ""
    input_transform: TransformInput = ""
    scale_factors: Annotated[Vec3, vec3()] = (1.0, 1.0, 1.0)
    appearance: Unnamed[Appearance] = made(Appearance)


class FrameGeometry(Geometry):
    """The three axes of a frame."""

    scale_factors: Annotated[Vec3, vec3()] = (0.2, 0.2, 0.2)
    display_radius: Annotated[float, real(domain=">= 0")] = 0.004


class AnalyticGeometry(Geometry, abstract=True):
    """A shape with a formula."""


class Brick(Geometry):
    """A box centred on the frame origin, given by half its edge lengths."""

    half_lengths: Annotated[Vec3, vec3("m", ">= 0")] = (0.1, 0.2, 0.3)


class Arrow(Geometry):
    """An arrow from a point along a direction."""

    start_point: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    direction: Annotated[Vec3, vec3()] = (1.0, 1.0, 1.0)
    length: Annotated[float, real(domain=">= 0")] = 1.0


class LineGeometry(Geometry):
    """A straight line between two points."""

    start_point: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    end_point: Annotated[Vec3, vec3()] = (1.0, 1.0, 1.0)


class Sphere(AnalyticGeometry):
    """A ball centred on the frame origin."""

    radius: Annotated[float, real("m", ">= 0")] = 1.0


class Ellipsoid(AnalyticGeometry):
    """An ellipsoid with its half axes along the frame's."""

    radii: Annotated[Vec3, vec3("m", ">= 0")] = (0.5, 1.0, 2.0)


class Cylinder(AnalyticGeometry):
    """A cylinder along the frame's Y axis, centred on the frame origin."""

    radius: Annotated[float, real("m", ">= 0")] = 0.5
    half_height: Annotated[float, real("m", ">= 0")] = 0.5


class Cone(AnalyticGeometry):
    """A cone: where it is, which way it points, how wide and how high."""

    origin: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    direction: Annotated[Vec3, vec3()] = (0.0, 1.0, 0.0)
    base_radius: Annotated[float, real(domain=">= 0")] = 0.5
    height: Annotated[float, real(domain=">= 0")] = 1.0


class Torus(AnalyticGeometry):
    """A ring; no property gives its size, only the scale factors do."""


class Mesh(Geometry):
    """A surface read from a file (.vtp, .stl or .obj)."""

    mesh_file: FileName = ""


class ModelDisplayHints(Object):
    """What a viewer should show of a model."""

    show_wrap_geometry: Flag = True
    show_contact_geometry: Flag = True
    show_path_geometry: Flag = True
    show_path_points: Flag = True
    show_markers: Flag = True
    show_stations: Flag = False
    marker_color: Annotated[Vec3, vec3(domain="0 to 1")] = (1.0, 0.6, 0.8)
    show_frames: Flag = False
    show_labels: Flag = False
    show_forces: Flag = True
    show_debug_geometry: Flag = False


class ModelVisualPreferences(Object):
    """Preferences of a viewer for this model."""

    model_display_hints: Unnamed[ModelDisplayHints] = made(ModelDisplayHints)
