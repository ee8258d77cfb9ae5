"""The open question on the page: when it is shown, and what an answer becomes."""

from types import SimpleNamespace

import pytest
import viser

from schemas import topics
from schemas.language import Answer, Instruction
from schemas.motion import StopLatch
from schemas.task import TaskState
from tests.unit.test_web_words import annotations, status
from web.question_box import QuestionBox
from web.requests import Inbox, Reply, message_for
from web.understood import understood_html
from web.view_model import ViewModel

ASKS = annotations(
    understood=False,
    question='By "gizmo" do you mean a cone or a tree?',
    options=("cone", "tree"),
)


def test_an_answer_goes_to_the_instruction_that_asks() -> None:
    output = message_for(Reply("a cone", "a", 3), 7)
    assert output is not None
    assert output.topic is topics.ANSWER
    assert output.message == Answer(stamp_ns=7, instruction_id="a", text="a cone", source="web:3")


def test_stop_stops_in_the_answer_line_too() -> None:
    output = message_for(Reply("stop!", "a", 3), 7)
    assert output is not None
    assert isinstance(output.message, StopLatch)


def test_a_question_is_open_until_it_is_answered_or_its_instruction_ends() -> None:
    view = ViewModel(0)
    assert view.asked is None
    view.put(topics.ANNOTATIONS, ASKS)
    view.put(topics.INSTRUCTION_STATUS, status(TaskState.ACTIVE, "waiting for an answer"))
    assert view.asked == ASKS
    view.put(topics.ANNOTATIONS, annotations(revision=1))
    assert view.asked is None
    view.put(topics.ANNOTATIONS, ASKS)
    view.put(topics.INSTRUCTION_STATUS, status(TaskState.FAILED, "no answer"))
    assert view.asked is None


def test_the_log_tells_the_conversation() -> None:
    view = ViewModel(0)
    view.put(topics.ANNOTATIONS, ASKS)
    view.put(topics.ANSWER, Answer(stamp_ns=5, instruction_id="a", text="a tree", source="cli"))
    texts = [event.text for event in view.events.events]
    assert f"robot: {ASKS.question}" in texts
    assert texts[-1] == "you: a tree"


def test_a_revised_instruction_is_shown_after_a_correction() -> None:
    said = Instruction(stamp_ns=5, id="b", text="no, the one behind the tree", source="cli")
    revised = annotations(stamp_ns=5, text="go to the hydrant behind the tree", revision=1)
    page = understood_html(said, revised, status(TaskState.ACTIVE, "going on"), None)
    assert "Trying to understand" not in page
    assert "going on" in page
    before = annotations(stamp_ns=1)
    assert "Trying to understand" in understood_html(said, before, None, None)


@pytest.fixture
def gui() -> viser.GuiApi:
    server = viser.ViserServer(host="127.0.0.1", port=18577, verbose=False)
    yield server.gui
    server.stop()


def test_the_box_has_a_button_for_each_answer_while_the_question_is_open(
    gui: viser.GuiApi,
) -> None:
    inbox = Inbox()
    box = QuestionBox(gui, inbox)
    client = SimpleNamespace(gui=gui, client_id=4)
    box.greet(client)  # type: ignore[arg-type]
    box.show(ASKS)
    assert [button.label for button in box.buttons] == ["cone", "tree"]
    box.answer("tree", 4)
    assert inbox.drain() == [Reply("tree", "a", 4)]
    box.show(None)
    assert box.buttons == ()
    box.answer("tree", 4)
    assert inbox.drain() == []
    box.leave(client)  # type: ignore[arg-type]
