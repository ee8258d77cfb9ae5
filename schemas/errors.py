"""The kinds of errors that end a command with one line instead of a traceback."""


class UserError(ValueError):
    """What was given cannot be used; the text says what is allowed. Exit code 2."""


class MissingComponentError(RuntimeError):
    """This machine lacks something that is needed; the text says what, and how to mend it.

    Exit code 5.
    """


class InternalFaultError(RuntimeError):
    """Something of ours broke for good; the text says what. Exit code 1."""
