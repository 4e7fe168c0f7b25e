"""The mechanics of mechanisms in numpy, by other formulas than the kernels': what these are checked by."""
