"""Rows of observations to poses: the filters of host/nav, what runs them over a scene (`localise`), and how good that is (`scoring`)."""
