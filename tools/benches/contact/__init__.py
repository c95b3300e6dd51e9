"""The contact filter against simulated and chained whiskers."""
