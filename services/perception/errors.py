"""The one exception base of this package."""

from schemas.errors import MissingComponentError


class PerceptionError(MissingComponentError):
    """Something about weights, card or pictures that a person has to mend."""
