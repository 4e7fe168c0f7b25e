"""OpenSim's ProbeReporter: what the probes of the model report."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import DEGREES
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.probes import Probe
from osimlite.schema.tools.analyses import ProbeReporter
from osimlite.simulation.run_report import probe_labels, probe_rows
from osimlite.tools.motion import Motion, Tables

_DESCRIPTION = (
    "\nThis file contains the probes on a model during a simulation.\n"
    f"\nThe units used are dependent on the type of probe component\n{DEGREES}"
)


def compute(analysis: ProbeReporter, motion: Motion, tables: Tables) -> None:
    """Write what the probes that are enabled report."""
    engine, tree = motion.simulation.engine, motion.model.tree()
    computed = {probe.path for probe in engine.probes}
    for probe in motion.model.components(Probe):
        if probe.enabled and tree.path_of(probe) not in computed:
            raise tables.job.unable(
                f"'{analysis.name}' asks for '{probe.name}', a {type(probe).__name__} that cannot be computed"
            )
    rows = motion.compute_balanced(_rows)
    # Components with outputs are reported in a run, and not here.
    shown = [
        issubclass(probe.component, Probe) for probe in engine.probes for _ in probe.reading.labels
    ]
    labels = [
        label
        for label, is_shown in zip(probe_labels(engine.probes), shown, strict=True)
        if is_shown
    ]
    tables.add("probes", "ModelProbes", labels, rows[:, shown], description=_DESCRIPTION)


def _rows(motion: Motion) -> Array:
    """Return what all probes report at every time (t, m)."""
    rows = list(probe_rows(motion.simulation.engine, [*motion.moments], motion.steps))
    return np.array(rows).reshape(
        len(motion.times), len(probe_labels(motion.simulation.engine.probes))
    )
