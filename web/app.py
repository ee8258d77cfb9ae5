"""The server behind the page: loopback only, token in front, no share tunnel, stdout untouched."""

import contextlib
import io
import json
import secrets
import sys
from collections.abc import Generator
from typing import Any

import viser
import viser._messages
import websockets.asyncio.server

from robots.spec import RobotSpec
from schemas.geometry import Pose2
from web.gate import Gate
from web.map_view import MapView
from web.panels import Panels
from web.requests import Inbox
from web.robot_view import RobotView
from web.view_model import ViewModel
from web.viewpoints import viewpoint

_host = "127.0.0.1"
_brand = (30, 90, 160)
_page_script = """(() => {
  document.title = TITLE;
  if (window.incognitaKeys) return;
  window.incognitaKeys = true;
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    const isStop = (button) => button.textContent.trim() === "STOP";
    [...document.querySelectorAll("button")].find(isStop)?.click();
  }, true);
})()"""
"""A capturing listener: viser's own hotkeys are dead while a text box has the focus."""


class App:
    """The page of one robot. Nothing listens before `start`."""

    def __init__(self, spec: RobotSpec, port: int, token: str) -> None:
        self._spec = spec
        self._asked_port = port
        self._token_is_new = not token
        self.token = token or secrets.token_urlsafe(24)
        self.inbox = Inbox()

    def start(self) -> None:
        """Open the port (the next free one if it is taken) and build the page."""
        with contextlib.redirect_stdout(io.StringIO()), _gated(self.token):
            self.server = viser.ViserServer(
                host=_host, port=self._asked_port, label=self._spec.title, verbose=False
            )
        _remove_share_tunnel(self.server)
        _add_keys(self.server, f"{self._spec.title} – Incognita")
        _set_look(self.server)
        self._robot = RobotView(self.server.scene, self._spec)
        self._map = MapView(self.server.scene)
        switches = self._map.switches() | {"Laser": self._robot.laser_frame}
        self._panels = Panels(self.server, self.inbox, switches)
        self.server.on_client_connect(self._panels.greet)
        self.server.on_client_disconnect(self._panels.leave)
        if self.port != self._asked_port or self._token_is_new:
            print(f"web: page at {self.address}", file=sys.stderr)

    @property
    def port(self) -> int:
        """Port that the page is really on."""
        return self.server.get_port()

    @property
    def address(self) -> str:
        """What to open in a browser; holds the token."""
        return f"http://{_host}:{self.port}/?token={self.token}"

    def show(self, view: ViewModel) -> None:
        """Send what changed to all browsers."""
        with self.server.atomic():
            self._robot.show(view)
            self._map.show(view)
            self._panels.show(view)

    def stop(self) -> None:
        """Close the port and all connections."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()


@contextlib.contextmanager
def _gated(token: str) -> Generator[None]:
    """Within the block, web servers are opened with the gate in front of their own answers.

    viser has no hook for this, but hands its answering function to `websockets` on start-up.
    """
    module = websockets.asyncio.server
    serve: Any = module.serve

    def serve_gated(*args: Any, process_request: Any, **options: Any) -> Any:
        return serve(*args, process_request=Gate(token, process_request), **options)

    setattr(module, "serve", serve_gated)  # noqa: B010 (a class by its type)
    try:
        yield
    finally:
        setattr(module, "serve", serve)  # noqa: B010


def _remove_share_tunnel(server: viser.ViserServer) -> None:
    """Any browser could otherwise make the server open a tunnel to the outside."""
    connection: Any = getattr(server, "_websock_server")  # noqa: B009 (private to viser)
    messages: Any = viser._messages  # pyright: ignore[reportPrivateUsage]
    connection.unregister_handler(messages.ShareUrlRequest)
    connection.unregister_handler(messages.ShareUrlDisconnect)


def _add_keys(server: viser.ViserServer, title: str) -> None:
    connection: Any = getattr(server, "_websock_server")  # noqa: B009 (private to viser)
    messages: Any = viser._messages  # pyright: ignore[reportPrivateUsage]
    script = _page_script.replace("TITLE", json.dumps(title))
    connection.queue_message(messages.RunJavascriptMessage(source=script))


def _set_look(server: viser.ViserServer) -> None:
    """Light theme, no environment map and no shadows: those two stall software rendering."""
    server.gui.configure_theme(
        dark_mode=False, show_logo=False, show_share_button=False, brand_color=_brand
    )
    scene = server.scene
    scene.configure_environment_map(hdri=None)
    scene.configure_default_lights(enabled=True, cast_shadow=False)
    scene.add_light_ambient("/lights/ambient", intensity=1.8)
    scene.add_grid(
        "/ground",
        width=60,
        height=60,
        cell_size=1,
        section_size=5,
        cell_color=(228, 231, 236),
        section_color=(208, 212, 220),
        position=(0.0, 0.0, -0.02),
        plane="xy",
        shadow_opacity=0.0,
    )
    position, target = viewpoint("Overview", Pose2(0.0, 0.0, 0.0))
    server.initial_camera.position = position
    server.initial_camera.look_at = target
    server.initial_camera.fov = 0.85
