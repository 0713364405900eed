"""What the arm may not touch: surface and unknown voxels, table, bin and the robot itself; batched checks."""
