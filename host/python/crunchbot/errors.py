"""What a person can mend, as one line. Imported by everything, so it imports nothing."""


class UserError(Exception):
    """Its text is one line: file, ring, device or option; what is wrong; the remedy. The command line prints it."""

    exit_code = 2  # arguments, or the structure of a file; 1 in subclasses: what was asked could not be done
