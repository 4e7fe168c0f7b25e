"""OpenSim's reporters: forces, outputs of components, probes and states."""

from __future__ import annotations

import numpy as np

from osimlite.base.patterns import compile_later
from osimlite.base.text import add_article, join_words, suggest_name
from osimlite.io.tables.old_storage import DEGREES, UNITS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Component
from osimlite.schema.sets import Probe
from osimlite.schema.states import list_outputs
from osimlite.schema.tools.analyses import (
    ForceReporter,
    OutputReporter,
    ProbeReporter,
    StatesReporter,
)
from osimlite.simulation.run_report import compute_probe_rows, list_probe_labels
from osimlite.simulation.system import System
from osimlite.simulation.trajectory import label_as_opensim
from osimlite.tools.motion import AnalysisTables, Motion
from osimlite.tools.outputs import find_reader
from osimlite.tools.reaction_forces import compute_constraint_records

OUTPUT_FILES = {"double": "Outputs", "Vec3": "OutputsVec3", "SpatialVec": "OutputsSpatialVec"}
"""Suffix of the file by type of the outputs."""
OUTPUT_PATTERN = compile_later(
    r"(?P<path>[^|:(]*)\|(?P<output>[^|:(]+)(:(?P<channel>[^(]*))?(\((?P<alias>.*)\))?"
)
"""Syntax of a requested output: ``path|output:channel(alias)``."""


def write_outputs(analysis: OutputReporter, motion: Motion, tables: AnalysisTables) -> None:
    """Write the requested outputs; ignore and report those of other types, as in OpenSim.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    tree = motion.model.tree()
    columns = {value_type: list[str]() for value_type in OUTPUT_FILES}
    rows = {value_type: [np.empty((len(motion.times), 0))] for value_type in OUTPUT_FILES}
    left_out = []
    for requested in map(str, analysis.output_paths):
        match = OUTPUT_PATTERN.fullmatch(requested.strip())
        if match is None:
            raise tables.job.create_error(
                f"'{analysis.name}' requests '{requested}', which does not name an output; write path|output, "
                "such as /bodyset/pelvis|position"
            )
        path = "/" + match["path"].strip("/")
        component = tree.walk(path, "", "Component").target if path != "/" else motion.model
        if not isinstance(component, Component):
            raise tables.job.create_error(
                f"'{analysis.name}' requests an output of '{path}', which is not in the model"
            )
        outputs = list_outputs(type(component))
        reader = find_reader(motion, component, match["output"])
        # Outputs that the class does not list, such as those of states, are single numbers.
        value_type = outputs[match["output"]].type if match["output"] in outputs else "double"
        if value_type not in OUTPUT_FILES:
            left_out.append(requested)
            continue
        if match["output"] not in outputs and reader is None:
            suggestion = suggest_name(match["output"], outputs)
            raise tables.job.create_error(
                f"'{path}' has no output '{match['output']}' for '{analysis.name}'{suggestion}"
            )
        # Channels belong to list outputs, which have no reader.
        if reader is None or match["channel"]:
            raise tables.job.create_unsupported_error(
                f"'{analysis.name}' requests '{requested}' of {add_article(type(component).__name__)}, which "
                "osimlite cannot compute yet"
            )
        columns[value_type].append(match["alias"] or f"{path}|{match['output']}")
        rows[value_type].append(reader(motion, component, path))
    if left_out:
        type_names = join_words([*OUTPUT_FILES])
        tables.outcome.add_message(
            analysis.name,
            f"{join_words(left_out)}: left out; as in OpenSim, only outputs of the types {type_names} are reported",
        )
    for value_type, name in OUTPUT_FILES.items():
        if columns[value_type]:
            tables.add_typed_table(
                name, columns[value_type], np.hstack(rows[value_type]), value_type
            )


FORCES_DESCRIPTION = (
    "\nThis file contains the forces exerted on a model during a simulation.\n"
    "\nA force is a generalized force, meaning that it can be either a force (N) or a torque (Nm).\n"
    f"\n{UNITS}"
)
"""OpenSim's text in the header of tables of forces."""


def write_forces(analysis: ForceReporter, motion: Motion, tables: AnalysisTables) -> None:
    """Write the records of every force and, if requested, of every constraint.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    rows = motion.compute_by_parts(
        lambda part_motion: collect_force_records(part_motion, motion.system)
    )
    labels = label_as_opensim(motion.system.columns)
    if analysis.include_constraint_forces and motion.simulation.constraints:
        constraint_labels, constraint_rows = compute_constraint_records(motion)
        labels = labels + constraint_labels
        rows = np.hstack([rows, constraint_rows])
    tables.add_table("forces", "ModelForces", labels, rows, description=FORCES_DESCRIPTION)


def collect_force_records(motion: Motion, system: System) -> Array:
    """Return the records of forces (t, m) of a motion; NaN for muscles that are off.

    Args:
        motion: motion at whose states the records are evaluated.
        system: engine with all forces, which has the columns.
    """
    result = np.full((len(motion.times), len(system.columns)), np.nan)
    element_paths = [element.path for element in system.forces.elements for _ in element.columns]
    # Columns of muscles that are off stay NaN.
    column_indices = [k for k, path in enumerate(element_paths) if path not in motion.left_out]
    result[:, column_indices] = motion.system.force_table(motion.times, motion.states)
    return result


PROBES_DESCRIPTION = (
    "\nThis file contains the probes on a model during a simulation.\n"
    f"\nThe units used are dependent on the type of probe component\n{DEGREES}"
)
"""OpenSim's text in the header of the table."""


def write_probes(analysis: ProbeReporter, motion: Motion, tables: AnalysisTables) -> None:
    """Write the values of the probes that are enabled.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the table.
    """
    engine = motion.simulation.engine
    tree = motion.model.tree()
    computed_paths = {probe.path for probe in engine.probes}
    for probe in motion.model.components(Probe):
        # A table without a requested probe could be mistaken for a complete one.
        if probe.enabled and tree.path_of(probe) not in computed_paths:
            raise tables.job.create_unsupported_error(
                f"'{analysis.name}' requests '{probe.name}', {add_article(type(probe).__name__)} that "
                "osimlite cannot compute"
            )
    rows = motion.compute_balanced(_compute_probe_rows)
    # A run reports outputs of other components as well, which are no probes of OpenSim.
    is_probe_column = [
        issubclass(probe.component, Probe) for probe in engine.probes for _ in probe.reading.labels
    ]
    labels = [
        label
        for label, is_shown in zip(list_probe_labels(engine.probes), is_probe_column, strict=True)
        if is_shown
    ]
    tables.add_table(
        "probes", "ModelProbes", labels, rows[:, is_probe_column], description=PROBES_DESCRIPTION
    )


def _compute_probe_rows(motion: Motion) -> Array:
    """Return the values of all probes at every time (t, m)."""
    rows = list(compute_probe_rows(motion.simulation.engine, [*motion.moments], motion.steps))
    return np.array(rows).reshape(
        len(motion.times), len(list_probe_labels(motion.simulation.engine.probes))
    )


STATES_DESCRIPTION = f"\nThis file contains the states of a model during a simulation.\n\n{UNITS}"
"""OpenSim's text in the header of the table."""


def write_states(analysis: StatesReporter, motion: Motion, tables: AnalysisTables) -> None:
    """Write the states in OpenSim's order.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the table.
    """
    states = motion.histories
    tables.add_table(
        "states",
        "ModelStates",
        list(states),
        np.column_stack([*states.values()]),
        description=STATES_DESCRIPTION,
    )
