"""One instruction of a conversation, and what it means after all that was said about it."""

from dataclasses import dataclass, field, replace

from services.grounding.questions import Question
from services.grounding.symbols import ROBOT, UNKNOWN
from services.grounding.understanding import Annotation, Intent, Understanding


@dataclass(frozen=True)
class Meaning:
    """What an utterance means after all that was said before, and what is to be asked about it."""

    instruction_id: str
    text: str
    """In the words that it was corrected to."""
    understanding: Understanding
    """Joint with other utterances; not understood while a question stands in the way."""
    question: Question | None = None
    revision: int = 0
    revises: str = ""
    """Instruction that the utterance is about: a meaning of that one carries its evidence."""
    viewpoint: str = ""
    """Id of the utterance at whose moment the relations hold, "" for this one."""
    not_meant: tuple[int, ...] = ()
    """Seen things that the person said no to."""


@dataclass
class Talk:
    """One instruction, and what was asked and answered about it."""

    id: str
    text: str
    """In the words that it was corrected to."""
    asked: list[str] = field(default_factory=list[str])
    question: Question | None = None
    """The open one."""
    choices: list[tuple[Intent, bool]] = field(default_factory=list[tuple[Intent, bool]])
    """Readings that the person said yes or no to."""
    revision: int = -1
    """Of the last meaning."""
    intents: tuple[Intent, ...] = ()
    """As last understood, best first."""
    annotations: tuple[Annotation, ...] = ()
    not_meant: set[int] = field(default_factory=set[int])
    """Seen things that the person said no to."""
    is_found: bool = False
    """Whether the person said which of the seen things is meant."""

    @property
    def wanted(self) -> Intent | None:
        """The best reading that has an object."""
        named = (one for one in self.intents if one.object not in (UNKNOWN, ROBOT))
        return next(named, None)


def acts(understanding: Understanding) -> bool:
    """Whether something is to be done, rather than noted."""
    best = understanding.intents[:1]
    return bool(best) and best[0].probability >= understanding.statement_mass


def ask(talk: Talk, question: Question) -> None:
    """Put a question; it counts."""
    talk.question = question
    talk.asked.append(question.text)


def noted_in(instruction_id: str, text: str, about: Meaning) -> Meaning:
    """An utterance that is taken into account in another one's meaning."""
    understood = replace(about.understanding, text=text, understood=True, question=None)
    return Meaning(instruction_id, text, understood, revises=about.instruction_id)
