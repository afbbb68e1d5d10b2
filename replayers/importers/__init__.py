"""Bags of other stacks as logs of ours: ROS 1 and ROS 2, by rosbags, no ROS needed."""
