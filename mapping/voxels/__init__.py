"""Sparse occupancy maps by OctoMap's rules, in hashed blocks of 8 x 8 x 8 voxels that hold bricks of 2 x 2 x 2."""
