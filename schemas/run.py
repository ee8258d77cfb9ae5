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
    view_range_m: float = 0.0
    """Radius of the field of view that an experiment gives the robot; 0 is its own camera's."""
    view_fov_rad: float = 0.0
    """Width of that field of view; not used while `view_range_m` is 0."""
    detectors: tuple[str, ...] = ()
    """ONNX files of the networks that find objects in pictures; none is the one trained here."""
    detector_classes: tuple[str, ...] = ()
    """Files with the names of their classes, one for each; none if they say them themselves."""
    adaptive: bool = True
    """Whether perception attends to what the instruction needs, or to all of every picture."""
    web_port: int = 8080
    web_token: str = ""
    """Secret in the page's address; "" lets the page make one up. Never recorded."""
    log: str = ""
    """File the recorder writes; "" records nothing."""
    tags: str = ""
    """JSON file that says which tag hangs in which place; "" numbers the robot's places from 0."""
    camera: str = ""
    """Where pictures come from instead of the simulated robot: a device, an address, a file or a
    folder; "" is the robot's own camera."""
    camera_calibration: str = ""
    """JSON file with the lens of `camera`; "" supposes one with the robot's field of view."""
