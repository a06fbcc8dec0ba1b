"""The ground floor: frames, radar processing, tracking and voxel maps. Arrays in, arrays out; imports no other floor."""
