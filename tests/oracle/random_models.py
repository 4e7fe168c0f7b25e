"""Random models for tests: trees of joints of every class with springs, bushings and coordinate limits."""

from __future__ import annotations

from typing import Any

import numpy as np

import osimlite
from osimlite import Body, Coordinate, CoordinateLimitForce, Model
from osimlite.schema.function_types import PolynomialFunction, Sine
from osimlite.schema.functions import Constant, LinearFunction
from osimlite.schema.springs import BushingForce, PointToPointSpring, SpringGeneralizedForce

# Number of coordinates of each class of joints.
COORDINATES = {
    "PinJoint": 1,
    "SliderJoint": 1,
    "UniversalJoint": 2,
    "PlanarJoint": 3,
    "GimbalJoint": 3,
    "BallJoint": 3,
    "CustomJoint": 3,
    "EllipsoidJoint": 3,
    "FreeJoint": 6,
}
AXES = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")


class RandomModel:
    """Random model that is determined by its seed."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.model = Model(name="random")
        self.model.gravity = self.vector(6.0)
        self.bodies: list[Body] = []
        self.coordinates: list[Coordinate] = []
        for number in range(int(self.rng.integers(1, 5))):
            self.add_body(number)
        for number in range(int(self.rng.integers(1, 6))):
            make = (self.spring, self.band, self.bushing, self.stop)[int(self.rng.integers(4))]
            self.model.add(make(f"force{number}"))

    def number(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def vector(self, size: float, low: float | None = None) -> tuple[float, float, float]:
        x, y, z = self.rng.uniform(-size if low is None else low, size, 3).tolist()
        return x, y, z

    def choice(self, items: Any) -> Any:
        return items[int(self.rng.integers(len(items)))]

    def add_body(self, number: int) -> None:
        inertia = (*self.vector(0.08, 0.05), *self.vector(0.005))
        body = Body(
            name=f"b{number}",
            mass=self.number(0.3, 3.0),
            mass_center=self.vector(0.2),
            inertia=inertia,
        )
        self.model.add(body)
        parent = self.choice([self.model.ground, *self.bodies])
        kind = self.choice(list(COORDINATES))
        own = [
            Coordinate(
                name=f"q{number}_{index}",
                default_value=self.number(-0.6, 0.6),
                default_speed_value=self.number(-2.0, 2.0),
                locked=self.number(0.0, 1.0) < 0.08,
                range=(-50.0, 50.0),
            )
            for index in range(COORDINATES[kind])
        ]
        joint = getattr(osimlite, kind)(name=f"j{number}", coordinates=own)
        if kind == "EllipsoidJoint":
            joint.radii_x_y_z = self.vector(0.3, 0.05)
        if kind == "CustomJoint":
            self.set_axes(joint.spatial_transform, [item.name for item in own])
        self.model.add(joint.between(parent, body, at=self.vector(0.3)))
        self.bodies.append(body)
        self.coordinates += own

    def set_axes(self, transform: Any, names: list[str]) -> None:
        """Set the axes of a custom joint at random.

        Each coordinate moves one axis alone; some of the other axes follow a function of one
        coordinate.
        """
        frame = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
        alone = dict(zip(self.rng.permutation(6).tolist(), names, strict=False))
        for index, name in enumerate(AXES):
            axis = getattr(transform, name)
            axis.axis = tuple(frame[index % 3].tolist())
            axis.function, driver = Constant(value=0.0), alone.get(index)
            if driver is not None:
                axis.function = LinearFunction(coefficients=(1.0, 0.0))
            elif self.number(0.0, 1.0) < 0.4:
                driver, polynomial = (
                    self.choice(names),
                    PolynomialFunction(coefficients=self.vector(0.2)),
                )
                wave = Sine(
                    amplitude=self.number(-0.3, 0.3),
                    omega=self.number(0.5, 2.0),
                    phase=0.3,
                    offset=0.0,
                )
                axis.function = self.choice([polynomial, wave])
            axis.coordinates = [] if driver is None else [driver]

    def spring(self, name: str) -> SpringGeneralizedForce:
        return SpringGeneralizedForce(
            name=name,
            coordinate=self.choice(self.coordinates).name,
            stiffness=self.number(1.0, 200.0),
            viscosity=self.number(0.0, 2.0),
            rest_length=self.number(-0.3, 0.3),
        )

    def band(self, name: str) -> PointToPointSpring:
        return PointToPointSpring(
            name=name,
            socket_body1="/ground",
            socket_body2=f"/bodyset/{self.choice(self.bodies).name}",
            point1=self.vector(1.0),
            point2=self.vector(0.3),
            stiffness=self.number(1.0, 300.0),
            rest_length=self.number(0.0, 1.0),
        )

    def bushing(self, name: str) -> BushingForce:
        frames = ["/ground", *(f"/bodyset/{body.name}" for body in self.bodies)]
        one, two = self.rng.permutation(len(frames))[:2]
        return BushingForce(
            name=name,
            socket_frame1=frames[one],
            socket_frame2=frames[two],
            rotational_stiffness=self.vector(5.0, 0.0),
            rotational_damping=self.vector(0.3, 0.0),
            translational_stiffness=self.vector(100.0, 0.0),
            translational_damping=self.vector(2.0, 0.0),
        )

    def stop(self, name: str) -> CoordinateLimitForce:
        return CoordinateLimitForce(
            name=name,
            coordinate=self.choice(self.coordinates).name,
            upper_limit=self.number(0.0, 20.0),
            upper_stiffness=self.number(1.0, 20.0),
            lower_limit=self.number(-30.0, 0.0),
            lower_stiffness=self.number(1.0, 20.0),
            damping=self.number(0.0, 1.0),
            transition=self.number(0.01, 10.0),
            compute_dissipation_energy=self.choice([True, False]),
        )
