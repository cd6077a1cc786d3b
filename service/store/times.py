"""Times as the store writes them: ISO 8601 in UTC with microseconds, which sort as text."""

from datetime import UTC, datetime, timedelta


def now() -> str:
    """This moment."""
    return _text(datetime.now(UTC))


def after(text: str) -> str:
    """This moment, or a microsecond after another one, as the store has it or empty, where the clock is not past it."""
    moment = now()
    return moment if moment > text else _text(datetime.fromisoformat(text) + timedelta(microseconds=1))


def stored(text: str) -> str:
    """A time as a lab or a user wrote it; without a zone it is taken as UTC. Raises ValueError."""
    moment = datetime.fromisoformat(text)
    try:
        return _text(moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC))
    except OverflowError:
        raise ValueError(f"{text} is outside the years 1 to 9999") from None


def checked(text: str) -> str:
    """A text in the store's form, where there is such a time; raises ValueError."""
    datetime.fromisoformat(text)
    return text


def _text(moment: datetime) -> str:
    return moment.isoformat(timespec="microseconds").replace("+00:00", "Z")
