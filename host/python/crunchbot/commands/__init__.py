"""The subcommands of `whisker`, a module each, imported when it is called.

A module has `EXAMPLE`, a command line that works, and `add(parser)`, which adds its arguments and sets `run`, a function
of the parsed arguments that returns the exit code.
"""
