"""Where to touch next: actions by the entropy that they are expected to cut per second, over a belief of poses and a map.

`places` says what whiskers would meet, `actions` where an action leads, `information` what its readings would tell, `planner`
which action is best, and `choices` puts that, and simpler policies, in the place of the pilot's random turns. `coverage` says
which way over a map sweeps most new floor a second, `tiles` what windows say of a tile, and `tasks` drives by both.
"""
