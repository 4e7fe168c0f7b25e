"""Many simulations of one model: sweeps over its numbers and its start, and the search for the best of them."""
