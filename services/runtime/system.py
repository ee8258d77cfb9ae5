"""A whole system on this machine: hub, supervisor and services, until someone ends it."""

import os
import secrets
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from schemas import topics
from schemas.errors import InternalFaultError, MissingComponentError
from schemas.language import Instruction
from schemas.run import RunConfig
from schemas.task import InstructionStatus, TaskState
from services.process_table import PROCESSES, Process
from services.runtime import clock
from services.runtime.link import Link
from services.runtime.mailbox import Sample
from services.runtime.run_directory import RunDirectory, SystemInfo
from services.runtime.supervisor import Supervisor
from services.runtime.wire import Bus

if TYPE_CHECKING:
    from services.runtime.identity import Identity

POLL_S = 0.05

Say = Callable[[str], None]


def prepared(run: RunConfig, runs: Path, *, web: bool, record: bool) -> RunConfig:
    """The run with everything filled in that is decided at its start."""
    return msgspec.structs.replace(
        run,
        start_ns=clock.now_ns(),
        web_port=free_port(run.web_port) if web else 0,
        web_token=secrets.token_urlsafe(16) if web else "",
        log=str(log_path(run, runs)) if record else "",
    )


def log_path(run: RunConfig, runs: Path) -> Path:
    """A new file for a run that begins now."""
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    return runs.resolve() / f"{stamp}-{run.robot}-{Path(run.world).stem}.mcap"


def chosen_processes(run: RunConfig) -> list[Process]:
    """Rows of the table that take part in a run."""
    left_out = {name for name, on in (("web", run.web_token), ("recorder", run.log)) if not on}
    taking_part = [process for process in PROCESSES if process.takes_part(run)]
    return [process for process in taking_part if process.name not in left_out]


def free_port(wanted: int, tries: int = 50) -> int:
    """The port asked for, or the next one that is free on this machine.

    Raises:
        MissingComponentError: none of the next fifty is free.
    """
    for port in range(wanted, wanted + tries):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise MissingComponentError(f"no free port from {wanted} to {wanted + tries - 1}; use --port")


def page_address(run: RunConfig) -> str:
    """Address of the page with its token; "" without a page."""
    if not run.web_token:
        return ""
    return f"http://127.0.0.1:{run.web_port}/?token={run.web_token}"


def write_settings(directory: RunDirectory, run: RunConfig, link: Link | None = None) -> None:
    """Clear what an earlier system left, and say what this one is.

    Args:
        directory: where it is said.
        run: its settings.
        link: to the hub, where that is elsewhere.
    """
    for old in (*directory.path.glob("hub.sock*"), *directory.path.glob("*.log")):
        old.unlink()
    directory.config_file.touch(mode=0o600)
    directory.config_file.write_bytes(msgspec.json.encode(run))
    directory.write_info(
        SystemInfo(
            pid=os.getpid(),
            endpoint=link.endpoint if link else directory.endpoint,
            address=page_address(run),
            log=run.log,
            run=run,
            tls=str(link.identity.folder) if link and link.identity else "",
        )
    )


class InstructionWatch:
    """Sends one instruction when the system is ready and remembers how it ended."""

    def __init__(self, hub: Bus, text: str) -> None:
        self.status: InstructionStatus | None = None
        self._hub, self._text = hub, text
        self._id = ""
        hub.subscribe(topics.INSTRUCTION_STATUS, self._note)

    @property
    def done(self) -> bool:
        """Whether it has ended, one way or the other."""
        return self.status is not None and self.status.state is not TaskState.ACTIVE

    def send(self) -> None:
        """Send it, once."""
        stamp_ns = clock.now_ns()
        self._id = f"cli-{stamp_ns}"
        instruction = Instruction(stamp_ns=stamp_ns, id=self._id, text=self._text, source="cli")
        self._hub.publish(topics.INSTRUCTION.of(instruction))

    def _note(self, sample: Sample) -> None:
        status = msgspec.msgpack.decode(sample.payload, type=InstructionStatus)
        if status.instruction_id == self._id:
            self.status = status


class System:
    """Claims the realm, starts everything, and keeps it going.

    Args:
        run: settings of the run.
        say: is told what happens.
        processes: what to run here.
        elsewhere: what other machines must run; none of them may run anything if it is None.
        listen: where other machines reach the hub.
        identity: the hub's, where there are other machines.
    """

    def __init__(
        self,
        run: RunConfig,
        say: Say,
        processes: Iterable[Process],
        *,
        elsewhere: Iterable[Process] | None = None,
        listen: Iterable[str] = (),
        identity: "Identity | None" = None,
    ) -> None:
        self.run = run
        self._say = say
        self._processes = list(processes)
        self._elsewhere = elsewhere
        self._listen, self._identity = tuple(listen), identity
        self.stop_requested = threading.Event()

    def serve(
        self, text: str | None, *, exit_when_done: bool, on_ready: Callable[[], None]
    ) -> InstructionStatus | None:
        """Run until Ctrl-C, SIGTERM, or the end of the instruction if so asked.

        Raises:
            RealmTakenError: another system runs in this realm.
            MissingComponentError: a service cannot run on this machine.
        """
        directory = RunDirectory.of(self.run.realm)
        with directory.claimed():
            write_settings(directory, self.run)
            with Bus.hub(
                directory.endpoint, self.run.realm, self.run.robot, self._listen, self._identity
            ) as hub:
                supervisor = Supervisor(
                    self.run,
                    self._processes,
                    directory,
                    hub,
                    self._say,
                    elsewhere=self._elsewhere,
                )
                watch = InstructionWatch(hub, text) if text else None
                try:
                    supervisor.start()
                    self._loop(supervisor, watch, exit_when_done, on_ready)
                finally:
                    supervisor.stop()
        return watch.status if watch else None

    def _loop(
        self,
        supervisor: Supervisor,
        watch: InstructionWatch | None,
        exit_when_done: bool,
        on_ready: Callable[[], None],
    ) -> None:
        announced = False
        while not self.stop_requested.is_set():
            supervisor.poll()
            require_all_alive(supervisor)
            if supervisor.ready and not announced:
                announced = True
                on_ready()
                if watch is not None:
                    watch.send()
            if exit_when_done and watch is not None and watch.done:
                time.sleep(0.5)
                return
            self.stop_requested.wait(POLL_S)


def require_all_alive(supervisor: Supervisor) -> None:
    """Give up when a service cannot be kept alive.

    Raises:
        MissingComponentError: it cannot run on this machine.
        InternalFaultError: it ended too often.
    """
    if supervisor.missing_component is not None:
        raise MissingComponentError(supervisor.missing_component)
    failed = supervisor.failed
    if failed is not None:
        raise InternalFaultError(
            f"{failed.name} failed for good: {failed.detail} "
            f"(its output: {supervisor.output_of(failed)})"
        )


def stop_on_signals(event: threading.Event) -> None:
    """Set the event on Ctrl-C and SIGTERM instead of raising in the middle of something."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda _number, _frame: event.set())
