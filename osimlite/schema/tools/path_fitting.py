"""Fit of polynomials to the paths of muscles."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.fields import (
    Flag,
    Integer,
    Many,
    Number,
    Reference,
    Single,
    Value,
    Vec2,
    real,
    word,
)
from osimlite.schema.references import Named, OutputFolder
from osimlite.schema.tools.processors import ModelProcessor, TableProcessor

Range = Annotated[Vec2, Value("double", "Vec2")]


class PolynomialPathFitterBounds(Object):
    """Range in which a coordinate is varied."""

    coordinate_path: Annotated[Named, Reference("model-path", "Coordinate")] = ""
    """Path of the coordinate."""
    bounds: Range = (-10.0, 10.0)
    """Smallest and largest deviation, in degrees or metres."""


class PolynomialPathFitter(Object):
    """Fits polynomials of the coordinates to lengths and moment arms of paths."""

    model: Single[ModelProcessor] = make_default(ModelProcessor, name="model")
    """Model whose paths are fitted."""
    coordinate_values: Single[TableProcessor] = make_default(
        TableProcessor, name="coordinate_values"
    )
    """Motion around which coordinates are varied."""
    output_directory: OutputFolder = ""
    """Folder for the polynomials and the samples."""
    use_stepwise_regression: Flag = False
    """Whether only terms that improve the fit are included."""
    moment_arm_threshold: Number = 0.001
    """Moment arm below which a coordinate is ignored for a path, in metres."""
    moment_arm_tolerance: Annotated[float, real("m")] = 1e-4
    """Tolerance of moment arms."""
    path_length_tolerance: Annotated[float, real("m")] = 1e-4
    """Tolerance of path lengths."""
    minimum_polynomial_order: Integer = 2
    """Smallest order that is tried."""
    maximum_polynomial_order: Integer = 6
    """Largest order that is tried."""
    num_parallel_threads: Integer = 2
    """Number of threads."""
    global_coordinate_sampling_bounds: Annotated[Vec2, Value("double", "Vec2", unit="deg")] = (
        -10.0,
        10.0,
    )
    """Smallest and largest deviation of coordinates without bounds of their own."""
    coordinate_sampling_bounds: Many[PolynomialPathFitterBounds] = make_empty_list()
    """Deviations of single coordinates."""
    num_samples_per_frame: Integer = 25
    """Number of variations of each row of the motion."""
    latin_hypercube_algorithm: Annotated[str, word("random", "ESEA")] = "random"
    """Algorithm that spreads the variations."""
    include_moment_arm_functions: Flag = False
    """Whether polynomials of moment arms are written, too."""
    include_lengthening_speed_function: Flag = False
    """Whether polynomials of lengthening speeds are written, too."""
