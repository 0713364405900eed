"""Plan 6-DoF parallel-jaw grasps on partial clouds: candidates, hard checks, features, score, validity."""
