"""What makes the element of a force, by the class of the force; the two that every walker has are not among them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.schema.actuators import (
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.contact_forces import ElasticFoundationForce, MeyerFregly2016Force, SmoothSphereHalfSpaceForce
from osimlite.schema.prescribed import ExternalForce, PrescribedForce
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedBushingForce,
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    FunctionBasedBushingForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation.actuator_elements import (
    CoordinateDrive,
    IdleActuator,
    PointDrive,
    PointToPointDrive,
    Prescribed,
    TorqueDrive,
)
from osimlite.simulation.bushing_elements import Bushing
from osimlite.simulation.elements import ElementBuilder, ForceElement
from osimlite.simulation.external_loads import load_in_model
from osimlite.simulation.mesh_contact import elastic_foundation
from osimlite.simulation.path_elements import PATH_MAKERS
from osimlite.simulation.smooth_contact_element import SmoothContact
from osimlite.simulation.spring_elements import CoordinateFormula, CoordinateSpring, PointSpring
from osimlite.simulation.station_contact_element import StationContact

MAKERS: dict[type, Callable[[ElementBuilder, Any], ForceElement]] = {
    **PATH_MAKERS,
    BodyActuator: IdleActuator.of,
    CoordinateActuator: CoordinateDrive.of,
    PointActuator: PointDrive.of,
    PointToPointActuator: PointToPointDrive.of,
    PrescribedForce: Prescribed.of,
    TorqueActuator: TorqueDrive.of,
    BushingForce: Bushing.linear,
    ElasticFoundationForce: elastic_foundation,
    ExpressionBasedBushingForce: Bushing.by_formulas,
    ExpressionBasedCoordinateForce: CoordinateFormula.of,
    ExpressionBasedPointToPointForce: PointSpring.of_formula,
    ExternalForce: load_in_model,
    FunctionBasedBushingForce: Bushing.by_functions,
    MeyerFregly2016Force: StationContact.of,
    PointToPointSpring: PointSpring.of,
    SmoothSphereHalfSpaceForce: SmoothContact.of,
    SpringGeneralizedForce: CoordinateSpring.of,
}
