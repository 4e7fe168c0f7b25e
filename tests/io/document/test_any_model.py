"""Check that any model which the schema can express is equal after printing and reading, in every form."""

from __future__ import annotations

import json

import pytest
from hypothesis import HealthCheck, given, settings

import osimlite
from osimlite.io.document.data import from_data, to_json
from osimlite.schema.model import Model
from tests.io.document.strategies import models
from tests.suite import choose

slow = settings(
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    max_examples=choose(60, 150),
)


@slow
@given(models())
@pytest.mark.parametrize("numbers", ["shortest", "opensim"])
def test_printed_and_read_it_is_equal(numbers: str, model: Model) -> None:
    text = osimlite.to_text(model, numbers=numbers)  # type: ignore[arg-type]
    again = osimlite.read_text(text)
    assert again == model
    assert osimlite.to_text(again, numbers=numbers) == text  # type: ignore[arg-type]


@slow
@given(models())
def test_as_data_it_is_equal(model: Model) -> None:
    again = from_data(json.loads(to_json(model)))
    assert again == model
    assert osimlite.to_text(again) == osimlite.to_text(model)
