"""Services of one machine that take part in a system whose hub is on another."""

import secrets
import threading
from collections.abc import Callable, Iterable

import msgspec

from schemas.run import RunConfig
from services.process_table import Process
from services.runtime.link import Link
from services.runtime.run_directory import RunDirectory
from services.runtime.supervisor import Supervisor
from services.runtime.system import (
    POLL_S,
    Say,
    free_port,
    page_address,
    require_all_alive,
    write_settings,
)
from services.runtime.wire import Bus


class Outpost:
    """Starts some services here and keeps them going while the hub comes and goes.

    Args:
        run: settings of the run, from the hub.
        processes: what to run here.
        link: to the hub.
        name: of what runs here, told apart from other outposts on this machine.
        say: is told what happens.
    """

    def __init__(
        self, run: RunConfig, processes: Iterable[Process], link: Link, name: str, say: Say
    ) -> None:
        self._processes = list(processes)
        self._run = self._with_page(run)
        self._link, self._name, self._say = link, name, say
        self.stop_requested = threading.Event()

    def serve(self, on_ready: Callable[[str], None]) -> None:
        """Run until Ctrl-C or SIGTERM.

        Args:
            on_ready: called once with the page's address, "" without a page.

        Raises:
            RealmTakenError: the same services run here already.
            MissingComponentError: a service cannot run on this machine.
        """
        directory = RunDirectory.of(f"{self._run.realm}-{self._name}"[:40])
        with directory.claimed():
            write_settings(directory, self._run, self._link)
            with Bus.client(
                self._link.endpoint,
                self._run.realm,
                self._run.robot,
                identity=self._link.identity,
            ) as bus:
                supervisor = Supervisor(
                    self._run, self._processes, directory, bus, self._say, link=self._link
                )
                try:
                    supervisor.start()
                    self._loop(supervisor, on_ready)
                finally:
                    supervisor.stop()

    def _loop(self, supervisor: Supervisor, on_ready: Callable[[str], None]) -> None:
        announced = False
        while not self.stop_requested.wait(POLL_S):
            supervisor.poll()
            require_all_alive(supervisor)
            if supervisor.ready and not announced:
                announced = True
                on_ready(page_address(self._run))

    def _with_page(self, run: RunConfig) -> RunConfig:
        """A page has a port and a secret of this machine's own."""
        if "web" not in [process.name for process in self._processes]:
            return run
        return msgspec.structs.replace(
            run, web_port=free_port(run.web_port), web_token=secrets.token_urlsafe(16)
        )
