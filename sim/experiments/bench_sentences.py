"""Held-out sentences with what they mean, and how an understanding is judged against them.

The format is explained at the top of `tests/data/language/husky.txt`. The sentences measure and
nothing is tuned to them, hence what a bench prints of failures is their variety and their cause.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from robots.symbols import SymbolSpace, get_symbols
from schemas.errors import MissingComponentError, UserError
from services.grounding.conformal import ConformalSet, load_conformal
from services.grounding.dialogue import Dialogue
from services.grounding.model import GroundingModel
from services.grounding.understanding import UNKNOWN, Annotation, Intent, Understanding

FOLDER = Path(__file__).resolve().parents[2] / "tests" / "data" / "language"
ANY = "any"
"""A slot of a behavior that the sentence leaves open."""

_COLUMNS = 4
_TURN = ">>"
_VARIETY = re.compile(r"\[(.+)\]")
_CALL = re.compile(r"([\w ]+)\(([\w ]+(?:, *[\w ]+)*)\)")
_WORDS_AFTER = ("quickly", "safely", "comparative")

Relation = tuple[str, str, str]
"""Relation, figure, landmark."""


class HeldOutError(UserError):
    """File, line, what is wrong and what is allowed."""


@dataclass(frozen=True)
class Wanted:
    """What is to be done; `ANY` matches every value."""

    action: str
    object: str
    relation: str
    landmark: str
    mode: str
    comparative: bool


@dataclass(frozen=True)
class Sentence:
    """One sentence, or short conversation, that no training has seen."""

    turns: tuple[str, ...]
    """What is said, one utterance after the other; mostly one."""
    variety: str
    """Kind of construction."""
    objects: tuple[str, ...]
    relations: tuple[Relation, ...]
    behavior: Wanted | None
    """None for a statement, and where the sentence is to be refused."""
    refused: tuple[str, ...]
    """Words that must be named as unknown; with them, nothing else counts."""

    @property
    def text(self) -> str:
        """What is said first."""
        return self.turns[0]


def read_sentences(robot: str, folder: Path = FOLDER) -> tuple[Sentence, ...]:
    """All held-out sentences of one robot.

    Raises:
        MissingComponentError: the checkout's test data are not there.
        HeldOutError: a line is not as the format says.
    """
    path = folder / f"{robot}.txt"
    if not path.exists():
        raise MissingComponentError(f"{path} is missing: run this from a checkout, not a wheel")
    variety, found = "", list[Sentence]()
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        if heading := _VARIETY.fullmatch(line.strip()):
            variety = heading[1]
        else:
            found.append(_sentence(line, variety, f"{path.name}:{number}", get_symbols(robot)))
    return tuple(found)


def _sentence(line: str, variety: str, where: str, space: SymbolSpace) -> Sentence:
    columns = [column.strip() for column in line.split("|")]
    if len(columns) != _COLUMNS:
        raise HeldOutError(
            f"{where}: {len(columns)} columns; allowed: sentence | objects | relations | behavior"
        )
    text, objects, relations, behavior = columns
    refused = behavior.removeprefix("refused ") if behavior.startswith("refused ") else ""
    acts = behavior != "none" and not refused
    names = (*space.object_classes, *space.locations)
    calls = [_call(f"{one})", where) for one in relations.split(")") if one.strip(", ")]
    return Sentence(
        turns=tuple(turn.strip() for turn in text.split(_TURN)),
        variety=variety,
        objects=tuple(sorted(_known(objects, names, where))),
        relations=tuple(sorted(_relation(call, space, where) for call in calls)),
        behavior=_wanted(behavior, space, where) if acts else None,
        refused=tuple(word.strip() for word in refused.split(",") if word.strip()),
    )


def _known(text: str, names: tuple[str, ...], where: str) -> list[str]:
    found = [name.strip() for name in text.split(",") if name.strip()]
    for name in found:
        if name not in names:
            raise HeldOutError(f"{where}: {name!r}; allowed: {', '.join(names)}")
    return found


def _call(text: str, where: str) -> tuple[str, list[str]]:
    match = _CALL.fullmatch(text.strip(", "))
    if not match:
        raise HeldOutError(f"{where}: {text!r}; allowed: name(argument, ...)")
    return match[1].strip(), [argument.strip() for argument in match[2].split(",")]


def _relation(call: tuple[str, list[str]], space: SymbolSpace, where: str) -> Relation:
    name, arguments = call
    _known(name, space.relations, where)
    _known(", ".join(arguments), (*space.object_classes, *space.locations), where)
    if len(arguments) != 2:
        raise HeldOutError(f"{where}: {arguments}; allowed: figure, landmark")
    return name, arguments[0], arguments[1]


def _wanted(text: str, space: SymbolSpace, where: str) -> Wanted:
    head, *after = re.split(r"\s+(?=(?:quickly|safely|comparative)\b)", text)
    _known(", ".join(after), _WORDS_AFTER, where)
    # A turn has neither object nor place: "turn left" is the action alone.
    action, arguments = _call(head, where) if "(" in head else (head, [ANY, ANY, ANY])
    names = (*space.object_classes, *space.locations, ANY)
    _known(action, (*space.actions, ANY), where)
    if len(arguments) not in (1, 3):
        raise HeldOutError(f"{where}: {head!r}; allowed: action(object, relation, landmark)")
    goal, relation, landmark = (*arguments, UNKNOWN, UNKNOWN)[:3]
    _known(f"{goal}, {landmark}", names, where)
    _known(relation, (*space.relations, ANY), where)
    mode = next((word for word in after if word != "comparative"), UNKNOWN)
    return Wanted(action, goal, relation, landmark, mode, "comparative" in after)


@dataclass(frozen=True)
class Listener:
    """Understands as the grounding node of a robot does."""

    model: GroundingModel
    conformal: ConformalSet

    @classmethod
    def of(cls, robot: str) -> "Listener":
        """With the robot's trained weights."""
        return cls(GroundingModel.load(robot), load_conformal(robot))

    def hear(self, sentence: Sentence) -> Understanding:
        """What the first utterance means after the last one."""
        if len(sentence.turns) == 1:
            return self.model.understand(sentence.text)
        dialogue = Dialogue(self.model.understand, self.model.lexicon, self.conformal)
        dialogue.hear("0", sentence.text)
        for number, turn in enumerate(sentence.turns[1:], 1):
            dialogue.hear(str(number), turn, running="0")
        meaning = dialogue.meaning_of("0")
        assert meaning is not None
        return meaning.understanding


@dataclass(frozen=True)
class Verdict:
    """How one sentence was understood."""

    sentence: Sentence
    parsed: bool
    """Whether the grammar covers all of it."""
    annotation: bool
    """Whether the best annotation is exactly right."""
    behavior: bool
    """Whether the best behaviour, or doing nothing, is exactly right."""
    annotation_confidence: float
    """Stated probability of the best annotation."""
    behavior_confidence: float
    """Stated probability of the best behaviour, or of doing nothing."""
    causes: tuple[str, ...]
    """Why it is wrong; none if all is right."""


def judge(sentence: Sentence, found: Understanding) -> Verdict:
    """Compares an understanding with what is right."""
    annotation, intent = _best_annotation(found), _best_intent(found)
    if sentence.refused:
        causes = _refusal_causes(sentence, found)
        right_annotation = right_behavior = not causes
    else:
        said = _annotation_causes(sentence, annotation)
        done = _behavior_causes(sentence.behavior, intent, found)
        causes, right_annotation, right_behavior = (*said, *done), not said, not done
        causes = ("incomplete parse", *causes) if found.partial else causes
    return Verdict(
        sentence=sentence,
        parsed=not found.partial,
        annotation=right_annotation,
        behavior=right_behavior,
        annotation_confidence=annotation.probability,
        behavior_confidence=intent.probability if intent else found.statement_mass,
        causes=causes,
    )


def _best_annotation(found: Understanding) -> Annotation:
    return found.annotations[0] if found.annotations else Annotation(0.0, (), ())


def _best_intent(found: Understanding) -> Intent | None:
    best = next(iter(found.intents), None)
    return best if best and best.probability >= found.statement_mass else None


def _refusal_causes(sentence: Sentence, found: Understanding) -> tuple[str, ...]:
    if found.understood:
        return ("accepted an unknown word",)
    named = " ".join(found.unknown_words)
    missing = any(word not in named for word in sentence.refused)
    return ("unknown word not named",) if missing else ()


def _annotation_causes(sentence: Sentence, best: Annotation) -> tuple[str, ...]:
    checks = {
        "wrong objects": best.objects == sentence.objects,
        "wrong relations": best.relations == sentence.relations,
    }
    return tuple(cause for cause, right in checks.items() if not right)


def _behavior_causes(
    wanted: Wanted | None, best: Intent | None, found: Understanding
) -> tuple[str, ...]:
    if not found.understood:
        return ("refused what it knows",)
    if wanted is None or best is None:
        both = wanted is None and best is None
        return () if both else ("acts on a statement" if best else "does nothing",)
    same = {
        "wrong action": _fits(wanted.action, best.action),
        "wrong goal": _fits(wanted.object, best.object),
        "wrong place": _fits(wanted.relation, best.relation)
        and _fits(wanted.landmark, best.landmark),
        "wrong mode": wanted.mode == best.mode,
        "nearest lost or invented": wanted.comparative == best.comparative,
    }
    return tuple(cause for cause, right in same.items() if not right)


def _fits(wanted: str, found: str) -> bool:
    return wanted in (ANY, found)
