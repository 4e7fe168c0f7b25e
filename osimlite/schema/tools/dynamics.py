"""Tools that compute forces or motions: inverse dynamics, analyses along a motion, forward integration."""

from typing import Annotated

from osimlite.schema.base import Object, make_default
from osimlite.schema.fields import (
    LegacyFlag,
    LegacyInteger,
    LegacyNumber,
    LegacyUnnamed,
    Reals,
    Reference,
    real,
    reals,
)
from osimlite.schema.references import (
    LegacyInputLoads,
    LegacyInputModel,
    LegacyInputMotion,
    LegacyInputTable,
    LegacyJointNames,
    LegacyOutputFolder,
    LegacyOutputTable,
    Names,
    make_input_file,
    make_name_list,
    make_output_file,
)
from osimlite.schema.sets import ControllerSet
from osimlite.schema.tools.base import AnalysisSet, Tool


class DynamicsTool(Tool, abstract=True):
    """Base class of tools that use measured loads."""

    model_file: LegacyInputModel = "Unassigned"
    """File of the model, relative to the working folder of OpenSim."""
    time_range: Annotated[Reals, reals("s", least=2, most=2, legacy=True)] = (
        float("-inf"),
        float("inf"),
    )
    """First and last time."""
    # OpenSim looks for names of forces only if the ForceSet has no group. ALL keeps the external
    # loads, although OpenSim's own description says that it removes them.
    forces_to_exclude: Annotated[
        Names,
        make_name_list(
            "set-member",
            "Force",
            "MUSCLES",
            "ACTUATORS",
            "ALL",
            any_case=True,
            consequence="left out",
        ),
    ] = ()
    """Forces that do not act: ALL, ACTUATORS, MUSCLES, groups of the model's forces, names of forces."""
    external_loads_file: LegacyInputLoads = "Unassigned"
    """Measured loads (.xml)."""


class InverseDynamicsTool(DynamicsTool):
    """Computes the generalized forces of a measured motion."""

    # Of the values of `inDegrees` OpenSim understands only yes and y, in lower case. After `true` it
    # takes degrees for radians: moments become enormous, and nothing is reported.
    coordinates_file: LegacyInputMotion = "Unassigned"
    """The motion: a column for each coordinate by its plain name (.mot, .sto)."""
    # OpenSim first pads the data at both ends by half their length, reflected. Padded rows within
    # the time range are results as well.
    lowpass_cutoff_frequency_for_coordinates: Annotated[float, real("Hz", legacy=True)] = -1.0
    """Cut-off frequency of the filter of the coordinates; negative for no filter."""
    # OpenSim drops a folder in this name with a warning. An empty name makes a file named `.sto`.
    output_gen_force_file: Annotated[str, make_output_file("table", legacy=True, required=True)] = (
        "inverse_dynamics.sto"
    )
    """File for the generalized forces, in `results_directory`."""
    # OpenSim understands no paths here: it warns and writes no file.
    joints_to_report_body_forces: LegacyJointNames = ()
    """Joints whose generalized forces are also written as forces and torques on bodies, or ALL."""
    output_body_forces_file: LegacyOutputTable = "body_forces_at_joints.sto"
    """File for forces and torques on bodies, in `results_directory`."""


class AbstractTool(Object, abstract=True):
    """Base class of tools that simulate a model, with their common settings."""

    model_file: LegacyInputModel = ""
    """File of the model, relative to the folder of the setup file, as are all files."""
    replace_force_set: LegacyFlag = False
    """Whether the forces of `force_set_files` replace those of the model; otherwise they are added."""
    # OpenSim splits the list at blanks and knows no quotes, so that no name can contain a blank.
    force_set_files: Annotated[
        tuple[str, ...], Reference("file", "ForceSet file", "list", required=False, legacy=True)
    ] = ()
    """Documents of forces, separated by blanks."""
    # OpenSim makes one level of folders only. If more are missing, all results are lost, and the
    # tool still reports success.
    results_directory: LegacyOutputFolder = "./"
    """Folder for the results, made if only its last part is missing."""
    output_precision: LegacyInteger = 8
    """Number of digits in the results."""
    initial_time: Annotated[float, real("s", legacy=True)] = 0.0
    """Time at which the run begins."""
    # OpenSim's AnalyzeTool crashes if it is before the initial time.
    final_time: Annotated[float, real("s", legacy=True)] = 1.0
    """Time at which the run ends."""
    solve_for_equilibrium_for_auxiliary_states: LegacyFlag = False
    """Whether muscles are brought into equilibrium before the run."""
    # OpenSim 4.6's forward tool does not stop there (measured with 1).
    maximum_number_of_integrator_steps: LegacyInteger = 20000
    """Largest number of steps of the integrator."""
    maximum_integrator_step_size: Annotated[float, real(domain="> 0", legacy=True)] = 1.0
    """Longest step of the integrator, in seconds."""
    minimum_integrator_step_size: LegacyNumber = 1e-8
    """Shortest step of the integrator, in seconds."""
    # OpenSim does not return with a tolerance of 0.
    integrator_error_tolerance: LegacyNumber = 1e-5
    """Error of a step above which the integrator takes a shorter one."""
    analysis_set: LegacyUnnamed[AnalysisSet] = make_default(AnalysisSet, name="Analyses")
    """Analyses that are computed and written along the run."""
    controller_set: LegacyUnnamed[ControllerSet] = make_default(ControllerSet, name="Controllers")
    """Controllers that are added to those of the model."""
    external_loads_file: LegacyInputLoads = ""
    """Measured loads (.xml)."""


class AnalyzeTool(AbstractTool):
    """Runs analyses along a given motion."""

    states_file: LegacyInputTable = ""
    """The motion, as states."""
    coordinates_file: Annotated[str, make_input_file("motion", legacy=True)] = ""
    """The motion, as coordinates, if there is no `states_file`."""
    speeds_file: LegacyInputTable = ""
    """Generalized speeds; without it they are the derivatives of the coordinates."""
    lowpass_cutoff_frequency_for_coordinates: Annotated[float, real("Hz", legacy=True)] = -1.0
    """Cut-off frequency of the filter of the coordinates; negative for no filter."""


class ForwardTool(AbstractTool):
    """Integrates the equations of motion."""

    # OpenSim does not interpolate: it takes the last row up to `initial_time` and gives it that
    # time.
    states_file: LegacyInputTable = ""
    """File of the initial state (row at `initial_time`); without it, the model's default state."""
