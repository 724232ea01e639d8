"""The ROS 2 nodes, one thin file each; the logic is in core."""
