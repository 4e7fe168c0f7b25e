"""OpenSim's reporters: forces, outputs of components, probes and states."""

from __future__ import annotations

import re

import numpy as np

from osimlite.base.text import join_words, suggest_name
from osimlite.io.tables.old_storage import DEGREES, UNITS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Component
from osimlite.schema.sets import Probe
from osimlite.schema.states import outputs_of
from osimlite.schema.tools.analyses import (
    ForceReporter,
    OutputReporter,
    ProbeReporter,
    StatesReporter,
)
from osimlite.simulation.run_report import probe_labels, probe_rows
from osimlite.simulation.system import System
from osimlite.simulation.trajectory import label_as_opensim
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.outputs import reader_of
from osimlite.tools.reaction_forces import compute_constraint_records

OUTPUT_FILES = {"double": "Outputs", "Vec3": "OutputsVec3", "SpatialVec": "OutputsSpatialVec"}
"""By type of the outputs: what the file is called."""
OUTPUT_PATTERN = re.compile(
    r"(?P<path>[^|:(]*)\|(?P<output>[^|:(]+)(:(?P<channel>[^(]*))?(\((?P<alias>.*)\))?"
)


def write_outputs(analysis: OutputReporter, motion: Motion, tables: Tables) -> None:
    """Write the outputs that are asked for; those of other types are left out and told, as in OpenSim."""
    tree, columns = motion.model.tree(), {kind: list[str]() for kind in OUTPUT_FILES}
    rows = {kind: [np.empty((len(motion.times), 0))] for kind in OUTPUT_FILES}
    left_out = []
    for asked in map(str, analysis.output_paths):
        parts = OUTPUT_PATTERN.fullmatch(asked.strip())
        if parts is None:
            raise tables.job.error(
                f"'{analysis.name}' asks for '{asked}', which is no output; write path|output"
            )
        path = "/" + parts["path"].strip("/")
        component = tree.walk(path, "", "Component").target if path != "/" else motion.model
        if not isinstance(component, Component):
            raise tables.job.error(
                f"'{analysis.name}' asks for an output of '{path}', which is not in the model"
            )
        outputs = outputs_of(type(component))
        reader = reader_of(motion, component, parts["output"])
        kind = outputs[parts["output"]].type if parts["output"] in outputs else "double"
        if kind not in OUTPUT_FILES:
            left_out.append(asked)
            continue
        if parts["output"] not in outputs and reader is None:
            near = suggest_name(parts["output"], outputs)
            raise tables.job.error(
                f"'{path}' has no output '{parts['output']}' for '{analysis.name}'{near}"
            )
        if reader is None or parts["channel"]:
            raise tables.job.unable(
                f"'{analysis.name}' asks for '{asked}' of a {type(component).__name__}, which cannot be computed yet"
            )
        columns[kind].append(parts["alias"] or f"{path}|{parts['output']}")
        rows[kind].append(reader(motion, component, path))
    if left_out:
        kinds = join_words([*OUTPUT_FILES])
        tables.outcome.tell(
            analysis.name,
            f"{join_words(left_out)}: left out, as only {kinds} are reported, as in OpenSim",
        )
    for kind, name in OUTPUT_FILES.items():
        if columns[kind]:
            tables.add_newer(name, columns[kind], np.hstack(rows[kind]), kind)


FORCES_DESCRIPTION = (
    "\nThis file contains the forces exerted on a model during a simulation.\n"
    "\nA force is a generalized force, meaning that it can be either a force (N) or a torque (Nm).\n"
    f"\n{UNITS}"
)
"""What the header of forces says besides."""


def write_forces(analysis: ForceReporter, motion: Motion, tables: Tables) -> None:
    """Write the columns of every force, and of every constraint if they are asked for."""
    rows = motion.compute_by_parts(lambda part: collect_force_records(part, motion.system))
    labels = label_as_opensim(motion.system.columns)
    if analysis.include_constraint_forces and motion.simulation.constraints:
        more, result = compute_constraint_records(motion)
        labels, rows = labels + more, np.hstack([rows, result])
    tables.add("forces", "ModelForces", labels, rows, description=FORCES_DESCRIPTION)


def collect_force_records(motion: Motion, system: System) -> Array:
    """Return the force records (t, m) of a motion in the columns of a system; NaN of muscles that are left out.

    Args:
        motion: at whose states they are.
        system: with all forces, among them those that the motion leaves out.
    """
    result = np.full((len(motion.times), len(system.columns)), np.nan)
    owners = [element.path for element in system.forces.elements for _ in element.columns]
    there = [k for k, path in enumerate(owners) if path not in motion.left_out]
    result[:, there] = motion.system.force_table(motion.times, motion.states)
    return result


PROBES_DESCRIPTION = (
    "\nThis file contains the probes on a model during a simulation.\n"
    f"\nThe units used are dependent on the type of probe component\n{DEGREES}"
)


def write_probes(analysis: ProbeReporter, motion: Motion, tables: Tables) -> None:
    """Write what the probes that are enabled report."""
    engine, tree = motion.simulation.engine, motion.model.tree()
    computed = {probe.path for probe in engine.probes}
    for probe in motion.model.components(Probe):
        if probe.enabled and tree.path_of(probe) not in computed:
            raise tables.job.unable(
                f"'{analysis.name}' asks for '{probe.name}', a {type(probe).__name__} that cannot be computed"
            )
    rows = motion.compute_balanced(_compute_probe_rows)
    # Components with outputs are reported in a run, and not here.
    shown = [
        issubclass(probe.component, Probe) for probe in engine.probes for _ in probe.reading.labels
    ]
    labels = [
        label
        for label, is_shown in zip(probe_labels(engine.probes), shown, strict=True)
        if is_shown
    ]
    tables.add("probes", "ModelProbes", labels, rows[:, shown], description=PROBES_DESCRIPTION)


def _compute_probe_rows(motion: Motion) -> Array:
    """Return what all probes report at every time (t, m)."""
    rows = list(probe_rows(motion.simulation.engine, [*motion.moments], motion.steps))
    return np.array(rows).reshape(
        len(motion.times), len(probe_labels(motion.simulation.engine.probes))
    )


STATES_DESCRIPTION = f"\nThis file contains the states of a model during a simulation.\n\n{UNITS}"


def write_states(analysis: StatesReporter, motion: Motion, tables: Tables) -> None:
    """Write the states in OpenSim's order."""
    states = motion.histories
    tables.add(
        "states",
        "ModelStates",
        list(states),
        np.column_stack([*states.values()]),
        description=STATES_DESCRIPTION,
    )
