"""Tendons as OpenSim paths: which path is nearest, and how far it is off.

A tendon with one branch becomes a GeometryPath. For each segment that bends around a geom, the
quadrant of the wrap surface is the one whose lengths are nearest to MuJoCo's in sampled poses.
Tendons that bend inside of a geom, or have pulleys, become a FunctionBasedPath with a fitted
polynomial of the coordinates, and so do tendons that no wrap follows well. Where no hinge or slide
moves such a tendon, its path is straight.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from osimlite.base.progress import report_progress
from osimlite.base.text import format_count
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.functions import LinearFunction
from osimlite.schema.paths import FunctionBasedPath, GeometryPath
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.wrapping import norm
from osimlite.translate.mjcf_import.draft import ConversionDraft, TendonPath
from osimlite.translate.mjcf_import.geodesic_paths import (
    CLOSE_M,
    Hints,
    Obstacles,
    find_default_pose,
    make_geodesic_path,
    select_geodesics,
)
from osimlite.translate.mjcf_import.joints import BALL, FREE
from osimlite.translate.mjcf_import.path_comparison import Bench
from osimlite.translate.mjcf_import.path_parts import Quadrant, Surfaces, make_geometry_path
from osimlite.translate.mjcf_import.polynomials import fit_polynomial, samples_for
from osimlite.translate.mjcf_import.poses import (
    SampledPoses,
    compute_poses,
    sample_qpos,
    satisfy_equalities,
)
from osimlite.translate.mjcf_import.tendon_lengths import (
    Tendon,
    TendonSegment,
    read_tendon,
    segment_lengths,
    tendon_lengths,
)

EXACT_M = 1e-9
"""Error of a length up to which a path is exact."""
SAME_MEANING_M = 1e-6
"""Difference of lengths up to which a tendon means the same in MuJoCo 3 and 4."""
GOOD_WRAP_M = 3e-4
"""Error (rms) of a wrapped path above which a polynomial is tried."""
TRIAL_POSES = 300
"""Number of further poses in which a path over contact surfaces must have MuJoCo's length."""
CHECK_POSES = 100
"""Number of poses in which errors are measured; none is one that decided anything."""
ARM_POSES = 20
"""Number of poses in which moment arms are compared."""
COINCIDENT_M = 1e-9
"""Distance of neighbouring sites up to which a path has no direction between them."""
STEP = 1e-6
"""Step of the joint position (rad, m) for derivatives of tendon lengths."""


def find_version(draft: ConversionDraft, tendons: list[Tendon], poses: SampledPoses) -> int:
    """Return the version of MuJoCo whose rules the tendons follow.

    Raises:
        SettingError: the versions differ, and the option does not say which one is meant.
    """
    if draft.options.written_for is not None:
        return draft.options.written_for
    lengths = [tendon_lengths(draft.source, tendons, poses, version) for version in (3, 4)]
    # The versions agree on most files.
    differences = np.abs(lengths[0] - lengths[1]).max(1, initial=0.0)
    if not len(differences) or differences.max() <= SAME_MEANING_M:
        return draft.source.major
    worst_row = int(np.argmax(differences))
    worst_name = draft.source.name_of("tendon", tendons[worst_row].number)
    count = format_count(int(np.sum(differences > SAME_MEANING_M)), "tendon")
    raise SettingError(
        f"MuJoCo 3 and 4 use the side sites of this file differently: the length of {count} differs, "
        f"of '{worst_name}' by up to {differences[worst_row]:.3g} m; name the version that the file was "
        "written for, 3 (also for older versions) or 4: --written-for 3 (written_for=3)"
    )


def add_tendon_paths(draft: ConversionDraft) -> None:
    """Make the path of each tendon, and measure it."""
    source, model = draft.source, draft.mj
    tendons = [read_tendon(source, index) for index in range(model.ntendon)]
    for tendon in tendons:
        for segment in tendon.segments:
            # -1 stands for no side site.
            draft.path_sites |= {segment.first, segment.second, *({segment.side} - {-1})}
            if segment.geom >= 0:
                draft.wrapping_geoms.add(segment.geom)
    for site in draft.path_sites:
        draft.note_result("site", site, "point of a path, or side of a wrap surface")
    for geom in draft.wrapping_geoms:
        draft.note_result("geom", geom, "wrap surface of paths")
    spatial = [tendon for tendon in tendons if not tendon.is_fixed]
    for tendon in tendons:
        if tendon.is_fixed:
            draft.paths[tendon.number] = _make_linear_path(draft, tendon)
    if not spatial:
        return
    poses = compute_poses(source, sample_qpos(source, draft.options.poses, draft.options.seed))
    version = find_version(draft, spatial, poses)
    draft.version = version
    _Selection(draft, spatial, poses, version).run()


class _Selection:
    """Selection of the path of each spatial tendon."""

    def __init__(
        self, draft: ConversionDraft, tendons: list[Tendon], poses: SampledPoses, version: int
    ) -> None:
        self.draft, self.source = draft, draft.source
        self.tendons, self.poses, self.version = tendons, poses, version
        self.reach = _find_reach(draft, tendons, poses)
        # Other poses than those that decide, so that errors are honest.
        self.checks = compute_poses(self.source, sample_qpos(self.source, CHECK_POSES, 1))
        self.truth = tendon_lengths(self.source, tendons, self.checks, version)

    def run(self) -> None:
        """Set the paths of the draft, and record their errors."""
        draft = self.draft
        quadrants, unwrappable = self._select_quadrants()
        routes = {
            # A pulley divides forces, which one OpenSim path cannot do.
            row: tuple(quadrants.get(_key(segment)) for segment in tendon.segments)
            for row, tendon in enumerate(self.tendons)
            if not tendon.has_pulley
            and not any(_key(segment) in unwrappable for segment in tendon.segments)
        }
        # All candidates are measured in one model, which is built once.
        bench = Bench(draft)
        surfaces = Surfaces(draft, bench.frames, self.reach)
        numbers = {
            row: bench.add(
                make_geometry_path(draft, bench.frames, surfaces, self.tendons[row].segments, route)
            )
            for row, route in routes.items()
        }
        lengths, _, _ = bench.measure(self.checks.qpos) if numbers else (np.empty(0), None, None)
        errors = {row: lengths[number] - self.truth[row] for row, number in numbers.items()}
        geodesics: dict[int, Hints] = {}
        if draft.options.tendon_paths == "geodesics":
            rows = [
                row
                for row in range(len(self.tendons))
                if row not in errors or np.abs(errors[row]).max() > CLOSE_M
            ]
            selected = select_geodesics(
                draft,
                [self.tendons[row] for row in rows],
                [
                    self.poses,
                    self.checks,
                    compute_poses(self.source, sample_qpos(self.source, TRIAL_POSES, 3)),
                ],
                self.version,
            )
            geodesics = {rows[index]: hints for index, hints in selected.items()}
        polynomials: dict[int, tuple[FunctionBasedPath, Array]] = {}
        for row in range(len(self.tendons)):
            if row in geodesics:
                continue
            report_progress("fitting paths", row, len(self.tendons))
            rms = _rms(errors[row]) if row in errors else np.inf
            joints = self._find_joints(self.tendons[row]) if rms > GOOD_WRAP_M else []
            # The arguments of a polynomial are hinges and slides; balls and free joints are not.
            if joints:
                path, fit_errors = self._fit(row, joints)
                # A polynomial needs many numbers, so it must be clearly better.
                if _rms(fit_errors) < 0.5 * rms:
                    polynomials[row] = path, fit_errors
        straight = {
            row: _find_first_branch(tendon)
            for row, tendon in enumerate(self.tendons)
            if row not in routes and row not in polynomials and row not in geodesics
        }
        self._record(polynomials, routes, geodesics, straight)
        # Names of the trial surfaces are free again.
        draft.names.pop("wrap", None)
        draft.names.pop("obstacle", None)
        surfaces = Surfaces(draft, draft.frames, self.reach)
        obstacles = Obstacles(draft, draft.frames, draft.model)
        for row, tendon in enumerate(self.tendons):
            if row in polynomials:
                draft.paths[tendon.number] = TendonPath(polynomials[row][0])
            elif row in geodesics:
                draft.paths[tendon.number] = TendonPath(
                    make_geodesic_path(
                        draft, draft.frames, obstacles, tendon.segments, geodesics[row]
                    )
                )
            elif row in straight:
                draft.paths[tendon.number] = TendonPath(
                    _make_straight_path(draft, draft.frames, surfaces, straight[row])
                )
            else:
                draft.paths[tendon.number] = TendonPath(
                    make_geometry_path(draft, draft.frames, surfaces, tendon.segments, routes[row])
                )

    def _select_quadrants(self) -> tuple[dict[TendonSegment, Quadrant | None], set[TendonSegment]]:
        """Return the best quadrant of each wrapped segment, and segments that need a polynomial."""
        segments = sorted(
            {
                _key(segment)
                for tendon in self.tendons
                for segment in tendon.segments
                if segment.geom >= 0
            }
        )
        target_lengths, contact_lengths = segment_lengths(
            self.source, segments, self.poses, self.version
        )
        unwrappable = {
            segment
            for segment, row in zip(segments, contact_lengths, strict=True)
            if np.isnan(row).any()
        }
        bench = Bench(self.draft)
        surfaces = Surfaces(self.draft, bench.frames, self.reach)
        candidates: list[tuple[int, Quadrant | None, int]] = []
        for number, segment in enumerate(segments):
            if segment in unwrappable:
                continue
            # A side site inside of a geom means a path through it.
            options: tuple[Quadrant | None, ...] = ("all",)
            if segment.side >= 0:
                options = (None,) if self._is_inside(segment) else ("all", "+x")
            for option in options:
                path = make_geometry_path(self.draft, bench.frames, surfaces, (segment,), (option,))
                candidates.append((number, option, bench.add(path)))
        result: dict[TendonSegment, Quadrant | None] = {}
        if candidates:
            lengths, _, _ = bench.measure(self.poses.qpos)
            best: dict[int, float] = {}
            for number, option, row in candidates:
                rms_error = _rms(lengths[row] - target_lengths[number])
                # A tie leaves both sides open.
                if number not in best or rms_error < 0.99 * best[number] - 1e-12:
                    best[number], result[segments[number]] = rms_error, option
        return result, unwrappable

    def _is_inside(self, segment: TendonSegment) -> bool:
        """Return whether the side site is inside of the geom, so that the tendon passes through it."""
        model = self.draft.mj
        offset = self.poses.sites[:, segment.side] - self.poses.geoms[:, segment.geom]
        return bool(norm(offset).max() < float(model.geom_size[segment.geom, 0]))

    def _fit(self, row: int, joints: list[int]) -> tuple[FunctionBasedPath, Array]:
        """Fit a polynomial to the length of a tendon.

        Args:
            row: index of the tendon.
            joints: independent hinges and slides that the length depends on, one or more.

        Returns:
            The path, and its errors in the check poses, m.
        """
        draft, source = self.draft, self.source
        tendon = self.tendons[row]
        poses = compute_poses(source, sample_qpos(source, max(samples_for(len(joints)), 400), 2))
        lengths = tendon_lengths(source, [tendon], poses, self.version)[0]
        addresses = [int(draft.mj.jnt_qposadr[joint]) for joint in joints]
        function, fit_errors = fit_polynomial(
            poses.qpos[:, addresses],
            lengths,
            self.checks.qpos[:, addresses],
            self.truth[row],
        )
        return (
            FunctionBasedPath(
                name="path",
                coordinate_paths=tuple(draft.coordinate_path(joint) for joint in joints),
                length_function=function,
            ),
            fit_errors,
        )

    def _find_joints(self, tendon: Tendon) -> list[int]:
        """Return the independent hinges and slides that the length of a tendon depends on."""
        arms, joints = self._compute_moment_arms([tendon], self.poses.qpos[:ARM_POSES])
        return [
            joint for column, joint in enumerate(joints) if np.abs(arms[0, :, column]).max() > 1e-8
        ]

    def _compute_moment_arms(self, tendons: list[Tendon], qpos: Array) -> tuple[Array, list[int]]:
        """Return moment arms of tendons about independent hinges and slides, by central differences.

        Joints that equalities couple to the moved one move with it, as in OpenSim's moment arms;
        MuJoCo's own Jacobian of tendons leaves them at rest.

        Args:
            tendons: T tendons.
            qpos: poses (P, nq).

        Returns:
            Moment arms -dL/dq (T, P, n), m or 1, and the n joints.
        """
        model, source = self.draft.mj, self.source
        joints = [
            joint
            for joint in range(model.njnt)
            # A derivative needs a joint whose position is a single number.
            if int(model.jnt_type[joint]) not in (FREE, BALL)
            and joint not in _dependent(self.draft)
        ]
        arms = np.empty((len(tendons), len(qpos), len(joints)))
        for column, joint in enumerate(joints):
            shifted_lengths = []
            for sign in (-1.0, 1.0):
                shifted = qpos.copy()
                shifted[:, int(model.jnt_qposadr[joint])] += sign * STEP
                satisfy_equalities(source, shifted)
                shifted_lengths.append(
                    tendon_lengths(source, tendons, compute_poses(source, shifted), self.version)
                )
            arms[:, :, column] = (shifted_lengths[0] - shifted_lengths[1]) / (2.0 * STEP)
        return arms, joints

    def _record(
        self,
        polynomials: dict[int, tuple[FunctionBasedPath, Array]],
        routes: dict[int, tuple[Quadrant | None, ...]],
        geodesics: dict[int, Hints],
        straight: dict[int, tuple[TendonSegment, ...]],
    ) -> None:
        """Measure the selected paths, and record their deviations."""
        draft, model = self.draft, self.draft.mj
        bench = Bench(draft)
        surfaces = Surfaces(draft, bench.frames, self.reach)
        obstacles = Obstacles(draft, bench.frames, bench.model)
        for row, tendon in enumerate(self.tendons):
            if row in polynomials:
                bench.add(polynomials[row][0].copy_deep())
            elif row in geodesics:
                bench.add(
                    make_geodesic_path(
                        draft, bench.frames, obstacles, tendon.segments, geodesics[row]
                    )
                )
            elif row in straight:
                bench.add(_make_straight_path(draft, bench.frames, surfaces, straight[row]))
            else:
                bench.add(
                    make_geometry_path(draft, bench.frames, surfaces, tendon.segments, routes[row])
                )
        lengths, _, _ = bench.measure(self.checks.qpos)
        qpos = self.checks.qpos[:ARM_POSES]
        target_arms, joints = self._compute_moment_arms(self.tendons, qpos)
        _, arms, names = bench.measure(qpos, arms=True)
        columns = [names.index(draft.coordinates[joint][0]) for joint in joints]
        default_pose = find_default_pose(draft)
        is_rotational = [int(model.jnt_type[joint]) == 3 for joint in joints]
        for row, tendon in enumerate(self.tendons):
            length_errors = lengths[row] - self.truth[row]
            errors = {"length": Error.measure(length_errors, "m")}
            arm_errors = arms[row][:, columns] - target_arms[row]
            if len(joints):
                worst = int(np.argmax(np.abs(arm_errors).max(0)))
                errors["moment arm"] = Error.measure(
                    arm_errors[:, worst], "m" if is_rotational[worst] else "1"
                )
            reason = (
                "pulleys"
                if tendon.has_pulley
                else "a tendon that bends inside a geom"
                if row not in routes
                else "a tendon that no wrap surface can represent"
            )
            if row in polynomials:
                path = polynomials[row][0]
                function = path.length_function
                draft.record(
                    "tendon",
                    tendon.number,
                    reason,
                    "a FunctionBasedPath: a polynomial of the coordinates, fitted in sampled poses",
                    f"order {function.order} of {function.dimension} coordinates, not to be used "  # type: ignore[union-attr]
                    "outside of their ranges",
                    errors,
                )
            elif row in straight:
                draft.record(
                    "tendon",
                    tendon.number,
                    reason,
                    "a GeometryPath through the sites of the first branch, straight between them"
                    if tendon.has_pulley
                    else "a GeometryPath, straight between the sites",
                    "no hinge or slide moves the tendon, so a polynomial of coordinates is impossible",
                    errors,
                )
            elif errors["length"].max > EXACT_M and row in geodesics:
                draft.record(
                    "tendon",
                    tendon.number,
                    f"the path around a geom by the rules of MuJoCo {self.version}",
                    "a Scholz2015GeometryPath over contact surfaces",
                    errors=errors,
                )
            elif errors["length"].max > EXACT_M:
                used_quadrants = sorted({str(quadrant) for quadrant in routes[row] if quadrant})
                draft.record(
                    "tendon",
                    tendon.number,
                    f"the path around a geom by the rules of MuJoCo {self.version}",
                    "a GeometryPath whose wrap surfaces have the best-fitting quadrant",
                    "quadrants " + " ".join(used_quadrants),
                    errors,
                )
            else:
                draft.note_result("tendon", tendon.number, "path")
            if row not in polynomials:
                self._record_coincident_sites(tendon, default_pose)

    def _record_coincident_sites(self, tendon: Tendon, pose: SampledPoses) -> None:
        """Record neighbouring sites of two bodies in one place: OpenSim needs their direction."""
        draft, model = self.draft, self.draft.mj
        for segment in tendon.segments:
            first, second = segment.first, segment.second
            if int(model.site_bodyid[first]) == int(model.site_bodyid[second]):
                continue
            distance = float(norm(pose.sites[0, first] - pose.sites[0, second]))
            if distance < COINCIDENT_M:
                names = [draft.source.name_of("site", site) for site in (first, second)]
                draft.record(
                    "tendon",
                    tendon.number,
                    "neighbouring sites at the same position in the default pose",
                    "a path without a direction between the two: OpenSim cannot compute accelerations "
                    "in this pose; start from another pose",
                    f"'{names[0]}' and '{names[1]}'",
                )


def _key(segment: TendonSegment) -> TendonSegment:
    return segment._replace(divisor=1.0)


def _find_first_branch(tendon: Tendon) -> tuple[TendonSegment, ...]:
    """Return the segments of a tendon up to its first pulley."""
    for count, (segment, following) in enumerate(pairwise(tendon.segments), 1):
        if segment.second != following.first or segment.divisor != following.divisor:
            return tendon.segments[:count]
    return tendon.segments


def _make_straight_path(
    draft: ConversionDraft,
    frames: list[PhysicalFrame],
    surfaces: Surfaces,
    segments: tuple[TendonSegment, ...],
) -> GeometryPath:
    """Return a path through the sites of a branch that wraps around nothing."""
    return make_geometry_path(draft, frames, surfaces, segments, (None,) * len(segments))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _dependent(draft: ConversionDraft) -> set[int]:
    model, equality_types = draft.mj, draft.source.mujoco.mjtEq
    return {
        int(model.eq_obj1id[number])
        for number in range(model.neq)
        if int(model.eq_type[number]) == int(equality_types.mjEQ_JOINT) and model.eq_active0[number]
    }


def _find_reach(
    draft: ConversionDraft, tendons: list[Tendon], poses: SampledPoses
) -> dict[int, float]:
    """Return the largest height (m) over the middle of each cylinder at which a segment ends."""
    result: dict[int, float] = {}
    for tendon in tendons:
        for segment in tendon.segments:
            if segment.geom < 0:
                continue
            axis = poses.rotations[:, segment.geom, :, 2]
            for site in (segment.first, segment.second):
                offset = poses.sites[:, site] - poses.geoms[:, segment.geom]
                height = float(np.abs(np.einsum("pi,pi->p", offset, axis)).max())
                result[segment.geom] = max(result.get(segment.geom, 0.0), height)
    return result


def _make_linear_path(draft: ConversionDraft, tendon: Tendon) -> TendonPath:
    """Make the path of a fixed tendon, which is a linear function of joint positions.

    Returns:
        Path, and the constant (m) that keeps its length positive.
    """
    names = []
    coefficients = []
    shortest = 0.0
    for joint, coefficient in tendon.joints:
        names.append(draft.coordinate_path(joint))
        coefficients.append(coefficient)
        lower, upper = draft.made[draft.coordinates[joint][0]].range
        shortest += min(coefficient * lower, coefficient * upper)
    shift = max(0.0, 0.01 - shortest)
    if shift:
        draft.record(
            "tendon",
            tendon.number,
            "a length that is negative in some poses",
            "a FunctionBasedPath with a linear function, whose constant keeps the length positive",
            f"constant {shift:g}",
        )
    else:
        draft.note_result("tendon", tendon.number, "path")
    path = FunctionBasedPath(
        name="path",
        coordinate_paths=tuple(names),
        length_function=LinearFunction(name="length_function", coefficients=(*coefficients, shift)),
    )
    return TendonPath(path, shift)
