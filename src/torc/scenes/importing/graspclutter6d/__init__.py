"""GraspClutter6D as it lies on disk, to objects and their poses on our table. See docs/graspclutter6d.md."""
