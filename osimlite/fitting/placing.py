"""The markers of a model moved to where they were measured on the standing subject: OpenSim's MarkerPlacer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from osimlite.base.records import dataclass
from osimlite.errors import SettingError
from osimlite.fitting.fit_messages import told
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.ik_tool import tasks_of
from osimlite.fitting.inverse_kinematics import fitted
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.measuring import frames_between
from osimlite.io.tables.old_storage import printed
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model
from osimlite.schema.tools.inverse_kinematics import IKTask
from osimlite.simulation.elements import force_elements
from osimlite.simulation.states import StateLayout, in_model_order


@dataclass(frozen=True, eq=False)
class Placed:
    """Markers that were placed."""

    # of the model as the subject stood, with the errors of the markers before they were moved
    pose: FittedMotion
    removed: tuple[str, ...]  # markers of the model that the data do not have; it has them no more
    moved: dict[str, float]  # by how much each marker was moved in its frame, m

    def told(self) -> Iterator[str]:
        """What a user should know of the pose; the limits are those of OpenSim's checklist for a static trial."""
        return told(self.pose, (0.01, 0.02), " of markers on bones")


def place_markers(
    model: Model,
    data: MarkerData,
    tasks: Iterable[IKTask],
    first: float,
    last: float,
    coordinates: StoTable | None = None,
) -> Placed:
    """Pose a model as a subject stood, and move its markers to where they were measured, but for those that are fixed.

    A marker that was not seen in every frame of the time range does not count for the pose, as in
    OpenSim; it is placed by the frames in which it was seen.

    Args:
        model: is changed: markers that the data do not have are removed.
        data: measured markers of the standing subject.
        tasks: what the pose is fitted to.
        first: time from which the markers are averaged, s.
        last: time up to which, s.
        coordinates: values of coordinates for tasks that take them from a file.

    Raises:
        SettingError: the time range holds no frame, or a task asks for what is not there.
    """
    first, last = max(first, float(data.times[0])), min(last, float(data.times[-1]))
    within = (data.times >= first) & (data.times <= last)
    if data.times[0] == data.times[-1]:
        raise SettingError(
            f"'{data.file or 'the static trial'}' has one frame, at {data.times[0]:g} s, and the markers are averaged "
            "over a range of times, as in OpenSim; repeat the row at a later time"
        )
    if not within.any() or not first < last:
        raise SettingError(
            f"the time range of the markers, {first:g} to {last:g} s, holds no frames to average; give one that begins "
            f"before it ends, within {data.times[0]:g} to {data.times[-1]:g} s"
        )
    mean = MarkerData(
        data.names, np.array((first,)), data.positions[within].mean(axis=0)[None], data.file
    )
    averaged = data.positions[frames_between(data.times, first, last)]
    seen = np.asarray(np.isfinite(averaged).all(axis=2))
    chosen = np.where(seen[..., None], averaged, 0.0)
    with np.errstate(invalid="ignore"):
        target = dict(zip(data.names, chosen.sum(axis=0) / seen.sum(axis=0)[:, None], strict=True))
    markers = model.marker_set.objects
    removed = tuple(marker.name for marker in markers if marker.name not in target)
    for marker in [marker for marker in markers if marker.name in removed]:
        model.remove(marker)
    mechanism = build_mechanism(model)
    asked = tasks_of(model, mechanism, tasks, mean, coordinates)
    pose = fitted(model, mechanism, mean, asked.weights, asked.goals, asked.wanted)
    state, moved = mechanism.at(pose.values[0]), dict[str, float]()
    for marker in model.components(Marker):
        if marker.fixed or marker.name not in target or not np.isfinite(target[marker.name]).all():
            continue
        body, frame = mechanism.placement(_frame_of(model, marker))
        there = np.linalg.inv(state.transform(body) @ frame) @ [*target[marker.name], 1.0]
        moved[marker.name] = float(np.linalg.norm(there[:3] - np.array(marker.location)))
        marker.location = tuple(there[:3].tolist())
    return Placed(pose, removed, moved)


def _frame_of(model: Model, marker: Marker) -> str:
    """The path of the frame of a marker."""
    tree = model.tree()
    return (
        tree.path_of(tree.target(marker, "socket_parent_frame", marker.socket_parent_frame)) or ""
    )


def pose_text(model: Model, placed: Placed) -> str:
    """The pose as OpenSim's placer writes it: all states of the model, in radians."""
    mechanism, motion = placed.pose.mechanism, placed.pose
    elements = force_elements(model, mechanism, skip_unsupported=True).elements
    layout = StateLayout(mechanism, range(len(mechanism.coordinates)), elements)
    values = motion.values[0].tolist()
    state = layout.pack(values, [0.0] * len(values))
    columns = dict(zip(layout.paths, layout.auxiliary(state), strict=True))
    named = [item.path for item in layout.variables if item.is_named]
    for info, value in zip(mechanism.coordinates, values, strict=True):
        columns[f"{info.path}/value"], columns[f"{info.path}/speed"] = value, 0.0
    own = [f"{info.path}/{what}" for info in mechanism.coordinates for what in ("value", "speed")]
    paths = in_model_order(model, [*own, *named])
    row = np.array([[columns[path] for path in paths]])
    return "".join(printed(StoTable("static pose", motion.times, tuple(paths), row)))
