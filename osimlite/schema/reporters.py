"""Reporters, which collect outputs during a simulation, and sources of input data."""

from typing import Annotated

from osimlite.schema.base import Component, make_default
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Single, real
from osimlite.schema.functions import Constant, Function
from osimlite.schema.references import ColumnName, FileName, NumberInputs, Vec3Inputs, VectorInputs


class AbstractReporter(Component, abstract=True):
    """Base class of components that collect values along a simulation."""

    report_time_interval: Annotated[float, real("s", ">= 0")] = 0.0
    """Time between two rows; with 0, a row at every step of the integrator."""


class NumberReporter(AbstractReporter, abstract=True):
    """Collects outputs that are numbers."""

    input_inputs: NumberInputs = ()
    """The outputs to collect, each as `path|output`."""


class Vec3Reporter(AbstractReporter, abstract=True):
    """Collects outputs that are points or directions."""

    input_inputs: Vec3Inputs = ()
    """The outputs to collect, each as `path|output`."""


class VectorReporter(AbstractReporter, abstract=True):
    """Collects outputs that are vectors of any length."""

    input_inputs: VectorInputs = ()
    """The outputs to collect, each as `path|output`."""


class ConsoleReporter__double_(NumberReporter):
    """Prints numbers while the simulation runs."""


class ConsoleReporter__Vec3_(Vec3Reporter):
    """Prints points or directions while the simulation runs."""


class TableReporter__double_(NumberReporter):
    """Collects numbers in a table."""


class TableReporter__Vec3_(Vec3Reporter):
    """Collects points or directions in a table."""


class TableReporter__Vector_(VectorReporter):
    """Collects vectors in a table."""


class StatesTrajectoryReporter(AbstractReporter):
    """Collects complete states."""


class TableSource(Component, abstract=True):
    """Gives the columns of a table file as outputs."""

    filename: FileName = ""
    """File of the table, relative to the folder that OpenSim runs in, not to the model."""
    tablename: ColumnName = ""
    """Name of the table in a file with several, such as `markers` or `forces` of a C3D file."""


class TableSource__double_(TableSource):
    """A table of numbers."""

    facts = Facts(outputs="all_columns:Vector column[]")


class TableSource__Vec3_(TableSource):
    """A table of points or directions."""

    facts = Facts(outputs="all_columns:Vector_<Vec3> column[]:Vec3")


class SignalGenerator(Component):
    """Gives a function of time as an output."""

    facts = Facts(outputs="signal")

    function: Single[Function] = make_default(Constant, name="function")
    """The output as a function of time."""
