"""docs/results.md."""
