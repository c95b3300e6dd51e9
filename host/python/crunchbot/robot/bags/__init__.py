"""Bags: what a robot's processes say, in files; and the rows in those, and in bags of others."""
