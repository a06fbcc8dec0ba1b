"""Sparse occupancy maps by OctoMap's rules, in hashed blocks of 8 x 8 x 8 voxels."""
