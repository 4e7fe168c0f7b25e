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
from osimlite.schema.functions import LinearFunction, PolynomialFunction
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    angles_of,
    quaternion_matrix,
    vector,
)

SOFT = "a soft constraint, which a load opens"


def add_equalities(draft: ConversionDraft) -> None:
    """Add all equality constraints that OpenSim has."""
    model, kinds = draft.mj, draft.source.mujoco.mjtEq
    for number in range(model.neq):
        kind = int(model.eq_type[number])
        if kind == int(kinds.mjEQ_JOINT):
            _couple_joints(draft, number)
        elif kind == int(kinds.mjEQ_CONNECT):
            _connect(draft, number)
        elif kind == int(kinds.mjEQ_WELD):
            _weld(draft, number)
        else:
            draft.drop("equality", number, "an equality of tendons, flexes or distances")


def shifted_polynomial(draft: ConversionDraft, number: int) -> Polynomial:
    """Return the polynomial of a joint equality in the values of the coordinates.

    MuJoCo's is q1 - ref1 = sum of c_k (q2 - ref2)^k; this one gives q1 from q2.
    """
    model = draft.mj
    one, other = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
    first = float(model.qpos0[model.jnt_qposadr[one]])
    coefficients = model.eq_data[number, :5]
    # Without a second joint the first one keeps a value.
    if other < 0:
        return Polynomial([first + float(coefficients[0])])
    second = float(model.qpos0[model.jnt_qposadr[other]])
    return Polynomial(coefficients)(Polynomial([-second, 1.0])) + first


def _couple_joints(draft: ConversionDraft, number: int) -> None:
    model = draft.mj
    one, other = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
    dependent = draft.coordinates[one][0]
    polynomial = shifted_polynomial(draft, number)
    active = bool(model.eq_active0[number])
    if other < 0:
        coordinate = draft.made[dependent]
        value = float(polynomial.coef[0])
        coordinate.default_value, coordinate.locked = value, active
        # A clamped coordinate needs its default in the range.
        low, high = coordinate.range
        coordinate.range = (min(low, value), max(high, value))
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
            independent_coordinate_names=(draft.coordinates[other][0],),
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


def _connect(draft: ConversionDraft, number: int) -> None:
    model = draft.mj
    one, two, sites = _frames_of(draft, number)
    # Sites have their points themselves, bodies have them in the data.
    if sites:
        points = model.site_pos[one], model.site_pos[two]
        one, two = int(model.site_bodyid[one]), int(model.site_bodyid[two])
    else:
        points = model.eq_data[number, :3], model.eq_data[number, 3:6]
    name = draft.unique("constraint", draft.source.name_of("equality", number))
    draft.model.add(
        PointConstraint(
            name=name,
            socket_body_1=draft.frames[one],
            socket_body_2=draft.frames[two],
            location_body_1=vector(points[0]),
            location_body_2=vector(points[1]),
            isEnforced=bool(model.eq_active0[number]),
        )
    )
    draft.record("equality", number, SOFT, "an exact PointConstraint", f"constraint {name}")


def _weld(draft: ConversionDraft, number: int) -> None:
    model = draft.mj
    one, two, sites = _frames_of(draft, number)
    here, straight = np.zeros(3), np.eye(3)
    poses: list[tuple[Array, Array]]
    if sites:
        poses = [
            (np.array(model.site_pos[site]), quaternion_matrix(model.site_quat[site]))
            for site in (one, two)
        ]
        one, two = int(model.site_bodyid[one]), int(model.site_bodyid[two])
    else:
        # The pose of the second body in the first, as MuJoCo stores it.
        relative = quaternion_matrix(model.eq_data[number, 6:10])
        poses = [(np.array(model.eq_data[number, 3:6]), relative), (here, straight)]
        # The anchor is a point of the second body; its place in the first one is in the data.
        anchor = np.array(model.eq_data[number, :3])
        poses[1] = (anchor, straight)
    name = draft.unique("constraint", draft.source.name_of("equality", number))
    frames: list[PhysicalFrame] = [
        PhysicalOffsetFrame(
            name=f"{draft.frames[body].name}_{word}",
            socket_parent=draft.frames[body],
            translation=vector(position),
            orientation=angles_of(rotation),
        )
        for word, body, (position, rotation) in zip(
            ("first", "second"), (one, two), poses, strict=True
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
