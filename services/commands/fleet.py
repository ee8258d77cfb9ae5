"""Verbs for systems of several machines."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from schemas.errors import UserError
from schemas.run import RunConfig
from services.commands.output import print_json, print_table, say
from services.commands.run_options import (
    DEFAULTS,
    NO_SOURCE,
    RunOptions,
    SourceOptions,
    config_of,
)
from services.process_table import Process, process_named
from services.roles import HUB, ROLES, services_of

if TYPE_CHECKING:
    from services.runtime.identity import Identity
    from services.runtime.link import Link


def hub(
    listen: tuple[str, ...] = (),
    tls: Path | None = None,
    role: tuple[str, ...] = (),
    robot: str = "husky",
    world: str = "hydrant",
    system: RunOptions = DEFAULTS,
    source: SourceOptions = NO_SOURCE,
    settings: bool = False,
) -> int:
    """Be what the machines of a system connect to, until Ctrl-C.

    The hub decides what is run; the others ask it. On its own machine nothing needs a certificate.

    Args:
        listen: endpoints for other machines; with --tls it is tls/0.0.0.0:7447 by default.
        tls: folder of the hub's certificate, DIR/hub of 'incognita certs make DIR'.
        role: run the services of this role here as well.
        robot: one of 'incognita robots'.
        world: one of 'incognita worlds', or a world file.
        system: how it runs.
        source: where pictures come from.
        settings: print Zenoh's settings with the access rules, as JSON, and start nothing.
    """
    from robots.catalogue import get_robot
    from services.runtime.link import read_identity
    from services.runtime.system import System, prepared, stop_on_signals

    get_robot(robot)
    identity = _hub_identity(read_identity(tls)) if tls else None
    endpoints = _endpoints(listen, identity)
    if settings:
        return _print_settings(endpoints, identity, system.realm, robot)
    run = config_of(robot, world, system, source)
    here = [process for name in role for process in services_of(name, run)]
    names = [process.name for process in here]
    if "robot" in names:
        _require_world(run)
    run = prepared(run, Path("runs"), web="web" in names, record=not system.no_record)
    served = System(
        run, say, here, elsewhere=_elsewhere(here, run), listen=endpoints, identity=identity
    )
    stop_on_signals(served.stop_requested)
    say(f"hub of realm {run.realm} ({robot} in {world}) at {', '.join(endpoints) or 'no port'}")
    served.serve(None, exit_when_done=False, on_ready=lambda: _announce(run))
    return 0


def service(
    name: Annotated[tuple[str, ...], tyro.conf.Positional] = (),
    config: Path | None = None,
    connect: str | None = None,
    tls: Path | None = None,
    realm: str = "default",
) -> int:
    """Run services in the foreground: one in this process, several supervised.

    Args:
        name: as in 'incognita graph'; without one, all services of the certificate's role.
        config: file with the run's settings; without one they come from the hub.
        connect: the hub's endpoint; without one the local hub of the realm.
        tls: folder of this machine's certificate, DIR/ROLE of 'incognita certs make DIR'.
        realm: of the system.
    """
    from services.runtime.joining import find_run
    from services.runtime.link import Link
    from services.runtime.process import read_settings, run_process
    from services.runtime.run_directory import RunDirectory

    processes = [process_named(one) for one in name]
    if connect is None:
        directory = RunDirectory.of(realm)
        run = read_settings(config or directory.config_file)
        link = Link(RunDirectory.of(run.realm).endpoint)
    else:
        link = Link.to(connect, tls)
        run = read_settings(config) if config else find_run(link, realm)
    processes = processes or _of_certificate(link, run)
    if len(processes) == 1 and (name or processes[0].guest):
        run_process(processes[0], run, link)
        return 0
    return _serve_outpost(run, processes, link)


def certs(
    action: Annotated[Literal["make", "show"], tyro.conf.Positional],
    folder: Annotated[Path, tyro.conf.Positional],
    host: tuple[str, ...] = (),
    days: int = 365,
    renew: bool = False,
    revoke: bool = False,
    json: bool = False,
) -> int:
    """Certificates for the machines of a system.

    DIR/authority stays with you. Each other folder goes to the machine of its name, as it is.

    Args:
        action: make: a private authority, and a certificate for the hub and for every role; show:
            what has been issued, and until when it is good.
        folder: where they are.
        host: names and addresses by which others reach the hub.
        days: how long the certificates are good.
        renew: new certificates of the same authority; old ones stay good until they expire.
        revoke: a new authority and new certificates; old ones are refused from the hub's next
            start with its new folder.
        json: one JSON document on stdout.
    """
    from services.runtime import certificates

    if renew and revoke:
        raise UserError("--renew keeps the authority and --revoke replaces it: give one of them")
    if days < 1:
        raise UserError(f"--days {days}: at least 1")
    if action == "show":
        return _tell(certificates.identities(folder), json)
    issue = certificates.renew if renew else certificates.revoke if revoke else certificates.make
    issued = issue(folder, host, days)
    say(f"{folder}/{certificates.AUTHORITY} stays here; {folder}/{HUB} and the roles' folders go")
    say("to their machines, as they are, by a safe way (scp -p)")
    return _tell(issued, json)


def _print_settings(
    endpoints: tuple[str, ...], identity: "Identity | None", realm: str, robot: str
) -> int:
    from services.runtime.link import Listen
    from services.runtime.run_directory import RunDirectory
    from services.runtime.wire import hub_settings

    listen = Listen((RunDirectory.of(realm).endpoint, *endpoints), identity)
    print_json(hub_settings(listen, realm, robot))
    return 0


def _hub_identity(identity: "Identity") -> "Identity":
    if identity.name != HUB:
        raise UserError(
            f"{identity.folder} is the certificate of role {identity.name!r}; a hub needs DIR/hub"
        )
    return identity


def _require_world(run: RunConfig) -> None:
    from sim.node import require_pictures
    from sim.world import make_world

    require_pictures(run.robot)
    make_world(run.world, run.seed)


def _endpoints(listen: tuple[str, ...], identity: "Identity | None") -> tuple[str, ...]:
    from services.runtime.link import PORT

    return listen or ((f"tls/0.0.0.0:{PORT}",) if identity else ())


def _elsewhere(here: Sequence[Process], run: RunConfig) -> list[Process]:
    needed = [process for role in ROLES if role.needed for process in services_of(role.name, run)]
    return [process for process in needed if process not in here]


def _announce(run: RunConfig) -> None:
    from services.runtime.system import page_address

    print(f"ready: {page_address(run) or 'no page here'}", flush=True)


def _of_certificate(link: "Link", run: RunConfig) -> list[Process]:
    if link.identity is None:
        raise UserError("name a service, or give --connect and --tls: the role says which")
    return services_of(link.identity.name, run)


def _serve_outpost(run: RunConfig, processes: list[Process], link: "Link") -> int:
    from services.runtime.outpost import Outpost
    from services.runtime.system import stop_on_signals

    role = link.identity.name if link.identity else "services"
    outpost = Outpost(run, processes, link, role, say)
    stop_on_signals(outpost.stop_requested)
    say(f"starting {', '.join(process.name for process in processes)} for {link.endpoint} ...")
    outpost.serve(lambda address: print(f"ready: {address or role}", flush=True))
    return 0


def _tell(issued: Sequence["Identity"], json: bool) -> int:
    rows = [
        {
            "certificate": one.name,
            "expires": f"{one.ends:%Y-%m-%d}",
            "folder": str(one.folder),
            "hosts": list(one.hosts),
        }
        for one in issued
    ]
    if json:
        print_json(rows)
    else:
        shown = [(*list(row.values())[:3], ", ".join(row["hosts"])) for row in rows]
        print_table(("certificate", "expires", "folder", "reached by"), shown)
    return 0
