"""Sparse occupancy maps by OctoMap's rules, in hashed blocks of 8 x 8 x 8 voxels."""

from mapping.voxels.map import Changes, VoxelMap
from mapping.voxels.marks import MAX_RANGE_VOXELS

__all__ = ["MAX_RANGE_VOXELS", "Changes", "VoxelMap"]
