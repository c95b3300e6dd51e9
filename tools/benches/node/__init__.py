"""The whisker node: faults, link, skew, processor load."""
