"""Diagnose the ledger's campaigns and print what changed against the kept answers: python -m proof.ledger [PART ...].

A run that was stopped goes on where it was while the code is the same. Ends with 1 where a part is worse by the sign
test, unless the new answers are kept.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from proof.ledger.campaigns import NEEDS, PARTS
from proof.ledger.differences import text
from proof.ledger.run import run
from proof.stored import Work


def main(names: Sequence[str], work: Work, *, keep: bool) -> int:
    """Run the parts whose data are there, print what changed, and return the exit status."""
    for name in names:
        if name in NEEDS and NEEDS[name] not in os.environ:
            print(f"{name}: left out, since {NEEDS[name]} does not name the folder of its data", file=sys.stderr)
    there = [name for name in names if name not in NEEDS or NEEDS[name] in os.environ]
    compared = run({name: PARTS[name]() for name in there}, work, keep=keep)
    print(text(compared))
    return int(not keep and any(part.is_worse for part in compared))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m proof.ledger", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--keep", action="store_true", help="keep the new answers")
    parser.add_argument("--work-dir", type=Path, default=Path("build/ledger"), help="where single reports are stored")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.parts) - set(PARTS))
    if unknown:
        parser.error(f"no such part: {', '.join(unknown)}; it must be one of {', '.join(PARTS)}")
    return arguments


if __name__ == "__main__":
    given = _arguments()
    sys.exit(main(given.parts or list(PARTS), Work(given.work_dir, given.workers), keep=given.keep))
