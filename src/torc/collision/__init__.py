"""Check collisions in batches: surface and unknown voxels, table, bin and the robot itself."""
