"""The robot in ROS 2's standard messages, by REP 105: what general tools draw without knowing this project."""
