"""A whole system: it survives what happens to its processes, and obeys the person."""

import os
import signal
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

import psutil
import pytest

from schemas import topics
from schemas.errors import MissingComponentError
from schemas.health import ServiceState
from schemas.sensing import Odometry
from schemas.task import Failure, InstructionStatus, TaskState
from services.runtime.client import Client, follow_instruction
from services.runtime.log_file import log_summary
from services.runtime.repair import check_log
from services.runtime.run_directory import RunDirectory
from services.runtime.wire import Bus
from tests.running import Running, eventually

Up = Callable[..., AbstractContextManager[Running]]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]

text = "go to the hydrant behind the cone"


def speeds(realm: str, seconds: float) -> list[float]:
    """What the odometry says for a while, in absolute values."""
    found: list[float] = []
    with Client(realm) as client:
        subscription = client.watch(topics.ODOMETRY)
        deadline = time.monotonic() + seconds
        for _, message in subscription.messages(1.0):
            assert isinstance(message, Odometry)
            found.append(max(abs(message.linear), abs(message.angular)))
            if time.monotonic() > deadline:
                break
    return found


def test_every_service_may_be_killed_during_a_run(up: Up) -> None:
    with up("--seed", "4", "--say", text, "--exit-when-done") as system:
        system.wait_until_ready()
        check_nothing_listens_beyond_this_machine(system)
        names = [row.name for row in system.status().services]
        for name in names:
            pid = system.kill(name)
            system.wait_until_reborn(name, pid)
        assert [row.restarts for row in system.status().services] == [1] * len(names)
        output, _ = system.process.communicate(timeout=250)
    assert system.process.returncode == 0, output
    assert "goal confirmed" in output


def test_a_run_is_recorded_and_leaves_nothing_behind(up: Up) -> None:
    with up("--no-web", "--seed", "6", "--say", text, "--exit-when-done") as system:
        system.wait_until_ready()
        children = [row.pid for row in system.status().services]
        output, _ = system.process.communicate(timeout=200)
    assert system.process.returncode == 0, output
    assert not [pid for pid in children if psutil.pid_exists(pid)]
    (log,) = (system.folder / "runs").glob("*.mcap")
    assert check_log(log) == []
    summary = log_summary(log)
    assert summary["metadata"]["run"]["seed"] == "6"
    assert "web_token" not in summary["metadata"]["run"]
    assert {"camera/rgbd", "map/belief", "decision", "instruction/status"} <= set(summary["topics"])


def test_bad_messages_strange_words_and_the_stop(up: Up) -> None:
    with up("--no-web", "--no-record", "--seed", "1") as system:
        system.wait_until_ready()
        check_malformed_bytes_kill_nothing(system)
        check_what_is_not_understood_moves_nothing(system)
        check_stop_stops_and_resume_goes_on(system)
        check_a_hung_service_is_replaced(system)
        check_a_second_system_is_refused(system, up)
        began = time.monotonic()
        system.process.send_signal(signal.SIGINT)
        system.process.wait(10)
        assert time.monotonic() - began < 5.0


def check_nothing_listens_beyond_this_machine(system: Running) -> None:
    listening = [
        connection.laddr.ip
        for process in system.processes()
        for connection in process.net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert listening == ["127.0.0.1"], "the page, and nothing else"


def check_malformed_bytes_kill_nothing(system: Running) -> None:
    pids = [row.pid for row in system.status().services]
    with Bus.client(RunDirectory.of(system.realm).endpoint, system.realm, "husky") as bus:
        for topic in topics.ALL_TOPICS:
            for payload in (b"", b"\xc1", b"{}", os.urandom(100)):
                bus.publish_bytes(topic, payload)
        eventually(lambda: any(row.malformed for row in system.status().services), 5, "counted")
        eventually(lambda: bool(system.status().faults), 5, "reported")
    time.sleep(1.0)
    status = system.status()
    assert [row.pid for row in status.services] == pids
    assert sum(row.malformed for row in status.services) >= len(status.services)


def check_what_is_not_understood_moves_nothing(system: Running) -> None:
    with Client(system.realm) as client:
        subscription = client.watch(topics.ANNOTATIONS, topics.INSTRUCTION_STATUS)
        sent = client.say("paint the fence")
        status = follow_instruction(subscription, sent.id, 10.0, lambda _message: None)
    assert status is not None
    assert status.failure is Failure.NOT_UNDERSTOOD
    assert max(speeds(system.realm, 1.0)) < 0.01


def check_stop_stops_and_resume_goes_on(system: Running) -> None:
    with Client(system.realm) as client:
        sent = client.say(text)
        eventually(lambda: max(speeds(system.realm, 0.5)) > 0.2, 20, "moving")
        client.latch_stop(True)
        time.sleep(1.0)
        assert max(speeds(system.realm, 1.0)) < 0.01
        subscription = client.watch(topics.INSTRUCTION_STATUS)
        last = [message for _, message in subscription.messages(0.5)][-1]
        assert isinstance(last, InstructionStatus)
        assert (last.instruction_id, last.state) == (sent.id, TaskState.ACTIVE)
        client.latch_stop(False)
        eventually(lambda: max(speeds(system.realm, 0.5)) > 0.2, 20, "moving again")
        pid = system.service("navigation").pid
        os.kill(pid, signal.SIGSTOP)
        time.sleep(1.0)
        assert max(speeds(system.realm, 0.5)) < 0.01, "commands must expire when nobody drives"
        os.kill(pid, signal.SIGCONT)
        client.cancel()
        status = follow_instruction(subscription, sent.id, 10.0, lambda _message: None)
        assert status is not None
        assert status.state is TaskState.CANCELLED
        eventually(lambda: max(speeds(system.realm, 0.5)) < 0.01, 5, "standing")


def check_a_hung_service_is_replaced(system: Running) -> None:
    pid = system.kill("grounding", signal.SIGSTOP)
    system.wait_until_reborn("grounding", pid)
    assert system.service("grounding").state is ServiceState.RUNNING


def check_a_second_system_is_refused(system: Running, up: Up) -> None:
    with up("--no-web") as second:
        output, _ = second.process.communicate(timeout=20)
    assert second.process.returncode == 2
    assert str(system.process.pid) in output
    assert "kill" in output


def test_an_instruction_that_is_not_understood_ends_with_its_own_code(up: Up) -> None:
    with up("--no-web", "--no-record", "--say", "paint the fence", "--exit-when-done") as system:
        output, _ = system.process.communicate(timeout=90)
    assert system.process.returncode == 3, output
    assert "paint" in output


def test_without_a_vulkan_device_it_says_so_and_how_to_mend_it(
    up: Up, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere/driver.json")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nowhere/driver.json")
    with up("--no-web", "--no-record") as system:
        output, _ = system.process.communicate(timeout=90)
    assert system.process.returncode == 5, output
    assert "doctor --fix" in output


def test_services_die_with_their_supervisor(up: Up) -> None:
    with up("--no-web", "--no-record") as system:
        system.wait_until_ready()
        children = [row.pid for row in system.status().services]
        os.kill(system.process.pid, signal.SIGKILL)
        eventually(lambda: not any(psutil.pid_exists(pid) for pid in children), 5, "no orphans")
        with pytest.raises(MissingComponentError, match="incognita up"):
            system.status()
