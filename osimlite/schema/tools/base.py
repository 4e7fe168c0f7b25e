"""Bases of tools and analyses."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import (
    LegacyFlag,
    LegacyInteger,
    LegacyMany,
    real,
)
from osimlite.schema.references import (
    OutputFolder,
)
from osimlite.schema.sets import Set


class Analysis(Object, abstract=True):
    """Base class of quantities that are computed along a motion."""

    on: LegacyFlag = True
    """Whether the analysis is done."""
    # OpenSim's tools ignore both times: analyses run over the range of the tool.
    start_time: Annotated[float, real("s", legacy=True)] = float("-inf")
    """Time at which the analysis begins."""
    end_time: Annotated[float, real("s", legacy=True)] = float("inf")
    """Time at which the analysis ends."""
    # OpenSim takes 0 and negative numbers as 1.
    step_interval: LegacyInteger = 1
    """Every how many steps of the integrator, or rows of the motion, something is written."""
    in_degrees: LegacyFlag = True
    """Whether angles are written in degrees."""


class AnalysisSet(Set):
    """The analyses of a run."""

    objects: LegacyMany[Analysis] = make_empty_list()
    """Analyses that the tool runs."""


class Tool(Object, abstract=True):
    """A tool that writes its results into a folder."""

    results_directory: OutputFolder = "./"
    """Folder for the results, made if only its last part is missing."""
