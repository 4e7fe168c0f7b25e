"""Collection of all force elements, controls and probes of a model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import join_words
from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.simulation.elements.builder import OPENSIM, ElementBuilder
from osimlite.simulation.elements.controls import NO_CONTROLS, Controls

if TYPE_CHECKING:
    from osimlite.schema.prescribed import ExternalLoads
    from osimlite.simulation.elements.force_records import ForceElement


@dataclass(frozen=True)
class Forces:
    """Force elements of a model, followed by its probes.

    Attributes:
        elements: the elements in the order of the model.
        skipped: forces that were left out, as ``path (class)``.
        controls: all controls of the actuators.
        reads_files: whether an element depends on a file besides the model: a mesh, measured loads,
            controls.
    """

    elements: tuple[ForceElement, ...]
    skipped: tuple[str, ...] = ()
    controls: Controls = NO_CONTROLS
    reads_files: bool = False


@np.errstate(over="ignore", divide="ignore", invalid="ignore")
def force_elements(
    model: Model,
    mechanism: Mechanism,
    *,
    skip_unsupported: bool | None = None,
    simbody_early_return: bool = False,
    own_activation_times: bool = False,
    wrapping: str = OPENSIM,
    external_loads: str | Path | ExternalLoads | None = None,
    folder: str | Path | None = None,
    rigid_tendons: bool = False,
) -> Forces:
    """Return the force elements, controls and probes of a model.

    As in OpenSim, a force whose `appliesForce` is false has only its states.

    Args:
        model: the model.
        mechanism: mechanism of the same model.
        skip_unsupported: whether forces that cannot be computed are left out; else they raise an
            UnsupportedError. None, if the caller has no such option, which the error then does not
            advise.
        simbody_early_return: whether Simbody's defect in contact of several surfaces is reproduced.
        own_activation_times: whether each DeGrooteFregly2016Muscle uses its own activation times;
            OpenSim's defect shares those of one muscle.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        external_loads: measured loads or their file; their elements follow the forces of the model;
            None for none.
        folder: folder of the model's file and of the files that it names; the working directory if
            None.
        rigid_tendons: whether the tension of each muscle is its control times the force of fully
            active fibers along a rigid tendon.

    Raises:
        UnsupportedError: some forces cannot be computed; the message names them.
        ModelError: a force names something that does not exist, or a parameter has no meaning.
        OsimliteError: a file cannot be read.
    """
    builder = ElementBuilder(
        model,
        mechanism,
        Path(folder or "."),
        simbody_early_return,
        own_activation_times,
        wrapping,
        rigid_tendons,
    )
    elements: list[ForceElement] = []
    skipped: list[str] = []
    for component in builder.iterate_forces():
        try:
            elements.append(builder.make_element(component))
        except UnsupportedError as error:
            # All unsupported forces are collected, so that one message names them all.
            skipped.append(error.message)
    if skipped and not skip_unsupported:
        advice = REMOVAL_ADVICE if skip_unsupported is None else SKIP_ADVICE
        raise UnsupportedError(
            f"osimlite cannot compute {join_words(summarize_skipped(skipped))}; set appliesForce of such forces to "
            f"false{advice}"
        )
    # External loads come after the forces of the model, as OpenSim adds them to the component set.
    if external_loads is not None:
        from osimlite.simulation.elements.external_loads import read_external_loads

        elements += read_external_loads(mechanism, external_loads)
    from osimlite.simulation.elements.probe_type import make_probes

    # Probes read the records of forces, so they are made last.
    elements += make_probes(builder, elements)
    controls = builder.controls.controls
    reads_files = builder.reads_files or external_loads is not None
    return Forces(tuple(elements), tuple(skipped), controls, reads_files)


SKIP_ADVICE = ", or add --skip-unsupported (skip_unsupported=True) to leave them out"
"""Advice of commands and functions with the option --skip-unsupported."""
REMOVAL_ADVICE = ", or remove them from the model"
"""Advice of commands and functions without this option."""
MAX_LISTED_FORCES = 4
"""Up to this number, skipped forces are listed one by one."""


def summarize_skipped(skipped: Sequence[str]) -> list[str]:
    """Return the skipped forces for a message.

    Args:
        skipped: forces as ``path (class)``.

    Returns:
        The forces one by one if they are few, else the count of each class.
    """
    if len(skipped) <= MAX_LISTED_FORCES:
        return list(skipped)
    groups: dict[str, list[str]] = {}
    for words in skipped:
        # The words are "path (class)".
        path, _, kind = words.partition(" (")
        groups.setdefault(kind.removesuffix(")") or "others", []).append(path)
    return [
        f"{len(paths)} of {kind}: {join_words(paths, max_count=2)}"
        for kind, paths in groups.items()
    ]
