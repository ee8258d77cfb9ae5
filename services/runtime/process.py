"""One service in the foreground: what a child of the supervisor, or a person, starts."""

import ctypes
import os
import signal
import threading

from schemas.run import RunConfig
from services.process_table import Process
from services.runtime.wire import Bus
from services.runtime.worker import Worker, build_node

_pr_set_pdeathsig = 1


def run_process(
    process: Process, run: RunConfig, endpoint: str, *, supervised: bool, stepped: bool = False
) -> None:
    """Serve until SIGTERM or Ctrl-C.

    Raises:
        NoSystemError: no hub at the endpoint.
        MissingComponentError: this machine cannot run the node.
    """
    if supervised:
        _die_with_parent()
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda _number, _frame: stop.set())
    node = build_node(process, run)
    with Bus.client(endpoint, run.realm, run.robot) as bus:
        Worker(process, node, bus, stepped=stepped).run(stop)


def _die_with_parent() -> None:
    """An orphan would hold ports and drive on; the kernel ends it with its supervisor."""
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_pr_set_pdeathsig, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
