"""Files of a fitted person: model, markers, factors, and a setup for OpenSim's ScaleTool.

With the setup, the ScaleTool makes the same model.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from osimlite.fitting.measuring import ScaleFactors, create_scale_set
from osimlite.fitting.person import Person
from osimlite.io.document.printer import to_text
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.markers import MarkerSet
from osimlite.schema.tools.scale import GenericModelMaker, MarkerPlacer, ModelScaler, ScaleTool

MARKERS = "markers.xml"
"""File of the markers on the scaled model."""
UNSCALED = "markers_unscaled.xml"
"""File of the markers on the generic model, which the setup reads."""
FACTORS = "scale_set.xml"
"""File of the scale factors."""
SETUP = "setup_scale.xml"
"""File of the setup for OpenSim's ScaleTool."""


def create_person_files(
    person: Person, generic: Path, folder: Path, mass: float = -1.0
) -> dict[str, str]:
    """Return the files of a fitted model.

    Args:
        person: result of the fit.
        generic: file of the generic model.
        folder: folder of the files, from which the setup names the generic model.
        mass: mass of the subject, kg; if it is not positive, the mass follows from the factors.

    Returns:
        Text of each file by its name.
    """
    model = person.model
    unscaled = [marker.copy_deep() for marker in model.marker_set.objects]
    placements = Placements(model.tree())
    for copy, marker in zip(unscaled, model.marker_set.objects, strict=True):
        base, _ = placements.resolve_frame(placements.follow_socket(marker, "socket_parent_frame"))
        factors = person.factors.get(base.rsplit("/", 1)[1], [1.0, 1.0, 1.0])
        # ScaleTool multiplies the markers of the generic model by the factors, so that they are
        # divided here.
        copy.location = tuple((np.array(marker.location) / factors).tolist())
    frames = [frame.name for frame in model.components(PhysicalFrame)]
    result = ScaleFactors(
        {name: person.factors.get(name, [1.0, 1.0, 1.0]) for name in frames}, {}, []
    )
    file = f"{generic.stem}_fitted.osim"
    tool = ScaleTool(
        name=model.name,
        mass=mass,
        generic_model_maker=GenericModelMaker(
            model_file=_make_relative_path(generic, folder), marker_set_file=UNSCALED
        ),
        model_scaler=ModelScaler(
            # The factors are known; measurements of markers would replace them.
            scaling_order=("manualScale",),
            scale_set=create_scale_set(frames, result),
            output_model_file=file,
        ),
        # The fit has found the offsets of the markers already.
        marker_placer=MarkerPlacer(apply=False),
    )
    documents = {
        file: model,
        MARKERS: model.marker_set,
        UNSCALED: MarkerSet(name="markers", objects=unscaled),
        FACTORS: create_scale_set(frames, result),
        SETUP: tool,
    }
    return {name: to_text(document, numbers="opensim") for name, document in documents.items()}


def _make_relative_path(file: Path, folder: Path) -> str:
    """Return a path relative to a folder, or the absolute path on another drive."""
    try:
        return Path(os.path.relpath(file.absolute(), folder.absolute())).as_posix()
    # On Windows no relative path leads to another drive.
    except ValueError:
        return str(file.absolute())
