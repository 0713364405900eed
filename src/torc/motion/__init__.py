"""Plan the motions of a pick: to the pre-grasp, down to the grasp, up again, to the bin and home."""
