"""Where a path along geodesics runs: each of these is shot anew, in the direction of the line before it."""

from __future__ import annotations

from osimlite.simulation.kernels.cable_paths import GEODESIC
from osimlite.simulation.kernels.cable_surfaces import ALONG_BENDS, END, POINT, START, STEP, shoot
from osimlite.simulation.kernels.geodesic_paths import CHAIN, PLACES, POSE_NUMBERS, POSES, SEARCH, WRAP_INTS
from osimlite.simulation.kernels.geodesic_starts import SURFACE
from osimlite.simulation.kernels.layout import NUMBERS, RECORD
from osimlite.simulation.kernels.path_wraps import in_ground, in_surface
from osimlite.simulation.kernels.paths import ALONG, COUNT, NODE_INTS, NODE_WORK, NODES_AT, ORDER, PLACE, POINTS, WRAPS
from osimlite.simulation.kernels.paths import SURFACE as SURFACE_LENGTH
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.vectors import dot, put, turned_back, vector
from osimlite.simulation.kernels.wrap_curves import pieces


def trace_geodesics(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, item: int) -> int:
    """Write all corners of a path that was measured into f, in ground; returns how many there are."""
    i, p, found = at(s, item), at(x, s[item + NUMBERS]), at(w, s[item + RECORD])
    points, wraps = i[POINTS], at(i, NODES_AT + NODE_INTS * (i[POINTS] + 2 * i[WRAPS]))
    order, work = at(found, ORDER), at(found, ORDER + points + 2 * i[WRAPS])
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    geodesic, room = at(found, slots[CHAIN] + GEODESIC), at(found, slots[SEARCH])
    geodesic[STEP] = 0.0
    count = 0
    for k in range(int(found[COUNT])):
        number = int(order[k])
        here = at(work, NODE_WORK * number)
        put(f, 3 * count, vector(here, PLACE))
        count += 1
        wrap = (number - points) // 2
        if number >= points and number == points + 2 * wrap:
            surface, pose = (
                at(p, wraps[WRAP_INTS * wrap + PLACES] + SURFACE),
                at(found, slots[POSES] + POSE_NUMBERS * wrap),
            )
            point = in_surface(pose, vector(here, PLACE))
            way = turned_back(pose, vector(work, NODE_WORK * int(order[k - 1]) + ALONG))
            length = here[NODE_WORK + SURFACE_LENGTH]
            if dot(way, way) > 0.0 and shoot(surface, point, way, length, geodesic, room):
                bends = max(abs(geodesic[START + ALONG_BENDS]), abs(geodesic[END + ALONG_BENDS]))
                parts = pieces(bends * length)
                for part in range(1, parts):
                    shoot(surface, point, way, length * part / parts, geodesic, room)
                    put(f, 3 * count, in_ground(pose, vector(geodesic, END + POINT)))
                    count += 1
    return count
