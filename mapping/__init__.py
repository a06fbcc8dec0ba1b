"""The ground floor: frames, radar processing, tracking, voxel maps. Arrays in, arrays out; imports no other floor."""
