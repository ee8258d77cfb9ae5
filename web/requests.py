"""What people do on the page, on its way from the browser's threads to the node."""

from dataclasses import dataclass
from queue import Empty, SimpleQueue

from schemas import topics
from schemas.language import Answer, Instruction
from schemas.motion import StopLatch
from schemas.task import CancelRequest
from schemas.topics import Output

LONGEST_INSTRUCTION = 400
"""Longer texts are no instructions but accidents of the clipboard."""
_stop_words = frozenset({"stop", "halt"})


@dataclass(frozen=True)
class Say:
    """Somebody typed an instruction."""

    text: str
    client: int


@dataclass(frozen=True)
class Reply:
    """Somebody answered the open question of an instruction."""

    text: str
    instruction_id: str
    client: int


@dataclass(frozen=True)
class Stop:
    """Somebody pressed STOP."""

    client: int


@dataclass(frozen=True)
class Release:
    """Somebody allows motion again."""

    client: int


@dataclass(frozen=True)
class Cancel:
    """Somebody drops the instruction."""

    client: int


Wish = Say | Reply | Stop | Release | Cancel


class Inbox:
    """Filled by the browser's threads, emptied by the node; never blocks either."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Wish] = SimpleQueue()

    def put(self, wish: Wish) -> None:
        """Called from any thread."""
        self._queue.put(wish)

    def drain(self) -> list[Wish]:
        """All that came since the last call, in order."""
        wishes: list[Wish] = []
        while True:
            try:
                wishes.append(self._queue.get_nowait())
            except Empty:
                return wishes


def message_for(wish: Wish, stamp_ns: int) -> Output | None:
    """The message that a wish becomes; None for a text that is empty or too long.

    "stop" typed alone never reaches the language model: stopping must not depend on it.
    """
    source = f"web:{wish.client}"
    match wish:
        case Stop():
            return topics.STOP.of(StopLatch(stamp_ns=stamp_ns, stopped=True, source=source))
        case Release():
            return topics.STOP.of(StopLatch(stamp_ns=stamp_ns, stopped=False, source=source))
        case Cancel():
            return topics.CANCEL.of(CancelRequest(stamp_ns=stamp_ns, source=source))
        case Say():
            return _said(wish, stamp_ns, source)
        case Reply():
            return _replied(wish, stamp_ns, source)


def means_stop(text: str) -> bool:
    """Whether a typed text is the command to stop."""
    return text.strip().strip("!. ").lower() in _stop_words


def _said(say: Say, stamp_ns: int, source: str) -> Output | None:
    text = say.text.strip()
    if means_stop(text):
        return message_for(Stop(say.client), stamp_ns)
    if not text or len(text) > LONGEST_INSTRUCTION:
        return None
    instruction = Instruction(stamp_ns=stamp_ns, id=f"web-{stamp_ns}", text=text, source=source)
    return topics.INSTRUCTION.of(instruction)


def _replied(reply: Reply, stamp_ns: int, source: str) -> Output:
    if means_stop(reply.text):
        return topics.STOP.of(StopLatch(stamp_ns=stamp_ns, stopped=True, source=source))
    return topics.ANSWER.of(
        Answer(
            stamp_ns=stamp_ns,
            instruction_id=reply.instruction_id,
            text=reply.text,
            source=source,
        )
    )
