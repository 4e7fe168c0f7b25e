"""Translation to MJCF, MuJoCo's model format.

A translation is a list of passes over a `Draft` (in `export`). Each pass adds the elements of one
kind of component to the draft and accounts for these components in the draft's fidelity. Components
that no pass accounts for are recorded as left out at the end. A new kind needs one function in a
module of its own and one entry in the list.

The draft gives a pass: elements of bodies by index (`bodies`), the joint of a coordinate (`leads`),
frames of sockets (`find_placement`), unused names (`make_name`), sites (`add_site`), components
that no pass has accounted for (`iterate_components`), and tendons of paths by their owners
(`tendons`).

A path is sampled in random poses (`poses`) and becomes the nearest tendon (`routes`, `surfaces`,
`fits`), which is measured with MuJoCo's formulas (`tendons`, `wrapping`) and written (`paths`).
Muscles and springs act on tendons (`muscles`, `path_forces`).
"""
