"""Curves of trials over time: joint angles, moments, controls, contact forces and actuators.

The outcomes of the setups of one folder are a trial. Each function collects one kind of curves from
the trials, by the panel in which a report draws them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.shared_forces import TITLE as ACTIVATION_TITLE
from osimlite.tools.evidence import (
    Evidence,
    Steps,
    find_root_coordinates,
    split_side,
    try_find_steps,
)
from osimlite.tools.outcome import DYNAMICS_TITLE, Outcome
from osimlite.view.motion import contact_forces
from osimlite.view.panel_groups import Column, Panel, group_columns, merge_panels
from osimlite.view.panels import STYLES
from osimlite.view.recording import MeasuredMarkers, Recording, compute_forces
from osimlite.view.table_plots import SECTIONS, ColumnNames, describe_columns

MIN_ANGLE_CHANGE_RAD = 1e-4
"""Smallest range of an angle that is drawn, rad."""
STATIC_FRAMES = "HalfSpace", "ground"
"""Frames of contact forces on the immobile side of a contact."""


class TrialOutcomes(NamedTuple):
    """Outcomes of the setups of one trial."""

    name: str  # name of the trial
    outcomes: Sequence[Outcome]  # outcomes of the setups
    setups: Sequence[Path] = ()  # paths of the setups, in the order of `outcomes`

    @property
    def evidence(self) -> Evidence | None:
        """Motion of the trial, preferably one with measured markers; None without any."""
        result = [outcome.evidence for outcome in self.outcomes if outcome.evidence is not None]
        return min(result, key=lambda evidence: evidence.measured is None, default=None)

    @property
    def steps(self) -> dict[str, Steps]:
        """Steps of the feet, from the measured loads of any setup.

        Returns:
            Steps by side ("r" or "l"); empty without measured loads.
        """
        result = (
            try_find_steps(outcome.evidence)
            for outcome in self.outcomes
            if outcome.evidence is not None
        )
        return next((steps for steps in result if steps), {})


class TrialCurve(NamedTuple):
    """Curve of a quantity over time."""

    times: Array
    column: Array
    side: str
    style: str
    label: str
    steps: Mapping[str, Steps]


def collect_trials(outcomes: Mapping[str | Path, Outcome]) -> list[TrialOutcomes]:
    """Return the outcomes, grouped by the folders of their setups."""
    by_folder: dict[Path, dict[Path, Outcome]] = {}
    for setup, outcome in outcomes.items():
        by_folder.setdefault(Path(setup).resolve().parent, {})[Path(setup)] = outcome
    titles = [outcome.title for outcome in outcomes.values()]
    # The name of a single study says more than that of its folder.
    study_name = titles[0] if len(titles) == 1 else ""
    return [
        TrialOutcomes(study_name or folder.name, [*group.values()], [*group])
        for folder, group in by_folder.items()
    ]


def collect_angles(trials: Sequence[TrialOutcomes]) -> dict[str, list[TrialCurve]]:
    """Return the curves of joint angles in degrees by coordinate, without its side.

    Args:
        trials: trials that have a motion.

    Returns:
        Curves by the title of their panel.
    """
    panels: dict[str, list[TrialCurve]] = {}
    for number, trial in enumerate(trials):
        evidence = trial.evidence
        assert evidence is not None
        for index, name in enumerate(evidence.coordinates):
            column = evidence.values[:, index]
            # Locked and unused coordinates would only take up space.
            if not evidence.turning[index] or np.ptp(column) < MIN_ANGLE_CHANGE_RAD:
                continue
            stem, side = split_side(name)
            panels.setdefault(f"{stem} (deg)", []).append(
                TrialCurve(
                    evidence.times,
                    np.degrees(column),
                    side,
                    STYLES[number % 3],
                    trial.name,
                    trial.steps,
                )
            )
    return panels


def collect_moments(trials: Sequence[TrialOutcomes]) -> dict[str, list[TrialCurve]]:
    """Return the curves of generalized forces, without those at the root.

    Args:
        trials: trials that have a motion.

    Returns:
        Curves by the title of their panel.
    """
    panels: dict[str, list[TrialCurve]] = {}
    for number, trial in enumerate(trials):
        for outcome in trial.outcomes:
            root = find_root_names(outcome.evidence)
            for table in select_dynamics_tables(outcome):
                for label in table.columns:
                    name, _, quantity = label.rpartition("_")
                    # Generalized forces at the root are residuals, which have a section of their
                    # own.
                    if name in root or quantity not in ("moment", "force"):
                        continue
                    stem, side = split_side(name)
                    unit = "N m" if quantity == "moment" else "N"
                    line = TrialCurve(
                        table.times, table[label], side, STYLES[number % 3], trial.name, trial.steps
                    )
                    panels.setdefault(f"{stem} ({unit})", []).append(line)
    return panels


def collect_controls(trials: Sequence[TrialOutcomes]) -> dict[str, list[TrialCurve]]:
    """Return the curves of controls by name, without the side.

    Args:
        trials: trials that have a motion.

    Returns:
        Curves by the title of their panel.
    """
    panels: dict[str, list[TrialCurve]] = {}
    for number, trial in enumerate(trials):
        evidence = trial.evidence
        if evidence is None or evidence.controls is None:
            continue
        for label in evidence.controls.columns:
            stem, side = split_side(label.rpartition("/")[2])
            column = evidence.controls[label]
            times = evidence.controls.times
            is_finite = np.isfinite(column)
            line = TrialCurve(
                times[is_finite], column[is_finite], side, STYLES[number % 3], trial.name, {}
            )
            panels.setdefault(stem, []).append(line)
    return panels


def collect_contacts(trials: Sequence[TrialOutcomes]) -> dict[str, list[TrialCurve]]:
    """Return the curves of contact forces on each side by axis.

    Args:
        trials: trials that have a motion.

    Returns:
        Curves by the title of their panel.
    """
    panels: dict[str, list[TrialCurve]] = {}
    for number, trial in enumerate(trials):
        evidence = trial.evidence
        if evidence is None or evidence.speeds is None:
            continue
        sums: dict[str, Array] = {}
        for force in contact_forces(create_recording(evidence, build_mechanism(evidence.model))):
            # Both sides of a contact have a force; they are opposite, so that their sum would
            # vanish.
            if force.frame not in STATIC_FRAMES:
                side = split_side(force.element)[1]
                sums[side] = sums.get(side, 0.0) + force.vectors
        for axis, name in enumerate("xyz"):
            for side, vectors in sums.items():
                # Planar models have no forces along z.
                if np.ptp(vectors[:, axis]) > 0.0:
                    line = TrialCurve(
                        evidence.times, vectors[:, axis], side, STYLES[number % 3], trial.name, {}
                    )
                    panels.setdefault(f"along {name} (N)", []).append(line)
    return panels


def read_muscle_states(trial: TrialOutcomes) -> dict[str, Array]:
    """Return the activations of muscles that a tool has computed, at the times of the trial's motion.

    Args:
        trial: outcomes of a trial with a motion.

    Returns:
        Activations by state labels; none if the motion has states itself.
    """
    evidence = trial.evidence
    assert evidence is not None
    if evidence.states:
        return {}
    result = {}
    for outcome in trial.outcomes:
        for table in outcome.tables.values():
            if not len(table.times):
                continue
            for label, column in zip(table.columns, table.rows.T, strict=True):
                if table.name == ACTIVATION_TITLE:
                    label = f"{label}.activation"
                elif not label.endswith("/activation"):
                    continue
                result[label] = np.interp(evidence.times, table.times, np.nan_to_num(column))
    return result


def collect_actuators(
    trials: Sequence[TrialOutcomes],
) -> list[tuple[str, str, list[Panel]]]:
    """Return the panels of activations, muscle forces, reserves and residuals.

    Args:
        trials: trials that have a motion.

    Returns:
        Title, note and panels of each section that has any.
    """
    sections: dict[str, list[Panel]] = {"activation": [], "muscle": [], "other": []}
    for number, trial in enumerate(trials):
        evidence = trial.evidence
        assert evidence is not None
        names = ColumnNames.from_model(evidence.model, build_mechanism(evidence.model))
        for outcome in trial.outcomes:
            for table in outcome.tables.values():
                for section, columns in _divide_actuators(table, names).items():
                    panels, _ = group_columns(
                        columns,
                        table.times,
                        steps=trial.steps,
                        style=STYLES[number % 3],
                        label=trial.name,
                    )
                    sections[section] += panels
    titles = {
        "activation": (
            "Muscle activations",
            "0 is at rest, 1 is fully active. Dashed red: the limits of the model.",
        ),
        "muscle": ("Muscle forces", "Dashed red: max_isometric_force."),
        "other": (
            "Reserves and residuals",
            "Forces and moments of actuators other than muscles; ideally small. Dashed red: the limits of "
            "the model. The last table has published limits.",
        ),
    }
    return [
        (*titles[section], merge_panels(panels)) for section, panels in sections.items() if panels
    ]


def _divide_actuators(table: StoTable, names: ColumnNames) -> dict[str, list[Column]]:
    """Return the columns of activations, of muscle forces and of other actuators of a table."""
    result: dict[str, list[Column]] = {}
    if table.name == ACTIVATION_TITLE:
        columns = [
            column for column in describe_columns(table, names) if column.name in names.regions
        ]
        result["activation"] = [_limit(column, names.control_limits) for column in columns]
    elif table.name in ("ActuatorForces", "ModelForces"):
        for column in describe_columns(table, names):
            if column.name in names.regions:
                result.setdefault("muscle", []).append(_limit(column, names.force_limits))
            elif column.name in names.units:
                result.setdefault("other", []).append(_limit(column, names.force_limits))
    else:
        columns = [
            _limit(column._replace(section=""), names.control_limits)
            for column in describe_columns(table, names)
            if column.section == SECTIONS["activation"]
        ]
        result["activation"] = columns
    return result


def _limit(column: Column, limits: Mapping[str, tuple[float, ...]]) -> Column:
    """Return a column with the limits of its actuator."""
    return column._replace(limits=limits.get(column.name, ()))


def create_recording(
    evidence: Evidence, mechanism: Mechanism, measured: MeasuredMarkers | None = None
) -> Recording:
    """Return the motion for the viewer, with contact forces if the speeds are known."""
    speeds = evidence.speeds
    forces = dict[str, Array]()
    if speeds is None:
        speeds = np.zeros_like(evidence.values)
    else:
        folder = evidence.file.parent
        forces = compute_forces(
            evidence.model, mechanism, evidence.times, evidence.values, speeds, folder
        )
    return Recording(
        evidence.times,
        evidence.coordinates,
        evidence.values,
        speeds,
        forces,
        evidence.states,
        measured=measured,
    )


def select_dynamics_tables(outcome: Outcome) -> list[Any]:
    """Return the tables of inverse dynamics."""
    return [table for table in outcome.tables.values() if table.name == DYNAMICS_TITLE]


def find_root_names(evidence: Evidence | None) -> set[str]:
    """Return the names of the coordinates of the joint between the model and ground."""
    if evidence is None:
        return set()
    mechanism = build_mechanism(evidence.model)
    return {mechanism.coordinates[index].name for index in find_root_coordinates(mechanism)}
