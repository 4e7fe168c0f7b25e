"""What a fit writes: the model, its markers, its factors, and a setup with which OpenSim's ScaleTool makes the same."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from osimlite.fitting.measuring import Measured, scale_set
from osimlite.fitting.person import Person
from osimlite.io.document.printer import to_text
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.markers import MarkerSet
from osimlite.schema.tools.scale import GenericModelMaker, MarkerPlacer, ModelScaler, ScaleTool

MARKERS, UNSCALED, FACTORS, SETUP = (
    "markers.xml",
    "markers_unscaled.xml",
    "scale_set.xml",
    "setup_scale.xml",
)


def person_texts(person: Person, generic: Path, folder: Path, mass: float = -1.0) -> dict[str, str]:
    """Names and texts of the files of a fitted model.

    Args:
        person: what was fitted.
        generic: the file of the model that was fitted.
        folder: where the files are to be, from which the setup names that file.
        mass: what the subject weighs, kg; if it is not positive that follows from the factors.
    """
    model = person.model
    unscaled = [marker.copy_deep() for marker in model.marker_set.objects]
    placements = Placements(model.tree())
    for copy, marker in zip(unscaled, model.marker_set.objects, strict=True):
        base, _ = placements.resolve_frame(placements.follow_socket(marker, "socket_parent_frame"))
        factors = person.factors.get(base.rsplit("/", 1)[1], [1.0, 1.0, 1.0])
        copy.location = tuple((np.array(marker.location) / factors).tolist())
    frames = [frame.name for frame in model.components(PhysicalFrame)]
    result = Measured({name: person.factors.get(name, [1.0, 1.0, 1.0]) for name in frames}, {}, [])
    file = f"{generic.stem}_fitted.osim"
    tool = ScaleTool(
        name=model.name,
        mass=mass,
        generic_model_maker=GenericModelMaker(
            model_file=_way(generic, folder), marker_set_file=UNSCALED
        ),
        model_scaler=ModelScaler(
            scaling_order=("manualScale",),
            scale_set=scale_set(frames, result),
            output_model_file=file,
        ),
        marker_placer=MarkerPlacer(apply=False),
    )
    documents = {
        file: model,
        MARKERS: model.marker_set,
        UNSCALED: MarkerSet(name="markers", objects=unscaled),
        FACTORS: scale_set(frames, result),
        SETUP: tool,
    }
    return {name: to_text(document, numbers="opensim") for name, document in documents.items()}


def _way(file: Path, folder: Path) -> str:
    """A file as it is named from a folder, or its whole path on another drive."""
    try:
        return Path(os.path.relpath(file.absolute(), folder.absolute())).as_posix()
    except ValueError:
        return str(file.absolute())
