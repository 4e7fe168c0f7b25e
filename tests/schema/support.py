"""Models, data and comparisons that several test modules of this package share."""

from __future__ import annotations

UNREGISTERED = {
    "APDMDataReaderSettings",
    "MocoConstraintInfo",
    "MocoControlTrackingGoalReference",
    "MocoStepTimeAsymmetryGoalGroup",
    "Set_FunctionBasedPath_",
}
"""What OpenSim writes, or reads where it knows beforehand what it will be, and finds by no tag."""
