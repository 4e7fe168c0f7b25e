"""OpenSim's analyses of motion: Kinematics, BodyKinematics and PointKinematics."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import DEGREES, UNITS
from osimlite.mechanics.multibody.spatial import angles_xyz
from osimlite.schema.tools.analyses import BodyKinematics, Kinematics, PointKinematics
from osimlite.tools.motion import AnalysisTables, Motion


def write_kinematics(analysis: Kinematics, motion: Motion, tables: AnalysisTables) -> None:
    """Write values, speeds and accelerations of coordinates.

    The accelerations follow from the forces of the model.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    infos = motion.mechanism.coordinates
    names = [info.name for info in infos]
    indices = motion.find_indices(analysis.coordinates, names, f"coordinates of '{analysis.name}'")
    shown_in_degrees = [
        analysis.in_degrees and infos[index].motion_type == "rotational" for index in indices
    ]
    for suffix, name, rows in (
        ("q", "Coordinates", motion.values),
        ("u", "Speeds", motion.speeds),
        ("dudt", "Accelerations", motion.accelerations),
    ):
        selected = rows[:, indices]
        tables.add_table(
            suffix,
            name,
            [names[index] for index in indices],
            np.where(shown_in_degrees, np.degrees(selected), selected),
            in_degrees=analysis.in_degrees,
            description=f"\n{UNITS}",
        )


CENTER_OF_MASS = "center_of_mass"
"""OpenSim's name of the mass centre of all bodies."""


def write_body_kinematics(analysis: BodyKinematics, motion: Motion, tables: AnalysisTables) -> None:
    """Write positions, X-Y-Z angles, velocities and accelerations of bodies and of the mass centre.

    Velocities and accelerations are in ground or along each body's axes. Positions, and everything
    about the mass centre of the model, are in ground.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    bodies = motion.model.body_set.objects
    tree = motion.model.tree()
    indices = {body.path: index for index, body in enumerate(motion.mechanism.bodies)}
    local = analysis.express_results_in_body_local_frame
    total = sum(body.mass for body in bodies) or 1.0
    result = []
    center_rows = np.zeros((3, len(motion.times), 3))
    for body in bodies:
        index = indices[tree.path_of(body) or ""]
        linear = np.array(motion.links.compute_point_motion(index, np.array(body.mass_center)))
        # The motion of the mass centre is the weighted mean of those of the bodies.
        center_rows += body.mass / total * linear
        rotation, _ = motion.links.locate_frame(index, np.eye(4))
        rows = np.stack(
            [linear, [angles_xyz(rotation), *motion.links.get_angular_motion(index)]], axis=2
        )
        # Positions remain in ground, as in OpenSim.
        if local:
            # Row vectors times R are the components along the axes of the body.
            rows[1:] = rows[1:] @ rotation
        if analysis.in_degrees:
            rows[:, :, 1] = np.degrees(rows[:, :, 1])
        result.append(rows.reshape(3, -1, 6))
    names = [body.name for body in bodies]
    selected = motion.find_indices(
        analysis.bodies, [*names, CENTER_OF_MASS], f"bodies of '{analysis.name}'"
    )
    body_indices = [index for index in selected if index < len(names)]
    columns = [
        f"{names[index]}_{component}"
        for index in body_indices
        for component in ("X", "Y", "Z", "Ox", "Oy", "Oz")
    ]
    blocks = [np.empty((3, len(motion.times), 0)), *(result[index] for index in body_indices)]
    if len(names) in selected:
        blocks.append(center_rows)
        columns += [f"{CENTER_OF_MASS}_{axis}" for axis in "XYZ"]
    frame = "bodyLocal" if local else "global"
    for rows, (suffix, title) in zip(
        np.concatenate(blocks, axis=2),
        (
            ("pos_global", "Positions"),
            (f"vel_{frame}", "Velocities"),
            (f"acc_{frame}", "Accelerations"),
        ),
        strict=True,
    ):
        description = BODY_DESCRIPTION.format(
            motion.model.name, "body-local" if local else "ground"
        )
        tables.add_table(
            suffix, title, columns, rows, in_degrees=analysis.in_degrees, description=description
        )


BODY_DESCRIPTION = (
    "\nThis file contains the kinematics (positions and orientations,\n"
    "velocities and angular velocities, or accelerations and angular accelerations)\n"
    "of the centers of mass of the body segments in model {}.\n"
    "\nBody segment orientations are described using body-fixed X-Y-Z Euler angles.\n"
    "\nAngular velocities and accelerations are expressed in the {} frame.\n"
    f"\nUnits are S.I. units (seconds, meters, Newtons, ...)\n{DEGREES}"
)
"""OpenSim's text in the header of the tables."""


def write_point_kinematics(
    analysis: PointKinematics, motion: Motion, tables: AnalysisTables
) -> None:
    """Write position, velocity and acceleration of a point that is fixed in a body.

    They are in ground; with another body, the position is in its frame, and the other two are along
    its axes.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    mechanism = motion.mechanism
    body_name = str(analysis.body_name)
    reference_name = str(analysis.relative_to_body_name)
    body, placement = mechanism.placement(
        motion.find_frame_path(body_name, *FRAME_SEARCH) or body_name
    )
    result = np.array(
        motion.links.compute_point_motion(
            body, placement[:3, :3] @ np.array(analysis.point) + placement[:3, 3]
        )
    )
    path = motion.find_frame_path(reference_name, *FRAME_SEARCH)
    if path is not None:
        rotation, origin = motion.links.locate_frame(*mechanism.placement(path))
        # Only the position is relative to the other body; the velocities are those in ground, along
        # its axes.
        result[0] -= origin
        result = (result[..., None, :] @ rotation)[..., 0, :]
    elif reference_name not in ("", "none"):
        tables.outcome.add_message(
            analysis.name, f"unknown frame '{reference_name}': results are in ground, as in OpenSim"
        )
    labels = [f"state_{axis}" for axis in range(3)]
    for rows, (suffix, title) in zip(result, POINT_TABLES, strict=True):
        tables.add_table(
            suffix,
            f"Point{title}",
            labels,
            rows,
            description="No description.",
            name_part=f"_{analysis.point_name}",
        )


FRAME_SEARCH = "PhysicalFrame", "/bodyset"
"""Class of frames that the analysis searches for, and the component below which it searches."""
POINT_TABLES = ("pos", "Position"), ("vel", "Velocity"), ("acc", "Acceleration")
"""Suffixes and titles of the three tables."""
