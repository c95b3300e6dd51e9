"""What is measured: a room per part of the project, one front (__main__.py)."""
