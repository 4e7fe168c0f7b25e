"""Tests of packed records, which are written by the names of their fields."""

from __future__ import annotations

import pytest

from osimlite.mechanics.kernels.layout import CONSTRAINED, ITEM, MODEL, OPERATION, RESPONSE


def test_a_record_is_in_the_order_of_its_declaration():
    assert RESPONSE.record(SENSE=-1, STATES=2, FIRST_STATE=7, ITEM=40, KERNEL=0) == [
        0,
        40,
        7,
        2,
        -1,
    ]
    assert ITEM.record(FIRST_CONTACT=4, RECORD=3, NUMBERS=2, LAW=1) == [1, 2, 3, 4]


def test_fields_beside_the_offsets_are_none():
    with pytest.raises(TypeError, match="OPERATION has the fields MOTION, BEFORE, DOF, FUNCTION"):
        OPERATION.record(SINGLE=1)


@pytest.mark.parametrize("wrong", [{"LAW": 1}, {"LAW": 1, "NUMBERS": 2, "RECORD": 3, "CONTACT": 4}])
def test_a_missing_or_another_field_is_refused(wrong):
    with pytest.raises(
        TypeError, match=r"ITEM has the fields LAW, NUMBERS, RECORD, FIRST_CONTACT; got LAW"
    ):
        ITEM.record(**wrong)


def test_offsets_follow_the_declaration():
    assert (MODEL.LINKS, MODEL.RUN_AT + 1, CONSTRAINED.MINIMUM_NORM + 1) == (
        0,
        MODEL.LAWS,
        CONSTRAINED.SIZE,
    )
