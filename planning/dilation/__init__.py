"""Grey dilation with a ball, pooling and smoothing of height grids: the kernels behind `planning.surface`."""
