"""What a hub knows of services that other machines run."""

import time
from collections.abc import Callable, Generator
from pathlib import Path

import msgspec
import pytest

from schemas import topics
from schemas.health import Heartbeat, ServiceHealth, ServiceState, StatusRequest, SystemStatus
from schemas.run import RunConfig
from services.process_table import process_named
from services.runtime import supervisor as supervision
from services.runtime.joining import find_run
from services.runtime.link import Link
from services.runtime.run_directory import RunDirectory
from services.runtime.supervisor import Supervisor
from services.runtime.wire import Bus

run = RunConfig(realm="elsewhere", robot="husky")
beat = Heartbeat(
    stamp_ns=1,
    node="policy",
    pid=7,
    handled=3,
    busy=0.1,
    lost=0,
    replaced=0,
    malformed=0,
    handler_ms=1.0,
    host="workstation",
    clock_offset_ms=2.5,
)


class System:
    """A hub that waits for the policy, and what a client of it sees."""

    def __init__(self, folder: Path) -> None:
        self.said: list[str] = []
        directory = RunDirectory(folder)
        self.hub = Bus.hub(directory.endpoint, run.realm, run.robot)
        self.supervisor = Supervisor(
            run, [], directory, self.hub, self.said.append, elsewhere=[process_named("policy")]
        )
        self.supervisor.start()
        self.link = Link(directory.endpoint)
        self.bus = Bus.client(directory.endpoint, run.realm, run.robot)

    def status(self) -> SystemStatus:
        self.supervisor.poll()
        return self.bus.ask(topics.STATUS, StatusRequest(stamp_ns=0))

    def row(self, name: str = "policy") -> ServiceHealth | None:
        return next((row for row in self.status().services if row.name == name), None)

    def beats(self, **changed: object) -> None:
        self.bus.publish(topics.HEARTBEAT.of(msgspec.structs.replace(beat, **changed)))

    def close(self) -> None:
        self.supervisor.stop()
        self.bus.close()
        self.hub.close()


@pytest.fixture
def system(tmp_path: Path) -> Generator[System]:
    made = System(tmp_path)
    yield made
    made.close()


def eventually(condition: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + 5.0
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


def state(system: System) -> ServiceState | None:
    row = system.row()
    return row.state if row else None


def test_nothing_is_ready_before_the_other_machine_is(system: System) -> None:
    assert state(system) is ServiceState.STARTING
    assert not system.status().ready
    system.beats()
    assert eventually(lambda: system.status().ready)
    row = system.row()
    assert row is not None
    assert (row.host, row.pid, row.handled) == ("workstation", 7, 3)
    assert row.clock_offset_ms == 2.5


def test_who_falls_silent_is_away_and_may_come_back(
    system: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervision, "_hung_after_s", 0.3)
    system.beats()
    assert eventually(lambda: state(system) is ServiceState.RUNNING)
    assert eventually(lambda: state(system) is ServiceState.AWAY)
    assert "policy is not heard any more" in system.said
    assert system.status().ready, "once ready, services go on and wait for nobody"
    system.beats()
    assert eventually(lambda: state(system) is ServiceState.RUNNING)


def test_a_restart_elsewhere_is_counted(system: System) -> None:
    system.beats()
    assert eventually(lambda: state(system) is ServiceState.RUNNING)
    system.beats(pid=8)
    assert eventually(lambda: (row := system.row()) is not None and row.restarts == 1)


def test_who_comes_unasked_is_shown_and_waited_for_by_nobody(system: System) -> None:
    system.beats()
    assert eventually(lambda: system.status().ready)
    system.beats(node="recorder", pid=9)
    assert eventually(lambda: system.row("recorder") is not None)
    assert system.status().ready
    system.beats(node="stranger", pid=10)
    time.sleep(0.2)
    assert system.row("stranger") is None


def test_the_hub_tells_who_asks_what_is_run(system: System) -> None:
    assert find_run(system.link, run.realm) == run
