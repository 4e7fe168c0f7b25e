"""Steps of format 30502 to 30516: geometry and appearance of bodies, contact, wraps and paths."""

from __future__ import annotations

from math import atan2, cos, hypot, sin

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    find_with_child,
    get_child_text,
    get_text,
    list_elements,
    list_members,
    parse_reals,
)
from osimlite.mechanics.laws.rotations import (
    Axes,
    combine_axes,
    multiply_rotations,
    rotation_from_xyz,
)
from osimlite.mechanics.laws.vectors import Vector, plus


def convert_display_geometry(draft: Draft) -> None:
    """Turn each <DisplayGeometry> into a <Mesh>, in an offset frame if it has a transform."""
    for body, visible in find_with_child(draft.find_tagged("Body", "Ground"), "VisibleObject"):
        geometry_set = visible.find("GeometrySet")
        if geometry_set is not None and geometry_set.find("objects") is not None:
            attached = draft.add(body, "attached_geometry", source=geometry_set)
            # Other classes in the set were never shown.
            geometries = [
                geometry
                for geometry in list_members(geometry_set)
                if geometry.tag == "DisplayGeometry"
            ]
            for count, geometry in enumerate(geometries, 1):
                _add_mesh(draft, body, visible, attached, geometry, count)
            draft.record_change(body, location=visible)
        draft.remove(visible)


def _add_mesh(
    draft: Draft, body: Element, visible: Element, attached: Element, geometry: Element, count: int
) -> None:
    """Add a <Mesh> for one <DisplayGeometry> of a body."""
    name = body.get("name", "")
    # The pose of the body's geometry, then that of the piece.
    pose = compose_transforms(
        get_child_text(visible, "transform"), get_child_text(geometry, "transform")
    )
    if pose is not None:
        orientation, translation = pose
        source = (
            geometry.find("transform")
            if geometry.find("transform") is not None
            else visible.find("transform")
        )
        assert source is not None
        frame = draft.add(
            draft.get_list(body, "components", source=source),
            "PhysicalOffsetFrame",
            source=source,
            name=f"{name}_geom_frame_{count}",
        )
        draft.add(frame, "socket_parent", "..", source=source)
        draft.add(frame, "translation", translation, source=source)
        draft.add(frame, "orientation", orientation, source=source)
        attached = draft.add(frame, "attached_geometry", source=source)
    mesh = draft.add(attached, "Mesh", source=geometry, name=f"{name}_geom_{count}")
    draft.add(mesh, "socket_frame", "..", source=geometry)
    scale = geometry.find("scale_factors")
    # Scales of body and piece multiply.
    body_scale = visible.find("scale_factors")
    source = scale if scale is not None else body_scale if body_scale is not None else geometry
    draft.add(mesh, "scale_factors", _multiply_scales(scale, body_scale), source=source)
    file = geometry.find("geometry_file")
    draft.add(
        mesh,
        "mesh_file",
        "" if file is None else get_text(file),
        source=geometry if file is None else file,
    )
    appearance = draft.add(mesh, "Appearance", source=geometry)
    for child in list_elements(geometry):
        if child.tag in ("color", "opacity"):
            draft.move(child, appearance)
        elif child.tag == "display_preference":
            # 0 hides the mesh, 4 draws it as a Mesh is drawn anyway; the others are lost.
            preference = get_text(child)
            if preference == "0":
                draft.add(appearance, "visible", "false", source=child)
            elif preference != "4":
                draft.record_change(body, location=child, lost=f"display_preference {preference}")


def _multiply_scales(scale: Element | None, body_scale: Element | None) -> str:
    """Return the text of the product of two scales; a scale of one leaves the other text unchanged."""
    inner_text = "1 1 1" if scale is None else get_text(scale)
    outer_text = "1 1 1" if body_scale is None else get_text(body_scale)
    inner_values, outer_values = parse_reals(inner_text, 3), parse_reals(outer_text, 3)
    # Words stay as they are where possible, so that no digits change.
    if outer_values is None or outer_values == [1, 1, 1]:
        return inner_text
    if inner_values is None or inner_values == [1, 1, 1]:
        return outer_text
    return " ".join(repr(a * b) for a, b in zip(inner_values, outer_values, strict=True))


_EPSILON = 2.0**-52
"""Machine precision; OpenSim ignores transforms whose numbers are smaller."""


def compose_transforms(outer: str | None, inner: str | None) -> tuple[str, str] | None:
    """Compose two transforms `rx ry rz tx ty tz` with body-fixed X-Y-Z angles.

    If one of the two is the identity, the words of the other stay unchanged.

    Args:
        outer: text of the outer transform (rad, m).
        inner: text of the transform within the outer one.

    Returns:
        Texts of the angles (rad) and of the translation (m); None if both are the identity.
    """
    texts = [text for text in (outer, inner) if _is_transform(text)]
    if not texts:
        return None
    if len(texts) == 1:
        words = (texts[0] or "").split()
        return " ".join(words[:3]), " ".join(words[3:])
    (outer_turn, outer_shift), (inner_turn, inner_shift) = (
        _parse_transform(text) for text in texts
    )
    angles = _compute_angles(multiply_rotations(outer_turn, inner_turn))
    return " ".join(map(repr, angles)), " ".join(
        map(repr, plus(outer_shift, combine_axes(outer_turn, inner_shift)))
    )


def _is_transform(text: str | None) -> bool:
    """Return whether a text is a transform other than the identity."""
    values = parse_reals(text, 6)
    return values is not None and hypot(*values) >= _EPSILON


def _parse_transform(text: str | None) -> tuple[Axes, Vector]:
    """Return the rotation and the translation (m) of a transform.

    Returns:
        The axes of the rotated frame and the translation.
    """
    values = parse_reals(text, 6)
    assert values is not None
    (s1, s2, s3), (c1, c2, c3) = map(sin, values[:3]), map(cos, values[:3])
    x, y, z = values[3:]
    return rotation_from_xyz(s1, c1, s2, c2, s3, c3), (x, y, z)


def _compute_angles(axes: Axes) -> Vector:
    """Return body-fixed X-Y-Z angles; if the middle one is a right angle, the last is zero."""
    (_, xy, xz), (_, yy, yz), (sine, zy, zz) = axes
    # Near a right angle the cosine has all digits, but asin(sine) only half of them.
    cosine = hypot(zy, zz)
    middle = atan2(sine, cosine)
    # At a right angle (gimbal lock) only the sum of the other two is known.
    if cosine <= 4 * _EPSILON:
        return atan2(yz, yy), middle, 0.0
    # The last angle is that of the rotation without the first one, and compensates for its rounding
    # error, which is large near a right angle.
    first = atan2(-zy, zz)
    s, c = sin(first), cos(first)
    return first, middle, atan2(c * xy + s * xz, c * yy + s * yz)


def hide_appearance(draft: Draft) -> None:
    """Make an appearance with representation 0 invisible."""
    for appearance, representation in find_with_child(
        draft.find_tagged("Appearance"), "representation"
    ):
        if get_text(representation) == "0" and appearance.find("visible") is None:
            draft.add(appearance, "visible", "false", source=representation)
        draft.remove(representation)
        draft.record_change(appearance)


def move_geometry_lists(draft: Draft) -> None:
    """Move the <geometry> of a component to its <components>."""
    for component, geometry in find_with_child(draft.find_all("ModelComponent"), "geometry"):
        # The <geometry> of contact forces is a list of names and stays.
        if not list_elements(geometry):
            continue
        components = draft.get_list(component, "components", source=geometry)
        for shape in list_elements(geometry):
            draft.move(shape, components)
        draft.remove(geometry)
        draft.record_change(component)


def convert_contact_appearance(draft: Draft) -> None:
    """Turn colour and display preference of contact geometry into an <Appearance>."""
    for geometry in draft.find_all("ContactGeometry"):
        color, preference = geometry.find("color"), geometry.find("display_preference")
        if color is None and preference is None:
            continue
        first = color if color is not None else preference
        assert first is not None
        appearance = draft.add(geometry, "Appearance", source=first)
        if color is None:
            # OpenSim's default colour of contact geometry, cyan.
            draft.add(appearance, "color", "0 1 1", source=first)
        else:
            draft.move(color, appearance)
        if preference is not None:
            word = get_child_text(geometry, "display_preference") or ""
            if word == "0":
                draft.add(appearance, "visible", "false", source=preference)
            else:
                surface = draft.add(appearance, "SurfaceProperties", source=preference)
                # Smooth shading (4) becomes a filled surface (3).
                text = "3" if word == "4" else get_text(preference)
                draft.add(surface, "representation", text, source=preference)
            draft.remove(preference)
        draft.record_change(geometry)


def convert_wrap_appearance(draft: Draft) -> None:
    """Turn colour and display preference of a wrap object into an <Appearance>."""
    for wrap in draft.find_all("WrapObject"):
        visible = wrap.find("VisibleObject")
        color, local = wrap.find("color"), wrap.find("display_preference")
        visible_preference = None if visible is None else visible.find("display_preference")
        representation = "3"
        hidden = False
        set_by = color
        # The preference of the wrap object comes before that of the visible object.
        for preference in (local, visible_preference):
            value = "" if preference is None else get_text(preference)
            if value == "0":
                hidden, set_by = True, preference
            elif value in ("1", "2", "3") and representation == "3":
                representation, set_by = value, preference
        if set_by is not None:
            _add_appearance(draft, wrap, set_by, color, representation, hidden)
        for part in (color, local, visible):
            if part is not None:
                draft.remove(part)
        if set_by is not None or visible is not None:
            lost = (
                "the position of the shown surface, which was not that of the wrap object"
                if _is_drawn_at_other_pose(wrap, visible)
                else None
            )
            draft.record_change(wrap, lost=lost)


def _add_appearance(
    draft: Draft,
    wrap: Element,
    source: Element,
    color: Element | None,
    representation: str,
    hidden: bool,
) -> None:
    """Add an <Appearance> with colour, opacity and representation to a wrap object."""
    appearance = draft.add(wrap, "Appearance", source=source)
    if hidden:
        draft.add(appearance, "visible", "false", source=source)
    text = "0 1 1" if color is None else get_text(color)
    draft.add(appearance, "color", text, source=source if color is None else color)
    # OpenSim shows wrap objects half transparent.
    draft.add(appearance, "opacity", "0.5", source=source)
    surface = draft.add(appearance, "SurfaceProperties", source=source)
    draft.add(surface, "representation", representation, source=source)


def _is_drawn_at_other_pose(wrap: Element, visible: Element | None) -> bool:
    """Return whether the surface was shown at another position than that of the wrap object."""
    drawn_pose = None if visible is None else parse_reals(get_child_text(visible, "transform"), 6)
    angles, translation = (
        parse_reals(get_child_text(wrap, tag), 3) or [0.0] * 3
        for tag in ("xyz_body_rotation", "translation")
    )
    wrap_pose = [*angles, *translation]
    return (
        drawn_pose is not None
        and any(drawn_pose)
        # OpenSim's wrap objects may be drawn elsewhere than they act, which the new format cannot
        # say.
        and any(abs(a - b) > 1e-4 for a, b in zip(drawn_pose, wrap_pose, strict=True))
    )


_COLORS = {"Muscle": ".8 .1 .1", "Ligament": "0 1 0"}


"""Default colour of a path by the class of its force: muscles are red, ligaments green."""


def convert_path_appearance(draft: Draft) -> None:
    """Turn colour and display preference of a path into an <Appearance>."""
    usual = {
        path: color
        for family, color in _COLORS.items()
        for _, path in find_with_child(draft.find_all(family), "GeometryPath")
    }
    for path in draft.find_tagged("GeometryPath"):
        color = path.find("default_color")
        visible = path.find("VisibleObject")
        appearance = path.find("Appearance")
        if appearance is None:
            appearance = draft.add(path, "Appearance", source=path)
        # An explicit appearance is newer than these properties.
        if visible is not None:
            _hide_path(draft, appearance, visible)
        if appearance.find("color") is None:
            if color is not None:
                draft.add(appearance, "color", get_text(color), source=color)
            elif path in usual:
                draft.add(appearance, "color", usual[path], source=path)
        for part in (color, visible):
            if part is not None:
                draft.remove(part)
        draft.record_change(path)


def _hide_path(draft: Draft, appearance: Element, visible: Element) -> None:
    """Make the appearance invisible if the display preference of the path is 0."""
    preference = get_child_text(visible, "display_preference")
    if preference == "0" and appearance.find("visible") is None:
        draft.add(appearance, "visible", "false", source=visible)
