"""Why the arm will not do something, told before it moves."""

from schemas.task import HandlingFailure


class RefusalError(Exception):
    """The arm will not do it; the text says why, with what was given and what is allowed.

    Args:
        failure: the kind of reason.
        reason: one sentence.
    """

    def __init__(self, failure: HandlingFailure, reason: str) -> None:
        super().__init__(reason)
        self.failure = failure
        self.reason = reason
