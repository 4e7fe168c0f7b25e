"""Search for the tendon nearest to a path.

OpenSim decides in each pose on which side of a surface a path passes, between which points it
touches the surface, and whether a conditional point counts. MuJoCo needs these decisions once. All
tendons that MuJoCo can express are measured in many poses, and the best is selected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain, combinations, groupby, pairwise, product

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.paths import NODE_TYPE
from osimlite.mechanics.multibody.spatial import Array, make_transform, rotation_about
from osimlite.simulation.elements.geometries.paths.geometry_path import Node, ThroughPoints
from osimlite.translate.mjcf.moving import fit_composition
from osimlite.translate.mjcf.poses import Indices, PathSamples, Poses
from osimlite.translate.mjcf.surfaces import make_substitutes, rotate_z_to
from osimlite.translate.mjcf.tendons import (
    Tendon,
    TendonSite,
    WrapGeom,
    measure_tendon,
    measure_tendons,
)
from osimlite.translate.mjcf.wrapping import unit

SIDE_DIRECTIONS = 12
"""Number of directions around a surface that are tried for its side site."""
CYLINDER_RADII_M = (0.001, 0.004, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04)
"""Radii (m) of the cylinders that are tried in place of conditional points."""
SPECK_RADIUS_M = 1e-5
"""Radius (m) of the sphere that replaces a conditional point: small enough not to change the path."""


Choose = Callable[[Sequence[Tendon]], Tendon]
"""Function that selects the best of several forms of a part of a tendon."""


@dataclass(frozen=True, eq=False)
class Touch:
    """Contact of a path with a surface, in the k poses in which it touches.

    Attributes:
        poses: indices of the poses (k,).
        first: first tangent points in the body of the surface (k, 3) (m).
        second: second tangent points (k, 3) (m).
        after: numbers of the path points before them (k,).
    """

    poses: Indices
    first: Array
    second: Array
    after: Indices


class Router:
    """Search for the tendon nearest to a path.

    Args:
        route: path to which tendons are compared.
        samples: samples of the path in the poses.
        poses: poses in which tendons are compared.
        version: major version of MuJoCo.

    Attributes:
        target: lengths and moment arms of the path (P, 1 + m).
        contacts: contact of the path with each of its surfaces.
    """

    def __init__(
        self, route: ThroughPoints, samples: PathSamples, poses: Poses, version: int
    ) -> None:
        # Coordinates about which the path has no moment arm would only dilute the error.
        columns = np.flatnonzero(np.abs(samples.arms).max(0, initial=0.0) > 1e-9)
        self.route = route
        self.samples = samples
        self.poses = poses.select_coordinates(columns.tolist())
        self.version = version
        self.target = np.concatenate((samples.lengths[:, None], samples.arms[:, columns]), axis=1)
        self.contacts = [self._find_touches(number) for number in range(len(route.surfaces))]

    def compute_residuals(self, tendon: Tendon) -> Array:
        """Return the errors of length and moment arms of a tendon (P, 1 + m) (m)."""
        return self._measure(tendon) - self.target

    def compute_error(self, tendon: Tendon) -> float:
        """Return the root of the sum of the mean squares of the residuals (m)."""
        return float(np.sqrt((self.compute_residuals(tendon) ** 2).mean(0).sum()))

    def find_best(self) -> Tendon:
        """Return the best tendon of those with the path's own points and surfaces.

        Parts that are alternatives (conditional points, surfaces between two points) are selected
        one after the other, in two rounds if there are several, because they influence one another.
        """
        slots: list[Tendon] = []
        choosers: dict[int, Callable[[Choose], Tendon]] = {}
        points = list(enumerate(self.route.points))
        for is_conditional, group in groupby(
            points, lambda numbered_point: numbered_point[1].kind == NODE_TYPE.CONDITIONAL
        ):
            numbers = [number for number, _ in group]
            for run in [numbers] if is_conditional else [[number] for number in numbers]:
                sites = tuple(make_site(self.route.points[number]) for number in run)
                if is_conditional:
                    point_options = [
                        [(point,), (), *self._make_switches(number)]
                        for point, number in zip(sites, run, strict=True)
                    ]
                    run_options = [
                        *map(_join_pieces, product(*point_options)),
                        *self._make_cylinders(run),
                    ]
                    choosers[len(slots)] = partial(_choose_option, run_options)
                slots.append(sites)
                if between := [
                    k
                    for k, contact in enumerate(self.contacts)
                    if np.isin(contact.after, run).any()
                ]:
                    choosers[len(slots)] = partial(self._choose_obstacles, between)
                    slots.append(())
        for _ in range(2 if len(choosers) > 1 else 1):
            for slot_index, choose_slot in choosers.items():
                parts = (
                    _join_pieces(slots[:slot_index]),
                    slots[slot_index],
                    _join_pieces(slots[slot_index + 1 :]),
                )
                slots[slot_index] = choose_slot(partial(self._choose_best, *parts))
        return _join_pieces(slots)

    def _choose_best(
        self, before: Tendon, current: Tendon, after: Tendon, options: Sequence[Tendon]
    ) -> Tendon:
        """Return the option for a part with which the complete tendon has the smallest error."""
        last_section = before[_find_last_site(before) :]
        first_section = after[: len(after) - _find_last_site(after[::-1])]
        outside_residuals = self.compute_residuals((*before, *current, *after)) - self._measure(
            (*last_section, *current, *first_section)
        )
        valid_options = [
            option for option in options if _is_tendon((*last_section, *option, *first_section))
        ]
        lengths, arms = measure_tendons(
            [(*last_section, *option, *first_section) for option in valid_options],
            self.poses,
            self.version,
        )
        errors = (
            np.square(outside_residuals + np.concatenate((lengths[..., None], arms), axis=-1))
            .mean(1)
            .sum(-1)
        )
        # Options that differ by rounding only: take the first, so that all machines select the same.
        return valid_options[int(np.argmax(errors <= errors.min() * (1.0 + 1e-9) + 1e-24))]

    def make_piece_residuals(self, tendon: Tendon, piece: Tendon) -> Callable[[Tendon], Array]:
        """Return the residuals as a function of a replacement for a piece of a tendon.

        A piece runs from site to site.

        Args:
            tendon: complete tendon.
            piece: piece of it that will be replaced.
        """
        outside_residuals = self.compute_residuals(tendon) - self._measure(piece)
        return lambda replacement: outside_residuals + self._measure(replacement)

    def _measure(self, tendon: Tendon) -> Array:
        """Return length and moment arms of a tendon (P, 1 + m)."""
        lengths, arms = measure_tendon(tendon, self.poses, self.version)
        return np.concatenate((lengths[:, None], arms), axis=1)

    def _find_touches(self, number: int) -> Touch:
        """Return the poses in which the path touches a surface, with the tangent points."""
        first_tangent_node = len(self.route.points) + 2 * number
        body = self.route.surfaces[number].tangent.body
        result = []
        for pose, nodes in enumerate(self.samples.nodes):
            last = 0
            for (node, position), (_, next_position) in pairwise(nodes):
                # Nodes below the number of points are path points, others are tangent points of
                # surfaces.
                last = node if node < len(self.route.points) else last
                if node == first_tangent_node:
                    result.append((pose, position, next_position, last))
        poses, first_points, second_points, previous_points = (
            zip(*result, strict=True) if result else ((), (), (), ())
        )
        pose_indices = np.array(poses, dtype=int)
        return Touch(
            pose_indices,
            self._express_in_body(body, pose_indices, np.array(first_points)),
            self._express_in_body(body, pose_indices, np.array(second_points)),
            np.array(previous_points),
        )

    def _express_in_body(self, body: int, pose_indices: Indices, positions: Array) -> Array:
        """Return positions in ground (k, 3), each in one pose, in the frame of a body (k, 3)."""
        return np.einsum(
            "pji,pj->pi",
            self.poses.rotations[body][pose_indices],
            positions.reshape(-1, 3) - self.poses.origins[body][pose_indices],
        )

    # ----------------------------------------------------------------------------------------------- options
    def _choose_obstacles(self, numbers: Sequence[int], choose: Choose) -> Tendon:
        """Return the best obstacles of a tendon between two points.

        They are none, one wrap geom, or two wrap geoms with a site between them.
        """
        best: dict[int, WrapGeom] = {}
        options: list[Tendon]
        for number in sorted(
            numbers, key=lambda number: np.mean(self._find_ranks(number, numbers))
        ):
            options = [
                (sided,)
                for wrap_geom in make_substitutes(
                    self.route.surfaces[number], self._find_tangent_points(number)
                )
                for sided in self._vary_side(number, wrap_geom, SIDE_DIRECTIONS)
            ]
            if not options:
                continue
            (result,) = choose(options)
            assert isinstance(result, WrapGeom)
            best[number] = result
        # No wrap geom at all is an option too: the path may hardly touch the surface.
        options = [(), *((wrap_geom,) for wrap_geom in best.values())]
        for (first_number, first_geom), (second_number, second_geom) in combinations(
            best.items(), 2
        ):
            # MuJoCo needs a site between two surfaces.
            for middle_site in self._place_sites_between(first_number, second_number):
                sides = product(
                    self._vary_side(first_number, first_geom, 0),
                    self._vary_side(second_number, second_geom, 0),
                )
                options += [(sided, middle_site, second_sided) for sided, second_sided in sides]
        return choose(options)

    def _find_tangent_points(self, number: int) -> Array:
        """Return the tangent points (2 k, 3) on a surface, in its own frame (m)."""
        contact = self.contacts[number]
        frame = self.route.surfaces[number].tangent.frame
        return (np.concatenate((contact.first, contact.second)) - frame[:3, 3]) @ frame[:3, :3]

    def _vary_side(self, number: int, wrap_geom: WrapGeom, directions: int) -> Iterator[WrapGeom]:
        """Yield copies of a geom with different side sites.

        These are the present one, those on the side of the quadrant and on the touched side, and
        those in `directions` directions all around.
        """
        yield wrap_geom
        surface = self.route.surfaces[number]
        contact = self.contacts[number]
        from_surface = wrap_geom.frame[:3, :3].T @ surface.tangent.frame[:3, :3]
        axis = int(surface.numbers[0])
        sign = surface.numbers[1]
        if sign:
            yield wrap_geom.replace_side(from_surface @ (sign * np.eye(3)[axis]))
        mean_points = (
            0.5 * (contact.first + contact.second) - wrap_geom.frame[:3, 3]
        ) @ wrap_geom.frame[:3, :3]
        # The mean direction in which the path touches the surface.
        yield wrap_geom.replace_side(unit(mean_points).mean(0))
        for angle in np.arange(directions) * (2.0 * np.pi / max(directions, 1)):
            yield wrap_geom.replace_side(np.array((np.cos(angle), np.sin(angle), 0.0)))
        if directions and wrap_geom.kind == "sphere":
            yield from (wrap_geom.replace_side(np.array((0.0, 0.0, z))) for z in (1.0, -1.0))

    def _find_ranks(self, number: int, numbers: Sequence[int]) -> list[int]:
        """Return the rank of a surface in the order of those that the path touches, in each pose."""
        points = len(self.route.points)
        result = []
        for pose in self.contacts[number].poses:
            order = [(node - points) // 2 for node, _ in self.samples.nodes[pose] if node >= points]
            result.append([k for k in dict.fromkeys(order) if k in numbers].index(number))
        return result

    def _place_sites_between(self, first_number: int, second_number: int) -> Iterator[TendonSite]:
        """Yield sites between two surfaces, halfway between their tangent points.

        They are in the body of either surface.
        """
        first_contact, second_contact = self.contacts[first_number], self.contacts[second_number]
        common_poses, first_indices, second_indices = np.intersect1d(
            first_contact.poses, second_contact.poses, return_indices=True
        )
        # The path never touches both surfaces in one pose.
        if not len(common_poses):
            return
        bodies = [
            self.route.surfaces[number].tangent.body for number in (first_number, second_number)
        ]
        exits = self.poses.locate_at(bodies[0], first_contact.second[first_indices], common_poses)
        entries = self.poses.locate_at(
            bodies[1], second_contact.first[second_indices], common_poses
        )
        for body in dict.fromkeys(bodies):
            yield TendonSite(
                body, self._express_in_body(body, common_poses, 0.5 * (exits + entries)).mean(0)
            )

    def _make_switches(self, number: int) -> Iterator[Tendon]:
        """Yield small spheres in place of a conditional point.

        The path runs through a sphere only while the coordinate is in the range of the point.

        The path runs through the sphere while its side site is inside. The side site leaves the
        centre with the square of the distance of the coordinate from the middle of its range,
        reaching the surface at its ends, in the direction of the previous or the next point, in
        which the sphere does not deflect the path.
        """
        point = make_site(self.route.points[number])
        node = self.route.points[number]
        lower, upper = node.range
        range_center = 0.5 * (lower + upper)
        half_width = 0.5 * (upper - lower)
        parabola = (
            SPECK_RADIUS_M
            / half_width**2
            * np.array((range_center**2, -2.0 * range_center, 1.0, 0.0, 0.0))
        )
        # Toward a neighbouring point the sphere lies on the path and does not deflect it.
        for neighbour in (number - 1, number + 1):
            if not 0 <= neighbour < len(self.route.points):
                continue
            neighbour_site = make_site(self.route.points[neighbour])
            positions = self.poses.locate(neighbour_site.body, neighbour_site.position)
            toward = (
                self._express_in_body(point.body, np.arange(len(positions)), positions).mean(0)
                - point.position
            )
            if not toward.any():
                continue
            direction = toward / np.linalg.norm(toward)
            side = TendonSite(
                point.body,
                point.position,
                node.coordinate,
                np.eye(5)[1],
                np.outer(direction, parabola),
            )
            yield (
                WrapGeom(
                    point.body,
                    make_transform(None, point.position),
                    "sphere",
                    SPECK_RADIUS_M,
                    side,
                    name=point.name,
                ),
            )

    def _make_cylinders(self, run: Sequence[int]) -> Iterator[Tendon]:
        """Yield cylinders that carry conditional points, over whose edge the path bends."""
        bends = []
        for pose, nodes in enumerate(self.samples.nodes):
            run_indices = [k for k, (node, _) in enumerate(nodes) if node in run]
            if run_indices and run_indices[0] > 0 and run_indices[-1] + 1 < len(nodes):
                before, first, last, after = (
                    nodes[k][1]
                    for k in (
                        run_indices[0] - 1,
                        run_indices[0],
                        run_indices[-1],
                        run_indices[-1] + 1,
                    )
                )
                bends.append((pose, first - before, after - last))
        points = [make_site(self.route.points[number]) for number in run]
        body = points[0].body
        if not bends or any(point.body != body for point in points):
            return
        poses, before, after = (np.array(column) for column in zip(*bends, strict=True))
        # The axis about which the path turns at the points.
        bend_axes = np.cross(unit(before), unit(after))
        normal, inward = (
            np.einsum("pji,pj->pi", self.poses.rotations[body][poses], directions).mean(0)
            for directions in (bend_axes, unit(after) - unit(before))
        )
        # A path that does not turn needs no cylinder.
        if not normal.any() or not inward.any():
            return
        frame = make_transform(rotate_z_to(normal))
        chord = frame[:3, :3].T @ (points[-1].position - points[0].position)
        inward = np.array((*(frame[:3, :3].T @ inward)[:2], 0.0))
        if len(run) > 1:
            inward = np.array((-chord[1], chord[0], 0.0)) * np.sign(
                chord[0] * inward[1] - chord[1] * inward[0]
            )
        inward /= np.linalg.norm(inward)
        frame[:3, 3] = 0.5 * (points[0].position + points[-1].position)
        half_chord = 0.5 * float(np.hypot(*chord[:2]))
        for radius in CYLINDER_RADII_M:
            if radius > half_chord:
                shifted_frame = frame @ make_transform(
                    None, np.sqrt(radius**2 - half_chord**2) * inward
                )
                cylinder = WrapGeom(
                    body,
                    shifted_frame,
                    "cylinder",
                    radius,
                    length=4.0 * radius,
                    name=points[0].name,
                )
                # Side sites around the outside of the bend, 1 rad to either side.
                for angle in np.linspace(-1.0, 1.0, 5):
                    yield (
                        cylinder.replace_side(
                            rotation_about(np.array((0.0, 0.0, 1.0)), angle) @ -inward
                        ),
                    )


def make_site(point: Node) -> TendonSite:
    """Return the site of a path point; a moving point slides along quartics of its coordinate."""
    position = point.frame[:3, :3] @ point.location + point.frame[:3, 3]
    if point.kind != NODE_TYPE.MOVING:
        return TendonSite(point.body, position, name=point.name)
    drive, slides = fit_composition(point.functions, point.range)
    return TendonSite(
        point.body, position, point.coordinate, drive, point.frame[:3, :3] @ slides, point.name
    )


def _choose_option(options: Sequence[Tendon], choose: Choose) -> Tendon:
    """Return the option that a function chooses."""
    return choose(options)


def _is_tendon(tendon: Tendon) -> bool:
    """Return whether a sequence is valid: sites at both ends and between any two surfaces."""
    has_end_sites = isinstance(tendon[0], TendonSite) and isinstance(tendon[-1], TendonSite)
    return has_end_sites and not any(
        isinstance(previous, WrapGeom) and isinstance(following, WrapGeom)
        for previous, following in pairwise(tendon)
    )


def _find_last_site(tendon: Tendon) -> int:
    """Return the index of the last site, or 0 without any site."""
    return max(
        (index for index, part in enumerate(tendon) if isinstance(part, TendonSite)), default=0
    )


def _join_pieces(slots: Sequence[Tendon]) -> Tendon:
    """Return one tendon of several pieces."""
    return tuple(chain.from_iterable(slots))
