"""Contact of a mesh with a half space or a sphere by an elastic foundation."""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import CONTACT_WORK, ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import (
    angular_velocity,
    apply_force,
    apply_torque,
    direction,
    station,
    velocity,
)
from osimlite.mechanics.laws.elastic_foundation import (
    FoundationSpring,
    spring_in_half_space,
    spring_in_sphere,
    spring_load,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    dot,
    minus,
    norm,
    plus,
    store_vector,
    times,
    vector,
)

SPRINGS = 16
"""Offset among the numbers of the springs: stiffness (N/m) and position in the link of each."""

MESH_WORK = 10
"""Length of the record: force and torque on the mesh, the point they act about, and energy."""


def touch_mesh(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Apply the contact force of a mesh (surface 2) on a half space or a sphere.

    The integers are the links of both surfaces, the number of the pair in its force, the number of
    springs, and whether surface 1 is a half space. The numbers are centre, normal and radius of surface
    1 in its link, centre and radius of the bounding sphere of the mesh in its link, and c, us, ud, uv,
    vt of the law.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the records of mesh and contact and the wrenches are changed.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    first_link = i[ITEM.DETAILS]
    second_link = i[ITEM.DETAILS + 1]
    count = i[ITEM.DETAILS + 3]
    is_plane = i[ITEM.DETAILS + 4]
    p, result = at(reals, i[ITEM.NUMBERS]), at(data, i[ITEM.RECORD])
    for k in range(MESH_WORK):
        result[k] = 0.0
    o = station(model, data, first_link, vector(p, 0))
    about = station(model, data, second_link, vector(p, 7))
    n = direction(model, data, first_link, vector(p, 3))
    mesh_offset = minus(about, o)
    # Skip all springs if the bounding sphere of the mesh does not reach the other surface.
    if is_plane:
        if dot(mesh_offset, n) >= p[10]:
            return OUTCOME.OK
    elif dot(mesh_offset, mesh_offset) >= (p[6] + p[10]) * (p[6] + p[10]):
        return OUTCOME.OK
    # Relative motion at one point, from which `spring_load` computes that of each spring.
    v = minus(velocity(model, data, first_link, about), velocity(model, data, second_link, about))
    turning = minus(
        angular_velocity(model, data, first_link), angular_velocity(model, data, second_link)
    )
    force = torque = ZERO
    energy = 0.0
    for k in range(count):
        spring = at(p, SPRINGS + 4 * k)
        middle = station(model, data, second_link, vector(spring, 1))
        d, end = (
            spring_in_half_space(o, n, middle) if is_plane else spring_in_sphere(o, p[6], middle)
        )
        if d > 0.0:
            constants = FoundationSpring(spring[0], p[11], p[12], p[13], p[14], p[15])
            spring_force, spring_torque, stored_energy = spring_load(
                constants, middle, end, about, v, turning
            )
            force = plus(force, spring_force)
            torque = plus(torque, spring_torque)
            energy += stored_energy
    apply_mesh_load(model, data, item, about, force, torque, energy)
    return OUTCOME.OK


def apply_mesh_load(
    model: Ints,
    data: Floats,
    item: int,
    about: Vector,
    force: Vector,
    torque: Vector,
    energy: float,
) -> None:
    """Apply a force and a torque to the mesh, and their opposites to surface 1; fill both records.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        item: offset of the mesh's item.
        about: point where the force acts (m).
        force: force on the mesh (N).
        torque: torque on the mesh (N m).
        energy: potential energy (J).
    """
    i = at(model, item)
    first_link = i[ITEM.DETAILS]
    second_link = i[ITEM.DETAILS + 1]
    result = at(data, i[ITEM.RECORD])
    contact = at(
        data,
        model[
            model[model[MODEL.CONTACT_AT] + i[ITEM.FIRST_CONTACT] + i[ITEM.DETAILS + 2]]
            + ITEM.RECORD
        ],
    )
    store_vector(result, 0, force)
    store_vector(result, 3, about)
    store_vector(result, 6, torque)
    store_vector(contact, 0, force)
    store_vector(contact, 3, about)
    result[9] = energy
    apply_force(model, data, second_link, about, force)
    apply_torque(model, data, second_link, torque)
    apply_force(model, data, first_link, about, times(-1.0, force))
    apply_torque(model, data, first_link, times(-1.0, torque))
    # A mesh has no depth of its own: 1 says that it transmits a force.
    if norm(force) != 0.0:
        contact[CONTACT_WORK.DEPTH] = 1.0
