"""Tests of Ctrl-C during the construction of a program, which it ends at any moment, even in CasADi's conversions."""

from __future__ import annotations

import signal
import sys

import pytest

from osimlite.derivatives.symbols import casadi
from osimlite.moco import build_problem
from osimlite.optimal.program import Program
from tests.optimal.studies import study_file

CONVERSIONS = "DM_from_array", "size1"
"""Python functions that CasADi calls when it converts arguments, and whose errors it discards."""


@pytest.mark.parametrize("name", CONVERSIONS)
@pytest.mark.parametrize("moment", [1, 5, 13, 34])
def test_an_interrupt_is_not_lost_in_casadi(name, moment, tmp_path):
    path = study_file(tmp_path, "pendulum-50")
    count = 0

    def interrupt(frame, event, _):
        nonlocal count
        code = frame.f_code
        if (event, code.co_name, code.co_filename) == ("call", name, casadi.casadi.__file__):
            count += 1
            if count == moment:
                sys.setprofile(None)
                signal.raise_signal(signal.SIGINT)

    sys.setprofile(interrupt)
    try:
        with pytest.raises(KeyboardInterrupt):
            Program(build_problem(path))
    finally:
        sys.setprofile(None)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
