"""OpenSim's OutputReporter: outputs of components, numbers, vectors and spatial vectors in a file each."""

from __future__ import annotations

import re

import numpy as np

from osimlite.base.text import did_you_mean, listed
from osimlite.schema.base import Component
from osimlite.schema.outputs import outputs_of
from osimlite.schema.tools.analyses import OutputReporter
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.outputs import reader_of

FILES = {"double": "Outputs", "Vec3": "OutputsVec3", "SpatialVec": "OutputsSpatialVec"}
"""By type of the outputs: what the file is called."""
_ASKED = re.compile(
    r"(?P<path>[^|:(]*)\|(?P<output>[^|:(]+)(:(?P<channel>[^(]*))?(\((?P<alias>.*)\))?"
)


def compute(analysis: OutputReporter, motion: Motion, tables: Tables) -> None:
    """Write the outputs that are asked for; those of other types are left out and told, as in OpenSim."""
    tree, columns = motion.model.tree(), {kind: list[str]() for kind in FILES}
    rows = {kind: [np.empty((len(motion.times), 0))] for kind in FILES}
    left_out = []
    for asked in map(str, analysis.output_paths):
        parts = _ASKED.fullmatch(asked.strip())
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
        if kind not in FILES:
            left_out.append(asked)
            continue
        if parts["output"] not in outputs and reader is None:
            near = did_you_mean(parts["output"], outputs)
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
        kinds = listed([*FILES])
        tables.outcome.tell(
            analysis.name,
            f"{listed(left_out)}: left out, as only {kinds} are reported, as in OpenSim",
        )
    for kind, name in FILES.items():
        if columns[kind]:
            tables.add_newer(name, columns[kind], np.hstack(rows[kind]), kind)
