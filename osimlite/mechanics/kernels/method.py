"""What a run and its method tell each other, at a place in the work vector.

A method is a law that tries one step: from a state y0, behind which its derivative stands, to y1.
It is called with the place as its last argument, and leaves the errors of the step at ERRORS. Its
module says how many numbers and states it needs there (HEAD, STATES), and whether derivatives of
the forces too (IS_IMPLICIT), for which there is room behind.
"""

from __future__ import annotations

LAST_TIME, ACCEPTED, COUNTED_Q, COUNTED_U, SHORTEST, LONGEST = 0, 1, 2, 3, 4, 5
"""What does not change: time that may be reached at most (s); what the error of a step may be, and
what the sums of the squared errors of values and of speeds are divided by, see `error_norm`; bounds
of Merson's steps (s), of which the shortest is taken whatever its error.
"""
REACHED, NEXT_STEP = 6, 7
"""Time (s) at the start of the step, and at its end if it was taken; step to try, and to try next."""
EVALUATED, HAS_DERIVATIVE = 8, 9
"""How many evaluations it took; whether the derivative at the end was put behind y1."""
IS_EVALUATED = 10
"""Whether the last evaluation was that of the start of the step."""
MEMORY = 11
"""From here on a method keeps what it likes from step to step; it begins anew where the first of that is 0."""

ERRORS = 4
"""Place of the errors, in states after WORK_STATE."""
