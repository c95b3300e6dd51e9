"""Netbook and desktop of one robot: typed messages over zenoh, the navigator, the Pyro5 facade, the robot's bag.

Messages are those of crunchbot/msgs (crunchbot.robot.network.messages); docs/remote.md is the reference of topics and options.
"""
