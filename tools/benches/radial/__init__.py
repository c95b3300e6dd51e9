"""Radial distance: the paper's line, curves, presses."""
