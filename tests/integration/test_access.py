"""What the hub's rules let pass is what they say, over mutual TLS on this machine."""

import time
from collections.abc import Callable, Generator
from pathlib import Path

import pytest
import zenoh

from schemas import topics
from schemas.errors import MissingComponentError
from schemas.fleet import RunRequest
from schemas.health import StatusRequest
from schemas.run import RunConfig
from schemas.topics import ALL_TOPICS, TICK, full_key
from services.process_table import process_named
from services.roles import ROLES
from services.runtime.certificates import make, revoke
from services.runtime.identity import Identity
from services.runtime.joining import (
    ClockError,
    ClockOffset,
    NotAllowedError,
    ask_access,
    find_run,
    measure_clock,
    receive_newcomers,
    require_access_for,
)
from services.runtime.link import Link
from services.runtime.mailbox import Sample
from services.runtime.system import free_port
from services.runtime.wire import Bus, NoAnswerError, NoSystemError, configuration, session_settings

realm, robot = "test", "husky"
run = RunConfig(realm=realm, robot=robot, web_token="secret", log="/elsewhere/a.mcap")
roles = [role.name for role in ROLES]
settle_s = 0.4
"""Long enough for what is refused not to have arrived."""


@pytest.fixture(scope="module")
def certs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("certs") / "certs"
    make(folder, [], days=1)
    return folder


@pytest.fixture(scope="module")
def endpoint() -> str:
    return f"tls/127.0.0.1:{free_port(17447)}"


@pytest.fixture(scope="module")
def hub(certs: Path, endpoint: str, tmp_path_factory: pytest.TempPathFactory) -> Generator[Bus]:
    local = f"unixsock-stream/{tmp_path_factory.mktemp('hub') / 'hub.sock'}"
    with Bus.hub(local, realm, robot, [endpoint], Identity.read(certs / "hub")) as bus:
        bus.serve_last_values()
        receive_newcomers(bus, run)
        yield bus


@pytest.fixture
def joined(hub: Bus, certs: Path, endpoint: str) -> Generator[Callable[[str], Bus]]:
    opened: list[Bus] = []

    def join(role: str) -> Bus:
        opened.append(
            Bus.client(
                endpoint, realm, robot, identity=Identity.read(certs / role), timeout_ms=4000
            )
        )
        return opened[-1]

    yield join
    for bus in opened:
        bus.close()


def heard_by(bus: Bus) -> set[str]:
    """Keys of the topics that arrive, filled as they do; the bus asks for all of them."""
    heard: set[str] = set()

    def note(sample: Sample) -> None:
        heard.add(sample.topic.key)

    for topic in ALL_TOPICS:
        bus.subscribe(topic, note)
    time.sleep(settle_s)
    return heard


@pytest.mark.parametrize("role", roles)
def test_what_a_role_may_publish_is_what_it_is_told(
    role: str, hub: Bus, joined: Callable[[str], Bus]
) -> None:
    bus = joined(role)
    stated = ask_access(bus)
    assert stated.role == role
    heard = heard_by(hub)
    for topic in ALL_TOPICS:
        bus.publish_bytes(topic, b"x")
    time.sleep(settle_s)
    assert heard == set(stated.publishes)


@pytest.mark.parametrize("role", roles)
def test_what_a_role_may_hear_is_what_it_is_told(
    role: str, hub: Bus, joined: Callable[[str], Bus]
) -> None:
    bus = joined(role)
    heard = heard_by(bus)
    for topic in ALL_TOPICS:
        hub.publish_bytes(topic, b"x")
    time.sleep(settle_s)
    assert heard == set(ask_access(bus).listens)
    assert TICK.key not in heard


def test_last_values_are_given_to_who_may_hear_them(hub: Bus, joined: Callable[[str], Bus]) -> None:
    hub.publish_bytes(topics.BELIEF, b"x")
    hub.publish_bytes(topics.DRIVER_CHECKPOINT, b"x")
    time.sleep(settle_s)
    viewer, driver = joined("viewer"), joined("robot")
    assert viewer.last_value(topics.BELIEF) is not None
    assert viewer.last_value(topics.DRIVER_CHECKPOINT) is None
    assert driver.last_value(topics.DRIVER_CHECKPOINT) is not None, "its own, to go on from"


def test_a_role_cannot_answer_for_the_hub(hub: Bus, joined: Callable[[str], Bus]) -> None:
    liar, asker = joined("compute"), joined("operator")
    liar.serve(topics.STATUS, lambda _request: StatusRequest(stamp_ns=0))
    time.sleep(settle_s)
    with pytest.raises(NoAnswerError):
        asker.ask(topics.STATUS, StatusRequest(stamp_ns=0), timeout_s=0.5)


def test_the_wrong_service_is_refused_in_words(joined: Callable[[str], Bus]) -> None:
    access = ask_access(joined("viewer"))
    with pytest.raises(NotAllowedError, match=r"navigation: .*'viewer' publish base/command"):
        require_access_for(process_named("navigation"), access)
    for role in ROLES:
        for name in role.services:
            require_access_for(process_named(name), ask_access(joined(role.name)))


def test_the_run_is_handed_out_without_its_secret(hub: Bus, certs: Path, endpoint: str) -> None:
    found = find_run(Link.to(endpoint, certs / "viewer"), realm)
    assert (found.robot, found.web_token, found.log) == (robot, "", "runs/a.mcap")
    with pytest.raises(NotAllowedError, match="another realm"):
        find_run(Link.to(endpoint, certs / "viewer"), "other", timeout_ms=2000)


def test_clocks_of_one_machine_agree_and_a_wrong_one_is_refused(
    joined: Callable[[str], Bus],
) -> None:
    measured = measure_clock(joined("robot"))
    assert abs(measured.offset_s) <= measured.uncertainty_s + 1e-4
    measured.require_small()
    ClockOffset(0.3, 0.25).require_small()
    with pytest.raises(ClockError, match=r"0\.300 s ahead.*chrony"):
        ClockOffset(0.3, 0.01).require_small()


def zenoh_session(certs: Path, mode: str, endpoint: str, role: str) -> zenoh.Session:
    settings = session_settings(mode, connect=[endpoint], timeout_ms=2000)
    return zenoh.open(configuration({**settings, **Link.to(endpoint, certs / role).settings()}))


@pytest.mark.parametrize("mode", ["peer", "router"])
def test_who_connects_as_something_else_is_under_the_same_rules(
    mode: str, hub: Bus, certs: Path, endpoint: str
) -> None:
    heard = heard_by(hub)
    with zenoh_session(certs, mode, endpoint, "viewer") as session:
        time.sleep(settle_s)
        for topic in ALL_TOPICS:
            session.put(full_key(realm, robot, topic.key), b"x")
        session.delete(full_key(realm, robot, topics.STOP.key))
        time.sleep(settle_s)
    assert heard == set()


def test_nobody_hears_a_deletion(hub: Bus, certs: Path, endpoint: str) -> None:
    heard = heard_by(hub)
    with zenoh_session(certs, "client", endpoint, "operator") as session:
        session.delete(full_key(realm, robot, topics.STOP.key))
        time.sleep(settle_s)
    assert heard == set()


def test_nobody_may_be_a_hub_with_a_roles_certificate(certs: Path, tmp_path: Path) -> None:
    endpoint = f"tls/127.0.0.1:{free_port(18447)}"
    local = f"unixsock-stream/{tmp_path / 'hub.sock'}"
    with (
        Bus.hub(local, realm, robot, [endpoint], Identity.read(certs / "viewer")),
        pytest.raises(NoSystemError, match="certs show"),
    ):
        Bus.client(endpoint, realm, robot, identity=Identity.read(certs / "robot"), timeout_ms=1000)


def test_a_revoked_certificate_does_not_connect(tmp_path: Path) -> None:
    folder = tmp_path / "certs"
    make(folder, [], days=1)
    (folder / "viewer").rename(tmp_path / "stolen")
    revoke(folder, [], days=1)
    endpoint = f"tls/127.0.0.1:{free_port(18447)}"
    local = f"unixsock-stream/{tmp_path / 'hub.sock'}"
    with Bus.hub(local, realm, robot, [endpoint], Identity.read(folder / "hub")) as hub:
        receive_newcomers(hub, run)
        for good, stranger in ((folder / "viewer", False), (tmp_path / "stolen", True)):
            if stranger:
                with pytest.raises(MissingComponentError):
                    find_run(Link.to(endpoint, good), realm, timeout_ms=1000)
            else:
                assert find_run(Link.to(endpoint, good), realm).realm == realm


def test_without_a_certificate_nobody_gets_in(hub: Bus, endpoint: str) -> None:
    for address in (endpoint, endpoint.replace("tls/", "tcp/")):
        settings = session_settings("client", connect=[address], timeout_ms=1000)
        with pytest.raises(zenoh.ZError):
            zenoh.open(configuration(settings))


def test_on_its_own_machine_the_hubs_user_may_do_everything(certs: Path, tmp_path: Path) -> None:
    local = f"unixsock-stream/{tmp_path / 'hub.sock'}"
    port = f"tls/127.0.0.1:{free_port(18447)}"
    with Bus.hub(local, realm, robot, [port], Identity.read(certs / "hub")) as hub:
        receive_newcomers(hub, run)
        heard = heard_by(hub)
        with Bus.client(local, realm, robot) as bus:
            assert ask_access(bus).role == "local"
            assert bus.ask(topics.RUN, RunRequest(stamp_ns=0)).realm == realm
            for topic in ALL_TOPICS:
                bus.publish_bytes(topic, b"x")
            time.sleep(settle_s)
    assert heard == {topic.key for topic in ALL_TOPICS}
