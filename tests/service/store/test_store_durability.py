"""kill -9 of the server under a stream of batches: what was acknowledged is there, once and whole."""

import os
import random
import threading
import time

from tests.support.store_server import Place, running
from tests.support.streams import BATCH, Stream, check_kept

SOAK = os.environ.get("UNDERSKIN_SOAK") == "1"
KILLS = {"sqlite": 200 if SOAK else 10, "postgresql": 50 if SOAK else 3}
SENDERS = 2


def test_what_was_acknowledged_survives_any_kill(place: Place) -> None:
    backend = "postgresql" if place.database_url else "sqlite"
    moments = random.Random(7)
    streams = [Stream(sender) for sender in range(SENDERS)]
    for kill in range(KILLS[backend]):
        with running(place) as server:
            threads = [threading.Thread(target=stream.send, args=(server.http,)) for stream in streams]
            for thread in threads:
                thread.start()
            if kill % 4:  # mostly amid the stream, else before or as it sets in
                streams[0].flowing.wait(20)
            time.sleep(moments.uniform(0.0, 0.6))
            server.kill()
            for thread in threads:
                thread.join()
            for stream in streams:
                stream.flowing.clear()
    with running(place) as server:
        check_kept(server, streams, BATCH * KILLS[backend])
