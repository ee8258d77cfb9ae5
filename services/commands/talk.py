"""Verbs that speak to a running system."""

from typing import Annotated

import tyro

from schemas import topics
from schemas.codec import as_builtins
from schemas.language import Annotations
from schemas.task import InstructionStatus
from services.commands import exit_codes
from services.commands.output import print_json
from services.commands.output import say as tell


def say(
    text: Annotated[str, tyro.conf.Positional],
    wait: bool = False,
    timeout: float = 300.0,
    json: bool = False,
    realm: str = "default",
) -> int:
    """Send an instruction and show how it was understood.

    Args:
        text: what to do, in English.
        wait: follow progress to the end.
        timeout: how long to follow [s].
        json: one JSON document on stdout.
        realm: of the running system.
    """
    from services.runtime.client import Client, follow_instruction

    understood: list[Annotations] = []

    def progress(message: Annotations | InstructionStatus) -> None:
        if isinstance(message, Annotations):
            understood.append(message)
        tell(describe(message))

    with Client(realm) as client:
        subscription = client.watch(topics.ANNOTATIONS, topics.INSTRUCTION_STATUS)
        sent = client.say(text)
        if wait:
            status = follow_instruction(subscription, sent.id, timeout, progress)
            answer = (
                as_builtins(status) if status else {"instruction_id": sent.id, "state": "timeout"}
            )
            if json:
                print_json(answer)
            return exit_codes.of_status(status)
        status = follow_instruction(subscription, sent.id, 3.0, progress)
    if json:
        print_json(as_builtins(understood[0]) if understood else {"instruction_id": sent.id})
    if understood and not understood[0].understood:
        return exit_codes.NOT_UNDERSTOOD
    return exit_codes.DONE


def describe(message: Annotations | InstructionStatus) -> str:
    """One line for a person."""
    if isinstance(message, InstructionStatus):
        return f"{message.state}: {message.reason}"
    if not message.understood:
        words = ", ".join(message.unknown_words) or "nothing to do"
        possible = "; ".join(message.possible)
        return f"not understood: {words}. Possible: {possible}"
    if not message.behaviors:
        return "noted"
    best = message.behaviors[0]
    relation = "nearest to" if best.comparative else best.relation
    tail = f" ({relation} {best.landmark})" if best.landmark not in ("", "unknown") else ""
    return f"understood: {best.action} to {best.object}{tail}, {best.probability:.2f}"


def cancel(realm: str = "default") -> int:
    """Drop the instruction; the robot stays where it is.

    Args:
        realm: of the running system.
    """
    from services.runtime.client import Client

    with Client(realm) as client:
        client.cancel()
    tell("cancelled")
    return exit_codes.DONE


def stop(realm: str = "default") -> int:
    """Stop all motion until 'incognita resume'.

    Args:
        realm: of the running system.
    """
    return _latch(realm, True, "stopped; release with 'incognita resume'")


def resume(realm: str = "default") -> int:
    """Release the stop.

    Args:
        realm: of the running system.
    """
    return _latch(realm, False, "released")


def _latch(realm: str, stopped: bool, text: str) -> int:
    from services.runtime.client import Client

    with Client(realm) as client:
        client.latch_stop(stopped)
    tell(text)
    return exit_codes.DONE
