"""Import of ROS 1 and ROS 2 bags of other robot stacks as logs, by rosbags; no ROS is needed."""
