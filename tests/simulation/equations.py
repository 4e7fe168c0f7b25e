"""Equations of motion whose solution is known."""

from __future__ import annotations

import math


def oscillator(t, y):
    """Unit mass on a unit spring: q = cos t from (1, 0)."""
    return [y[1], -y[0]]


def pendulum(t, y):
    return [y[1], -9.81 * math.sin(y[0])]


def cannon(t, y):
    """Quadratic drag: u = tanh t from rest."""
    return [y[1], 1.0 - y[1] * y[1]]


def last(pairs):
    for pair in pairs:
        final = pair
    return final


class Counting:
    """A derivative that remembers how often and where it was called."""

    def __init__(self, f):
        self.f = f
        self.calls = 0
        self.latest = None

    def __call__(self, t, y):
        self.calls += 1
        self.latest = t, list(y)
        return self.f(t, y)
