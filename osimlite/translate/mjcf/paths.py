"""Paths of muscles, springs and actuators as spatial tendons, with their errors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from osimlite.base.progress import report_stage, watch_items
from osimlite.base.records import dataclass, field
from osimlite.base.text import add_article, join_words
from osimlite.mechanics.kernels.paths import NODE_TYPE
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import Force
from osimlite.schema.paths import AbstractGeometryPath
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.paths import Paths
from osimlite.translate.fidelity import LEFT_OUT, Error
from osimlite.translate.mjcf.bodies import MIN_MASS
from osimlite.translate.mjcf.couplings import HELPER_INERTIA, add_helper, compose_with_line
from osimlite.translate.mjcf.draft import (
    Follower,
    MjcfDraft,
    PathTendon,
    Value,
    add_element,
    clear_rounding,
    format_pose,
)
from osimlite.translate.mjcf.fits import fit_tendon
from osimlite.translate.mjcf.poses import (
    EXACT_TOLERANCE_M,
    PathSamples,
    Poses,
    draw_poses,
    measure_arm_errors,
)
from osimlite.translate.mjcf.routes import Router
from osimlite.translate.mjcf.tendons import Tendon, TendonSite, WrapGeom, measure_tendon

SELECTION_POSES = 100
"""Random poses in which a tendon is selected if nothing is fitted."""
FIT_POSES = 250
"""Random poses in which a tendon is selected and fitted."""
VALIDATION_POSES = 500
"""Random poses that decide whether a fitted tendon is better than the selected one."""
TEST_POSES = 100
"""Random poses in which the errors of the account are measured."""
WRAP_GROUP = 4
"""Group of wrap geoms and their sites, which MuJoCo's viewer shows or hides together."""


def add_paths(draft: MjcfDraft) -> None:
    """Add a tendon for every path through points."""
    owners: dict[str, AbstractGeometryPath] = {
        path: owner.geometry_path
        for owner, path in draft.iterate_components(Force)
        if owner.appliesForce
        and isinstance(getattr(owner, "geometry_path", None), AbstractGeometryPath)
    }
    if not owners:
        return
    report_stage("measuring paths")
    exact = Paths(draft.model)
    fits = draft.options.fit != "none"
    poses, samples = draw_poses(exact, FIT_POSES if fits else SELECTION_POSES, 0)
    # Other seeds give other poses: errors are measured in poses that no fit has seen.
    test_poses, test_samples = draw_poses(exact, TEST_POSES, 1)
    validation_poses, validation_samples = (
        draw_poses(exact, VALIDATION_POSES, 2) if fits else (poses, samples)
    )
    default = exact.lengths(draft.default_state[0])
    writer = _TendonWriter(draft)
    for path, geometry in watch_items("fitting paths", owners.items(), " paths"):
        route = exact.routes[path]
        geometry_path = draft.tree.path_of(geometry) or ""
        # Function-based paths have no points for sites.
        if not isinstance(route, ThroughPoints):
            class_name = type(geometry).__name__
            draft.fidelity.add(
                "path", geometry_path, f"a path that is {add_article(class_name)}", LEFT_OUT
            )
            continue
        router = Router(route, samples[path], poses, draft.options.version)
        tendon = router.find_best()
        if fits:
            # A fit that is better only in its own poses has jumps in others: judge it in new poses.
            validation = Router(
                route, validation_samples[path], validation_poses, draft.options.version
            )
            tendon = min(tendon, fit_tendon(router, tendon), key=validation.compute_error)
        name = writer.write_tendon(path, tendon)
        draft.tendons[path] = PathTendon(
            name, default[path], samples[path].lengths, test_samples[path].lengths
        )
        draft.record_result(geometry_path, f"tendon {name}")
        for wrap in geometry.path_wrap_set.objects:
            surface = (
                draft.tree.path_of(draft.tree.target(wrap, "wrap_object", wrap.wrap_object)) or ""
            )
            draft.fidelity.translated[surface] = "a geom that tendons wrap around"
        errors = _measure_errors(draft, tendon, test_poses, test_samples[path])
        # Exact tendons need no record.
        if any(error.max > EXACT_TOLERANCE_M for error in errors.values()):
            approximation = "a tendon through the same points and around the same surfaces, selected for the smallest error"
            replacement = (
                f"{approximation}, with fitted wrap geoms and sites" if fits else approximation
            )
            draft.fidelity.add(
                "path",
                geometry_path,
                _describe_inexact_parts(route, router),
                replacement,
                f"tendon {name}",
                errors,
            )


def _measure_errors(
    draft: MjcfDraft, tendon: Tendon, poses: Poses, samples: PathSamples
) -> dict[str, Error]:
    """Measure the errors of a tendon in poses by which it was not selected.

    Args:
        draft: MJCF under construction.
        tendon: tendon to measure.
        poses: poses for tests.
        samples: path in these poses.

    Returns:
        Error by quantity: length, and moment arm about each coordinate.
    """
    lengths, arms = measure_tendon(tendon, poses, draft.options.version)
    arm_errors = measure_arm_errors(draft.mechanism, arms, samples)
    names = draft.mechanism.coordinate_names
    named_arm_errors = {
        f"moment arm about {names[index]}": error for index, error in arm_errors.items()
    }
    return {"length": Error.measure(lengths - samples.lengths, "m"), **named_arm_errors}


def _describe_inexact_parts(route: ThroughPoints, router: Router) -> str:
    """Return a text about the parts of a path that MuJoCo cannot express exactly."""
    point_types = {point.kind for point in route.points}
    touched = [
        surface
        for surface, contact in zip(route.surfaces, router.contacts, strict=True)
        if len(contact.poses)
    ]
    result = [
        *(["a point that moves with a coordinate"] if NODE_TYPE.MOVING in point_types else []),
        *(
            ["a point that acts only in a range of a coordinate"]
            if NODE_TYPE.CONDITIONAL in point_types
            else []
        ),
        # The cylinder with its clause is the last.
        *(
            add_article(name)
            for name in sorted({_SURFACE_NAMES[surface.law] for surface in touched}, reverse=True)
        ),
    ]
    start = "a path around several surfaces, with" if len(touched) > 1 else "a path with"
    return f"{start} {join_words(result or ['surfaces'])}"


_SURFACE_NAMES = {
    "wrap_cylinder": "cylinder (OpenSim's path around it is not the shortest)",
    "wrap_sphere": "sphere",
    "wrap_ellipsoid": "ellipsoid",
    "wrap_torus": "torus",
}
"""Descriptions of surfaces that tendons only approximate, by the law of the surface."""


@dataclass
class _TendonWriter:
    """Writer of tendons, which writes each wrap geom once.

    Attributes:
        draft: MJCF under construction.
    """

    draft: MjcfDraft
    _geoms: dict[tuple[Any, ...], str] = field(default_factory=dict)

    def write_tendon(self, path: str, tendon: Tendon) -> str:
        """Write a tendon with its sites and wrap geoms.

        Returns:
            Name of the tendon.
        """
        name = self.draft.make_name("tendon", path)
        element = add_element(
            self.draft.get_section("tendon"),
            "spatial",
            name=name,
            width=0.005,
            rgba=(0.8, 0.1, 0.1, 1.0),
        )
        for part in tendon:
            if isinstance(part, TendonSite):
                add_element(
                    element, "site", site=self._write_site(f"{path}/{part.name or 'between'}", part)
                )
            else:
                side = (
                    None
                    if part.side is None
                    else self._write_site(f"{path}/{part.name or 'around'}_side", part.side)
                )
                add_element(element, "geom", geom=self._write_geom(path, part), sidesite=side)
        return name

    def _write_site(self, path: str, tendon_site: TendonSite) -> str:
        """Write a site of a tendon, with the bodies that move it.

        Returns:
            Name of the site.
        """
        if tendon_site.slides is None:
            return self.draft.add_site(
                path, tendon_site.body, tendon_site.position, group=WRAP_GROUP
            )
        assert tendon_site.drive is not None
        helper = add_helper(self.draft, tendon_site.coordinate, tendon_site.drive)
        if helper is None:
            # The coordinate is locked.
            value = self.draft.mechanism.coordinates[tendon_site.coordinate].default_value
            displacement = [
                Polynomial(row)(Polynomial(tendon_site.drive)(value)) for row in tendon_site.slides
            ]
            return self.draft.add_site(
                path,
                tendon_site.body,
                tendon_site.position + np.array(displacement),
                group=WRAP_GROUP,
            )
        joint, line = helper
        name = self.draft.make_name("body", path)
        position = clear_rounding(tendon_site.position + tendon_site.slides[:, 0])
        carrier = add_element(
            self.draft.bodies[tendon_site.body], "body", name=name, pos=position, gravcomp=1
        )
        # MuJoCo weighs equalities of bodies that slide in ground by their mass without the armature, so
        # that the mass itself must be large there.
        mass = HELPER_INERTIA if tendon_site.body == GROUND else MIN_MASS
        add_element(carrier, "inertial", pos=np.zeros(3), mass=mass, diaginertia=np.full(3, mass))
        for axis, polynomial in _split_into_axes(tendon_site.slides * (0.0, 1.0, 1.0, 1.0, 1.0)):
            slide = self.draft.make_name("joint", f"{name}_{len(carrier)}")
            add_element(
                carrier, "joint", name=slide, type="slide", axis=axis, armature=HELPER_INERTIA
            )
            self.draft.add_follower(slide, Follower(joint, compose_with_line(line, polynomial)))
        site = self.draft.make_name("site", path)
        add_element(carrier, "site", name=site, group=WRAP_GROUP)
        return site

    def _write_geom(self, path: str, wrap_geom: WrapGeom) -> str:
        """Write the geom of a surface.

        Returns:
            Name of the geom, which may have been written before.
        """
        # Muscles share wrap objects; equal geoms are written once.
        key = (
            wrap_geom.body,
            wrap_geom.kind,
            wrap_geom.radius,
            wrap_geom.length,
            *wrap_geom.frame.ravel().tolist(),
        )
        if key not in self._geoms:
            name = self._geoms[key] = self.draft.make_name(
                "geom", f"{path}/{wrap_geom.name or 'around'}"
            )
            size = (
                [wrap_geom.radius]
                if wrap_geom.kind == "sphere"
                else [wrap_geom.radius, 0.5 * wrap_geom.length]
            )
            element = self.draft.bodies[wrap_geom.body]
            attributes: dict[str, Value] = {
                "contype": 0,
                "conaffinity": 0,
                "group": WRAP_GROUP,
                "rgba": (0.0, 1.0, 1.0, 0.3),
            }
            add_element(
                element,
                "geom",
                name=name,
                type=wrap_geom.kind,
                size=size,
                **format_pose(wrap_geom.frame),
                **attributes,
            )
        return self._geoms[key]


def _split_into_axes(polynomials: Array) -> Iterator[tuple[Array, Array]]:
    """Yield axes (3,) and polynomials (5,) along them whose sum is a motion (3, 5).

    A motion on a straight line has one axis only.
    """
    axes, sizes, rows = np.linalg.svd(polynomials, full_matrices=False)
    # The singular values tell whether all coefficients lie along one axis.
    if sizes[1] <= 1e-12 * sizes[0]:
        yield axes[:, 0], sizes[0] * rows[0]
        return
    for axis, row in zip(np.eye(3), polynomials, strict=True):
        if row.any():
            yield axis, row
