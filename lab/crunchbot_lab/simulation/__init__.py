"""The simulated robot: the simulated bridge's faults and courses (`bridge`) and scenes to put it in (`scenes`)."""
