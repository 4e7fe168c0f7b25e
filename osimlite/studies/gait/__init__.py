"""Walking: steps and falls, the step map with its fixed points and their stability, basins of attraction."""
