"""Compare smooth contact, and contact of ellipsoids and stations, with a live OpenSim 4.6."""

from __future__ import annotations

import pytest

from osimlite import ContactHalfSpace, ContactSphere, HuntCrossleyForce
from osimlite.schema.contact_forces import MeyerFregly2016Force, SmoothSphereHalfSpaceForce
from osimlite.schema.contact_types import ContactEllipsoid
from osimlite.schema.markers import Station

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, STATES, carrier, compare  # noqa: E402


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    return carrier(request.param)


@pytest.mark.parametrize("dissipation", [0.0, 0.4])
@pytest.mark.parametrize("carried", ["/ground", "/bodyset/b0/f0"])
def test_smooth_contact(model, dissipation, carried, tmp_path):
    plane = ContactHalfSpace(
        name="plane", socket_frame=carried, location=(0, -0.1, 0.2), orientation=(0.1, 0.2, -1.4)
    )
    model.add(plane)
    for number, frame in enumerate(("/bodyset/b1/f1", "/bodyset/b2", "/bodyset/b2/f2")):
        ball = ContactSphere(
            name=f"ball{number}", socket_frame=frame, location=(0.1, 0.0, -0.1), radius=0.3
        )
        model.add(ball)
        model.add(
            SmoothSphereHalfSpaceForce(
                name=f"contact{number}",
                socket_sphere=ball,
                socket_half_space=plane,
                stiffness=1e4,
                dissipation=dissipation,
                static_friction=0.8,
                dynamic_friction=0.5,
                viscous_friction=0.1,
                transition_velocity=0.2 + number,
                hertz_smoothing=3.0,
                hunt_crossley_smoothing=0.5,
            )
        )
    compare(model, tmp_path)


@pytest.mark.parametrize("carried", ["/ground", "/bodyset/b0/f0"])
def test_ellipsoids_on_a_plane(model, carried, tmp_path):
    plane = ContactHalfSpace(
        name="plane", socket_frame=carried, location=(0, -0.6, 0), orientation=(0.1, 0.2, -1.4)
    )
    model.add(plane)
    for number, (frame, hardness) in enumerate(
        (("/bodyset/b1/f1", 1e4), ("/bodyset/b2", 1e5), ("/bodyset/b2/f2", 1e3))
    ):
        egg = ContactEllipsoid(
            name=f"egg{number}",
            socket_frame=frame,
            location=(0.1, 0.0, -0.1),
            orientation=(0.5, -0.3, 0.7 * number),
            radii=(0.2, 0.5 + 0.2 * number, 0.9),
        )
        model.add(egg)
        force = HuntCrossleyForce(name=f"contact{number}", transition_velocity=0.1)
        for surface, stiffness in ((egg, hardness), (plane, 1e4)):
            force.contact_parameters.objects.append(
                HuntCrossleyForce.ContactParameters(
                    geometry=(surface,),
                    stiffness=stiffness,
                    dissipation=0.3,
                    static_friction=0.8,
                    dynamic_friction=0.4,
                    viscous_friction=0.2,
                )
            )
        model.add(force)
    # Some of the surfaces touch the plane in the test states, others do not.
    assert 0 < compare(model, tmp_path) < STATES * 3 * 12


def test_stations_on_the_floor(model, tmp_path):
    for number, frame in enumerate(("/bodyset/b0", "/bodyset/b1/f1", "/bodyset/b2", "/ground")):
        station = Station(
            name=f"s{number}", socket_parent_frame=frame, location=(0.1, -0.2 * number, 0.3)
        )
        model.subcomponents.append(station)
        model.add(
            MeyerFregly2016Force(
                name=f"contact{number}",
                socket_station=f"/s{number}",
                stiffness=2000.0,
                dissipation=0.3,
                dynamic_friction=0.6,
                viscous_friction=0.4,
                spring_resting_length=0.02,
            )
        )
    assert compare(model, tmp_path) > 0
