"""The one exception base of this package."""


class GroundingError(ValueError):
    """Something about a lexicon, grammar, corpus or weight file that a person has to mend."""
