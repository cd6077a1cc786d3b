"""kill -9 of the server under a stream of batches: what was acknowledged is there, once and whole."""

import random
import threading
import time

import pytest

from bench.figures import Figure
from bench.soak import SOAK, record
from tests.support.store_server import Place, running
from tests.support.streams import BATCH, Stream, check_kept

# In parts, so that an interrupted soak goes on with the next one.
PARTS = 10 if SOAK else 1
KILLS = {"sqlite": 20 if SOAK else 4, "postgresql": 5 if SOAK else 2}
SENDERS = 2


@pytest.mark.parametrize("part", range(PARTS))
def test_what_was_acknowledged_survives_any_kill(place: Place, part: int) -> None:
    backend = "postgresql" if place.database_url else "sqlite"
    moments = random.Random(7 + part)
    streams = [Stream(sender) for sender in range(SENDERS)]
    for kill in range(KILLS[backend]):
        with running(place) as server:
            threads = [threading.Thread(target=stream.send, args=(server.http,)) for stream in streams]
            for thread in threads:
                thread.start()
            if kill % 4:  # mostly amid the stream, else before or as it sets in
                streams[0].flowing.wait(240)
            time.sleep(moments.uniform(0.0, 0.6))
            server.kill()
            for thread in threads:
                thread.join()
            for stream in streams:
                stream.flowing.clear()
    with running(place) as server:
        check_kept(server, streams, BATCH * KILLS[backend])
    record(Figure("Kills of a server with nothing acknowledged lost", KILLS[backend], "", 250))
