"""Classes by XML tag, and the modules that declare them.

Modules are imported when a tag is first met, so that reading a model costs only the areas it uses.
A test compares this table with the classes that exist.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import TypeVar

from osimlite.schema.base import Object

T = TypeVar("T")

_AREAS = {
    "actuators": (
        "ActivationCoordinateActuator BodyActuator CoordinateActuator PointActuator PointToPointActuator "
        "TorqueActuator"
    ),
    "base": "Component ModelComponent Object Unknown",
    "constraint_types": (
        "ConstantDistanceConstraint CoordinateCouplerConstraint PointConstraint PointOnLineConstraint "
        "RollingOnSurfaceConstraint UnilateralConstraint WeldConstraint"
    ),
    "contact": "ContactGeometry ContactGeometrySet",
    "contact_forces": (
        "ElasticFoundationContactParameters ElasticFoundationContactParametersSet ElasticFoundationForce "
        "ExponentialContactForce MeyerFregly2016Force SmoothSphereHalfSpaceForce"
    ),
    "contact_types": "ContactCylinder ContactEllipsoid ContactHalfSpace ContactMesh ContactSphere ContactTorus",
    "control_sets": "Control ControlConstant ControlLinear ControlLinearNode ControlSet ControlSetController",
    "controller_types": (
        "CMC ControlDistributor CorrectionController InputController PrescribedController SynergyController "
        "SynergyVector TrackingController"
    ),
    "coordinates": "Coordinate CoordinateSet",
    "custom_joint": "CustomJoint SpatialTransform TransformAxis",
    "examples": "HopperDevice ToyPropMyoController ToyReflexController",
    "forces": (
        "Actuator CoordinateLimitForce Force ForceProducer ForceSet HuntCrossleyContactParameters "
        "HuntCrossleyContactParametersSet HuntCrossleyForce ScalarActuator"
    ),
    "frames": "Body BodySet Frame Ground PhysicalFrame PhysicalOffsetFrame StationDefinedFrame TwoFrameLinker",
    "function_types": "ExpressionBasedFunction MultivariatePolynomialFunction PolynomialFunction Sine StepFunction",
    "functions": "Constant Function FunctionSet LinearFunction MultiplierFunction",
    "geometry": "Appearance FrameGeometry Geometry Mesh ModelDisplayHints ModelVisualPreferences SurfaceProperties",
    "geometry_types": "AnalyticGeometry Arrow Brick Cone Cylinder Ellipsoid LineGeometry Sphere Torus",
    "joint_types": (
        "BallJoint ConstantCurvatureJoint EllipsoidJoint FreeJoint GimbalJoint ScapulothoracicJoint UniversalJoint"
    ),
    "joints": "Joint JointSet PinJoint PlanarJoint SliderJoint WeldJoint",
    "markers": "IMU Marker MarkerSet Point Station",
    "millard_muscles": "Millard2012AccelerationMuscle Millard2012EquilibriumMuscle RigidTendonMuscle",
    "moco.goals": (
        "MocoAverageSpeedGoal MocoControlGoal MocoExpressionBasedParameterGoal MocoFinalOutputGoal MocoFinalTimeGoal "
        "MocoGoal MocoInitialActivationGoal MocoInitialForceEquilibriumDGFGoal MocoInitialOutputGoal "
        "MocoInitialVelocityEquilibriumDGFGoal MocoJointReactionGoal MocoMarkerFinalGoal MocoOutputBase "
        "MocoOutputGoal MocoPeriodicityGoal MocoPeriodicityGoalPair MocoStepLengthAsymmetryGoal "
        "MocoStepTimeAsymmetryGoal MocoStepTimeAsymmetryGoalGroup MocoSumSquaredStateGoal"
    ),
    "moco.parts": (
        "MocoBounds MocoConstraintInfo MocoFinalBounds MocoInitialBounds MocoParameter MocoScaleFactor "
        "MocoVariableInfo MocoWeight MocoWeightSet"
    ),
    "moco.path_constraints": (
        "MocoControlBoundConstraint MocoFrameDistanceConstraint MocoFrameDistanceConstraintPair "
        "MocoOutputBoundConstraint MocoPathConstraint MocoStateBoundConstraint"
    ),
    "moco.studies": (
        "MocoCasADiSolver MocoDirectCollocationSolver MocoInverse MocoPhase MocoProblem MocoSolver MocoStudy "
        "MocoTool MocoTrack"
    ),
    "moco.tracking": (
        "MocoAccelerationTrackingGoal MocoAngularVelocityTrackingGoal MocoContactImpulseTrackingGoal "
        "MocoContactImpulseTrackingGoalGroup MocoContactTrackingGoal MocoContactTrackingGoalGroup "
        "MocoControlTrackingGoal MocoControlTrackingGoalReference MocoGeneralizedForceTrackingGoal "
        "MocoMarkerTrackingGoal MocoOrientationTrackingGoal MocoStateTrackingGoal MocoTranslationTrackingGoal"
    ),
    "model": "Model",
    "motions": "AccelerationMotion DiscreteForces PositionMotion",
    "muscle_curves": (
        "ActiveForceLengthCurve FiberCompressiveForceCosPennationCurve FiberCompressiveForceLengthCurve "
        "FiberForceLengthCurve ForceVelocityCurve ForceVelocityInverseCurve TendonForceLengthCurve"
    ),
    "muscles": (
        "ActivationFiberLengthMuscle Muscle MuscleFirstOrderActivationDynamicModel MuscleFixedWidthPennationModel "
        "PathActuator Thelen2003Muscle"
    ),
    "old_muscles": (
        "ActivationFiberLengthMuscle_Deprecated Delp1990Muscle_Deprecated Schutte1993Muscle_Deprecated "
        "Thelen2003Muscle_Deprecated"
    ),
    "path_forces": (
        "Blankevoort1991Ligament ClutchedPathSpring ExpressionBasedPathForce Ligament McKibbenActuator PathSpring"
    ),
    "paths": (
        "AbstractGeometryPath AbstractPathPoint ConditionalPathPoint FunctionBasedPath GeometryPath MovingPathPoint "
        "PathPoint PathPointSet PathWrap PathWrapPoint PathWrapSet"
    ),
    "prescribed": "ExternalForce ExternalLoads PrescribedForce",
    "probe_types": (
        "ActuatorForceProbe ActuatorPowerProbe Bhargava2004MuscleMetabolicsProbe "
        "Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter "
        "Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameterSet Bhargava2004SmoothedMuscleMetabolics "
        "Bhargava2004SmoothedMuscleMetabolics_MuscleParameters JointInternalPowerProbe SystemEnergyProbe "
        "Umberger2010MuscleMetabolicsProbe Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter "
        "Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameterSet"
    ),
    "reporters": (
        "AbstractReporter ConsoleReporter__Vec3_ ConsoleReporter__double_ NumberReporter SignalGenerator "
        "StatesTrajectoryReporter TableReporter__Vec3_ TableReporter__Vector_ TableReporter__double_ TableSource "
        "TableSource__Vec3_ TableSource__double_ Vec3Reporter VectorReporter"
    ),
    "scholz_paths": (
        "Scholz2015GeometryPath Scholz2015GeometryPathElement Scholz2015GeometryPathObstacle "
        "Scholz2015GeometryPathPoint"
    ),
    "sets": (
        "ComponentSet Constraint ConstraintSet Controller ControllerSet ModelComponentSet ObjectGroup Probe ProbeSet "
        "Set"
    ),
    "smooth_muscles": "DeGrooteFregly2016Muscle MeyerFregly2016Muscle",
    "splines": "GCVSpline GCVSplineSet PiecewiseConstantFunction PiecewiseLinearFunction SimmSpline",
    "springs": (
        "BushingForce CoordinateLinearStopForce ExponentialCoordinateLimitForce ExpressionBasedBushingForce "
        "ExpressionBasedCoordinateForce ExpressionBasedPointToPointForce FunctionBasedBushingForce "
        "PointToPointSpring SpringGeneralizedForce"
    ),
    "tools.analyses": (
        "Actuation BodyKinematics ForceReporter IMUDataReporter InducedAccelerations JointReaction Kinematics "
        "MuscleAnalysis OutputReporter PointKinematics ProbeReporter StatesReporter StaticOptimization"
    ),
    "tools.base": "Analysis AnalysisSet Tool",
    "tools.dynamics": "AbstractTool AnalyzeTool DynamicsTool ForwardTool InverseDynamicsTool",
    "tools.ik_tasks": "IKCoordinateTask IKMarkerTask IKTask IKTaskSet",
    "tools.inverse_kinematics": (
        "IMUInverseKinematicsTool InverseKinematicsTool InverseKinematicsToolBase MarkerWeight MarkerWeightSet "
        "MarkersReference OrientationWeight OrientationWeightSet"
    ),
    "tools.path_fitting": "PolynomialPathFitter PolynomialPathFitterBounds",
    "tools.processors": (
        "FunctionBasedPathSet ModOpAddExternalLoads ModOpAddReserves ModOpIgnoreActivationDynamics "
        "ModOpIgnorePassiveFiberForcesDGF ModOpIgnoreTendonCompliance ModOpRemoveMuscles ModOpReplaceJointsWithWelds "
        "ModOpReplaceMusclesWithDeGrooteFregly2016 ModOpReplaceMusclesWithPathActuators "
        "ModOpReplacePathsWithFunctionBasedPaths ModOpScaleActiveFiberForceCurveWidthDGF ModOpScaleMaxIsometricForce "
        "ModOpTendonComplianceDynamicsModeDGF ModelOperator ModelProcessor TabOpAppendCoupledCoordinateValues "
        "TabOpLowPassFilter TabOpUseAbsoluteStateNames TableOperator TableProcessor"
    ),
    "tools.scale": (
        "BodyScale BodyScaleSet GenericModelMaker MarkerPair MarkerPairSet MarkerPlacer Measurement MeasurementSet "
        "ModelScaler Scale ScaleSet ScaleTool"
    ),
    "tools.sensors": "APDMDataReaderSettings ExperimentalSensor IMUPlacer XsensDataReaderSettings",
    "tools.tracking": (
        "CMCTool CMC_Joint CMC_Point CMC_Task CMC_TaskSet MuscleStateTrackingTask RRATool SMC_Joint "
        "StateTrackingTask TrackingTask"
    ),
    "wrap_types": "WrapCylinder WrapEllipsoid WrapSphere WrapTorus",
    "wrapping": "WrapObject WrapObjectSet",
}

_TAGS = {
    "ElasticFoundationForce::ContactParameters": "ElasticFoundationContactParameters",
    "ElasticFoundationForce::ContactParametersSet": "ElasticFoundationContactParametersSet",
    "HuntCrossleyForce::ContactParameters": "HuntCrossleyContactParameters",
    "HuntCrossleyForce::ContactParametersSet": "HuntCrossleyContactParametersSet",
    "Set_FunctionBasedPath_": "FunctionBasedPathSet",
    "Set_MarkerWeight_": "MarkerWeightSet",
}
"""Tags that are not the name of their class."""

MODULES = {
    name: f"osimlite.schema.{area}" for area, names in _AREAS.items() for name in names.split()
}
"""Module of each class, by class name."""


_further: dict[str, type[Object]] = {}
callbacks_of_changes: list[Callable[[], None]] = []


def get_plugin_classes() -> Mapping[str, type[Object]]:
    """Return the registered classes of plug-ins, by tag."""
    return _further.copy()


def register_plugin_classes(classes: Mapping[str, type[Object]]) -> None:
    """Register classes of plug-ins by tag, in place of those registered before."""
    # Unchanged classes keep the caches.
    if classes != _further:
        _further.clear()
        _further.update(classes)
        for forget in callbacks_of_changes:
            forget()


def add_change_callback(forget: Callable[[], None]) -> None:
    """Register a function that is called whenever the set of plug-in classes changes."""
    callbacks_of_changes.append(forget)


def cache_by_tags(function: Callable[..., T]) -> Callable[..., T]:
    """Cache a function of tags or classes until other plug-in classes are registered.

    Returns:
        The function with a cache, which is cleared when a class is registered.
    """
    cached = cache(function)
    add_change_callback(cached.cache_clear)
    return cached


@cache_by_tags
def find_class(tag: str) -> type[Object] | None:
    """Return the class of an XML tag; None if no class has it."""
    plugin_class = _further.get(tag)
    # Classes of plug-ins are in no table of modules.
    if plugin_class is not None:
        # Objects of an abstract class cannot stand in a file.
        return None if plugin_class.abstract else plugin_class
    module = MODULES.get(_TAGS.get(tag, tag))
    if module is None:
        return None
    # Importing the module declares its classes; only the areas that a document uses are imported.
    result = getattr(import_module(module), _TAGS.get(tag, tag))
    # A class whose tag differs from its name is found under the tag alone.
    return None if result.abstract or result.tag != tag else result


@cache_by_tags
def list_tags() -> tuple[str, ...]:
    """Return the tags of all concrete classes, sorted.

    Returns:
        Tags of OpenSim's classes and of registered plug-ins.
    """
    renamed = {name: tag for tag, name in _TAGS.items()}
    class_names = (renamed.get(name, name) for name in (*MODULES, *_further))
    return tuple(sorted(tag for tag in class_names if find_class(tag) is not None))


@cache_by_tags
def find_classes_mentioning(word: str) -> tuple[type[Object], ...]:
    """Return the classes, also abstract ones, of modules whose source contains a word, and those of plug-ins.

    Only modules that can declare the property are imported and their classes built; importing all of
    them takes a third of a second.

    Returns:
        Classes of these modules, then those of plug-ins.
    """
    # The word is looked for in the source text, which costs less than importing a module.
    modules = {module for module in MODULES.values() if _mentions_word(module, word)}
    opensim_classes = [
        getattr(import_module(module), name)
        for name, module in MODULES.items()
        if module in modules
    ]
    return (*opensim_classes, *_further.values())


def _mentions_word(module: str, word: str) -> bool:
    """Return whether the source of a module contains a word; true if the source is not available."""
    text = _read_source(module)
    return text is None or word in text


@cache
def _read_source(module: str) -> str | None:
    spec = find_spec(module)
    loader = None if spec is None else spec.loader
    # Not every loader can give a source; `_mentions_word` then assumes that it contains the word.
    read_source: Callable[[str], str | None] | None = getattr(loader, "get_source", None)
    return read_source(module) if read_source is not None else None


@cache_by_tags
def list_class_tags(cls: type[Object]) -> tuple[str, ...]:
    """Return the tags of a class and of classes derived from it, sorted.

    Returns:
        Tags of concrete classes.
    """
    return tuple(tag for tag in list_tags() if issubclass(find_class(tag) or type(None), cls))
