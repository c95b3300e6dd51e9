"""What a robot does about what it feels: `pilot` takes samples and odometry and gives wheel speeds and observation rows.

`behaviour` is its state machine (`states`, and `rules` with their `conditions` and `effects`); `base` and `wheels` are what drives.
"""
