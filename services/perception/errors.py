"""What can be wrong about weights, networks and pictures: a base, and a kind for each remedy."""

from schemas.errors import MissingComponentError, UserError


class PerceptionError(Exception):
    """Something about weights, detectors or pictures that a person has to mend."""


class MissingWeightsError(PerceptionError, MissingComponentError):
    """A file of ours is missing or is not what it was; the text says how to make it again."""


class MissingFramesError(PerceptionError, MissingComponentError):
    """Labelled pictures that training needs are not there."""


class DetectorFileError(PerceptionError, UserError):
    """A network, or a file beside it, that cannot be used; the text says why, and what can."""


class UnusablePictureError(PerceptionError, ValueError):
    """A camera frame in which nothing can be recognised."""
