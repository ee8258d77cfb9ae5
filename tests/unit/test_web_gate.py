import socket
from collections.abc import Iterator

import pytest

from robots.husky.spec import HUSKY
from web.app import App

_token = "a-token-for-tests"
_upgrade = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version": "13",
}


@pytest.fixture(scope="module")
def app() -> Iterator[App]:
    app = App(HUSKY, 0, _token)
    app.start()
    yield app
    app.stop()


def answer(app: App, path: str = "/", **headers: str) -> str:
    """Head of the answer to a raw request; a header of None is left out."""
    host = f"127.0.0.1:{app.port}"
    lines = {"Host": host, **headers}
    head = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in lines.items())
    with socket.create_connection(("127.0.0.1", app.port), timeout=5) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\n{head}\r\n".encode())
        data = b""
        while b"\r\n\r\n" not in data and (chunk := connection.recv(4096)):
            data += chunk
    return data.split(b"\r\n\r\n")[0].decode("latin-1")


def status(text: str) -> int:
    return int(text.split()[1])


def cookie(app: App) -> str:
    return f"incognita-{app.port}={_token}"


def test_without_the_token_nobody_enters(app):
    assert status(answer(app)) == 401
    assert status(answer(app, "/?token=wrong")) == 401
    assert status(answer(app, "/?token=%C3%A9")) == 401
    assert status(answer(app, Cookie=f"incognita-{app.port}=wrong")) == 401


def test_the_link_sets_a_cookie_and_hides_the_token(app):
    text = answer(app, f"/?token={_token}")
    assert status(text) == 303
    assert "Location: /\r\n" in text
    assert f"Set-Cookie: {cookie(app)}; HttpOnly; SameSite=Strict" in text


def test_the_cookie_opens_the_page_which_nobody_may_frame(app):
    text = answer(app, Cookie=cookie(app))
    assert status(text) == 200
    assert "X-Frame-Options: DENY" in text


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:80", "10.0.0.1:8080"])
def test_other_host_names_are_refused(app, host):
    assert status(answer(app, Host=host, Cookie=cookie(app))) == 403


def test_a_foreign_origin_is_refused_and_our_own_is_not(app):
    foreign = {**_upgrade, "Origin": "https://evil.example", "Cookie": cookie(app)}
    neighbour = foreign | {"Origin": "http://127.0.0.1:1"}
    own = foreign | {"Origin": f"http://127.0.0.1:{app.port}"}
    assert status(answer(app, **foreign)) == 403
    assert status(answer(app, **foreign | {"Upgrade": "WebSocket"})) == 403
    assert status(answer(app, **neighbour)) == 403
    assert status(answer(app, **own)) == 101


def test_a_socket_without_the_cookie_is_refused(app):
    assert status(answer(app, **_upgrade)) == 401


def test_a_port_that_is_taken_makes_way_for_the_next_free_one(app, capfd):
    second = App(HUSKY, app.port, _token)
    second.start()
    try:
        assert second.port != app.port
        captured = capfd.readouterr()
        assert captured.out == ""
        assert captured.err.count("\n") == 1
        assert second.address in captured.err
    finally:
        second.stop()


def test_an_empty_token_is_made_up_and_never_twice_the_same():
    assert App(HUSKY, 0, "").token != App(HUSKY, 0, "").token
    assert len(App(HUSKY, 0, "").token) >= 30


def test_no_browser_can_open_a_tunnel(app):
    handlers = app.server._websock_server._incoming_handlers
    assert not [kind for kind in handlers if "Share" in kind.__name__]
