"""The one exception base of this package."""

from schemas.errors import UserError


class GroundingError(UserError):
    """Something about a lexicon, grammar, corpus or weight file that a person has to mend."""
