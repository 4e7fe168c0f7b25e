"""Data that several test modules of this folder share."""

from __future__ import annotations

UNREGISTERED = {
    "APDMDataReaderSettings",
    "MocoConstraintInfo",
    "MocoControlTrackingGoalReference",
    "MocoStepTimeAsymmetryGoalGroup",
    "Set_FunctionBasedPath_",
}
"""Classes that OpenSim writes, or reads where their type is known, but does not find by their tag."""
