"""A running robot as a node of ROS 2, without ROS, by what two implementations of its middleware put on the wire."""

ROUTER = "tcp/localhost:7447"  # where rmw_zenohd listens
LOCALHOST, SUBNET = "localhost", "subnet"  # who finds a node, as ROS_AUTOMATIC_DISCOVERY_RANGE says it in capitals
