"""One service in the foreground: what a person starts, or a supervisor as its child.

As a child: `python -m services.runtime.process NAME CONFIG ENDPOINT [stepped] [tls=DIR]`.
"""

import ctypes
import os
import signal
import sys
import threading
from pathlib import Path

import msgspec

from schemas.errors import MissingComponentError, UserError
from schemas.run import RunConfig
from services.process_table import Process, process_named
from services.runtime.clock_watch import ClockWatch
from services.runtime.joining import NotAllowedError, ask_access, require_access_for
from services.runtime.link import Link
from services.runtime.wire import Bus, NoAnswerError, NoSystemError
from services.runtime.worker import Worker, build_node

_pr_set_pdeathsig = 1


MISSING_COMPONENT = 5
"""Exit code of a service that this machine cannot run; it is not restarted."""
TLS_FLAG = "tls="


def run_process(process: Process, run: RunConfig, link: Link, *, stepped: bool = False) -> None:
    """Serve until SIGTERM or Ctrl-C.

    Raises:
        NoSystemError: no hub at the endpoint.
        NotAllowedError: the hub would not let it do its work.
        ClockError: the clocks of this machine and the hub's differ.
        MissingComponentError: this machine cannot run the node.
    """
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda _number, _frame: stop.set())
    if link.identity is None:
        node = build_node(process, run)
        with Bus.client(link.endpoint, run.realm, run.robot) as bus:
            Worker(process, node, bus, stepped=stepped).run(stop)
        return
    with Bus.client(link.endpoint, run.realm, run.robot, identity=link.identity) as bus:
        # Asked first: building a node may take long, and the sim opens a device.
        require_access_for(process, ask_access(bus))
        with ClockWatch(bus, process.name) as clock_watch:
            worker = Worker(process, build_node(process, run), bus, clock_watch=clock_watch)
            worker.run(stop)


def read_settings(config: Path) -> RunConfig:
    """The run's settings that a supervisor wrote.

    Raises:
        UserError: no such file, or it is something else.
    """
    if not config.is_file():
        raise UserError(f"{config}: no such settings file; 'incognita up' writes one")
    try:
        return msgspec.json.decode(config.read_bytes(), type=RunConfig)
    except msgspec.DecodeError as error:
        raise UserError(f"{config}: {error}") from error


def main() -> int:
    """What a supervisor's child does."""
    name, config, endpoint, *flags = sys.argv[1:]
    _die_with_parent()
    try:
        folders = [Path(flag.removeprefix(TLS_FLAG)) for flag in flags if TLS_FLAG in flag]
        link = Link.to(endpoint, *folders)
        run = read_settings(Path(config))
        run_process(process_named(name), run, link, stepped="stepped" in flags)
    except (NoSystemError, NoAnswerError) as error:
        print(error, file=sys.stderr)
        return 1
    except (MissingComponentError, NotAllowedError) as error:
        print(error, file=sys.stderr)
        return MISSING_COMPONENT
    return 0


def _die_with_parent() -> None:
    """An orphan would hold ports and drive on; the kernel ends it with its supervisor."""
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_pr_set_pdeathsig, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


if __name__ == "__main__":
    sys.exit(main())
