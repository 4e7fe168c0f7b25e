"""OpenSim's MarkerPlacer: move markers of a model to their measured positions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import format_time_span, join_words
from osimlite.errors import SettingError
from osimlite.fitting.fit_messages import describe_fit
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.ik_tool import collect_targets
from osimlite.fitting.inverse_kinematics import fit_motion
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.measuring import select_frames
from osimlite.io.tables.old_storage import format_old_table
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.parts import CoordinateInfo
from osimlite.schema.markers import Marker
from osimlite.schema.model import Model
from osimlite.schema.tools.ik_tasks import IKTask
from osimlite.simulation.elements import force_elements
from osimlite.simulation.states import StateLayout, sort_by_component


@dataclass(frozen=True, eq=False)
class MarkerPlacement:
    """Placed markers, and the pose of the model."""

    # Pose of the standing subject, with the errors of the markers before they were moved.
    pose: FittedMotion
    removed: tuple[str, ...]  # removed markers, which the data lack
    moved: dict[str, float]  # distance by which each marker moved, m

    def describe_pose(self) -> Iterator[tuple[str, str]]:
        """Yield messages about the pose, with OpenSim's limits for a static trial.

        Yields:
            The subject and the text of each message, see :func:`describe_fit`.
        """
        yield from describe_fit(self.pose, (0.01, 0.02), " for markers on bones")
        if self.removed:
            names = join_words(self.removed)
            yield (
                "removed markers",
                f"removed from the model, as in OpenSim, because the data lack them: {names}",
            )


def place_markers(
    model: Model,
    data: MarkerData,
    tasks: Iterable[IKTask],
    start: float,
    end: float,
    coordinates: StoTable | None = None,
) -> MarkerPlacement:
    """Fit the pose of a model to a standing subject, and move its markers.

    Each marker moves to its measured position; fixed markers stay. A marker that was not seen in
    every frame of the range does not count for the pose, as in OpenSim; its position is the mean
    over the frames in which it was seen.

    Args:
        model: model whose markers are moved in place; markers without data are removed.
        data: measured markers of the standing subject.
        tasks: weights and targets of the pose.
        start: start of the range over which markers are averaged, s.
        end: end of the range, s.
        coordinates: table with values of coordinates, for tasks that read them from a file.

    Returns:
        Pose of the model, removed markers, and the distances by which markers moved.

    Raises:
        SettingError: the data have only one frame, the range has no frames, or a task has an
            unknown name.
    """
    range_error = _describe_range_error(data, start, end)
    start = max(start, float(data.times[0]))
    end = min(end, float(data.times[-1]))
    is_in_range = (data.times >= start) & (data.times <= end)
    if data.times[0] == data.times[-1]:
        raise SettingError(
            f"'{data.file or 'the static trial'}' has one frame, at {data.times[0]:g} s, but the "
            "markers are averaged "
            "over a range of times, as in OpenSim; add a copy of the row with a later time"
        )
    if range_error:
        raise SettingError(
            f"{range_error}; set a time range within {data.times[0]:g} to {data.times[-1]:g} s"
        )
    # The pose is fitted to the mean of the frames, in which a marker that was missed once is NaN.
    mean = MarkerData(
        data.names, np.array((start,)), data.positions[is_in_range].mean(axis=0)[None], data.file
    )
    frame_positions = data.positions[select_frames(data.times, start, end)]
    is_measured = np.asarray(np.isfinite(frame_positions).all(axis=2))
    selected = np.where(is_measured[..., None], frame_positions, 0.0)
    # A marker that is never seen has NaN as its mean, and stays.
    with np.errstate(invalid="ignore"):
        target = dict(
            zip(data.names, selected.sum(axis=0) / is_measured.sum(axis=0)[:, None], strict=True)
        )
    # Before markers are removed, so that the error names those of the model.
    mean.find_shared_names([marker.name for marker in model.components(Marker)])
    markers = model.marker_set.objects
    removed = tuple(marker.name for marker in markers if marker.name not in target)
    for marker in [marker for marker in markers if marker.name in removed]:
        model.remove(marker)
    mechanism = build_mechanism(model)
    requested = collect_targets(model, mechanism, tasks, mean, coordinates)
    pose = fit_motion(
        model, mechanism, mean, requested.weights, requested.goals, requested.target_values
    )
    state = mechanism.at(pose.values[0])
    move_distances = dict[str, float]()
    for marker in model.components(Marker):
        if marker.fixed or marker.name not in target or not np.isfinite(target[marker.name]).all():
            continue
        body, frame = mechanism.placement(_find_frame_path(model, marker))
        # From ground to the frame of the marker in the fitted pose.
        location = np.linalg.inv(state.transform(body) @ frame) @ [*target[marker.name], 1.0]
        move_distances[marker.name] = float(
            np.linalg.norm(location[:3] - np.array(marker.location))
        )
        marker.location = tuple(location[:3].tolist())
    return MarkerPlacement(pose, removed, move_distances)


def _describe_range_error(data: MarkerData, start: float, end: float) -> str:
    """Return why markers cannot be averaged from one time to another (s); empty if they can be."""
    first, last = data.times[0], data.times[-1]
    if not start < end:
        return f"the time range starts at {start:g} s and must end later, but it ends at {end:g} s"
    if start >= last:
        return f"the static trial ends at {last:g} s, and the time range starts at {start:g} s"
    if end <= first:
        return f"the static trial starts at {first:g} s, and the time range ends at {end:g} s"
    if not ((data.times >= start) & (data.times <= end)).any():
        return f"the static trial has no frame {format_time_span(start, end)}"
    return ""


def _get_pose_speed(info: CoordinateInfo) -> float:
    """Return the speed that OpenSim writes with a static pose.

    It is that of the initial state at the time 0, before constraints change it.
    """
    if info.locked:
        return 0.0
    if info.prescribed is not None:
        return float(info.prescribed.evaluate((0.0,))[1][0])
    return info.default_speed


def _find_frame_path(model: Model, marker: Marker) -> str:
    """Return the path of the frame of a marker."""
    tree = model.tree()
    return (
        tree.path_of(tree.target(marker, "socket_parent_frame", marker.socket_parent_frame)) or ""
    )


def format_pose(model: Model, placement: MarkerPlacement) -> str:
    """Return the pose as OpenSim's placer writes it: all states of the model, in radians.

    Args:
        model: model in the pose.
        placement: placed markers and fitted pose of the model.
    """
    mechanism = placement.pose.mechanism
    motion = placement.pose
    elements = force_elements(model, mechanism, skip_unsupported=True).elements
    # All states, also those of muscles, because OpenSim's file has them.
    layout = StateLayout(mechanism, range(len(mechanism.coordinates)), elements)
    values = motion.values[0].tolist()
    state = layout.pack(values, [0.0] * len(values))
    columns = dict(zip(layout.paths, layout.auxiliary(state), strict=True))
    named_paths = [variable.path for variable in layout.variables if variable.is_named]
    for info, value in zip(mechanism.coordinates, values, strict=True):
        columns[f"{info.path}/value"] = value
        columns[f"{info.path}/speed"] = _get_pose_speed(info)
    coordinate_paths = [
        f"{info.path}/{quantity}"
        for info in mechanism.coordinates
        for quantity in ("value", "speed")
    ]
    paths = sort_by_component(model, [*coordinate_paths, *named_paths])
    row = np.array([[columns[path] for path in paths]])
    return "".join(format_old_table(StoTable("static pose", motion.times, tuple(paths), row)))
