"""What a run and an implicit method tell each other, at a place in the work vector.

A method is a law that tries one step: from a state y0, behind which its derivative stands, to y1. It is called with the
place as its last argument.
"""

from __future__ import annotations

REACHED, LAST_TIME, NEXT_STEP, ACCEPTED, COUNTED_Q, COUNTED_U = 0, 1, 2, 3, 4, 5
"""Time (s) at the start of the step, and at its end if it was taken; time that it may reach at most; step to try, and
to try next; what its error may be, see `error_norm`."""
EVALUATED, HAS_DERIVATIVE = 6, 7
"""How many evaluations it took; whether the derivative at the end was put behind y1."""
MEMORY = 8
"""From here on a method keeps what it likes from step to step; it begins anew where the first of that is 0."""
