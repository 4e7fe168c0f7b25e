"""Tests of former names: they warn, name the present one, and do the same."""

from __future__ import annotations

import pytest

from osimlite.base.deprecation import make_deprecated_method, make_deprecated_property
from osimlite.errors import DeprecatedWarning


class Thermometer:
    def __init__(self, celsius: float) -> None:
        self.celsius = celsius

    def convert_to_kelvin(self, offset: float = 273.15) -> float:
        return self.celsius + offset

    kelvin = make_deprecated_method("convert_to_kelvin")
    degrees = make_deprecated_property("celsius")


def test_a_former_name_of_a_method_warns_and_calls_it():
    with pytest.warns(DeprecatedWarning, match="use convert_to_kelvin") as caught:
        assert Thermometer(20.0).kelvin(offset=273.0) == 293.0
    assert caught[0].filename == __file__


def test_a_former_name_of_a_property_warns_and_returns_it():
    with pytest.warns(DeprecatedWarning, match="use celsius") as caught:
        assert Thermometer(20.0).degrees == 20.0
    assert caught[0].filename == __file__
