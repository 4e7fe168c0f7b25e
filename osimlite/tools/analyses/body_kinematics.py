"""OpenSim's BodyKinematics: places, velocities and accelerations of bodies and of the whole mass centre."""

from __future__ import annotations

import numpy as np

from osimlite.multibody.dynamics import MassCentres
from osimlite.multibody.spatial import angles_xyz
from osimlite.schema.tools.analyses import BodyKinematics
from osimlite.simulation.files.old_storage import DEGREES
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.not_runnable import NotRunnable

WHOLE = "center_of_mass"


def compute(analysis: BodyKinematics, motion: Motion, tables: Tables) -> None:
    """Write places with body-fixed X-Y-Z angles, velocities and accelerations, in ground."""
    if analysis.express_results_in_body_local_frame:
        raise NotRunnable(
            f"'{analysis.name}' asks for results in the frames of bodies, which is not done yet",
            file=str(tables.job.file),
        )
    mechanism = motion.mechanism
    own = {body.name: place for place, body in enumerate(mechanism.bodies)}
    names = [body.name for body in motion.model.body_set.objects]
    chosen = motion.chosen(analysis.bodies, [*names, WHOLE], f"bodies of '{analysis.name}'")
    is_whole = len(names) in chosen
    names = [names[place] for place in chosen if place < len(names)]
    places = [own[name] for name in names]
    masses = mechanism.inertial[0]
    found = np.empty((3, len(motion.times), len(places), 6))
    whole = np.empty((3, len(motion.times), 3))
    for k, state in enumerate(motion.kinematics):
        centres = MassCentres.of(state)
        moved = state.accelerations(motion.accelerations[k])[:-1]
        w, alpha = state.velocities[:-1, :3], moved[:, :3]
        linear = (
            centres.positions(),
            centres.velocities(),
            moved[:, 3:] + np.cross(alpha, centres.arms) + np.cross(w, np.cross(w, centres.arms)),
        )
        turned = (np.array([angles_xyz(rotation) for rotation in state.rotations[:-1]]).reshape(-1, 3), w, alpha)
        for kind, (straight, round_) in enumerate(zip(linear, turned, strict=True)):
            found[kind, k, :, :3], found[kind, k, :, 3:] = straight[places], round_[places]
            whole[kind, k] = masses @ straight / (mechanism.total_mass or 1.0)
    if analysis.in_degrees:
        found[..., 3:] = np.degrees(found[..., 3:])
    columns = [f"{name}_{what}" for name in names for what in ("X", "Y", "Z", "Ox", "Oy", "Oz")]
    if is_whole:
        columns += [f"{WHOLE}_{axis}" for axis in "XYZ"]
    for kind, (suffix, title) in enumerate((("pos", "Positions"), ("vel", "Velocities"), ("acc", "Accelerations"))):
        rows = found[kind].reshape(len(motion.times), -1)
        tables.add(
            f"{suffix}_global",
            title,
            columns,
            np.hstack([rows, whole[kind]]) if is_whole else rows,
            in_degrees=analysis.in_degrees,
            description=_DESCRIPTION.format(motion.model.name),
        )


_DESCRIPTION = (
    "\nThis file contains the kinematics (positions and orientations,\n"
    "velocities and angular velocities, or accelerations and angular accelerations)\n"
    "of the centers of mass of the body segments in model {}.\n"
    "\nBody segment orientations are described using body-fixed X-Y-Z Euler angles.\n"
    "\nAngular velocities and accelerations are expressed in the ground frame.\n"
    f"\nUnits are S.I. units (seconds, meters, Newtons, ...)\n{DEGREES}"
)
