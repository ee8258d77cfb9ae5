"""A recorded run on the page: hub and page alone, no robot and no other service."""

import secrets
import threading
from pathlib import Path

import msgspec

from schemas import topics
from services.process_table import process_named
from services.runtime.replay import play, recorded_run
from services.runtime.run_directory import RunDirectory
from services.runtime.supervisor import Supervisor
from services.runtime.system import Say, free_port, page_address, write_settings
from services.runtime.wire import Bus

_realm = "replay"
_not_replayed = {topics.HEARTBEAT.key, topics.SYSTEM_STATUS.key, topics.TICK.key}
"""How the processes were says nothing about those that run now."""


def replay_on_page(file: Path, rate: float, port: int, stop: threading.Event, say: Say) -> None:
    """Play a log to a page until its end and Ctrl-C.

    Raises:
        LogError: not a readable log.
        RealmTakenError: another replay runs.
    """
    run = msgspec.structs.replace(
        recorded_run(file),
        realm=_realm,
        web_port=free_port(port),
        web_token=secrets.token_urlsafe(16),
        log="",
    )
    directory = RunDirectory.of(_realm)
    with directory.claimed():
        write_settings(directory, run)
        with Bus.hub(directory.endpoint, _realm, run.robot) as hub:
            supervisor = Supervisor(run, [process_named("web")], directory, hub, say)
            try:
                supervisor.start()
                _wait_until_ready(supervisor, stop)
                print(f"ready: {page_address(run)}", flush=True)
                looker_after = threading.Thread(target=_look_after, args=(supervisor, stop))
                looker_after.start()
                play(file, hub, rate, stop, lambda _: None, _not_replayed)
                say("end of the log; Ctrl-C ends")
                stop.wait()
                looker_after.join()
            finally:
                stop.set()
                supervisor.stop()


def _wait_until_ready(supervisor: Supervisor, stop: threading.Event) -> None:
    while not supervisor.ready and not stop.is_set():
        supervisor.poll()
        stop.wait(0.05)


def _look_after(supervisor: Supervisor, stop: threading.Event) -> None:
    while not stop.is_set():
        supervisor.poll()
        stop.wait(0.05)
