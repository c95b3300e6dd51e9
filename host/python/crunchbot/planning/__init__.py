"""Where to drive in an arena that is not known yet: `coverage` says which way over a map sweeps most new floor a second, and
`mapping` puts that in the place of the pilot's random turns.
"""
