from __future__ import annotations

import pytest

from osimlite.errors import UnsupportedError
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Body
from osimlite.schema.functions import LinearFunction, Sine
from osimlite.schema.joints import SliderJoint
from osimlite.schema.model import Model
from osimlite.simulation import simulate


def _sliders() -> tuple[Model, list[Coordinate]]:
    model, coordinates = Model(name="sliders"), []
    for name in "ab":
        body = model.add(Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        coordinate = Coordinate(name=f"x{name}")
        joint = SliderJoint(name=f"j{name}", coordinates=[coordinate])
        model.add(joint.between(model.ground, body))
        coordinates.append(joint.coordinates[0])
    return model, coordinates


def test_constraints_are_not_left_out_in_silence():
    model, (first, second) = _sliders()
    law = LinearFunction(coefficients=(1.0, 0.0))
    constraint = CoordinateCouplerConstraint(
        name="gear",
        coupled_coordinates_function=law,
        independent_coordinate_names=(first.name,),
        dependent_coordinate_name=second.name,
    )
    model.constraint_set.objects.append(constraint)
    pytest.importorskip("numba", reason="needs numba (extra 'fast')")
    with pytest.raises(UnsupportedError, match="compiled engine cannot keep up /constraintset/gear"):
        simulate(model, 0.01, "compiled")
    constraint.isEnforced = False
    first.prescribed_function, first.prescribed = Sine(), True
    with pytest.raises(UnsupportedError, match="cannot keep up /jointset/ja/xa"):
        simulate(model, 0.01, "compiled")
    first.prescribed = False
    simulate(model, 0.01, "compiled")
