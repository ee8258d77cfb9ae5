"""The page in a headless browser, fed with made-up messages instead of a running system."""

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

from schemas import topics
from schemas.geometry import Pose2
from schemas.health import Tick
from schemas.language import Annotation, Annotations, BehaviorSymbol, Relation
from schemas.run import RunConfig
from schemas.sensing import Odometry
from schemas.task import InstructionStatus, TaskState
from schemas.topics import Output
from web.node import WebNode

_chromium = Path("/usr/bin/chromium")
_flags = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
_patience_ms = 60_000
_hand_ms = 150
_sentence = "go to the hydrant behind the cone"

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
expect = playwright.expect
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not _chromium.exists(), reason=f"no browser at {_chromium}"),
]


class Ticker:
    """Plays the executor: ticks the node ten times a second and keeps what it says."""

    def __init__(self) -> None:
        run = RunConfig(web_port=0, web_token="test", start_ns=time.time_ns())
        self.node = WebNode(run, np.random.default_rng(0))
        self.outputs: list[Output] = []
        self.robot_alive = True
        self._handlers = self.node.handlers()
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def put(self, output: Output) -> None:
        with self._lock:
            list(self._handlers[output.topic](output.message))

    def wait_for(self, wanted: Callable[[Output], bool]) -> Output:
        deadline = time.monotonic() + _patience_ms / 1000
        while time.monotonic() < deadline:
            for output in self.outputs:
                if wanted(output):
                    return output
            time.sleep(0.02)
        raise AssertionError(f"the page only said {self.outputs}")

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self.node.close()

    def _run(self) -> None:
        while not self._ended.wait(0.1):
            now = time.time_ns()
            if self.robot_alive:
                self.put(topics.ODOMETRY.of(_odometry(now)))
            with self._lock:
                self.outputs += self.node.on_tick(Tick(stamp_ns=now))


def _odometry(stamp_ns: int) -> Odometry:
    return Odometry(
        stamp_ns=stamp_ns,
        odom_from_base=Pose2(0.0, 0.0, 0.0),
        linear=0.4,
        angular=0.0,
        variance_per_metre=0.0,
        variance_per_radian=0.0,
    )


def _annotations(instruction_id: str) -> Annotations:
    return Annotations(
        stamp_ns=time.time_ns(),
        instruction_id=instruction_id,
        text=_sentence,
        understood=True,
        parse="(VP (VB go) (PP (TO to) (NP (DT the) (NN hydrant))))",
        parse_probability=0.97,
        annotations=(
            Annotation(
                probability=0.95,
                objects=("cone", "hydrant"),
                relations=(Relation("back", "hydrant", "cone"),),
            ),
        ),
        behaviors=(
            BehaviorSymbol(
                probability=0.96,
                action="navigate",
                object="hydrant",
                mode="unknown",
                relation="back",
                landmark="cone",
            ),
        ),
        unknown_words=(),
        question=None,
        possible=(),
    )


def _confirmed(instruction_id: str) -> InstructionStatus:
    return InstructionStatus(
        stamp_ns=time.time_ns(),
        instruction_id=instruction_id,
        text=_sentence,
        state=TaskState.SUCCEEDED,
        failure=None,
        reason="goal confirmed",
        started_ns=0,
        decisions=3,
    )


@pytest.fixture
def ticker() -> Iterator[Ticker]:
    ticker = Ticker()
    yield ticker
    ticker.close()


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=str(_chromium), args=list(_flags))
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser, ticker) -> Iterator[Callable[..., "playwright.Page"]]:
    contexts = []

    def visit(width: int = 1000, height: int = 500) -> "playwright.Page":
        context = browser.new_context(viewport={"width": width, "height": height})
        context.set_default_timeout(_patience_ms)
        contexts.append(context)
        page = context.new_page()
        page.goto(ticker.node.app.address)
        page.get_by_role("button", name="Send").wait_for()
        return page

    yield visit
    for context in contexts:
        context.close()


def say_box(page):
    label = page.locator("label", has_text="Say")
    return label.locator("xpath=ancestor::div[.//input][1]").locator("input")


def type_and_enter(box, text: str) -> None:
    """As slow as a hand: in 50 ms a browser sends one message, and of others the last alone."""
    box.page.wait_for_timeout(_hand_ms)
    box.fill(text)
    box.page.wait_for_timeout(_hand_ms)
    box.press("Enter")


def see(page, text: str) -> None:
    expect(page.get_by_text(text, exact=True).first).to_be_visible(timeout=_patience_ms)


def test_an_instruction_is_sent_understood_and_confirmed(ticker, open_page):
    page = open_page()
    type_and_enter(say_box(page), _sentence)
    said = ticker.wait_for(lambda output: output.topic is topics.INSTRUCTION).message
    assert said.text == _sentence
    ticker.put(topics.ANNOTATIONS.of(_annotations(said.id)))
    see(page, "hydrant behind cone")
    see(page, "go to hydrant behind cone")
    ticker.put(topics.INSTRUCTION_STATUS.of(_confirmed(said.id)))
    see(page, "goal confirmed")
    see(page, "SUCCEEDED")
    assert "token" not in page.url

    late = open_page()
    see(late, "goal confirmed")


def test_escape_stops_even_while_typing_and_release_lets_go(ticker, open_page):
    page = open_page()
    say_box(page).fill("go to the")
    say_box(page).press("Escape")
    assert ticker.wait_for(lambda output: output.topic is topics.STOP).message.stopped
    see(page, "STOPPED")
    page.get_by_role("button", name="Release stop").click()
    ticker.wait_for(lambda output: output.topic is topics.STOP and not output.message.stopped)
    expect(page.get_by_role("button", name="Release stop")).to_be_hidden(timeout=_patience_ms)


def test_everybody_has_an_own_box(ticker, open_page):
    mine, yours = open_page(), open_page()
    say_box(mine).fill("go to the cone")
    type_and_enter(say_box(yours), "stop")
    stop = ticker.wait_for(lambda output: output.topic is topics.STOP).message
    assert stop.source.startswith("web:")
    expect(say_box(mine)).to_have_value("go to the cone")
    assert all(output.topic is not topics.INSTRUCTION for output in ticker.outputs)


def test_silence_of_the_robot_is_said(ticker, open_page):
    page = open_page()
    see(page, "LIVE")
    see(page, "MOVING")
    ticker.robot_alive = False
    expect(page.get_by_text("STALE").first).to_be_visible(timeout=_patience_ms)


@pytest.mark.parametrize(("width", "height"), [(1000, 500), (412, 839)])
def test_stop_is_in_reach_at_once(open_page, width, height):
    page = open_page(width, height)
    stop = page.get_by_role("button", name="STOP")
    expect(stop).to_be_in_viewport(timeout=_patience_ms)
    above_say = stop.bounding_box()["y"] < say_box(page).bounding_box()["y"]
    assert above_say


def test_a_question_is_answered_with_a_button_or_typed_and_goes_when_answered(ticker, open_page):
    page = open_page()
    answer = page.locator("label", has_text="Answer")
    expect(answer).to_be_hidden()
    asks = msgspec.structs.replace(
        _annotations("i1"),
        understood=False,
        question='By "gizmo" do you mean a cone or a tree?',
        options=("cone", "tree"),
    )
    ticker.put(topics.ANNOTATIONS.of(asks))
    see(page, "I have a question")
    page.get_by_role("button", name="tree").click()
    said = ticker.wait_for(lambda output: output.topic is topics.ANSWER).message
    assert (said.instruction_id, said.text) == ("i1", "tree")
    box = answer.locator("xpath=ancestor::div[.//input][1]").locator("input")
    type_and_enter(box, "a barrel")
    ticker.wait_for(lambda output: getattr(output.message, "text", "") == "a barrel")
    ticker.put(topics.ANNOTATIONS.of(_annotations("i1")))
    expect(page.get_by_text("I have a question").first).to_be_hidden(timeout=_patience_ms)
    expect(answer).to_be_hidden(timeout=_patience_ms)
    expect(page.get_by_role("button", name="tree")).to_be_hidden(timeout=_patience_ms)
