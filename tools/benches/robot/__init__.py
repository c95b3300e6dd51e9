"""The whole robot: levels of simulation, half an hour, odometry, latency, instructions, navigators begun anew."""
