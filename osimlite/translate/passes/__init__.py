"""Passes: small changes from one neutral robot to another, one per module."""
