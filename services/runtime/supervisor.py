"""Starts the processes of one machine, watches them, restarts what died or hung, stops all.

Beside the hub it keeps the last value of state topics for late joiners, answers `status`, and keeps
an eye on the services that other machines run.
"""

import os
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import IO

from schemas import topics
from schemas.codec import MalformedMessageError, decode
from schemas.health import (
    Fault,
    Heartbeat,
    ServiceHealth,
    ServiceState,
    StatusRequest,
    SystemStatus,
)
from schemas.run import RunConfig
from services.process_table import PROCESSES, Process
from services.runtime import clock
from services.runtime.joining import receive_newcomers
from services.runtime.link import Link
from services.runtime.mailbox import Mailbox, Sample
from services.runtime.process import MISSING_COMPONENT, TLS_FLAG
from services.runtime.run_directory import RunDirectory
from services.runtime.wire import Bus

_hung_after_s = 6.0
_ready_within_s = 90.0
_backoff_first_s, _backoff_last_s = 0.1, 5.0
_steady_after_s = 5.0
_crashes_a_minute = 10
_terminate_s = 3.0
_status_hz = 2.0
_kept_faults = 20
_one_thread = {"OPENBLAS_NUM_THREADS": "1"}
"""Services are many and their matrices small: more threads of each only get in the others' way."""

Say = Callable[[str], None]
"""Told in one line what the supervisor did."""


@dataclass
class Service:
    """One supervised process and what is known of it."""

    process: Process
    child: subprocess.Popen[bytes] | None = None
    state: ServiceState = ServiceState.STARTING
    started: float = 0.0
    restarts: int = 0
    backoff_s: float = _backoff_first_s
    restart_at: float = 0.0
    elsewhere: bool = False
    """Whether another machine runs it."""
    ready: bool = False
    """Whether it has declared itself ready since it was started. A hung process loses its link,
    and with it the declaration, but it stays one that must show signs of life."""
    beat: Heartbeat | None = None
    heard: float = 0.0
    crashes: deque[float] = field(default_factory=lambda: deque[float](maxlen=_crashes_a_minute))
    detail: str = ""

    @property
    def name(self) -> str:
        """As in the process table."""
        return self.process.name


class Supervisor:
    """Owns the child processes of one machine. All methods are called from one thread.

    Args:
        run: settings of the run.
        processes: what to run here.
        directory: for the services' output and settings.
        bus: the hub, or a connection to one elsewhere.
        say: is told what happens.
        elsewhere: what other machines must run; none of them may run anything if it is None.
        link: how the services reach the hub; by default it is the directory's.
    """

    def __init__(
        self,
        run: RunConfig,
        processes: Iterable[Process],
        directory: RunDirectory,
        bus: Bus,
        say: Say,
        *,
        elsewhere: Iterable[Process] | None = None,
        link: Link | None = None,
    ) -> None:
        self._run, self._directory, self._bus, self._say = run, directory, bus, say
        self._is_hub = link is None
        self._link = link or Link(directory.endpoint)
        self._services = {process.name: Service(process) for process in processes}
        self._takes_guests = elsewhere is not None
        for process in elsewhere or ():
            self._services[process.name] = Service(process, elsewhere=True)
        self._inbox = Mailbox([topics.HEARTBEAT, topics.FAULT])
        self._lock = threading.Lock()
        self._readiness: deque[tuple[str, bool]] = deque()
        self._faults: deque[Fault] = deque(maxlen=_kept_faults)
        self._status_rate = clock.Rate(_status_hz)
        self._was_ready = False
        self._unlinked = 0.0
        self._status = self._current_status()

    @property
    def ready(self) -> bool:
        """Whether every service has been ready once."""
        self._was_ready = self._was_ready or all(s.ready for s in self._services.values())
        return self._was_ready

    @property
    def missing_component(self) -> str | None:
        """What a service that cannot run here said, or None."""
        for service in self._services.values():
            if service.child is not None and service.child.returncode == MISSING_COMPONENT:
                return service.detail
        return None

    @property
    def failed(self) -> Service | None:
        """A service that was given up, or None."""
        failed = (s for s in self._services.values() if s.state is ServiceState.FAILED)
        return next(failed, None)

    def start(self) -> None:
        """Start every process of this machine."""
        self._bus.subscribe(topics.HEARTBEAT, self._enqueue)
        self._bus.subscribe(topics.FAULT, self._enqueue)
        if self._is_hub:
            self._bus.serve_last_values()
            self._bus.watch_ready(lambda name, there: self._readiness.append((name, there)))
            self._bus.serve(topics.STATUS, self._answer)
            receive_newcomers(self._bus, self._run)
        for service in self._services.values():
            if not service.elsewhere:
                self._launch(service)

    def poll(self) -> None:
        """Look after everything once; call it some twenty times a second."""
        self._read_inbox()
        for service in self._services.values():
            self._look_after(service)
        self._status = self._current_status()
        if self._is_hub and self._status_rate.due():
            self._bus.publish(topics.SYSTEM_STATUS.of(self._status))

    def stop(self) -> None:
        """End every process: a request first, then by force. Takes at most about 4 s."""
        children = [s.child for s in self._services.values() if s.child is not None]
        for child in children:
            child.terminate()
        deadline = time.monotonic() + _terminate_s
        for child in children:
            try:
                child.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
        for service in self._services.values():
            service.state = ServiceState.STOPPED

    def output_of(self, service: Service) -> str:
        """File with what a service wrote."""
        return str(self._directory.output_file(service.name))

    def pids(self) -> dict[str, int]:
        """Process numbers of the living services."""
        return {
            service.name: service.child.pid
            for service in self._services.values()
            if service.child is not None and service.child.poll() is None
        }

    def _launch(self, service: Service) -> None:
        service.started = time.monotonic()
        service.ready, service.beat = False, None
        service.state = ServiceState.RESTARTING if service.restarts else ServiceState.STARTING
        with self._directory.output_file(service.name).open("ab") as output:
            service.child = subprocess.Popen(
                self._command(service),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env={**_one_thread, **os.environ},
                start_new_session=True,
            )

    def _command(self, service: Service) -> list[str]:
        config = str(self._directory.config_file)
        return [
            *(sys.executable, "-m", "services.runtime.process", service.name),
            *(config, self._link.endpoint),
            *([f"{TLS_FLAG}{self._link.identity.folder}"] if self._link.identity else []),
        ]

    def _look_after(self, service: Service) -> None:
        if service.state in (ServiceState.FAILED, ServiceState.STOPPED):
            return
        now = time.monotonic()
        child = service.child
        if service.elsewhere:
            self._listen_for(service, now)
        elif child is None:
            if now >= service.restart_at:
                self._launch(service)
        elif child.poll() is not None:
            self._ended(service, child.returncode, now)
        elif service.ready:
            self._check_alive(service, child, now)
        elif now - service.started > _ready_within_s:
            self._say(f"{service.name} was not ready within {_ready_within_s:.0f} s: killed")
            child.kill()

    def _listen_for(self, service: Service, now: float) -> None:
        """Another machine's supervisor looks after it; here it is only told how it is."""
        if not service.heard:
            service.detail = "no machine has started it yet"
        elif now - service.heard > _hung_after_s:
            if service.state is ServiceState.RUNNING:
                self._say(f"{service.name} is not heard any more")
            service.state = ServiceState.AWAY
            service.detail = f"not heard for {now - service.heard:.0f} s"
        else:
            if service.state is not ServiceState.RUNNING:
                self._say(f"{service.name} is there")
            service.state, service.detail = ServiceState.RUNNING, ""

    def _check_alive(self, service: Service, child: subprocess.Popen[bytes], now: float) -> None:
        silent_s = now - max(service.heard, service.started, self._linked_since(now))
        if silent_s > _hung_after_s:
            service.state, service.detail = ServiceState.HUNG, f"silent for {silent_s:.1f} s"
            self._say(f"{service.name} is hung ({service.detail}): killed")
            child.kill()
            return
        service.state = ServiceState.RUNNING
        if now - service.started > _steady_after_s:
            service.backoff_s = _backoff_first_s

    def _linked_since(self, now: float) -> float:
        """Who cannot hear must not say that the others are silent."""
        if self._is_hub:
            return 0.0
        if not self._bus.is_linked:
            self._unlinked = now
        return self._unlinked

    def _ended(self, service: Service, code: int, now: float) -> None:
        reason = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
        last = last_line(self._directory, service.name)
        service.detail = f"{reason}: {last}" if last else reason
        service.ready = False
        service.crashes.append(now)
        if code == MISSING_COMPONENT:
            service.state, service.detail = ServiceState.FAILED, last
            return
        crashes = service.crashes
        if len(crashes) == crashes.maxlen and now - crashes[0] < 60:
            service.state = ServiceState.FAILED
            self._say(f"{service.name} failed {len(crashes)} times in a minute: given up")
            return
        self._say(f"{service.name} ended ({service.detail}): restart in {service.backoff_s:.1f} s")
        service.state, service.child = ServiceState.RESTARTING, None
        service.restarts += 1
        service.restart_at = now + service.backoff_s
        service.backoff_s = min(2 * service.backoff_s, _backoff_last_s)

    def _enqueue(self, sample: Sample) -> None:
        with self._lock:
            self._inbox.put(sample)

    def _read_inbox(self) -> None:
        while self._readiness:
            name, there = self._readiness.popleft()
            if name in self._services and there:
                self._services[name].ready = True
        while True:
            with self._lock:
                sample = self._inbox.take()
            if sample is None:
                return
            self._note(sample)

    def _note(self, sample: Sample) -> None:
        try:
            if sample.topic is topics.FAULT:
                self._faults.append(decode(sample.payload, Fault))
                return
            beat = decode(sample.payload, Heartbeat)
        except MalformedMessageError as error:
            self._faults.append(self._own_fault("malformed message", str(error)))
            return
        service = self._services.get(beat.node) or self._guest(beat.node)
        if service is None:
            return
        if service.elsewhere and service.beat is not None and service.beat.pid != beat.pid:
            service.restarts += 1
        # A service beats once its subscriptions are in place.
        if service.elsewhere or (service.child is not None and beat.pid == service.child.pid):
            service.beat, service.heard, service.ready = beat, time.monotonic(), True

    def _guest(self, name: str) -> Service | None:
        """A service that nobody has to wait for and that another machine started all the same."""
        rows = [process for process in PROCESSES if process.name == name]
        if not (rows and self._takes_guests):
            return None
        return self._services.setdefault(name, Service(rows[0], elsewhere=True))

    def _own_fault(self, what: str, detail: str) -> Fault:
        return Fault(stamp_ns=clock.now_ns(), node="supervisor", what=what, detail=detail)

    def _answer(self, request: StatusRequest) -> SystemStatus:
        del request
        return self._status

    def _current_status(self) -> SystemStatus:
        return SystemStatus(
            stamp_ns=clock.now_ns(),
            realm=self._run.realm,
            robot=self._run.robot,
            world=self._run.world,
            ready=self.ready,
            services=tuple(_health(service) for service in self._services.values()),
            faults=tuple(self._faults),
        )


def _health(service: Service) -> ServiceHealth:
    beat = service.beat
    return ServiceHealth(
        name=service.name,
        state=service.state,
        pid=service.child.pid if service.child is not None else beat.pid if beat else 0,
        restarts=service.restarts,
        age_s=round(time.monotonic() - service.heard, 3) if beat else -1.0,
        handled=beat.handled if beat else 0,
        busy=beat.busy if beat else 0.0,
        handler_ms=beat.handler_ms if beat else 0.0,
        lost=beat.lost if beat else 0,
        replaced=beat.replaced if beat else 0,
        malformed=beat.malformed if beat else 0,
        detail=service.detail,
        host=beat.host if beat else "",
        clock_offset_ms=beat.clock_offset_ms if beat else 0.0,
    )


def last_line(directory: RunDirectory, service: str) -> str:
    """Last thing a service wrote, for telling why it ended."""
    path = directory.output_file(service)
    if not path.exists():
        return ""
    with path.open("rb") as stream:
        lines = _tail(stream).decode(errors="replace").strip().splitlines()
    return lines[-1].strip() if lines else ""


def _tail(stream: IO[bytes], size: int = 4000) -> bytes:
    stream.seek(0, 2)
    stream.seek(max(0, stream.tell() - size))
    return stream.read()
