"""What samples of a whisker say: a contact, how far along the whisker it is, which floor a tip sweeps.

Knows no robot that drives and no map; the arithmetic is host/nav/touch in C.
"""
