"""Compare motions with contact with a live OpenSim 4.6 at equal accuracy.

The models have balls, blocks, terrain of several surfaces, and feet that are meshes.
"""

from __future__ import annotations

import gzip
import shutil

import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactMesh,
    ContactSphere,
    Coordinate,
    HuntCrossleyForce,
    Model,
)
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.contact_forces import ElasticFoundationForce
from osimlite.schema.springs import (
    ExpressionBasedPointToPointForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation import read_sto
from tests.oracle.opensim_runs import simulated
from tests.simulation.meshes import ball, block, write_obj, write_vtp

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Rotation that turns the normal of a half space upwards (rad).
UP = (0.0, 0.0, -1.5707963267948966)


def by_opensim(path, to, accuracy):
    """Return OpenSim's final state by label."""
    result = simulated(path, to, accuracy)
    return dict(zip(result.columns, result.rows[-1], strict=True))


def by_osimlite(path, to, accuracy):
    trajectory = osimlite.simulate(osimlite.read(path), to, accuracy=accuracy, folder=path.parent)
    trajectory.write(path.parent / "out")
    result = read_sto(path.parent / "out" / "states.sto")
    return dict(zip(result.columns, result.rows[-1], strict=True)), trajectory


def compare(path, to=0.5, accuracy=1e-9, tolerance=1e-6):
    theirs = by_opensim(path, to, accuracy)
    ours, trajectory = by_osimlite(path, to, accuracy)
    assert max(abs(ours[label] - theirs[label]) for label in ours) < tolerance
    return trajectory


@pytest.mark.parametrize("name", ["m0134", "m0178", "m0466", "m0478"])
def test_published_models(corpus, name, tmp_path):
    """The models are a mesh ball, a tug of war by an actuator, a hopping leg and a walker."""
    model = next(model for model in corpus if model.id == name)
    shutil.copytree(model.path.parent, tmp_path / "model")
    path = tmp_path / "model" / model.path.name
    # Use OpenSim's print of the model: when OpenSim upgrades an old file it keeps six digits of
    # some numbers.
    path.write_bytes(gzip.decompress(model.converted.read_bytes()))
    compare(path)


def touching(name, surfaces, stiffness=1e6, kind=HuntCrossleyForce, transition=0.2):
    force = kind(name=name, transition_velocity=transition)
    force.contact_parameters.objects.append(
        kind.ContactParameters(
            geometry=surfaces,
            stiffness=stiffness,
            dissipation=0.7,
            static_friction=0.8,
            dynamic_friction=0.4,
            viscous_friction=0.3,
        )
    )
    return force


def balls(count=2) -> Model:
    """Return a model of balls that are thrown on a floor and on each other."""
    model = Model(name="balls")
    floor = ContactHalfSpace(name="floor", socket_frame=model.ground, orientation=UP)
    model.add(floor)
    surfaces = [floor]
    for number in range(count):
        body = model.add(
            Body(name=f"ball{number}", mass=0.5, inertia=(0.002, 0.002, 0.002, 0, 0, 0))
        )
        joint = osimlite.FreeJoint(name=f"free{number}")
        values = (0.1, 0.0, 0.2, 0.12 * number, 0.2 + 0.3 * number, 0.03 * number)
        speeds = (1.0, 0.0, 3.0 * number, 0.3 - 0.6 * number, -1.0 * number, 0.0)
        for index, axis in enumerate(("rx", "ry", "rz", "tx", "ty", "tz")):
            joint.coordinates[index] = Coordinate(
                name=f"{axis}{number}",
                default_value=values[index],
                default_speed_value=speeds[index],
            )
        model.add(joint.between(model.ground, body))
        sphere = ContactSphere(name=f"sphere{number}", socket_frame=body, radius=0.1)
        model.add(sphere)
        surfaces.append(sphere)
    model.add(touching("contact", tuple(surfaces)))
    return model


def test_balls_at_several_accuracies(tmp_path):
    path = tmp_path / "balls.osim"
    osimlite.write(balls(), path)
    exact = by_opensim(path, 0.5, 1e-10)
    errors = []
    for accuracy in (1e-3, 1e-5, 1e-7, 1e-9):
        ours, trajectory = by_osimlite(path, 0.5, accuracy)
        theirs = by_opensim(path, 0.5, accuracy)
        error, their_error = (
            max(abs(result[label] - exact[label]) for label in ours) for result in (ours, theirs)
        )
        # OpenSim reports states between its steps. The two programs therefore agree only within the
        # error of each.
        assert error < 10.0 * max(their_error, 1e-8)
        errors.append(error)
    assert errors[-1] < 1e-6 and errors == sorted(errors, reverse=True)
    names = {event["contact"] for event in trajectory.summary["contact_events"]}
    assert names == {
        "contact (sphere0, floor)",
        "contact (sphere1, floor)",
        "contact (sphere1, sphere0)",
    }


def terrain(folder) -> Model:
    """Return the walker among half spaces, balls and a mesh, held by springs and drawn by a magnet."""
    model = dynamic_walker()
    platform, feet = "/bodyset/Platform", []
    for side in ("R", "L"):
        feet.append(
            next(
                item
                for item in model.components(ContactSphere)
                if item.name == f"{side}FootContact"
            )
        )
    ramp = ContactHalfSpace(
        name="ramp",
        socket_frame=platform,
        location=(0.5, 0.03, 0.0),
        orientation=(0, 0, UP[2] + 0.15),
    )
    boulders = [
        ContactSphere(
            name=f"boulder{k}",
            socket_frame=platform,
            location=(0.15 * k - 0.3, -0.25, 0.2),
            radius=0.3,
        )
        for k in range(4)
    ]
    write_obj(folder / "rock.obj", *block((0.2, 0.3, 0.12)))
    rock = ContactMesh(
        name="rock", socket_frame=platform, location=(0.1, 0.02, -0.2), filename="rock.obj"
    )
    model.add(ramp, *boulders, rock)
    for foot, name in zip(feet, "RL", strict=True):
        model.add(touching(f"{name}Terrain", (foot, ramp, *boulders)))
        model.add(touching(f"{name}Rock", (foot, rock), 1e7, ElasticFoundationForce))
    for name in ("RHip_rz", "LHip_rz", "RKnee_rz", "LKnee_rz"):
        model.add(
            SpringGeneralizedForce(
                name=f"{name}_spring", coordinate=name, stiffness=20.0, viscosity=0.5
            )
        )
    model.add(
        PointToPointSpring(
            name="band",
            socket_body1="/bodyset/RightShank",
            socket_body2="/bodyset/LeftShank",
            stiffness=10.0,
            rest_length=0.1,
        ),
        ExpressionBasedPointToPointForce(
            name="magnet",
            body1="Platform",
            body2="LeftShank",
            point1=(0.3, 0, 0),
            expression="0.01/(0.1+d^2)",
        ),
    )
    return model


def foot(folder) -> Model:
    """Return the walker with feet that are meshes."""
    model = dynamic_walker()
    write_vtp(folder / "foot.vtp", *ball((0.12, 0.05, 0.06), 14, 9))
    for force in [item for item in model.components(HuntCrossleyForce) if "Foot" in item.name]:
        model.force_set.objects.remove(force)
    for side, shank in (("R", "RightShank"), ("L", "LeftShank")):
        sole = ContactMesh(
            name=f"{side}Sole",
            socket_frame=f"/bodyset/{shank}",
            location=(0.04, -0.2175, 0.0),
            orientation=(0.1, 0.0, 0.4),
            filename="foot.vtp",
        )
        model.add(sole)
        model.add(
            touching(f"{side}FootForce", (sole, "PlatformContact"), 3e6, ElasticFoundationForce)
        )
    return model


@pytest.mark.parametrize(
    ("make", "met"),
    [(terrain, {"Terrain", "Rock"}), (foot, {"Foot"})],
    ids=["terrain", "mesh feet"],
)
def test_walkers(make, met, tmp_path):
    path = tmp_path / "walker.osim"
    osimlite.write(make(tmp_path), path)
    trajectory = compare(path)
    largest = trajectory.summary["largest_contact_forces"]
    assert all(any(word in name for name in largest) for word in met)
    assert np.abs(trajectory.energy["total"]).max() < 100.0
