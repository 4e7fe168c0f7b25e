"""OpenSim's BodyKinematics: places, velocities and accelerations of bodies and of the whole mass centre."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import DEGREES
from osimlite.mechanics.multibody.spatial import angles_xyz
from osimlite.schema.tools.analyses import BodyKinematics
from osimlite.tools.motion import Motion, Tables

WHOLE = "center_of_mass"


def compute(analysis: BodyKinematics, motion: Motion, tables: Tables) -> None:
    """Write places with body-fixed X-Y-Z angles, velocities and accelerations, in ground or along each body's axes.

    Places, and what is said of the whole mass centre, are always in ground.
    """
    bodies, tree = motion.model.body_set.objects, motion.model.tree()
    places = {body.path: place for place, body in enumerate(motion.mechanism.bodies)}
    local, total = (
        analysis.express_results_in_body_local_frame,
        sum(body.mass for body in bodies) or 1.0,
    )
    result, whole = [], np.zeros((3, len(motion.times), 3))
    for body in bodies:
        place = places[tree.path_of(body) or ""]
        linear = np.array(motion.links.point(place, np.array(body.mass_center)))
        whole += body.mass / total * linear
        rotation, _ = motion.links.placed(place, np.eye(4))
        rows = np.stack([linear, [angles_xyz(rotation), *motion.links.turning(place)]], axis=2)
        if local:
            rows[1:] = rows[1:] @ rotation
        if analysis.in_degrees:
            rows[:, :, 1] = np.degrees(rows[:, :, 1])
        result.append(rows.reshape(3, -1, 6))
    names = [body.name for body in bodies]
    chosen = motion.chosen(analysis.bodies, [*names, WHOLE], f"bodies of '{analysis.name}'")
    own = [place for place in chosen if place < len(names)]
    columns = [
        f"{names[place]}_{what}" for place in own for what in ("X", "Y", "Z", "Ox", "Oy", "Oz")
    ]
    parts = [np.empty((3, len(motion.times), 0)), *(result[place] for place in own)]
    if len(names) in chosen:
        parts.append(whole)
        columns += [f"{WHOLE}_{axis}" for axis in "XYZ"]
    frame = "bodyLocal" if local else "global"
    for rows, (suffix, title) in zip(
        np.concatenate(parts, axis=2),
        (
            ("pos_global", "Positions"),
            (f"vel_{frame}", "Velocities"),
            (f"acc_{frame}", "Accelerations"),
        ),
        strict=True,
    ):
        description = _DESCRIPTION.format(motion.model.name, "body-local" if local else "ground")
        tables.add(
            suffix, title, columns, rows, in_degrees=analysis.in_degrees, description=description
        )


_DESCRIPTION = (
    "\nThis file contains the kinematics (positions and orientations,\n"
    "velocities and angular velocities, or accelerations and angular accelerations)\n"
    "of the centers of mass of the body segments in model {}.\n"
    "\nBody segment orientations are described using body-fixed X-Y-Z Euler angles.\n"
    "\nAngular velocities and accelerations are expressed in the {} frame.\n"
    f"\nUnits are S.I. units (seconds, meters, Newtons, ...)\n{DEGREES}"
)
