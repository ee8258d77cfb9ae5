"""The optional rewriter against a server of our own: it helps, and it can do no harm."""

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from services.commands import talk
from services.grounding.model import GroundingModel
from services.grounding.rewriter import (
    Rewriter,
    RewriterError,
    needs_rewriting,
    understand_rewritten,
)

MODEL = GroundingModel.load("husky")
ODD = "mosey yonder unto the hydrant abaft the cone"
PLAIN = "go to the hydrant behind the cone"


@contextmanager
def server(body: bytes, status: int = 200, drip_s: float = 0.0) -> Iterator[tuple[str, list[Any]]]:
    """An OpenAI-compatible server that always says the same; yields its address and requests."""
    requests: list[Any] = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            length = int(self.headers["Content-Length"])
            requests.append((self.path, json.loads(self.rfile.read(length))))
            self.send_response(status)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            for at in range(0, len(body), 20 if drip_s else len(body)):
                time.sleep(drip_s)
                self.wfile.write(body[at : at + 20 if drip_s else None])
                self.wfile.flush()

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing."""

    class Quiet(ThreadingHTTPServer):
        daemon_threads = True
        block_on_close = False

        def handle_error(self, *_: object) -> None:
            """A client that has gone is what the drip test wants."""

    httpd = Quiet(("127.0.0.1", 0), Handler)
    threading.Thread(target=httpd.serve_forever, args=(0.01,), daemon=True).start()
    try:
        yield f"http://127.0.0.1:{httpd.server_port}/v1", requests
    finally:
        httpd.shutdown()
        httpd.server_close()


def reply(text: object) -> bytes:
    return json.dumps({"choices": [{"message": {"content": text}}]}).encode()


def test_rewrite_is_grounded_and_shown() -> None:
    assert needs_rewriting(MODEL.understand(ODD))
    with server(reply(f'"{PLAIN}"\n')) as (address, requests):
        found, rewrite = understand_rewritten(MODEL, Rewriter(address, "small"), ODD)
    assert rewrite is not None
    assert (rewrite.text, rewrite.reason) == (PLAIN, "")
    assert found.text == ODD
    assert found.annotations == MODEL.understand(PLAIN).annotations
    assert found.question == f'Do you mean "{PLAIN}"?'
    ((path, body),) = requests
    assert path == "/v1/chat/completions"
    assert body["model"] == "small"
    assert body["messages"][-1]["content"] == ODD
    assert "hydrant" in body["messages"][0]["content"]


def test_server_is_not_asked_what_the_parser_can_do() -> None:
    with server(reply("go to the tree")) as (address, requests):
        found, rewrite = understand_rewritten(MODEL, Rewriter(address), PLAIN)
    assert rewrite is None
    assert requests == []
    assert found == MODEL.understand(PLAIN)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (reply("NONE"), 200),
        (reply(""), 200),
        (reply(None), 200),
        (reply({"a": 1}), 200),
        (reply("go to the zeppelin"), 200),
        (reply("I am sorry, but I cannot help with that."), 200),
        (reply("go to the tree"), 200),  # speaks of none of the things that were said
        (reply("x" * 5000), 200),
        (reply("go to\x00 the \x1b[31m hydrant"), 200),
        (b'{"choices": []}', 200),
        (b"[]", 200),
        (b"<html>", 200),
        (b"\xff\xfe", 200),
        (b" ", 200),
        (reply(PLAIN), 500),
        (reply(PLAIN), 404),
    ],
)
def test_bad_answers_change_nothing(body: bytes, status: int) -> None:
    own = MODEL.understand(ODD)
    with server(body, status) as (address, _):
        found, rewrite = understand_rewritten(MODEL, Rewriter(address), ODD)
    assert found == own
    assert rewrite is not None
    assert rewrite.reason


def test_server_that_drips_is_left() -> None:
    with server(reply(PLAIN), drip_s=0.1) as (address, _):
        started = time.monotonic()
        found, rewrite = understand_rewritten(MODEL, Rewriter(address, timeout_s=0.2), ODD)
    assert time.monotonic() - started < 1.0
    assert found == MODEL.understand(ODD)
    assert rewrite is not None
    assert rewrite.reason == "no answer within 0.2 s"


def test_no_server_changes_nothing() -> None:
    with server(b"") as (address, _):
        pass
    found, rewrite = understand_rewritten(MODEL, Rewriter(address), ODD)
    assert found == MODEL.understand(ODD)
    assert rewrite is not None
    assert "no usable answer" in rewrite.reason


def test_address_must_be_of_the_web() -> None:
    with pytest.raises(RewriterError, match="http://"):
        Rewriter("file:///etc/passwd")


def test_say_sends_a_guessed_word_only_if_a_person_agrees(monkeypatch: pytest.MonkeyPatch) -> None:
    with server(reply(PLAIN)) as (address, _):
        assert talk.in_known_words(ODD, "husky", address, "small") == ODD
        monkeypatch.setattr(talk, "_person_types", lambda: True)
        for answer, sent in (("y", PLAIN), ("", ODD)):
            monkeypatch.setattr("builtins.input", lambda _question, answer=answer: answer)
            assert talk.in_known_words(ODD, "husky", address, "small") == sent
        assert talk.in_known_words("go to the cone", "husky", address, "small") == "go to the cone"
