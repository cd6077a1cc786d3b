"""What the store refuses."""


class Missing(LookupError):
    """There is no such campaign, recording or skin."""


class Conflict(ValueError):
    """What was asked does not fit the state of what is kept."""
