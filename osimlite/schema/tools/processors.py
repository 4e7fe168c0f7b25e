"""Processors: a model or a table that is read from a file and changed by operators, one after the other."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import (
    Flag,
    LegacyMany,
    Many,
    Number,
    Optional,
    Reference,
    maybe,
    real,
    word,
)
from osimlite.schema.model import Model
from osimlite.schema.paths import FunctionBasedPath
from osimlite.schema.references import InputTable, Names, make_input_file
from osimlite.schema.sets import Set


class ModelOperator(Object, abstract=True):
    """A change of a model."""


class ModelProcessor(Object):
    """A model and what is done to it before it is used."""

    filepath: Annotated[str, make_input_file("Model")] = ""
    """File of the model, found from the folder that OpenSim runs in."""
    operators: Many[ModelOperator] = make_empty_list()
    """Operators that are applied in this order."""
    model: Optional[Model] = None
    """The model itself, if it is in no file."""


class ModOpAddExternalLoads(ModelOperator):
    """Adds measured loads."""

    filepath: Annotated[str, make_input_file("ExternalLoads")] = ""
    """File of the loads."""


class ModOpAddReserves(ModelOperator):
    """Adds an actuator for each coordinate."""

    optimal_force: Number = 1.0
    """Force or torque of each at full control."""
    bound: Annotated[float | None, maybe()] = None
    """Largest control in both directions; left out, there is none."""
    skip_coordinates_with_actuators: Flag = True
    """Whether coordinates that have an actuator already get none."""
    skip_residual_coordinates: Flag = False
    """Whether coordinates of joints to ground get none."""


class ModOpIgnoreActivationDynamics(ModelOperator):
    """Makes activations of muscles equal to their excitations."""


class ModOpIgnorePassiveFiberForcesDGF(ModelOperator):
    """Takes passive forces from muscles of DeGroote and Fregly."""


class ModOpIgnoreTendonCompliance(ModelOperator):
    """Makes tendons stiff."""


class ModOpRemoveMuscles(ModelOperator):
    """Takes out all muscles."""


class ModOpReplaceJointsWithWelds(ModelOperator):
    """Makes joints stiff."""

    joint_paths: Annotated[Names, Reference("model-path", "Joint", "list", required=False)] = ()
    """Paths of the joints."""


class ModOpReplaceMusclesWithDeGrooteFregly2016(ModelOperator):
    """Puts muscles of DeGroote and Fregly in the places of others."""


class ModOpReplaceMusclesWithPathActuators(ModelOperator):
    """Puts actuators along the same paths in the places of muscles."""


class ModOpReplacePathsWithFunctionBasedPaths(ModelOperator):
    """Puts functions in the places of paths."""

    paths_file: Annotated[str, make_input_file("Set_FunctionBasedPath_")] = ""
    """File of the functions, each with the path of the force that it belongs to as its name."""


class ModOpScaleActiveFiberForceCurveWidthDGF(ModelOperator):
    """Widens the active force-length curve of muscles of DeGroote and Fregly."""

    scale_factor: Number = 1.0
    """Factor of the width."""


class ModOpScaleMaxIsometricForce(ModelOperator):
    """Makes muscles stronger."""

    scale_factor: Number = 1.0
    """Factor of their maximum isometric forces."""


class ModOpTendonComplianceDynamicsModeDGF(ModelOperator):
    """Says how the tendons of muscles of DeGroote and Fregly are computed."""

    mode: Annotated[str, word("explicit", "implicit")] = "explicit"
    """Form of the differential equation: explicit or implicit."""


class FunctionBasedPathSet(Set, tag="Set_FunctionBasedPath_"):
    """Paths as functions of coordinates, in a document of their own."""

    objects: LegacyMany[FunctionBasedPath] = make_empty_list()
    """The paths, each with the path of the force that it belongs to as its name."""


class TableOperator(Object, abstract=True):
    """A change of a table."""


class TableProcessor(Object):
    """A table and what is done to it before it is used."""

    filepath: InputTable = ""
    """File of the table, found from the folder of the document."""
    operators: Many[TableOperator] = make_empty_list()
    """Operators that are applied in this order."""


class TabOpAppendCoupledCoordinateValues(TableOperator):
    """Adds columns for coordinates that others determine."""

    overwrite_existing_columns: Flag = True
    """Whether columns that are there already are computed anew."""


class TabOpLowPassFilter(TableOperator):
    """Filters all columns."""

    cutoff_frequency: Annotated[float, real("Hz")] = -1.0
    """Cut-off frequency; negative for no filter."""
    trim_to_original_time_range: Flag = True
    """Whether rows that the filter adds at both ends are taken away."""


class TabOpUseAbsoluteStateNames(TableOperator):
    """Gives columns of states their paths as labels."""
