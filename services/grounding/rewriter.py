"""Sentences the parser cannot complete, said again in words it knows by a language model.

Off unless a person names a server. The server may only rewrite: what it answers is parsed and
grounded like any other sentence, and what the grounding finds improbable is thrown away.
"""

import threading
import urllib.request
from collections.abc import Sequence
from dataclasses import dataclass, replace
from http.client import HTTPException

import msgspec
from msgspec import Struct

from schemas.errors import UserError
from services.grounding.model import GroundingModel
from services.grounding.understanding import Understanding

TIMEOUT_S = 10.0
"""For the whole answer, however slowly it arrives."""
MAX_BYTES = 100_000
MAX_LETTERS = 300
REFUSAL = "NONE"

_prompt = """You rewrite what a person says to a robot into one short English sentence.
Use only these words, and small words such as "the", "to", "is", "there":
{words}
Patterns: "go to the A", "go to the A behind the B", "go to the A nearest to the B",
"there is a A in front of the B".
Keep the meaning. Add nothing. Never swap a thing the robot has no word for with another thing:
where that would be needed, or where the meaning is lost, answer {refusal} alone.
Answer with the sentence alone."""


class RewriterError(UserError):
    """The address of the server cannot be used."""


class _Message(Struct):
    content: str | None = None


class _Choice(Struct):
    message: _Message


class _Reply(Struct):
    choices: list[_Choice]


@dataclass(frozen=True)
class Rewrite:
    """What came of one attempt."""

    text: str | None
    """The sentence in known words, None if there is none."""
    reason: str
    """Why there is none, or that it was not taken; "" if it was."""


@dataclass(frozen=True)
class Rewriter:
    """A server that speaks the chat-completions protocol."""

    address: str
    """Base address, such as http://127.0.0.1:8080/v1."""
    model: str = "default"
    timeout_s: float = TIMEOUT_S

    def __post_init__(self) -> None:
        if not self.address.startswith(("http://", "https://")):
            raise RewriterError(f"rewriter {self.address!r}; allowed: http://... or https://...")

    def rewrite(self, text: str, words: Sequence[str]) -> Rewrite:
        """Asks for a sentence in known words; whatever the server does, there is an answer.

        Args:
            text: what was said.
            words: lines that tell what can be said.
        """
        found = [Rewrite(None, f"no answer within {self.timeout_s:g} s")]

        def attempt() -> None:
            found.append(self._attempt(text, words))

        # A socket's timeout is for every single read: a server that drips would hold us for ever.
        thread = threading.Thread(target=attempt, daemon=True)
        thread.start()
        thread.join(self.timeout_s)
        return found[-1]

    def _attempt(self, text: str, words: Sequence[str]) -> Rewrite:
        try:
            reply = msgspec.json.decode(self._post(text, words), type=_Reply)
        except (OSError, HTTPException, ValueError, msgspec.MsgspecError) as error:
            return Rewrite(
                None, f"no usable answer ({type(error).__name__}: {error})"[:MAX_LETTERS]
            )
        return _sentence(reply.choices[0].message.content if reply.choices else None)

    def _post(self, text: str, words: Sequence[str]) -> bytes:
        body = {
            "model": self.model,
            "temperature": 0,
            "seed": 0,
            "max_tokens": 80,
            "messages": [
                {
                    "role": "system",
                    "content": _prompt.format(words="\n".join(words), refusal=REFUSAL),
                },
                {"role": "user", "content": text[:MAX_LETTERS]},
            ],
        }
        request = urllib.request.Request(
            f"{self.address.rstrip('/')}/chat/completions",
            data=msgspec.json.encode(body),
            headers={"Content-Type": "application/json"},
        )
        # No proxy from the environment: what is said goes to the named server and nowhere else.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(request, timeout=self.timeout_s) as response:
            return response.read(MAX_BYTES)


def _sentence(content: str | None) -> Rewrite:
    lines = [line.strip(" \t\"'`*") for line in (content or "").splitlines()]
    text = next((line for line in lines if line), "")
    if not text or text.upper().startswith(REFUSAL):
        return Rewrite(None, "refused")
    if len(text) > MAX_LETTERS or not text.isprintable():
        return Rewrite(None, "nonsense")
    return Rewrite(text, "")


def needs_rewriting(found: Understanding) -> bool:
    """Whether the parse is partial, or unknown words leave nothing to be done."""
    return found.partial or (bool(found.unknown_words) and not found.understood)


def understand_rewritten(
    model: GroundingModel, rewriter: Rewriter, text: str
) -> tuple[Understanding, Rewrite | None]:
    """Understands a text, by way of the rewriter only where nothing else helps.

    The rewrite counts if the grounding understands all of it, it speaks of every object that the
    text itself was seen to speak of, and its best reading is more probable than the text's own.

    Returns:
        The understanding, and what came of the rewriter; None if it was not asked.
    """
    own = model.understand(text)
    if not needs_rewriting(own):
        return own, None
    rewrite = rewriter.rewrite(text, own.possible)
    if rewrite.text is None:
        return own, rewrite
    other = model.understand(rewrite.text)
    reason = _rejection(own, other)
    if reason:
        return own, Rewrite(rewrite.text, reason)
    # A word that only the server knew may stand for something else: the person is to see it.
    question = f'Do you mean "{rewrite.text}"?' if own.unknown_words else other.question
    return replace(other, text=own.text, question=question), rewrite


def _rejection(own: Understanding, other: Understanding) -> str:
    """Why a rewrite is not taken, "" if it is."""
    if not other.understood or other.partial or other.unknown_words:
        return "the rewrite is not understood either"
    if not _objects(own) <= _objects(other):
        return f"the rewrite leaves out: {', '.join(sorted(_objects(own) - _objects(other)))}"
    if own.understood and _confidence(own) >= _confidence(other):
        return "the rewrite is less probable than the sentence itself"
    return ""


def _objects(found: Understanding) -> set[str]:
    return set(found.annotations[0].objects) if found.annotations else set()


def _confidence(found: Understanding) -> float:
    return found.annotations[0].probability if found.annotations else 0.0
