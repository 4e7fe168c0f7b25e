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
    """Change of a model."""


class ModelProcessor(Object):
    """Model with operators that change it before use."""

    filepath: Annotated[str, make_input_file("Model")] = ""
    """File of the model, relative to the working folder of OpenSim."""
    operators: Many[ModelOperator] = make_empty_list()
    """Operators that are applied in this order."""
    model: Optional[Model] = None
    """The model itself, if it is in no file."""


class ModOpAddExternalLoads(ModelOperator):
    """Adds measured loads."""

    filepath: Annotated[str, make_input_file("ExternalLoads")] = ""
    """File of the loads."""


class ModOpAddReserves(ModelOperator):
    """Adds a reserve actuator for each coordinate."""

    optimal_force: Number = 1.0
    """Force or torque of each actuator at a control of 1."""
    bound: Annotated[float | None, maybe()] = None
    """Largest control in both directions; left out, there is none."""
    skip_coordinates_with_actuators: Flag = True
    """Whether coordinates that have an actuator get no reserve."""
    skip_residual_coordinates: Flag = False
    """Whether coordinates of joints to ground get no reserve."""


class ModOpIgnoreActivationDynamics(ModelOperator):
    """Makes activations of muscles equal to their excitations."""


class ModOpIgnorePassiveFiberForcesDGF(ModelOperator):
    """Switches off passive forces of DeGrooteFregly2016Muscles."""


class ModOpIgnoreTendonCompliance(ModelOperator):
    """Makes tendons rigid."""


class ModOpRemoveMuscles(ModelOperator):
    """Removes all muscles."""


class ModOpReplaceJointsWithWelds(ModelOperator):
    """Replaces joints by weld joints."""

    joint_paths: Annotated[Names, Reference("model-path", "Joint", "list", required=False)] = ()
    """Paths of the joints."""


class ModOpReplaceMusclesWithDeGrooteFregly2016(ModelOperator):
    """Replaces muscles by DeGrooteFregly2016Muscles."""


class ModOpReplaceMusclesWithPathActuators(ModelOperator):
    """Replaces muscles by actuators along the same paths."""


class ModOpReplacePathsWithFunctionBasedPaths(ModelOperator):
    """Replaces paths by functions."""

    paths_file: Annotated[str, make_input_file("Set_FunctionBasedPath_")] = ""
    """File of the functions, each with the path of the force that it belongs to as its name."""


class ModOpScaleActiveFiberForceCurveWidthDGF(ModelOperator):
    """Widens the active force-length curve of DeGrooteFregly2016Muscles."""

    scale_factor: Number = 1.0
    """Factor of the width."""


class ModOpScaleMaxIsometricForce(ModelOperator):
    """Scales the maximum isometric forces of muscles."""

    scale_factor: Number = 1.0
    """Factor of the maximum isometric force of each muscle."""


class ModOpTendonComplianceDynamicsModeDGF(ModelOperator):
    """Sets the form of the tendon dynamics of DeGrooteFregly2016Muscles."""

    mode: Annotated[str, word("explicit", "implicit")] = "explicit"
    """Form of the differential equation: explicit or implicit."""


class FunctionBasedPathSet(Set, tag="Set_FunctionBasedPath_"):
    """Paths as functions of coordinates, in a separate document."""

    objects: LegacyMany[FunctionBasedPath] = make_empty_list()
    """The paths, each with the path of the force that it belongs to as its name."""


class TableOperator(Object, abstract=True):
    """Change of a table."""


class TableProcessor(Object):
    """Table with operators that change it before use."""

    filepath: InputTable = ""
    """File of the table, relative to the folder of the document."""
    operators: Many[TableOperator] = make_empty_list()
    """Operators that are applied in this order."""


class TabOpAppendCoupledCoordinateValues(TableOperator):
    """Adds columns for coordinates that others determine."""

    overwrite_existing_columns: Flag = True
    """Whether existing columns are computed anew."""


class TabOpLowPassFilter(TableOperator):
    """Filters all columns."""

    cutoff_frequency: Annotated[float, real("Hz")] = -1.0
    """Cut-off frequency; negative for no filter."""
    trim_to_original_time_range: Flag = True
    """Whether rows that the filter adds at both ends are removed."""


class TabOpUseAbsoluteStateNames(TableOperator):
    """Labels columns of states with their paths."""
