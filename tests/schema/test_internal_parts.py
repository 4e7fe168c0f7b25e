"""Check the parts that OpenSim creates itself.

They have a path, are in no file, and stay the same objects while their owner exists.
"""

from __future__ import annotations

import pytest

from osimlite.io.document.printer import to_text
from osimlite.schema.contact_forces import MeyerFregly2016Force
from osimlite.schema.frames import Body
from osimlite.schema.markers import Station
from osimlite.schema.model import Model
from osimlite.schema.muscles import Thelen2003Muscle
from osimlite.schema.paths import PathPoint
from osimlite.schema.probe_types import (
    Umberger2010MuscleMetabolicsProbe,
    Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter,
)


@pytest.fixture
def model() -> Model:
    model = Model(name="arm")
    body = model.add(Body(name="upper", mass=1.0))
    muscle = model.add(Thelen2003Muscle(name="biceps"))
    muscle.geometry_path.path_point_set.objects.append(
        PathPoint(name="origin", socket_parent_frame=body)
    )
    return model


def test_they_come_before_what_the_file_holds(model: Model) -> None:
    below = [
        c.path.removeprefix("/forceset/biceps") for c in model.components() if "biceps" in c.path
    ]
    assert below == ["", "/pennMdl", "/actMdl", "/path", "/path/origin", "/path/origin/station"]


def test_a_reference_to_one_outlives_changes_of_the_model(model: Model) -> None:
    station = model.find("/forceset/biceps/path/origin/station")
    assert isinstance(station, Station)
    model.add(MeyerFregly2016Force(name="foot", socket_station=station))
    assert model.find("/forceset/biceps/path/origin/station") is station
    assert "<socket_station>/forceset/biceps/path/origin/station</socket_station>" in to_text(model)
    assert "<Station" not in to_text(model)


def test_their_own_empty_sockets_are_no_references_of_the_model(model: Model) -> None:
    named = [use.value for use in model.tree().uses() if use.spec.tag == "socket_parent_frame"]
    assert named == [model.find("/bodyset/upper")]
    assert model.tree().is_internal(model.find("/forceset/biceps/actMdl"))
    assert not model.tree().is_internal(model.find("/forceset/biceps"))


def test_an_object_that_bears_the_name_of_a_muscle_refers_to_it(model: Model) -> None:
    probe = model.add(Umberger2010MuscleMetabolicsProbe(name="heat"))
    members = probe.metabolic_muscle_parameter_set.objects
    members.append(Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter(name="biceps"))
    members.append(Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter(name="triceps"))
    tree = model.tree()
    result = {use.value: tree.resolve(use) for use in tree.uses() if use.spec.tag == "@name"}
    assert result["biceps"].target is model.find("/forceset/biceps")
    assert result["triceps"].failure == "missing"
