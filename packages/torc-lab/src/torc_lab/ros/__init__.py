"""Arms that ROS drives: FollowJointTrajectory, by rosbridge."""
