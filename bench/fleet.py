"""Ten skins of one batch diagnosed as a fleet, from their campaigns' thousand recordings."""

import time

from bench.diagnosed import document
from bench.diagnosis import PRELOADS_N
from bench.figures import Figure
from underskin.compiled import load_all
from underskin.diagnosis.several.fleet import diagnose_fleet
from underskin.recordings.campaign import parse
from underskin.surrogate.sigma_table import load_table

_SKINS, _LONGEST = 10, 60.0


def measure() -> list[Figure]:
    """Seconds of the clock and of the processor, in this process alone."""
    load_all()
    table = load_table()
    documents = {
        f"skin-{number}": document({}, columns=5, preloads_n=PRELOADS_N, lines=60, seed=number)
        for number in range(_SKINS)
    }
    skins = {skin: [parse({**documents_of_skin, "name": skin})] for skin, documents_of_skin in documents.items()}
    recordings = sum(len(documents_of_skin[0].recordings) for documents_of_skin in skins.values())
    clock, processor = time.perf_counter(), time.process_time()
    diagnose_fleet(skins, table, "bench")
    clock, processor = time.perf_counter() - clock, time.process_time() - processor
    what = f"{recordings:,} recordings × 60 lines of {_SKINS} skins, as a fleet"
    return [Figure(what, clock, "s", _LONGEST, "lower"), Figure(f"{what}: processor time", processor, "s")]
