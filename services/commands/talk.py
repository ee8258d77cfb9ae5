"""Verbs that speak to a running system."""

import sys
from typing import TYPE_CHECKING, Annotated

import tyro

from schemas import topics
from schemas.codec import as_builtins
from schemas.errors import InternalFaultError, UserError
from schemas.language import Annotations
from schemas.task import InstructionStatus, TaskState
from services.commands import exit_codes
from services.commands.output import print_json
from services.commands.output import say as tell
from services.commands.where import HERE, System, Where

if TYPE_CHECKING:
    from services.runtime.client import Subscription

_understanding_timeout_s = 3.0
"""So long `say` waits to show how it was understood [s]."""
_last_values_s = 0.2
"""Last values of state topics are there at once; silence of this length means that is all [s]."""


class NoReplyError(InternalFaultError):
    """The system did not take an answer up."""


def say(
    text: Annotated[str, tyro.conf.Positional],
    wait: bool = False,
    timeout: float = 300.0,
    json: bool = False,
    system: System = HERE,
    rewriter: str | None = None,
    rewriter_model: str = "default",
) -> int:
    """Send an instruction and show how it was understood.

    A question that has to be answered first is put at once where a person types; elsewhere it
    ends the verb, and 'incognita answer' goes on.

    Args:
        text: what to do, in English.
        wait: follow progress to the end.
        timeout: how long to follow [s].
        json: one JSON document on stdout.
        system: which one.
        rewriter: address of an OpenAI-compatible server, http://127.0.0.1:8080/v1, that is asked
            to say again in known words what the parser cannot complete; by default none is.
        rewriter_model: the model's name on that server.
    """
    from services.runtime.client import follow_instruction

    understood: list[Annotations] = []

    def progress(message: Annotations | InstructionStatus) -> bool:
        tell(describe(message))
        if not isinstance(message, Annotations):
            return False
        understood.append(message)
        if not needs_answer(message):
            return False
        if not (wait and _person_types()):
            return True
        client.answer(input("answer: "), message.instruction_id)
        return False

    with system.client() as client:
        subscription = client.watch(topics.ANNOTATIONS, topics.INSTRUCTION_STATUS)
        if rewriter is not None:
            text = in_known_words(text, client.info.run.robot, rewriter, rewriter_model)
        sent = client.say(text)
        limit = timeout if wait else _understanding_timeout_s
        status = follow_instruction(subscription, sent.id, limit, progress)
    newest = understood[-1] if understood else None
    if newest and not newest.understood and (needs_answer(newest) or not wait):
        if json:
            print_json(as_builtins(newest))
        return exit_codes.NOT_UNDERSTOOD
    if json:
        shown = status if wait else newest
        unknown = {"instruction_id": sent.id} | ({"state": "timeout"} if wait else {})
        print_json(as_builtins(shown) if shown else unknown)
    return exit_codes.of_status(status) if wait else exit_codes.DONE


def in_known_words(text: str, robot: str, address: str, name: str) -> str:
    """The text, or what a rewriter made of it; here, because a node opens no socket.

    A rewrite that put a known word for an unknown one goes out only if a person agrees.
    """
    from services.grounding.model import GroundingModel
    from services.grounding.rewriter import Rewriter, understand_rewritten

    found, rewrite = understand_rewritten(GroundingModel.load(robot), Rewriter(address, name), text)
    if rewrite is None or rewrite.text is None or rewrite.reason:
        return text
    if found.question is not None and not _agreed(found.question):
        return text
    tell(f"rewritten: {rewrite.text}")
    return rewrite.text


def _agreed(question: str) -> bool:
    if _person_types():
        return input(f"{question} [y/N] ").strip().lower() in ("y", "yes")
    tell(f"{question} Say it so if you do")
    return False


def answer(
    text: Annotated[str, tyro.conf.Positional],
    timeout: float = 10.0,
    json: bool = False,
    system: System = HERE,
) -> int:
    """Answer the question that is open, and show what is understood then.

    Args:
        text: the answer: an option, yes or no, a place, or the instruction in other words.
        timeout: how long to wait for the system to take it up [s].
        json: one JSON document on stdout.
        system: which one.
    """
    from services.runtime.client import follow_instruction

    understood: list[Annotations] = []

    with system.client() as client:
        subscription = client.watch(topics.ANNOTATIONS, topics.INSTRUCTION_STATUS)
        asked = _open_question(subscription)

        def progress(message: Annotations | InstructionStatus) -> bool:
            if not isinstance(message, Annotations) or message.revision <= asked.revision:
                return False
            understood.append(message)
            return True

        client.answer(text, asked.instruction_id)
        follow_instruction(subscription, asked.instruction_id, timeout, progress)
    if not understood:
        raise NoReplyError(
            f"nobody took up the answer within {timeout:g} s; see 'incognita status'"
        )
    tell(describe(understood[0]))
    if json:
        print_json(as_builtins(understood[0]))
    return exit_codes.DONE if understood[0].understood else exit_codes.NOT_UNDERSTOOD


def needs_answer(message: Annotations) -> bool:
    """Whether nothing is done before a question is answered."""
    return not message.understood and bool(message.question and message.options)


def _open_question(subscription: "Subscription") -> Annotations:
    """The newest annotations, if they ask and their instruction has not ended."""
    asked: Annotations | None = None
    ended = ""
    for _, message in subscription.messages(_last_values_s):
        if isinstance(message, Annotations):
            asked = message
        elif isinstance(message, InstructionStatus) and message.state is not TaskState.ACTIVE:
            ended = message.instruction_id
    if asked is None or not asked.question or asked.instruction_id == ended:
        raise UserError(
            "no question is open; send an instruction with 'incognita say', or what else you know"
        )
    return asked


def _person_types() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()


def describe(message: Annotations | InstructionStatus) -> str:
    """One line for a person."""
    if isinstance(message, InstructionStatus):
        return f"{message.state}: {message.reason}"
    if needs_answer(message):
        return f"{message.question} ({' / '.join(message.options)})"
    if not message.understood:
        words = ", ".join(message.unknown_words) or "nothing to do"
        possible = "; ".join(message.possible)
        return f"not understood: {words}. Possible: {possible}"
    if not message.behaviors:
        return "noted"
    tail = f". {message.question}" if message.question else ""
    return f"understood: {_wanted(message)}{tail}"


def _wanted(message: Annotations) -> str:
    best = message.behaviors[0]
    relation = "nearest to" if best.comparative else best.relation
    tail = f" ({relation} {best.landmark})" if best.landmark not in ("", "unknown") else ""
    return f"{best.action} to {best.object}{tail}, {best.probability:.2f}"


def cancel(system: System = HERE) -> int:
    """Drop the instruction; the robot stays where it is.

    Args:
        system: which one.
    """
    with system.client() as client:
        client.cancel()
    tell("cancelled")
    return exit_codes.DONE


def stop(system: System = HERE) -> int:
    """Stop all motion until 'incognita resume'.

    Args:
        system: which one.
    """
    return _latch(system, True, "stopped; release with 'incognita resume'")


def resume(system: System = HERE) -> int:
    """Release the stop.

    Args:
        system: which one.
    """
    return _latch(system, False, "released")


def _latch(system: Where, stopped: bool, text: str) -> int:
    with system.client() as client:
        client.latch_stop(stopped)
    tell(text)
    return exit_codes.DONE
