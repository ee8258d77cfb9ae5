"""Where the system is that a verb speaks to: options that several verbs share."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from schemas.errors import UserError

if TYPE_CHECKING:
    from services.runtime.client import Client
    from services.runtime.link import Link


@dataclass(frozen=True)
class Where:
    """A running system, on this machine or behind a hub elsewhere."""

    realm: str = "default"
    """Of the running system."""
    connect: str | None = None
    """The hub's endpoint if it is on another machine, tls/HOST:PORT."""
    tls: Path | None = None
    """Folder of this machine's certificate, with --connect."""

    def link(self) -> "Link | None":
        """To a hub elsewhere; None if the system is on this machine.

        Raises:
            UserError: a certificate and nothing to connect to, or the other way round.
        """
        from services.runtime.link import Link

        if self.connect is None:
            if self.tls is not None:
                raise UserError("--tls goes with --connect tls/HOST:PORT")
            return None
        return Link.to(self.connect, self.tls)

    def client(self) -> "Client":
        """A connection to it.

        Raises:
            MissingComponentError: there is no such system.
        """
        from services.runtime.client import Client

        return Client(self.realm, self.link())


System = Annotated[Where, tyro.conf.OmitArgPrefixes]
"""Type of the argument of a verb."""
HERE = Where()
