"""Radial distance: the paper's line, curves, whole whisks."""
