import pytest

from schemas import topics
from schemas.language import Annotation, Annotations, BehaviorSymbol, Instruction, Relation
from schemas.task import InstructionStatus, TaskState
from web.phrases import direction, intention, reading
from web.requests import LONGEST_INSTRUCTION, Cancel, Inbox, Release, Say, Stop, message_for
from web.understood import understood_html, word_roles

_parse = (
    "(VP (VB go) (PP (TO to) (NP (NP (DT the) (NN hydrant))"
    " (PP (IN behind) (NP (DT the) (NN cone))))))"
)
_behind = Annotation(
    probability=0.95, objects=("cone", "hydrant"), relations=(Relation("back", "hydrant", "cone"),)
)
_go = BehaviorSymbol(
    probability=0.96,
    action="navigate",
    object="hydrant",
    mode="unknown",
    relation="back",
    landmark="cone",
)


def annotations(**changes) -> Annotations:
    fields = {
        "stamp_ns": 1,
        "instruction_id": "a",
        "text": "go to the hydrant behind the cone",
        "understood": True,
        "parse": _parse,
        "parse_probability": 0.97,
        "annotations": (_behind,),
        "behaviors": (_go,),
        "unknown_words": (),
        "question": None,
        "possible": (),
    }
    return Annotations(**fields | changes)


def status(state: TaskState, reason: str) -> InstructionStatus:
    return InstructionStatus(
        stamp_ns=2,
        instruction_id="a",
        text="",
        state=state,
        failure=None,
        reason=reason,
        started_ns=1,
        decisions=1,
    )


def test_symbols_read_as_words():
    assert reading(_behind) == "hydrant behind cone"
    assert intention(_go) == "go to hydrant behind cone"
    assert direction(0) == "ahead"
    assert direction(92) == "to the left"
    assert direction(-88) == "to the right"
    assert direction(179) == direction(-179) == "behind"


def test_words_carry_their_roles():
    roles = {word: role for word, role, _ in word_roles(annotations())}
    assert roles == {
        "go": "action",
        "to": "",
        "the": "",
        "hydrant": "goal",
        "behind": "relation",
        "cone": "landmark",
    }


def test_the_panel_holds_readings_probabilities_and_the_outcome():
    html = understood_html(None, annotations(), status(TaskState.SUCCEEDED, "goal confirmed"), None)
    for text in ("hydrant behind cone", "0.95", "go to hydrant", "0.96", ">goal confirmed<"):
        assert text in html


def test_what_is_not_understood_is_named_with_what_would_be():
    html = understood_html(
        None,
        annotations(
            text="paint the fence",
            understood=False,
            parse="",
            annotations=(),
            behaviors=(),
            unknown_words=("paint", "fence"),
            possible=("go to the cone",),
        ),
        None,
        None,
    )
    assert "I do not know: paint, fence" in html
    assert "go to the cone" in html
    assert html.count("unknown") == 2


def test_no_text_becomes_markup():
    evil = '<img src=x onerror="alert(1)">'
    html = understood_html(
        None,
        annotations(text=evil, parse="", understood=False, unknown_words=(evil,), possible=(evil,)),
        status(TaskState.FAILED, evil),
        None,
    )
    assert "<img" not in html
    assert 'onerror="' not in html


@pytest.mark.parametrize("text", ["stop", " STOP! ", "halt", "Halt."])
def test_stop_typed_alone_never_reaches_the_language_model(text):
    output = message_for(Say(text, 3), 10)
    assert output.topic is topics.STOP
    assert output.message.stopped


def test_wishes_become_messages():
    said = message_for(Say(" go to the stop sign ", 3), 10)
    assert said.topic is topics.INSTRUCTION
    assert (said.message.text, said.message.id, said.message.source) == (
        "go to the stop sign",
        "web-10",
        "web:3",
    )
    assert message_for(Stop(1), 10).message.stopped
    assert not message_for(Release(1), 10).message.stopped
    assert message_for(Cancel(1), 10).topic is topics.CANCEL


@pytest.mark.parametrize("text", ["", "   ", "x" * (LONGEST_INSTRUCTION + 1)])
def test_empty_and_endless_texts_are_no_instructions(text):
    assert message_for(Say(text, 1), 10) is None


def test_the_inbox_keeps_the_order_and_empties_once():
    inbox = Inbox()
    wishes = [Say("a", 1), Stop(2), Cancel(1)]
    for wish in wishes:
        inbox.put(wish)
    assert inbox.drain() == wishes
    assert inbox.drain() == []


def test_what_belongs_to_an_earlier_instruction_is_left_out():
    newer = Instruction(stamp_ns=9, id="b", text="go to the barrel", source="cli")
    done = status(TaskState.SUCCEEDED, "goal confirmed")
    html = understood_html(newer, annotations(), done, None)
    assert "go to the barrel" in html
    assert "goal confirmed" not in html
    assert "hydrant" not in html
