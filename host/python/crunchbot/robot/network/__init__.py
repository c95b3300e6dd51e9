"""What the processes of a robot say to each other over zenoh: typed messages, each judged before it is used."""
