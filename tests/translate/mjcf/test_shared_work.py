"""Tests of results that an export reuses: they equal those that are computed anew."""

from __future__ import annotations

import numpy as np

import osimlite
from osimlite import Body, Coordinate, CoordinateCouplerConstraint, Model, PinJoint
from osimlite.mechanics.multibody.functions import ScaledFunction, SimmCubicSpline
from osimlite.schema.functions import LinearFunction
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import PathPoint
from osimlite.translate.mjcf import moving
from osimlite.translate.mjcf.poses import draw_poses


def test_the_other_side_of_a_body_takes_no_second_fit() -> None:
    right = SimmCubicSpline((0.0, 0.4, 0.9, 1.3, 2.0), (0.1, 0.3, -0.2, 0.25, 0.2))
    first, slides = moving.fit_composition((right, right), (0.0, 2.0))
    fits = moving.fit_quartics.cache_info().misses
    other, mirrored = moving.fit_composition((right, ScaledFunction(-1.0, right)), (0.0, 2.0))
    assert moving.fit_quartics.cache_info().misses == fits
    assert np.array_equal(first, other)
    assert np.array_equal(mirrored, slides * [[1.0], [-1.0]])


def test_poses_know_what_paths_say_one_by_one() -> None:
    model = Model(name="coupled")
    below = model.ground
    coordinates = [Coordinate(name=f"q{k}", range=(-1.0, 1.0)) for k in range(4)]
    coordinates[2].locked, coordinates[2].default_value = True, 0.3
    for number, coordinate in enumerate(coordinates):
        body = model.add(Body(name=f"b{number}", mass=1.0, inertia=(0.1, 0.1, 0.1, 0.0, 0.0, 0.0)))
        model.add(
            PinJoint(name=f"j{number}", coordinates=[coordinate]).between(
                below, body, at=(0.0, -0.4, 0.1)
            )
        )
        below = body
    model.add(
        CoordinateCouplerConstraint(
            name="couples",
            coupled_coordinates_function=LinearFunction(coefficients=(0.5, 0.1)),
            independent_coordinate_names=(coordinates[0],),
            dependent_coordinate_name=coordinates[1],
        )
    )
    spring = PathSpring(name="spring", resting_length=0.2, stiffness=300.0, dissipation=0.4)
    for name, frame in (("p0", "/ground"), ("p1", "/bodyset/b1"), ("p2", "/bodyset/b2")):
        point = PathPoint(name=name, socket_parent_frame=frame, location=(0.1, 0.05, 0.0))
        spring.geometry_path.path_point_set.objects.append(point)
    model.add(spring)
    paths = osimlite.paths(model)
    poses, truth = draw_poses(paths, 5)
    names = [paths.mechanism.coordinates[place].path for place in poses.moving]
    assert names == ["/jointset/j0/q0", "/jointset/j3/q3"]
    for number, q in enumerate(poses.q):
        (length,), (arms,) = paths.lengths(q).values(), paths.moment_arms(q).values()
        assert truth["/forceset/spring"].lengths[number] == length
        assert truth["/forceset/spring"].arms[number].tolist() == [
            arms.get(name, 0.0) for name in names
        ]
        state, coupling = paths.mechanism.at(q), paths.compute_coupling(q)
        assert np.array_equal(poses.rates[number], coupling[:, poses.moving])
        for body in (-1, 0, 1, 2):
            assert np.array_equal(poses.rotations[body, number], state.rotations[body])
            assert np.array_equal(
                poses.jacobians[body, number], state.jacobians[body] @ coupling[:, poses.moving]
            )
