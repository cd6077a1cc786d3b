"""Diagnose the ledger's campaigns and print what changed against the kept answers: python -m proof.ledger [PART ...].

A run that was stopped goes on where it was while the code is the same. Ends with 1 where a part is worse by the sign
test, unless the new answers are kept.
"""

import argparse
import os
import sys
from pathlib import Path

from proof.ledger.campaigns import PARTS
from proof.ledger.run import run


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m proof.ledger", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--keep", action="store_true", help="keep the new answers")
    parser.add_argument("--work-dir", type=Path, default=Path("build/ledger"), help="where single reports are stored")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    given = parser.parse_args()
    unknown = sorted(set(given.parts) - set(PARTS))
    if unknown:
        parser.error(f"no such part: {', '.join(unknown)}; it must be one of {', '.join(PARTS)}")
    return given


if __name__ == "__main__":
    given = _arguments()
    sys.exit(run(given.parts or list(PARTS), keep=given.keep, work_dir=given.work_dir, workers=given.workers))
