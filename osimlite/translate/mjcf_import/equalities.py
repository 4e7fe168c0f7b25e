"""Equality constraints: polynomials of joints, welds and connections.

MuJoCo's constraints are soft, OpenSim's are exact.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.constraint_types import (
    CoordinateCouplerConstraint,
    PointConstraint,
    WeldConstraint,
)
from osimlite.schema.frames import PhysicalFrame, PhysicalOffsetFrame
from osimlite.schema.function_types import PolynomialFunction
from osimlite.schema.functions import LinearFunction
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    angles_of,
    quaternion_matrix,
    vector,
)

SOFT = "a soft constraint, which yields under load"


def add_equalities(draft: ConversionDraft) -> None:
    """Add all equality constraints that OpenSim has."""
    model, equality_types = draft.mj, draft.source.mujoco.mjtEq
    for number in range(model.neq):
        equality_type = int(model.eq_type[number])
        if equality_type == int(equality_types.mjEQ_JOINT):
            _couple_joints(draft, number)
        elif equality_type == int(equality_types.mjEQ_CONNECT):
            _add_point_constraint(draft, number)
        elif equality_type == int(equality_types.mjEQ_WELD):
            _weld(draft, number)
        else:
            draft.drop("equality", number, "an equality of tendons, flexes or distances")


def shifted_polynomial(draft: ConversionDraft, number: int) -> Polynomial:
    """Return the polynomial of a joint equality in the values of the coordinates.

    MuJoCo's is q1 - ref1 = sum of c_k (q2 - ref2)^k; this one gives q1 from q2.
    """
    model = draft.mj
    first_joint, second_joint = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
    first_reference = float(model.qpos0[model.jnt_qposadr[first_joint]])
    coefficients = model.eq_data[number, :5]
    # Without a second joint the first one keeps a value.
    if second_joint < 0:
        return Polynomial([first_reference + float(coefficients[0])])
    second_reference = float(model.qpos0[model.jnt_qposadr[second_joint]])
    return Polynomial(coefficients)(Polynomial([-second_reference, 1.0])) + first_reference


def _couple_joints(draft: ConversionDraft, number: int) -> None:
    model = draft.mj
    first_joint, second_joint = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
    dependent = draft.coordinates[first_joint][0]
    polynomial = shifted_polynomial(draft, number)
    active = bool(model.eq_active0[number])
    if second_joint < 0:
        coordinate = draft.made[dependent]
        value = float(polynomial.coef[0])
        coordinate.default_value, coordinate.locked = value, active
        # A clamped coordinate needs its default in the range.
        lower, upper = coordinate.range
        coordinate.range = (min(lower, value), max(upper, value))
        draft.record("equality", number, SOFT, f"coordinate {dependent} is locked")
        return
    coefficients = tuple(float(value) for value in polynomial.coef[::-1])
    name = draft.unique("constraint", draft.source.name_of("equality", number))
    function = (
        # OpenSim lists the highest power first.
        LinearFunction(
            name="coupled_coordinates_function",
            coefficients=coefficients if len(coefficients) == 2 else (0.0, *coefficients),
        )
        if len(coefficients) <= 2
        else PolynomialFunction(name="coupled_coordinates_function", coefficients=coefficients)
    )
    draft.model.add(
        CoordinateCouplerConstraint(
            name=name,
            coupled_coordinates_function=function,
            independent_coordinate_names=(draft.coordinates[second_joint][0],),
            dependent_coordinate_name=dependent,
            isEnforced=active,
        )
    )
    # Otherwise the assembly would move the independent coordinate.
    if active:
        draft.made[dependent].is_free_to_satisfy_constraints = True
    draft.record("equality", number, SOFT, "an exact coupler of coordinates", f"constraint {name}")


def _frames_of(draft: ConversionDraft, number: int) -> tuple[int, int, bool]:
    """Return the objects of an equality, and whether they are sites."""
    model = draft.mj
    sites = int(model.eq_objtype[number]) == int(draft.source.mujoco.mjtObj.mjOBJ_SITE)
    return int(model.eq_obj1id[number]), int(model.eq_obj2id[number]), sites


def _add_point_constraint(draft: ConversionDraft, number: int) -> None:
    """Add the PointConstraint of a `connect` equality, between points of bodies or two sites."""
    model = draft.mj
    first, second, are_sites = _frames_of(draft, number)
    # Sites have their points themselves, bodies have them in the data.
    if are_sites:
        points = model.site_pos[first], model.site_pos[second]
        first, second = int(model.site_bodyid[first]), int(model.site_bodyid[second])
    else:
        points = model.eq_data[number, :3], model.eq_data[number, 3:6]
    name = draft.unique("constraint", draft.source.name_of("equality", number))
    draft.model.add(
        PointConstraint(
            name=name,
            socket_body_1=draft.frames[first],
            socket_body_2=draft.frames[second],
            location_body_1=vector(points[0]),
            location_body_2=vector(points[1]),
            isEnforced=bool(model.eq_active0[number]),
        )
    )
    draft.record("equality", number, SOFT, "an exact PointConstraint", f"constraint {name}")


def _weld(draft: ConversionDraft, number: int) -> None:
    model = draft.mj
    first, second, are_sites = _frames_of(draft, number)
    origin, identity = np.zeros(3), np.eye(3)
    poses: list[tuple[Array, Array]]
    if are_sites:
        poses = [
            (np.array(model.site_pos[site]), quaternion_matrix(model.site_quat[site]))
            for site in (first, second)
        ]
        first, second = int(model.site_bodyid[first]), int(model.site_bodyid[second])
    else:
        # The pose of the second body in the first, as MuJoCo stores it.
        relative = quaternion_matrix(model.eq_data[number, 6:10])
        poses = [(np.array(model.eq_data[number, 3:6]), relative), (origin, identity)]
        # The anchor is a point of the second body; its place in the first one is in the data.
        anchor = np.array(model.eq_data[number, :3])
        poses[1] = (anchor, identity)
    name = draft.unique("constraint", draft.source.name_of("equality", number))
    frames: list[PhysicalFrame] = [
        PhysicalOffsetFrame(
            name=f"{draft.frames[body].name}_{suffix}",
            socket_parent=draft.frames[body],
            translation=vector(position),
            orientation=angles_of(rotation),
        )
        for suffix, body, (position, rotation) in zip(
            ("first", "second"), (first, second), poses, strict=True
        )
    ]
    draft.model.add(
        WeldConstraint(
            name=name,
            frames=frames,
            socket_frame1=frames[0],
            socket_frame2=frames[1],
            isEnforced=bool(model.eq_active0[number]),
        )
    )
    draft.record("equality", number, SOFT, "an exact WeldConstraint", f"constraint {name}")
