"""Tests of the names and ranges of variables, and of their error messages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import SettingError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.actuators import CoordinateActuator
from osimlite.simulation.properties import find_properties
from osimlite.studies.sweep.controls import Control
from osimlite.studies.sweep.variables import (
    FunctionParameter,
    Property,
    Slope,
    Start,
    Variable,
    parse_ranges,
    resolve_variables,
)

MODEL = dynamic_walker()
MECHANISM = build_mechanism(MODEL)
HIP = "/jointset/RightThighToPelvis/RHip_rz"


def one(name, given="0:1", parameters=None):
    return resolve_variables({name: given}, MODEL, MECHANISM, parameters or {})[0]


def test_names():
    assert one("RHip_rz").target == Start((HIP,), False)
    assert one(HIP).target == Start((HIP,), False)
    assert one("RHip_rz/value").target == Start((HIP,), False)
    assert one("RHip_rz/speed").target == Start((HIP,), True)
    assert one(f"{HIP}/speed").target == Start((HIP,), True)
    assert one("?Hip_rz/speed").target == Start((HIP, "/jointset/LeftThighToPelvis/LHip_rz"), True)
    assert one("slope").target == Slope()
    assert one("slope", parameters={"slope": 10.0}).target == FunctionParameter("slope", 10.0)
    (place,) = one("/bodyset/Pelvis/mass_center/1").target.paths
    assert (place.component, place.steps, place.unit) == (
        "/bodyset/Pelvis",
        ("mass_center", 1),
        "m",
    )
    locked = one("platform_rz", "-12deg:-2deg")
    assert isinstance(locked.target, Property) and locked.target.paths[0].steps == (
        "default_value",
    )
    assert locked.low == math.radians(-12)


def test_controls():
    model = dynamic_walker()
    model.add(CoordinateActuator(name="motor", coordinate="RHip_rz"))
    for name in ("motor/control", "/forceset/motor/control"):
        (result,) = resolve_variables({name: "-1:1"}, model, build_mechanism(model))
        assert result.target == Control(("/forceset/motor",))
    with pytest.raises(SettingError, match="'motor' is an actuator: vary 'motor/control', or"):
        resolve_variables({"motor": "0:1"}, model, build_mechanism(model), {})
    with pytest.raises(SettingError, match="did you mean 'motor/control'"):
        resolve_variables({"moter/control": "0:1"}, model, build_mechanism(model))
    with pytest.raises(SettingError, match="are the same quantity; vary one of them"):
        resolve_variables(
            {"motor/control": "0:1", "/forceset/motor/control": "0:1"},
            model,
            build_mechanism(model),
        )


def test_several_numbers_by_one_path():
    result = one("/forceset/*Foot*/contact_parameters/stiffness", "1e5:1e7:3:log")
    assert [place.component for place in result.target.paths] == [
        "/forceset/RFootForce",
        "/forceset/LFootForce",
    ]
    assert (result.low, result.high, result.count, result.is_log) == (1e5, 1e7, 3, True)


def test_every_number_that_is_found_can_be_set_and_read():
    for path, value in {
        "/forceset/RFootForce/contact_parameters/stiffness": 3.5,
        "/forceset/RFootForce/contact_parameters/0/dissipation": 0.25,
        "/forceset/RKneeLimitTorque/upper_limit": 0.1,
        "/contactgeometryset/PlatformContact/orientation/2": -1.5,
        "/bodyset/Pelvis/inertia/0": 7.0,
        "/gravity/0": 1.0,
    }.items():
        model = dynamic_walker()
        (place,) = find_properties(model, path)
        setter = place.make_setter(model)
        setter.set_value(value)
        assert setter.get_value() == value
        assert find_properties(model, path)[0].make_setter(model).get_value() == value
    assert model.gravity == (1.0, -9.80665, 0.0)


def test_units():
    assert one("RHip_rz", "20deg:40deg").high == pytest.approx(math.radians(40), abs=1e-15)
    assert one("Pelvis_tx", "10cm:0.5m").low == 0.1
    assert one("/forceset/RKneeLimitTorque/upper_limit", "5deg:10").low == 5.0
    assert one("/forceset/RKneeLimitTorque/upper_limit", f"0:{math.pi}rad").high == pytest.approx(
        180.0
    )
    for name, text, words in [
        ("RHip_rz", "1m:2m", "is in rad"),
        ("/bodyset/Pelvis/mass", "1deg:2", "is in kg"),
        ("Pelvis_tx", "0:30deg", "is in m"),
    ]:
        with pytest.raises(SettingError, match=words):
            one(name, text)
    with pytest.raises(SettingError, match="plain number"):
        one("slope", "1deg:5deg", {"slope": 10.0})


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("RHip_rx", "RHip_rz"),
        ("RHip_rz/sped", "RHip_rz/speed"),
        ("RHip_rx/speed", "RHip_rz/speed"),
        ("slpe", "slope"),
        ("thigh_lenght", "thigh_length"),
        ("/jointset/RightThigToPelvis/RHip_rz", "/jointset/RightThighToPelvis/RHip_rz"),
        ("/bodyset/Pelvis/mas", "/bodyset/Pelvis/mass"),
        ("/bodyset/Plvis/mass", "/bodyset/Pelvis/mass"),
        (
            "/forceset/RFotForce/contact_parameters/stiffnes",
            "/forceset/RFootForce/contact_parameters/stiffness",
        ),
    ],
)
def test_the_nearest_spelling_is_told(name, near):
    with pytest.raises(SettingError, match=f"did you mean '{near}'"):
        one(name, parameters={"thigh_length": 0.4})


def test_a_path_without_its_slash_is_told():
    with pytest.raises(
        SettingError, match="'bodyset/Pelvis/mass' to vary; did you mean '/bodyset/Pelvis/mass'"
    ):
        one("bodyset/Pelvis/mass")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("1:0", "write the lower end first"),
        ("0:1:0", "at least 1"),
        ("0:1:x", "at least 1"),
        ("0:1:2:3", "takes LOW:HIGH"),
        ("a:1", "not a number"),
        ("0:inf", "not a number"),
        ("0:1:log", "above 0"),
        ("1:1:5", "give one value"),
        ("0:1:1", "one value only"),
        ((0.0, math.nan), "not a number"),
    ],
)
def test_ranges_that_are_none(given, words):
    with pytest.raises(SettingError, match=words):
        one("Pelvis_tx", given)


def test_words_of_the_command_line():
    assert parse_ranges(["a=0:1", " b = 2:3:4 "]) == {"a": "0:1", "b": "2:3:4"}
    for word in ("a", "a=", "=1:2"):
        with pytest.raises(SettingError, match="--vary takes"):
            parse_ranges([word])
    with pytest.raises(SettingError, match="twice"):
        parse_ranges(["a=1:2", "a=2:3"])


def test_the_same_number_is_not_varied_twice():
    with pytest.raises(SettingError, match="same quantity"):
        resolve_variables(
            {"/bodyset/*/mass": "1:2", "/bodyset/Pelvis/mass": "1:2"}, MODEL, MECHANISM
        )
    with pytest.raises(SettingError, match="same quantity"):
        resolve_variables({"RHip_rz": "1:2", HIP: "1:2"}, MODEL, MECHANISM)
    with pytest.raises(SettingError, match="locked"):
        one("platform_rz/speed")


def test_one_value():
    held = one("Pelvis_tx", "0.25")
    assert held.is_fixed and held.count == 1
    assert held.interpolate(np.array([0.0, 0.5, 1.0])).tolist() == [0.25] * 3


@given(st.floats(0.001, 1e6), st.floats(0.001, 1e6), st.booleans(), st.floats(0.0, 1.0))
def test_values_stay_within_and_go_back(a, b, is_log, fraction):
    low, high = min(a, b), max(a, b) + 1.0
    item = Variable("x", Slope(), low, high, None, is_log)
    value = float(item.interpolate(np.array([fraction]))[0])
    assert low <= value <= high
    assert item.compute_fraction(value) == pytest.approx(fraction, abs=1e-7)
    assert item.interpolate(np.array([0.0, 1.0])).tolist() == [low, high]


def test_degrees_taken_for_radians_are_doubted():
    assert (
        "20deg" in one("RHip_rz", "20:40").warning
        and "range of -1.75 to 1.75 rad" in one("RHip_rz", "20:40").warning
    )
    assert (
        "40deg" in one("RHip_rz", "0:40").warning and "20deg" in one("RHip_rz", (20.0, 40)).warning
    )
    for fine in ("20deg:40deg", "0.3:0.6", "-1:5"):
        assert one("RHip_rz", fine).warning == ""
    assert one("RHip_rz/speed", "20:40").warning == "" and one("Pelvis_tx", "20:40").warning == ""


def test_a_unit_stands_at_both_ends():
    with pytest.raises(SettingError, match="20deg:40; write it at both, as in 40deg"):
        one("RHip_rz", "20deg:40")
    assert one("RHip_rz", "0:60deg").high == math.radians(60)
