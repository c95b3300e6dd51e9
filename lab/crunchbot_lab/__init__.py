"""The laboratory of crunchbot: what stands in for hardware and world, and what measures the whole robot.

`signals` (the world without bits), `simulation` (the simulated bridge), `scenes` (level 0), `report`, `demo`.
"""
