"""The conversation: what was said, what is asked, and what all of it means together.

Every utterance and every answer leads to a new joint reading of the instruction it is about
(Tellex et al. 2013: inference over command, question and answer). Three kinds of utterance are
told apart: an instruction; a statement, which moves nothing; and a correction, which gives the
running instruction another goal.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from schemas.language import Utterance
from services.grounding import questions, wording
from services.grounding.answers import chosen, means_no, means_yes, reweighed
from services.grounding.conformal import IMPROBABLE, ConformalSet
from services.grounding.discourse import Fact, Relation, facts_of, joint
from services.grounding.doubt import MIN_CONFIDENCE, NOT_UNDERSTOOD
from services.grounding.lexicon import Lexicon, constituents
from services.grounding.questions import Kind, Question
from services.grounding.scene import Scene, the_only, told_apart
from services.grounding.symbols import ROBOT, UNKNOWN
from services.grounding.talk import Meaning, Talk, acts, ask, noted_in
from services.grounding.understanding import Intent, Understanding

MAX_QUESTIONS = 2
"""About one instruction; a third would be a nuisance."""
PATIENCE_S = 20.0
"""So long the robot looks for a thing before it asks where it is [s]."""
MAX_REMEMBERED = 12
"""Utterances that still count."""


class Dialogue:
    """All that was said in a session.

    Args:
        understand: annotation inference of one text alone.
        lexicon: known words.
        conformal: which readings cannot be ruled out.
    """

    def __init__(
        self, understand: Callable[[str], Understanding], lexicon: Lexicon, conformal: ConformalSet
    ) -> None:
        # Equal texts give equal answers, and one utterance asks about the same text several times.
        self._understand_known = lru_cache(maxsize=64)(understand)
        self._lexicon = lexicon
        self._conformal = conformal
        self._said: list[Utterance] = []
        self._talks: dict[str, Talk] = {}
        self._facts: list[Fact] = []
        self._aliases: dict[str, str] = {}
        self._refused: dict[str, set[str]] = {}

    @property
    def said(self) -> tuple[Utterance, ...]:
        """The conversation, oldest first."""
        return tuple(self._said)

    def knows(self, instruction_id: str) -> bool:
        """Whether an utterance was heard before."""
        return any(one.instruction_id == instruction_id for one in self._said)

    def hear(self, instruction_id: str, text: str, running: str = "") -> tuple[Meaning, ...]:
        """Take up an utterance.

        Args:
            instruction_id: its id.
            text: what was said.
            running: id of the instruction that is being followed or waits for an answer.

        Returns:
            What it means; if it is about the running instruction, also what that means now.
        """
        base = self._talks.get(running)
        meanings = self._heard(instruction_id, text, base)
        self._said.append(Utterance(instruction_id, text, meanings[0].revises, ()))
        del self._said[:-MAX_REMEMBERED]
        return meanings

    def answer(self, text: str, instruction_id: str = "") -> Meaning | None:
        """Take up an answer.

        Args:
            text: the answer.
            instruction_id: whose question it answers; "" for the newest open one.

        Returns:
            What the instruction means now; None where no question is open.
        """
        talk = self._asked(instruction_id)
        if talk is None or talk.question is None:
            return None
        self._note_answer(talk.id, talk.question, text)
        return self._answered(talk, talk.question, text)

    def look(self, instruction_id: str, scene: Scene, searching_s: float) -> Meaning | None:
        """Ask about what the map leaves open; nobody waits for the answer.

        Args:
            instruction_id: of the instruction that is being followed.
            scene: what was seen.
            searching_s: time since the instruction [s].

        Returns:
            The instruction with a question, None where there is nothing new to ask.
        """
        talk = self._talks.get(instruction_id)
        if talk is None or len(talk.asked) >= MAX_QUESTIONS:
            return None
        # Where something is need not be answered any more once one was seen.
        if talk.question is not None and talk.question.kind is not Kind.PLACE:
            return None
        question = self._scene_question(talk, scene, searching_s)
        if question is None or question.text in talk.asked:
            return None
        ask(talk, question)
        return self._meaning(talk)

    def close(self, instruction_id: str) -> None:
        """The instruction has ended: its question is no longer open."""
        if instruction_id in self._talks:
            self._talks[instruction_id].question = None

    def restore(
        self,
        said: tuple[Utterance, ...],
        revision: int,
        instruction_id: str = "",
        not_meant: tuple[int, ...] = (),
    ) -> None:
        """Take up a conversation that an earlier process led.

        Args:
            said: as in `said`.
            revision: of the last meaning that was told.
            instruction_id: what that was about.
            not_meant: as in that meaning.
        """
        for one in said:
            self.hear(one.instruction_id, one.text, one.revises)
            for asked, answered in one.answers:
                self._answer_again(one.instruction_id, asked, answered)
        for talk in self._talks.values():
            talk.revision = max(talk.revision, revision)
        if instruction_id in self._talks:
            self._talks[instruction_id].not_meant.update(not_meant)

    def meaning_of(self, instruction_id: str) -> Meaning | None:
        """What an instruction meant when it was last spoken of; None if nobody spoke of it."""
        talk = self._talks.get(instruction_id)
        return self._said_of(talk, *self._joint(talk)) if talk else None

    def _heard(self, instruction_id: str, text: str, base: Talk | None) -> tuple[Meaning, ...]:
        asked = self._asked()
        if asked and asked.question and self._is_answer(asked.question, text):
            meaning = self._answered(asked, asked.question, text)
            return (noted_in(instruction_id, text, meaning), meaning)
        context = base or next(reversed(self._talks.values()), None)
        wanted = context.wanted if context else None
        command = self._corrected(text, wanted) if wanted else None
        if command is not None and base is not None:
            self._restate(base, command)
            meaning = self._meaning(base)
            return (noted_in(instruction_id, text, meaning), meaning)
        told = command or (wording.resolved(text, wanted.object) if wanted else text)
        return self._instructed_or_told(instruction_id, told, base)

    def _asked(self, instruction_id: str = "") -> Talk | None:
        """The newest instruction with an open question, or the one of that id."""
        open_ones = [one for one in self._talks.values() if one.question]
        return next((one for one in open_ones[::-1] if instruction_id in ("", one.id)), None)

    def _instructed_or_told(
        self, instruction_id: str, text: str, base: Talk | None
    ) -> tuple[Meaning, ...]:
        alone = self._understand(text)
        if not alone.understood or acts(alone):
            for other in self._talks.values():
                other.question = None
            talk = Talk(instruction_id, text)
            self._talks[instruction_id] = talk
            return (self._meaning(talk),)
        self._facts += facts_of(alone, instruction_id, not wording.introduces(text))
        joined, viewpoint = joint(alone, self._facts_beside(instruction_id))
        noted = Meaning(instruction_id, text, joined, viewpoint=viewpoint)
        return self._with_revision(noted, base) if base else (noted,)

    def _with_revision(self, noted: Meaning, base: Talk) -> tuple[Meaning, ...]:
        """A statement, and what the running instruction means after it if that has changed."""
        now, _ = self._joint(base)
        if (now.annotations, now.intents) == (base.annotations, base.intents):
            return (replace(noted, revises=base.id),)
        return (replace(noted, revises=base.id), self._meaning(base))

    def _corrected(self, text: str, wanted: Intent) -> str | None:
        """The whole instruction that a correction amounts to, None if the text is no correction."""
        rest = wording.corrected(text)
        if not rest:
            return None
        named = wording.resolved(rest, wanted.object)
        alone = self._understand(named)
        whole = alone.understood and acts(alone)
        return named if whole else self._instruction_from(named, wanted)

    def _instruction_from(self, phrase: str, wanted: Intent) -> str | None:
        """What is wanted, of "the hydrant behind the tree" or "behind the tree"."""
        bare = questions.sentence(replace(wanted, relation=UNKNOWN, landmark=UNKNOWN))
        verb = bare.partition(" the ")[0]
        for candidate in (f"{verb} {phrase}", f"{bare} {wording.location(phrase)}"):
            read = self._understand(candidate)
            if read.understood and acts(read):
                return candidate
        return None

    def _is_answer(self, question: Question, text: str) -> bool:
        """Whether an utterance answers a question, though it was not sent as an answer."""
        if question.kind is Kind.PLACE:
            alone = self._understand(text)
            says_itself = acts(alone) or any(one.relations for one in alone.annotations[:1])
            return not says_itself and bool(self._placed(question.subject, text))
        if not question.meanings:
            return False
        if means_yes(text) or means_no(text) or chosen(question, text):
            return True
        return question.kind is Kind.WORD and self._named(question, text) is not None

    def _placed(self, name: str, text: str) -> tuple[Relation, ...]:
        """The relations that an answer to "where is it?" gives a thing."""
        alone = self._understand(f"the {name} is {wording.location(text)}")
        return alone.annotations[0].relations if alone.annotations else ()

    def _answered(self, talk: Talk, question: Question, text: str) -> Meaning:
        talk.question = None
        match question.kind:
            case Kind.WORD:
                self._learn_word(talk, question, text)
            case Kind.REFERENT if question.nodes:
                self._learn_referent(talk, question, text)
            case Kind.CHOICE | Kind.REFERENT:
                self._learn_choice(talk, question, text)
            case Kind.PLACE:
                self._learn_place(talk, question.subject, text)
            case Kind.REPEAT:
                self._restate(talk, text)
        return self._meaning(talk)

    def _learn_word(self, talk: Talk, question: Question, text: str) -> None:
        meaning = chosen(question, text) or self._named(question, text)
        if meaning is not None:
            self._aliases[question.subject] = meaning
        elif means_no(text):
            self._refused.setdefault(question.subject, set()).update(question.meanings)
        elif not means_yes(text):
            self._restate(talk, text)

    def _learn_choice(self, talk: Talk, question: Question, text: str) -> None:
        readings = {questions.sentence(one): one for one in reversed(talk.intents)}
        picked = chosen(question, text)
        if picked in readings:
            talk.choices.append((readings[picked], True))
        elif picked is not None:
            self._restate(talk, picked)
        elif means_no(text):
            talk.choices += [(readings[one], False) for one in question.meanings if one in readings]
        elif not means_yes(text):
            self._restate(talk, text)

    def _learn_referent(self, talk: Talk, question: Question, text: str) -> None:
        """Which of the seen things is meant; what its place is called does not matter then."""
        picked = chosen(question, text)
        if picked is not None:
            node = question.nodes[question.meanings.index(picked)]
            talk.not_meant |= set(question.nodes) - {node}
            talk.is_found = True
        elif means_no(text):
            talk.not_meant |= set(question.nodes)
        elif not means_yes(text):
            self._restate(talk, text)

    def _learn_place(self, talk: Talk, name: str, text: str) -> None:
        told = [Fact(one, 1.0, talk.id, definite=True) for one in self._placed(name, text)]
        self._facts += told
        if not told:
            self._restate(talk, text)

    def _restate(self, talk: Talk, text: str) -> None:
        """Another instruction, or another goal of the same one, takes the place of the text."""
        alone = self._understand(text)
        whole: str | None = text
        if not (alone.understood and acts(alone)):
            phrase = wording.corrected(text) or text
            wanted = talk.wanted
            named = wording.resolved(phrase, wanted.object) if wanted else phrase
            whole = self._instruction_from(named, wanted) if wanted else None
        if whole is not None:
            talk.text, talk.choices, talk.question = whole, [], None
            talk.not_meant, talk.is_found = set(), False
            self._facts = self._facts_beside(talk.id)

    def _named(self, question: Question, text: str) -> str | None:
        """The one class that an answer names, where a class is asked for."""
        if question.meanings[0] not in constituents(self._lexicon.symbols)["class"]:
            return None
        alone = self._understand(wording.corrected(text) or text)
        named = alone.annotations[0].objects if alone.annotations else ()
        return named[0] if len(named) == 1 and alone.understood and not acts(alone) else None

    def _note_answer(self, instruction_id: str, question: Question, text: str) -> None:
        pair = (question.text, chosen(question, text) or text)
        self._said = [
            Utterance(one.instruction_id, one.text, one.revises, (*one.answers, pair))
            if one.instruction_id == instruction_id
            else one
            for one in self._said
        ]

    def _answer_again(self, instruction_id: str, asked: str, answered: str) -> None:
        talk = self._talks.get(instruction_id)
        if talk is None:
            return
        if talk.question is None or talk.question.text != asked:
            # It was about the map of that time, which is not known any more.
            name = talk.wanted.object if talk.wanted else ""
            place = questions.place_question(name)
            talk.question = place if place.text == asked else Question(Kind.REFERENT, asked)
        self.answer(answered, instruction_id)

    def _meaning(self, talk: Talk) -> Meaning:
        """What an instruction means now, and the next question about it."""
        understanding, viewpoint = self._joint(talk)
        if talk.question is None:
            self._ask_next(talk, understanding)
        talk.intents, talk.annotations = understanding.intents, understanding.annotations
        talk.revision += 1
        meaning = self._said_of(talk, understanding, viewpoint)
        if meaning.understanding.understood:
            own = facts_of(self._understand(talk.text), talk.id, definite=False)
            self._facts = [*self._facts_beside(talk.id), *own]
        return meaning

    def _said_of(self, talk: Talk, understanding: Understanding, viewpoint: str) -> Meaning:
        question, understood = talk.question, understanding.understood
        if question is not None and question.kind is Kind.CHOICE:
            understood = False
        text = question.text if question else None
        said = replace(understanding, understood=understood, question=text)
        not_meant = tuple(sorted(talk.not_meant))
        return Meaning(
            talk.id, talk.text, said, question, talk.revision,
            viewpoint=viewpoint, not_meant=not_meant,
        )  # fmt: skip

    def _joint(self, talk: Talk) -> tuple[Understanding, str]:
        understanding = self._understand(talk.text)
        for asked, is_meant in talk.choices:
            understanding = reweighed(understanding, asked, is_meant)
        if talk.choices:
            best = understanding.intents[0].probability
            understanding = replace(understanding, understood=best >= MIN_CONFIDENCE)
        return joint(understanding, self._facts_beside(talk.id))

    def _ask_next(self, talk: Talk, understanding: Understanding) -> None:
        best = None
        if len(talk.asked) < MAX_QUESTIONS:
            candidates = self._candidates(talk, understanding)
            best = questions.best_question(candidates, talk.asked)
        if best is not None:
            ask(talk, best)
        elif not understanding.understood and not talk.asked:
            talk.question = Question(Kind.REPEAT, understanding.question or NOT_UNDERSTOOD)

    def _word_candidates(self, talk: Talk, understanding: Understanding) -> list[Question]:
        """Questions about unknown words, if knowing them would make an instruction of the text.

        Where neither action nor object is known, to say it again is quicker than two answers.
        """
        best = understanding.intents[:1]
        if not best or (best[0].action, best[0].object) == (UNKNOWN, UNKNOWN):
            return []
        found = questions.word_questions(understanding, self._lexicon, self._refused)
        likeliest = {one.subject: one.meanings[0] for one in found}
        guess = self._understand(wording.substituted(talk.text, likeliest))
        return found if guess.understood and acts(guess) else []

    def _candidates(self, talk: Talk, understanding: Understanding) -> list[Question]:
        """Questions that would tell the readings apart."""
        if not understanding.understood:
            return self._word_candidates(talk, understanding)
        best: dict[tuple[str, str], Intent] = {}
        masses: dict[tuple[str, str], float] = {}
        for one in understanding.intents:
            # Readings of one goal at different places are left to the map: looking is cheaper.
            goal = (one.action, one.object)
            best.setdefault(goal, one)
            masses[goal] = masses.get(goal, 0.0) + one.probability
        goals = [goal for goal in self._conformal.members(masses) if UNKNOWN not in goal]
        split = tuple(replace(best[goal], probability=masses[goal]) for goal in goals)
        return [questions.choice_question(split)] if len(split) > 1 else []

    def _scene_question(self, talk: Talk, scene: Scene, searching_s: float) -> Question | None:
        wanted = talk.intents[0] if talk.intents else None
        if wanted is None or questions.place(wanted) or wanted.object in (ROBOT, UNKNOWN):
            return None
        found = tuple(one for one in scene if one.name == wanted.object)
        if not found:
            return questions.place_question(wanted.object) if searching_s >= PATIENCE_S else None
        found = tuple(one for one in found if one.node not in talk.not_meant)
        total = sum(one.mass for one in found)
        if total <= 0.0 or talk.is_found:
            return None
        members = self._conformal.members({one: one.mass / total for one in found})
        phrases = told_apart(members, scene) if len(members) > 1 else the_only(members)
        if phrases is None:
            return None
        masses = tuple(one.mass for one in members)
        nodes = tuple(one.node for one in members)
        question = questions.referent_question(wanted, phrases, masses, nodes)
        # Where what was seen is meant almost surely, asking would only be a nuisance.
        needed = len(members) > 1 or 1.0 - masses[0] >= IMPROBABLE
        return question if needed and question.gain > 0.0 else None

    def _facts_beside(self, instruction_id: str) -> list[Fact]:
        """What was said elsewhere, and in answers about this instruction."""
        return [one for one in self._facts if one.definite or one.source != instruction_id]

    def _understand(self, text: str) -> Understanding:
        return self._understand_known(wording.substituted(text, self._aliases))
