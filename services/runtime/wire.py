"""Zenoh, and the traps around it. Nothing else imports zenoh.

Every process is a client of one hub, so that there is one place for access rules and nothing
listens beyond this machine. Messages are dropped rather than block a publisher (one stuck reader
would stop everybody for five seconds), and the sequence numbers show what was lost.
"""

import json
import secrets
import struct
import threading
from collections.abc import Callable, Iterable, Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any

import zenoh
from msgspec import Struct

from schemas.codec import MalformedMessageError, decode, encode
from schemas.errors import MissingComponentError
from schemas.topics import ALL_TOPICS, LAST, READY, Output, Qos, Query, Topic, full_key
from services.runtime import clock
from services.runtime.link import Link, Listen
from services.runtime.mailbox import Sample

if TYPE_CHECKING:
    from services.runtime.identity import Identity

_header = struct.Struct("<QQq")


class NoSystemError(MissingComponentError):
    """Nobody answers at the endpoint."""


class NoAnswerError(MissingComponentError):
    """A query was not answered in time, or the answer was a refusal."""


def session_settings(
    mode: str, *, listen: Iterable[str] = (), connect: Iterable[str] = (), timeout_ms: int = 8000
) -> dict[str, Any]:
    """Zenoh's settings for a session that is invisible beyond its endpoints."""
    return {
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/timeout_ms": timeout_ms,
        "connect/retry": {
            "period_init_ms": 100,
            "period_max_ms": 500,
            "period_increase_factor": 2,
        },
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": 2000,
        # The default of 1 ms drops small messages behind a picture whenever a core is busy.
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 20_000,
        # Room for a burst of commands, goals and events while this process gets no core.
        "transport/link/tx/queue/size/real_time": 16,
        "transport/link/tx/queue/size/data_high": 16,
    }


def hub_settings(listen: Listen, realm: str, robot: str) -> dict[str, Any]:
    """Zenoh's settings for the hub of one realm."""
    session = session_settings("router", listen=listen.endpoints)
    return {**session, **listen.settings(realm, robot)}


def configuration(settings: Mapping[str, Any]) -> zenoh.Config:
    """Settings in the form that a session is opened with."""
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


class Bus:
    """One process's connection. Use it as a context manager.

    A session that is not closed keeps the process alive for ever.
    """

    def __init__(self, config: zenoh.Config, realm: str, robot: str) -> None:
        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            why = str(error).partition(" at /")[0]
            raise NoSystemError(f"cannot reach the hub: {why}") from error
        self._realm, self._robot = realm, robot
        self._publisher = secrets.randbits(63)
        self._sequences: dict[str, int] = {}
        self._lock = threading.Lock()
        self._declared: list[Any] = []

    @classmethod
    def client(
        cls,
        endpoint: str,
        realm: str,
        robot: str,
        timeout_ms: int = 8000,
        identity: "Identity | None" = None,
    ) -> "Bus":
        """Connect to a hub. It listens nowhere itself: all that it sends goes by the hub's rules.

        Raises:
            EndpointError: the endpoint is none, or needs an identity.
            NoSystemError: nobody listens there within the timeout, or lets us in.
        """
        link = Link(endpoint, identity)
        session = session_settings("client", connect=[link.endpoint], timeout_ms=timeout_ms)
        try:
            return cls(configuration({**session, **link.settings()}), realm, robot)
        except NoSystemError as error:
            raise NoSystemError(f"{error}{link.why_not()}") from error

    @classmethod
    def hub(
        cls,
        endpoint: str,
        realm: str,
        robot: str,
        also: Iterable[str] = (),
        identity: "Identity | None" = None,
    ) -> "Bus":
        """Be the hub that everybody connects to.

        Args:
            endpoint: where it listens on this machine.
            realm: of the run.
            robot: of the run.
            also: more endpoints, for other machines.
            identity: the hub's; with it come rules about who may do what.

        Raises:
            EndpointError: an endpoint is none, or needs an identity, or would be open to all.
        """
        listen = Listen((endpoint, *also), identity)
        return cls(configuration(hub_settings(listen, realm, robot)), realm, robot)

    def __enter__(self) -> "Bus":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the session; safe to call twice."""
        if not self._session.is_closed():
            self._session.close()

    @property
    def session(self) -> str:
        """Number of this connection, as the others see it."""
        return str(self._session.info.zid())

    @property
    def is_linked(self) -> bool:
        """Whether a hub is at the other end just now."""
        return bool(self._session.info.routers_zid())

    def name_of(self, session: str) -> str | None:
        """Name in the certificate with which a session connected; None if it came without."""
        for link in self._session.info.links():
            if str(link.zid) == session:
                return link.auth_identifier
        return None

    def publish(self, output: Output) -> Sample:
        """Send a message; returns what went out."""
        return self.publish_bytes(output.topic, encode(output.message))

    def publish_bytes(
        self, topic: Topic[Any], payload: bytes, sequence: int | None = None
    ) -> Sample:
        """Send an encoded message, with the next sequence number unless one is given."""
        with self._lock:
            if sequence is None:
                sequence = self._sequences.get(topic.key, 0)
            self._sequences[topic.key] = sequence + 1
        sample = Sample(topic, payload, self._publisher, sequence, clock.now_ns())
        self._session.put(
            self._key(topic.key),
            payload,
            attachment=_header.pack(sample.publisher, sample.sequence, sample.sent_ns),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=_priority(topic),
            express=topic.qos is Qos.NEVER_DROP or topic.rank <= 1,
        )
        return sample

    def subscribe(self, topic: Topic[Any], on_sample: Callable[[Sample], None]) -> None:
        """Call `on_sample` for each message, in a thread of zenoh's; it must only enqueue."""

        def receive(received: zenoh.Sample) -> None:
            on_sample(_sample(topic, received.payload, received.attachment))

        self._declared.append(self._session.declare_subscriber(self._key(topic.key), receive))

    def subscribe_all(self, on_sample: Callable[[Sample], None]) -> None:
        """Call `on_sample` for each message of every topic."""
        for topic in ALL_TOPICS:
            self.subscribe(topic, on_sample)

    def serve_last_values(self) -> None:
        """Keep the last message of every state topic and give it to late joiners."""
        last: dict[str, Sample] = {}

        def keep(sample: Sample) -> None:
            last[sample.topic.key] = sample

        def answer(query: zenoh.Query) -> None:
            with query:
                key = str(query.key_expr)
                sample = last.get(key.removeprefix(self._key(f"{LAST}/")))
                if sample is not None:
                    header = _header.pack(sample.publisher, sample.sequence, sample.sent_ns)
                    query.reply(key, sample.payload, attachment=header)

        for topic in ALL_TOPICS:
            if topic.keep_last:
                self.subscribe(topic, keep)
        self._declared.append(self._session.declare_queryable(self._key(f"{LAST}/**"), answer))

    def last_value(self, topic: Topic[Any], timeout_s: float = 2.0) -> Sample | None:
        """Last message of a state topic, or None if there was none yet."""
        for reply in self._session.get(self._key(f"{LAST}/{topic.key}"), timeout=timeout_s):
            if reply.ok is not None:
                return _sample(topic, reply.ok.payload, reply.ok.attachment)
        return None

    def serve(self, query: Query[Any, Any], answer: Callable[[Any], Struct]) -> None:
        """Answer a query; a request that does not decode gets an error that says why."""

        def respond(asked: zenoh.Query) -> None:
            with asked:
                try:
                    data = asked.payload.to_bytes() if asked.payload is not None else b""
                    request = decode(data, query.request)
                except MalformedMessageError as error:
                    asked.reply_err(str(error).encode())
                    return
                asked.reply(self._key(query.key), encode(answer(request)))

        self._declared.append(self._session.declare_queryable(self._key(query.key), respond))

    def ask(self, query: Query[Any, Any], request: Struct, timeout_s: float = 2.0) -> Any:
        """Ask for a snapshot.

        Raises:
            NoAnswerError: nobody answered, or the answer was an error.
        """
        payload = encode(request)
        for reply in self._session.get(self._key(query.key), payload=payload, timeout=timeout_s):
            if reply.ok is not None:
                return decode(reply.ok.payload.to_bytes(), query.reply)
            if reply.err is not None:
                raise NoAnswerError(f"{query.key}: {reply.err.payload.to_string()}")
        raise NoAnswerError(f"{query.key}: nobody answered within {timeout_s:g} s")

    def declare_ready(self, name: str) -> None:
        """Tell the supervisor that this service's subscriptions are in place."""
        token = self._session.liveliness().declare_token(self._key(f"{READY}/{name}"))
        self._declared.append(token)

    def watch_ready(self, on_change: Callable[[str, bool], None]) -> None:
        """Call `on_change(name, is_there)` when a service gets ready or is gone."""

        def changed(received: zenoh.Sample) -> None:
            name = str(received.key_expr).rsplit("/", 1)[1]
            on_change(name, received.kind == zenoh.SampleKind.PUT)

        self._declared.append(
            self._session.liveliness().declare_subscriber(
                self._key(f"{READY}/*"), changed, history=True
            )
        )

    def _key(self, key: str) -> str:
        return full_key(self._realm, self._robot, key)


def _priority(topic: Topic[Any]) -> zenoh.Priority:
    if topic.rank <= 1:
        return zenoh.Priority.REAL_TIME
    if topic.qos is Qos.NEVER_DROP:
        return zenoh.Priority.DATA_HIGH
    return zenoh.Priority.DATA


def _sample(topic: Topic[Any], payload: zenoh.ZBytes, attachment: zenoh.ZBytes | None) -> Sample:
    header = attachment.to_bytes() if attachment is not None else b""
    if len(header) == _header.size:
        publisher, sequence, sent_ns = _header.unpack(header)
    else:
        # A stranger's message: never counted as a loss, and refused later if it does not decode.
        publisher, sequence, sent_ns = secrets.randbits(63), 0, clock.now_ns()
    return Sample(topic, payload.to_bytes(), publisher, sequence, sent_ns)
