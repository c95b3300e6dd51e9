"""Whiskered robots from Python: the wire format, the shared ring, recordings, tactile perception and localisation."""

__version__ = "0.1.0"
