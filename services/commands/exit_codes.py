"""Exit codes of the contract for the ends an instruction can have."""

from schemas.task import Failure, InstructionStatus, TaskState

DONE, FAULT, NOT_UNDERSTOOD, WITHOUT_SUCCESS = 0, 1, 3, 4


def of_status(status: InstructionStatus | None) -> int:
    """Exit code for how an instruction ended; None is an instruction nobody answered."""
    if status is None:
        return WITHOUT_SUCCESS
    if status.state is TaskState.SUCCEEDED:
        return DONE
    return NOT_UNDERSTOOD if status.failure is Failure.NOT_UNDERSTOOD else WITHOUT_SUCCESS
