"""Three machines and a stranger, in network namespaces of this one."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest

from schemas.topics import ALL_TOPICS
from services.runtime.certificates import make
from services.runtime.wire import Bus
from tests.hosts import Host, hosts

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

text = "go to the hydrant behind the cone"
realm = "default"


class Fleet:
    """Robot with the hub, a machine that computes, the operator's, and a stranger's."""

    def __init__(self, machines: list[Host], certs: Path) -> None:
        self.robot, self.compute, self.operator, self.stranger = machines
        self.certs = certs
        self.endpoint = f"tls/{self.robot.address}:7447"
        self.started: list[subprocess.Popen[str]] = []

    def hub(self) -> subprocess.Popen[str]:
        folder = str(self.certs / "hub")
        return self.robot.incognita("hub", "--tls", folder, "--role", "robot", "--seed", "4")

    def to_hub(self, role: str) -> list[str]:
        return ["--connect", self.endpoint, "--tls", str(self.certs / role)]

    def verb(self, host: Host, role: str, *arguments: str) -> tuple[int, str]:
        command = [*arguments, *self.to_hub(role)]
        return host.run(sys.executable, "-P", "-m", "services.cli", *command, timeout_s=400)

    def local(self) -> Bus:
        """The hub's own user, through the file system."""
        path = self.robot.folder / "incognita-0" / realm / "hub.sock"
        return Bus.client(f"unixsock-stream/{path}", realm, "husky")


@pytest.fixture(scope="module")
def fleet() -> Generator[Fleet]:
    with hosts("robot", "compute", "operator", "stranger") as machines:
        certs = machines[0].folder.parent / "certs"
        make(certs, [machines[0].address], days=90)
        made = Fleet(machines, certs)
        made.started = [
            made.hub(),
            made.compute.incognita("service", *made.to_hub("compute")),
        ]
        try:
            eventually(lambda: ready(made), 180, "all services on both machines ready")
            yield made
        finally:
            for process in made.started:
                process.send_signal(signal.SIGINT)
            for process in made.started:
                print(process.communicate(timeout=15)[0])


def ready(fleet: Fleet) -> bool:
    for process in fleet.started:
        assert process.poll() is None, process.communicate()[0]
    code, said = fleet.verb(fleet.operator, "viewer", "status", "--json")
    return code == 0 and json.loads(said.splitlines()[-1])["ready"]


def services(fleet: Fleet) -> dict[str, dict[str, Any]]:
    code, said = fleet.verb(fleet.operator, "viewer", "status", "--json")
    assert code == 0, said
    return {row["name"]: row for row in json.loads(said.splitlines()[-1])["services"]}


def service(fleet: Fleet, name: str) -> dict[str, Any]:
    return services(fleet)[name]


def state_is(fleet: Fleet, name: str, state: str) -> bool:
    """As the hub tells; for a moment after a link was cut it may not answer in time."""
    code, said = fleet.verb(fleet.operator, "viewer", "status", "--json")
    rows = json.loads(said.splitlines()[-1])["services"] if code == 0 else []
    return (name, state) in [(row["name"], row["state"]) for row in rows]


def eventually(condition: Callable[[], bool], seconds: float, what: str) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"{what}: not within {seconds:g} s"
        time.sleep(0.5)


def test_nothing_is_open_but_the_hubs_one_port(fleet: Fleet) -> None:
    assert fleet.robot.open_ports() == {7447}
    assert fleet.compute.open_ports() == set()
    assert fleet.operator.open_ports() == set()


def test_a_stranger_finds_no_answer_and_moves_nothing(fleet: Fleet) -> None:
    heard: list[bytes] = []
    with fleet.local() as bus:
        for topic in ALL_TOPICS:
            bus.subscribe(topic, lambda sample: heard.append(sample.payload))
        address, folder = fleet.robot.address, str(fleet.stranger.folder)
        code, said = fleet.stranger.run(
            *(sys.executable, "-P", "-m", "tests.stranger", address, realm, "husky", folder),
            timeout_s=200,
        )
    assert code == 0, said
    found = json.loads(said.splitlines()[-1])
    assert len(found) > 20, "every way was tried"
    assert {what: result for what, result in found.items() if result} == {}
    assert heard, "the system was at work meanwhile"
    assert b"\x80" not in heard, "what the stranger published"


def test_a_viewer_sees_and_cannot_drive(fleet: Fleet) -> None:
    code, said = fleet.verb(fleet.operator, "viewer", "status")
    assert code == 0, said
    assert "you are viewer: you may publish nothing" in said
    for verb in (["say", text], ["stop"], ["resume"], ["cancel"]):
        code, said = fleet.verb(fleet.operator, "viewer", *verb)
        assert code == 2, said
        assert "does not let role 'viewer' publish" in said
    code, said = fleet.verb(fleet.operator, "viewer", "watch", "map/belief", "-n", "1")
    assert code == 0, said


def test_a_viewers_page_comes_up_and_says_nothing_to_the_others(fleet: Fleet) -> None:
    page = fleet.stranger.incognita("service", *fleet.to_hub("viewer"))
    try:
        assert page.stdout is not None
        assert "web: page at http://127.0.0.1:" in page.stdout.readline()
        assert fleet.stranger.open_ports() == set()
        assert "viewer" not in services(fleet)
    finally:
        page.send_signal(signal.SIGINT)
        page.communicate(timeout=15)
    assert page.returncode == 0


@pytest.mark.parametrize("role", ["compute", "viewer"])
def test_the_doctor_says_how_the_hub_sees_a_machine(fleet: Fleet, role: str) -> None:
    code, said = fleet.verb(fleet.operator, role, "doctor", "--json")
    checks = {check["name"]: check for check in json.loads(said.splitlines()[-1])["checks"]}
    assert code == 0, said
    assert list(checks) == ["identity", "hub", "access", "clock", "services"]
    assert ("nothing" in checks["access"]["detail"]) == (role == "viewer")


def test_the_wrong_certificate_runs_no_service(fleet: Fleet) -> None:
    code, said = fleet.verb(fleet.stranger, "viewer", "service", "navigation")
    assert code == 2, said
    assert "publish base/command" in said


def test_an_instruction_succeeds_with_everything_apart(fleet: Fleet) -> None:
    code, said = fleet.verb(fleet.operator, "operator", "say", text, "--wait")
    assert code == 0, said
    assert "goal confirmed" in said
    assert service(fleet, "navigation")["host"] == "robot"
    assert service(fleet, "policy")["host"] == "compute"


def test_services_outlive_a_link_that_is_cut(fleet: Fleet) -> None:
    before = services(fleet)
    with fleet.compute.unplugged():
        eventually(lambda: state_is(fleet, "policy", "away"), 30, "said to be away")
        time.sleep(5.0)
    eventually(lambda: state_is(fleet, "policy", "running"), 30, "back")
    after = services(fleet)
    assert {n: row["pid"] for n, row in after.items()} == {
        n: row["pid"] for n, row in before.items()
    }


def test_the_hub_dies_and_returns_and_the_others_rejoin_by_themselves(fleet: Fleet) -> None:
    pid = service(fleet, "policy")["pid"]
    fleet.started[0].kill()
    fleet.started[0].communicate(timeout=15)
    fleet.started[0] = fleet.hub()
    eventually(lambda: ready(fleet), 120, "ready again")
    assert service(fleet, "policy")["pid"] == pid, "nobody else had to be started again"


def test_the_robots_machine_says_when_the_other_is_gone(fleet: Fleet) -> None:
    compute = fleet.started[1]
    compute.send_signal(signal.SIGINT)
    compute.communicate(timeout=15)

    def away() -> bool:
        states = [service(fleet, name)["state"] for name in ("policy", "navigation")]
        return states == ["away", "running"]

    eventually(away, 30, "said to be away")
