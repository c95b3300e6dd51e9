"""Whiskered robots from Python: the wire format, the shared ring, tactile perception and localisation."""
