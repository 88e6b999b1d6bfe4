"""What can go wrong, as exceptions whose text is the one line that the program says."""


class AsidError(RuntimeError):
    """The work failed: exit status 1 of the program."""


class UsageError(AsidError, ValueError):
    """The call was wrong, and the line says what to give instead: exit status 2 of the program."""
