"""Outputs of a state besides its derivative: points, forces, muscles, paths.

The workspace holds either formulas or dual numbers; its method `wrap` makes the kernels run on
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import TYPE_CHECKING, Any, TypeAlias

from osimlite.mechanics.kernels.layout import INERTIA, LINK, LINK_WORK, MODEL, REALS
from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.kernels.points import (
    angular_velocity,
    direction,
    link_ints,
    station,
    velocity,
)
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.contact import PairContact
from osimlite.simulation.elements.force_type import DeclaredForce
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.geometries.sphere_on_plane import SPHERE_ON_PLANE
from osimlite.simulation.elements.probe_type import DeclaredProbe
from osimlite.simulation.engines.dual_numbers import DualNumber
from osimlite.simulation.pack import PackedModel

if TYPE_CHECKING:
    from osimlite.derivatives.symbolic_evaluator import SymbolicWorkspace
    from osimlite.derivatives.tangents import DualWorkspace

    Workspace: TypeAlias = SymbolicWorkspace | DualWorkspace

AXES = "xyz"
"""Names of the axes."""


def locate_stations(
    mechanism: Mechanism, packed: PackedModel
) -> list[tuple[str, int, tuple[float, ...]]]:
    """Return the links of all stations of a model, and their positions in the links.

    Args:
        mechanism: mechanism of the model.
        packed: packed model.

    Returns:
        Path, link and point in the link (3,), m, of each station.
    """
    link_placements = LinkMap(mechanism, {}, packed.placements)
    return [
        (path, *link_placements.station(body, point.tolist()))
        for path, (body, point) in mechanism.stations.items()
    ]


def locate_frames(mechanism: Mechanism, packed: PackedModel) -> dict[str, tuple[int, list[float]]]:
    """Return the links of all frames of a model, and the frames in the links.

    Args:
        mechanism: mechanism of the model.
        packed: packed model.

    Returns:
        Link, and axes and origin in the link (12,), of each frame by its path.
    """
    link_placements = LinkMap(mechanism, {}, packed.placements)
    return {
        path: link_placements.frame(frame_placement.body, frame_placement.transform)
        for path, frame_placement in mechanism.frames.items()
    }


def list_probe_items(packed: PackedModel, elements: Sequence[Any]) -> list[int]:
    """Return the items of all probes.

    Args:
        packed: packed model.
        elements: force elements of the model.

    Returns:
        Offsets in the structure.
    """
    return [
        offset
        for offset, element_index in packed.owners.items()
        if isinstance(elements[element_index], DeclaredProbe)
    ]


def compute_frame_columns(
    workspace: SymbolicWorkspace, frames: Sequence[tuple[int, Sequence[Any]]]
) -> dict[str, Any]:
    """Compute the results of `CasadiModel.frames`.

    Args:
        workspace: workspace of an evaluation up to the speeds.
        frames: link, and axes and origin in the link (12,), of each frame; the numbers may be
            symbols.

    Returns:
        Column of each result by its name.
    """
    from osimlite.derivatives.symbols import casadi

    columns: list[list[Any]] = [[], [], [], []]
    for link, numbers in frames:
        origin = workspace.wrap(station)(workspace.model, workspace.data, link, tuple(numbers[9:]))
        columns[0] += origin
        for axis in range(3):
            columns[1] += workspace.wrap(direction)(
                workspace.model, workspace.data, link, tuple(numbers[3 * axis : 3 * axis + 3])
            )
        columns[2] += workspace.wrap(velocity)(workspace.model, workspace.data, link, origin)
        columns[3] += workspace.wrap(angular_velocity)(workspace.model, workspace.data, link)
    names = "position", "rotation", "velocity", "angular_velocity"
    sizes = 3, 9, 3, 3
    return {
        name: casadi.reshape(workspace.mask_failures(column), size, len(frames))
        for name, column, size in zip(names, columns, sizes, strict=True)
    }


def compute_output_columns(
    mechanism: Mechanism,
    packed: PackedModel,
    forces: Forces,
    workspace: Workspace,
    points: Sequence[Any],
) -> dict[str, tuple[list[str], Any]]:
    """Compute the results of `CasadiModel.outputs`.

    Args:
        mechanism: mechanism of the model.
        packed: packed model.
        forces: forces of the model.
        workspace: workspace of the evaluation.
        points: points of all stations in their links (3 k,), which may be symbols.

    Returns:
        Labels and column of each result by its name.
    """
    at_station = workspace.wrap(station)
    speed_of = workspace.wrap(velocity)
    labels: list[str] = []
    positions: list[Any] = []
    speeds: list[Any] = []
    for number, (path, link, _) in enumerate(locate_stations(mechanism, packed)):
        labels += [f"{path}|{axis}" for axis in AXES]
        point = at_station(
            workspace.model, workspace.data, link, tuple(points[3 * number : 3 * number + 3])
        )
        positions += point
        speeds += speed_of(workspace.model, workspace.data, link, point)
    center, rate = _compute_mass_center(mechanism, packed, workspace)
    contact_values = _list_contact_values(packed, forces, workspace)
    force_values = [
        (f"{element.path}|{name}", workspace.data[element_items[-1][0] + offset])
        for element, element_items in zip(forces.elements, packed.items, strict=True)
        if isinstance(element, DeclaredForce) and element_items
        for name, offset in element.force_type.record_offsets.items()
    ]
    probed = [
        (f"{probe.path}|{label}", probe.gain * workspace.data[element_items[-1][0] + offset])
        for probe, element_items in zip(forces.elements, packed.items, strict=True)
        if isinstance(probe, DeclaredProbe)
        for offset, label in enumerate(probe.reading.labels)
    ]
    return {
        "stations": (labels, workspace.mask_failures(positions)),
        "station_velocities": (labels, workspace.mask_failures(speeds)),
        "mass_center": ([*AXES], workspace.mask_failures(center)),
        "mass_center_velocity": ([*AXES], workspace.mask_failures(rate)),
        "contact_forces": (
            [name for name, _ in contact_values],
            workspace.mask_failures([value for _, value in contact_values]),
        ),
        "forces": (
            [name for name, _ in force_values],
            workspace.mask_failures([value for _, value in force_values]),
        ),
        "probes": (
            [name for name, _ in probed],
            workspace.mask_failures([value for _, value in probed]),
        ),
    }


def _compute_mass_center(
    mechanism: Mechanism, packed: PackedModel, workspace: Workspace
) -> tuple[list[Any], list[Any]]:
    """Compute position and velocity of the mass centre of all bodies.

    Args:
        mechanism: mechanism of the model.
        packed: packed model.
        workspace: workspace of the evaluation.

    Returns:
        Position (3,), m, and velocity (3,), m/s; NaN for a model without mass.
    """
    mass_points = []
    for link in range(int(packed.structure[MODEL.LINKS])):
        # Read from the numbers, which may be symbols or dual numbers: masses may be parameters.
        inertia_offset = REALS.INERTIA + INERTIA.SIZE * link
        mass_points.append(
            (
                workspace.reals[inertia_offset],
                link,
                tuple(
                    workspace.reals[
                        inertia_offset + INERTIA.CENTER : inertia_offset + INERTIA.MOMENTS
                    ]
                ),
            )
        )
    # Bodies that are fixed to ground have no link, but mass.
    for placement, body in zip(packed.placements, mechanism.bodies, strict=True):
        if placement.link == GROUND:
            mass_properties = body.mass_properties
            frame = placement.frame
            mass_points.append(
                (
                    mass_properties.mass,
                    GROUND,
                    tuple((frame[:3, :3] @ mass_properties.center + frame[:3, 3]).tolist()),
                )
            )
    total = 0.0
    center = [0.0] * 3
    rate = [0.0] * 3
    for mass, link, point in mass_points:
        position = workspace.wrap(station)(workspace.model, workspace.data, link, point)
        point_velocity = workspace.wrap(velocity)(workspace.model, workspace.data, link, position)
        total = total + mass
        center = [a + mass * b for a, b in zip(center, position, strict=True)]
        rate = [a + mass * b for a, b in zip(rate, point_velocity, strict=True)]
    # A symbolic mass is neither a float nor a dual number.
    if isinstance(total, (float, DualNumber)) and float(total) == 0.0:
        total = nan
    return [a / total for a in center], [a / total for a in rate]


def _list_contact_values(
    packed: PackedModel, forces: Forces, workspace: Workspace
) -> list[tuple[str, Any]]:
    """Return force and point of each contact, the first entries of its record.

    Args:
        packed: packed model.
        forces: forces of the model.
        workspace: workspace of the evaluation.

    Returns:
        Labels and values.
    """
    record_offsets: list[tuple[str, int]] = []
    for element, element_items in zip(forces.elements, packed.items, strict=True):
        if isinstance(element, PairContact):
            folder = element.path.rpartition("/")[0]
            record_offsets += [
                (f"{folder}/{element.pair_name(k)}", offset)
                for k, (offset, _) in enumerate(element_items[: len(element.pairs)])
            ]
        elif (
            isinstance(element, DeclaredForce)
            and element.force_type.geometry is SPHERE_ON_PLANE
            and element_items
        ):
            # The geometry's part of a record follows the results of the law: force, then point.
            record_offsets.append(
                (element.path, element_items[-1][0] + len(element.force_type.record_offsets))
            )
    return [
        (f"{name}|{vector_name}_{axis}", workspace.data[offset + 3 * vector_number + k])
        for name, offset in record_offsets
        for vector_number, vector_name in enumerate(("force", "point"))
        for k, axis in enumerate(AXES)
    ]


def compute_path_columns(
    packed: PackedModel, forces: Forces, workspace: SymbolicWorkspace
) -> tuple[list[str], Any, Any]:
    """Compute the geometry of all paths with a force.

    Args:
        packed: packed model.
        forces: forces of the model.
        workspace: workspace of the evaluation.

    Returns:
        Component paths of the forces, lengths (m), and lengthening speeds (m/s).
    """
    names = list[str]()
    lengths = list[Any]()
    speeds = list[Any]()
    for element, element_items in zip(forces.elements, packed.items, strict=True):
        if (
            isinstance(element, DeclaredForce)
            and element.force_type.geometry is PATH
            and len(element_items) > 1
        ):
            record = element_items[-2][0]
            names.append(element.path)
            lengths.append(workspace.data[record + PATH_WORK.LENGTH])
            speeds.append(workspace.data[record + PATH_WORK.SPEED])
    return names, workspace.mask_failures(lengths), workspace.mask_failures(speeds)


def compute_joint_load_columns(
    workspace: SymbolicWorkspace,
    link: int,
    origin: tuple[int, Sequence[Any]],
    sign: float,
    constraint_wrenches: Sequence[tuple[int, Any, Sequence[Any]]],
) -> dict[str, Any]:
    """Compute the results of `CasadiModel.joint_load`.

    Args:
        workspace: workspace of inverse dynamics.
        link: link that the joint carries.
        origin: link of the frame at whose origin the load acts, and the point in the link (3,).
        sign: 1 for the load on the carried body, -1 for the load on the carrying body.
        constraint_wrenches: link on which a constraint acts, its multiplier, and the wrench of a unit
            multiplier.

    Returns:
        Force and moment by name.
    """
    from osimlite.derivatives.symbols import casadi

    # The wrench of a link includes all links that it carries, so constraints on any of them count.
    carried_links = {link}
    for outer_link in range(link + 1, workspace.model[MODEL.LINKS]):
        if workspace.wrap(link_ints)(workspace.model, outer_link)[LINK.PARENT] in carried_links:
            carried_links.add(outer_link)
    link_offset = workspace.model[MODEL.WORK_LINK] + LINK_WORK.SIZE * link
    wrench = casadi.vertcat(
        *workspace.data[link_offset + LINK_WORK.WRENCH : link_offset + LINK_WORK.WRENCH + 6]
    )
    for constrained_link, multiplier, unit in constraint_wrenches:
        if constrained_link in carried_links:
            wrench -= multiplier * casadi.vertcat(*unit)
    wrench *= -sign
    joint_origin = workspace.wrap(station)(
        workspace.model, workspace.data, origin[0], tuple(origin[1])
    )
    link_origin = workspace.data[
        link_offset + LINK_WORK.ORIGIN : link_offset + LINK_WORK.ORIGIN + 3
    ]
    arm = casadi.vertcat(*joint_origin) - casadi.vertcat(*link_origin)
    # Spatial forces are about the link's ORIGIN; the load is about the origin of the joint's frame.
    moment = wrench[:3] - casadi.cross(arm, wrench[3:])
    return {
        "force": workspace.mask_failures([wrench[3:]]),
        "moment": workspace.mask_failures([moment]),
    }
