"""Ways to send bytes to another process and get them back, all behind one interface.

A frame is a payload whose first eight bytes are its number. The other ends are in `echo.py`.
Two links of ours can share a hub: each has a realm of its own.
"""

import ctypes
import queue
import socket
import struct
import time
from typing import Annotated, Any, Protocol

import iceoryx2
import numpy as np
from msgspec import Struct

from schemas.arrays import Bytes, Shape
from schemas.codec import decode, encode
from schemas.topics import Qos, Topic
from services.runtime.mailbox import Sample
from services.runtime.wire import Bus

SIZES: dict[str, int] = {"100 B": 100, "64 KB": 64 << 10, "1 MB": 1 << 20}
ROBOT = "husky"

_number = struct.Struct("<Q")
_length = struct.Struct("<I")
# Most of its names come out of a compiled module without types.
_iceoryx: Any = iceoryx2


class Blob(Struct, frozen=True, kw_only=True):
    """A message that is nearly all payload."""

    stamp_ns: int
    data: Annotated[Bytes, Shape("N")]


def _topic(direction: str, size: int) -> Topic[Blob]:
    # Small messages of the system are events or commands, large ones pictures.
    qos = Qos.NEVER_DROP if size < 1000 else Qos.LATEST_WINS
    return Topic(f"bench/{direction}/{size}", Blob, qos, 0, rank=10)


PINGS = {size: _topic("ping", size) for size in SIZES.values()}
PONGS = {size: _topic("pong", size) for size in SIZES.values()}


class Link(Protocol):
    """One end of a connection."""

    def send(self, frame: bytes) -> None: ...

    def receive(self, timeout_s: float) -> bytes | None:
        """The next frame, or None if none came in time."""
        ...

    def close(self) -> None: ...


def frame_of(number: int, size: int) -> bytes:
    return _number.pack(number) + bytes(size - _number.size)


def number_of(frame: bytes) -> int:
    return _number.unpack_from(frame)[0]


class SocketLink:
    """A unix stream socket; each frame after its length."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end

    def send(self, frame: bytes) -> None:
        self._socket.settimeout(None)
        self._socket.sendall(_length.pack(len(frame)) + frame)

    def receive(self, timeout_s: float) -> bytes | None:
        self._socket.settimeout(timeout_s)
        try:
            head = self._exactly(_length.size)
        except TimeoutError:
            return None
        self._socket.settimeout(None)
        return bytes(self._exactly(_length.unpack(head)[0]))

    def close(self) -> None:
        self._socket.close()

    def _exactly(self, size: int) -> bytearray:
        taken = bytearray(size)
        view = memoryview(taken)
        while view:
            count = self._socket.recv_into(view)
            if not count:
                raise EOFError("the other end is gone")
            view = view[count:]
        return taken


class BusLink:
    """Our wire: encoded messages over the hub, queued at the reader as in a service."""

    def __init__(
        self, endpoint: str, realm: str, out: dict[int, Topic[Blob]], back: dict[int, Topic[Blob]]
    ) -> None:
        self._bus = Bus.client(endpoint, realm, ROBOT)
        self._out = out
        self._arrived: queue.SimpleQueue[Sample] = queue.SimpleQueue()
        for topic in back.values():
            self._bus.subscribe(topic, self._arrived.put)

    def send(self, frame: bytes) -> None:
        self._bus.publish_bytes(self._out[len(frame)], frame)

    def receive(self, timeout_s: float) -> bytes | None:
        sample = self._next(timeout_s)
        return sample.payload if sample else None

    def close(self) -> None:
        self._bus.close()

    def _next(self, timeout_s: float) -> Sample | None:
        try:
            return self._arrived.get(timeout=timeout_s)
        except queue.Empty:
            return None


class MessageLink(BusLink):
    """Our wire with the codec: what is sent and received are messages."""

    def send(self, frame: bytes) -> None:
        blob = Blob(stamp_ns=0, data=np.frombuffer(frame, np.uint8))
        self._bus.publish_bytes(self._out[len(frame)], encode(blob))

    def receive(self, timeout_s: float) -> bytes | None:
        sample = self._next(timeout_s)
        return decode(sample.payload, Blob).data.tobytes()[: _number.size] if sample else None


class IceoryxLink:
    """iceoryx2: slices in shared memory, and an event that wakes the reader."""

    def __init__(self, name: str, out: str, back: str) -> None:
        _iceoryx.set_log_level(_iceoryx.LogLevel.Error)
        builder = _iceoryx.NodeBuilder.new()
        builder = builder.signal_handling_mode(_iceoryx.SignalHandlingMode.Disabled)
        self._node = builder.create(_iceoryx.ServiceType.Ipc)
        self._sender = (
            self._data(f"{name}/{out}")
            .publisher_builder()
            .initial_max_slice_len(max(SIZES.values()))
            .create()
        )
        self._reader = self._data(f"{name}/{back}").subscriber_builder().create()
        self._notifier = self._event(f"{name}/{out}").notifier_builder().create()
        self._listener = self._event(f"{name}/{back}").listener_builder().create()

    def send(self, frame: bytes) -> None:
        room = self._sender.loan_slice_uninit(len(frame))
        ctypes.memmove(room.payload_ptr, frame, len(frame))
        room.assume_init().send()
        self._notifier.notify()

    def receive(self, timeout_s: float) -> bytes | None:
        due = time.monotonic() + timeout_s
        # An event may be that of a sample which was taken before.
        while (sample := self._reader.receive()) is None:
            left = due - time.monotonic()
            if left <= 0:
                return None
            self._listener.timed_wait(_iceoryx.Duration.from_secs_f64(left))
        frame = ctypes.string_at(sample.payload_ptr, sample.payload().len())
        sample.delete()
        return frame

    def close(self) -> None:
        for port in (self._sender, self._reader, self._notifier, self._listener):
            port.delete()

    def _data(self, name: str) -> Any:
        slices = iceoryx2.Slice[ctypes.c_uint8]
        return self._service(f"{name}/data").publish_subscribe(slices).open_or_create()

    def _event(self, name: str) -> Any:
        return self._service(f"{name}/event").event().open_or_create()

    def _service(self, name: str) -> Any:
        return self._node.service_builder(_iceoryx.ServiceName.new(name))
