"""Options that verbs share which start a system, and the settings of the run they stand for."""

from dataclasses import dataclass
from pathlib import Path

from schemas.run import RunConfig
from services.commands.detectors import chosen


@dataclass(frozen=True)
class RunOptions:
    """Of every system."""

    seed: int = 0
    """decides the world, the noise and every random choice."""
    particles: int = 100
    """number of map hypotheses."""
    no_record: bool = False
    """without a log."""
    port: int = 8080
    """of the page; the next free one is taken if it is in use."""
    realm: str = "default"
    """isolates parallel systems on this machine."""
    detector: tuple[Path, ...] = ()
    """ONNX files of other networks that find objects; several work as one."""
    classes: tuple[Path, ...] = ()
    """a file with the class names of each, where they do not say them themselves."""
    no_adaptive: bool = False
    """perception looks at all of every picture, whatever is asked for."""


@dataclass(frozen=True)
class SourceOptions:
    """Where pictures come from that no simulated robot makes."""

    camera: str = ""
    """pictures from outside instead of a simulated robot, to try perception on: the number of a
    camera, /dev/videoN, an rtsp:// or http:// address, a video, or a folder of pictures."""
    calibration: Path | None = None
    """JSON file with the lens of that camera."""
    tags: Path | None = None
    """JSON file that says which AprilTag hangs in which place."""


DEFAULTS = RunOptions()
NO_SOURCE = SourceOptions()
"""The robot's own camera."""


def config_of(
    robot: str, world: str, options: RunOptions, source: SourceOptions = NO_SOURCE
) -> RunConfig:
    """The settings of a run, after its detectors were tried out.

    Raises:
        UserError: one of them, or the camera, cannot be used.
    """
    if source.camera:
        _try_out(source.camera)
    detectors, detector_classes = chosen(options.detector, options.classes)
    return RunConfig(
        robot=robot,
        world=world,
        seed=options.seed,
        particles=options.particles,
        realm=options.realm,
        detectors=detectors,
        detector_classes=detector_classes,
        adaptive=not options.no_adaptive,
        camera=_absolute(source.camera),
        camera_calibration=str(source.calibration.resolve()) if source.calibration else "",
        tags=str(source.tags.resolve()) if source.tags else "",
        web_port=options.port,
    )


def _try_out(camera: str) -> None:
    """Say at once what is wrong with a source, and not by a process that dies."""
    from services.perception.camera.source import open_source

    open_source(camera).close()


def _absolute(camera: str) -> str:
    """A path as seen from wherever the camera's process runs."""
    is_path = camera and not camera.isdigit() and Path(camera).exists()
    return str(Path(camera).resolve()) if is_path else camera
