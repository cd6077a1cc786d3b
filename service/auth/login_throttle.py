"""Rate limit of login attempts by address: a few at once, then one every few seconds."""

import threading
import time
from collections import OrderedDict

AT_ONCE, SECONDS = 10, 6.0  # tries at once, and the seconds until one more is free
_MOST_ADDRESSES = 10_000  # remembered; the one that was not heard of for the longest is forgotten first


class LoginThrottle:
    """Failed and pending attempts by address, each forgotten after a while. Thread-safe."""

    def __init__(self) -> None:
        """Without failed attempts."""
        self._lock = threading.Lock()
        self._used: OrderedDict[str, tuple[float, float]] = OrderedDict()  # tries that count still, and when they did

    def begin(self, address: str) -> float:
        """Count an attempt and return 0, or return the seconds until this address may try again."""
        with self._lock:
            counting = self._counting(address)
            if counting + 1 > AT_ONCE:
                return (counting + 1 - AT_ONCE) * SECONDS
            self._count(address, counting + 1)
            return 0.0

    def succeeded(self, address: str) -> None:
        """Forget an attempt: the key was right."""
        with self._lock:
            self._count(address, max(0.0, self._counting(address) - 1))

    def _count(self, address: str, tries: float) -> None:
        self._used[address] = tries, time.monotonic()
        self._used.move_to_end(address)
        while len(self._used) > _MOST_ADDRESSES:
            self._used.popitem(last=False)

    def _counting(self, address: str) -> float:
        tries, at = self._used.get(address, (0.0, 0.0))
        return max(0.0, tries - (time.monotonic() - at) / SECONDS)
