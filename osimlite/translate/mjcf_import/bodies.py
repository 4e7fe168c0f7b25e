"""Bodies: masses and inertias of the compiled model, and sites as markers."""

from __future__ import annotations

import numpy as np

from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import Body
from osimlite.schema.markers import Marker
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf_import.draft import ConversionDraft, quaternion_matrix, vector
from osimlite.translate.mjcf_import.joints import add_joints


def add_bodies(draft: ConversionDraft) -> None:
    """Add all bodies and joints, parents first."""
    model = draft.mj
    draft.frames = [draft.world]
    draft.coordinates = [()] * int(model.njnt)
    draft.unique("body", "ground")
    draft.fidelity.translated[draft.source.path_of("body", 0)] = "ground"
    for body in range(1, model.nbody):
        frame = _make_body(draft, body)
        parent = draft.frames[int(model.body_parentid[body])]
        draft.frames.append(frame)
        draft.model.add(frame)
        draft.note_result("body", body, f"body {frame.name}")
        draft.fidelity.note_name(
            draft.source.path_of("body", body),
            "body",
            draft.source.name_of("body", body),
            frame.name,
        )
        add_joints(draft, body, frame, parent)
        if model.body_mocapid[body] >= 0:
            draft.record(
                "body",
                body,
                "a body that a program moves (mocap)",
                "welded at its default position",
            )
        if model.body_gravcomp[body]:
            draft.record(
                "body",
                body,
                "compensation of gravity",
                LEFT_OUT,
                f"gravcomp {float(model.body_gravcomp[body]):g}",
            )


def _make_body(draft: ConversionDraft, body: int) -> Body:
    """Return the OpenSim body with the mass, mass centre and inertia of a body of MuJoCo.

    MuJoCo gives principal moments and axes; OpenSim needs the matrix in the axes of the body.
    """
    model = draft.mj
    axes = quaternion_matrix(model.body_iquat[body])
    inertia: Array = axes @ np.diag(model.body_inertia[body]) @ axes.T
    mass = float(model.body_mass[body])
    xx, yy, zz, xy, xz, yz = (
        # Adding 0.0 turns -0.0 into 0.0, which files should not show.
        float(inertia[row, column]) + 0.0
        for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    )
    return Body(
        name=draft.unique("body", draft.source.name_of("body", body)),
        mass=mass,
        mass_center=vector(model.body_ipos[body]),
        inertia=(xx, yy, zz, xy, xz, yz),
    )


def add_markers(draft: ConversionDraft) -> None:
    """Add the sites that no tendon runs through as markers."""
    model = draft.mj
    for site in range(model.nsite):
        if site in draft.path_sites:
            continue
        name = draft.unique("marker", draft.source.name_of("site", site))
        draft.model.add(
            Marker(
                name=name,
                socket_parent_frame=draft.frames[int(model.site_bodyid[site])],
                location=vector(model.site_pos[site]),
                fixed=True,
            )
        )
        draft.note_result("site", site, f"marker {name}")
