"""Faults that a user can mend. They reach the terminal as one line; any other fault is ours."""


class UserError(Exception):
    """Something given is missing or wrong; the message names it and says what to do."""
