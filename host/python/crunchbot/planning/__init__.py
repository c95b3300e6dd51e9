"""Where to touch next: actions by the entropy that they are expected to cut per second, over a belief of poses and a map.

`places` says what whiskers would meet, `actions` where an action leads, `information` what its readings would tell, `planner`
which action is best, and `choices` puts that, and simpler policies, in the place of the pilot's random turns.
"""
