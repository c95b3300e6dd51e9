"""The robot that is not there: the simulated bridge's programs and faults (`bridge`), its wheels (`link`), scenes to put it in
(`scenes`), and, from a source tree, the world's signals without bits (`world`)."""
