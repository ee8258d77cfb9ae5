"""The settings of one run, recorded with its log."""

from msgspec import Struct


class RunConfig(Struct, frozen=True, kw_only=True):
    """Everything that, with the code, decides what a run does."""

    robot: str = "husky"
    world: str = "hydrant"
    """Name of a world, or path of a world file; only the simulated hardware reads it."""
    seed: int = 0
    particles: int = 100
    realm: str = "default"
    """Isolates parallel runs from one another."""
    start_ns: int = 0
    """Time at which the run began, since the epoch; 0 in lockstep."""
    web_port: int = 8080
    web_token: str = ""
    """Secret in the page's address; "" lets the page make one up. Never recorded."""
    log: str = ""
    """File the recorder writes; "" records nothing."""
