"""`python -m rig.unlisted --seed N --count K --output-dir DIR`."""

from __future__ import annotations

import argparse
from pathlib import Path

from rig.unlisted.campaign import write


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="rig.unlisted", description="Draws FRF campaigns, each with a concealed law.")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--output-dir", type=Path, required=True)
    parser.add_argument("--quiet", action="store_true", help="conceal nothing")
    parser.add_argument("--random-columns", type=int, default=0, help="further columns of conditions without meaning")
    arguments = parser.parse_args()
    truth = write(arguments.seed, arguments.count, arguments.output_dir, arguments.quiet, arguments.random_columns)
    identifiable = sum(bool(t["identifiable"]) for t in truth.values())
    print(f"{len(truth)} campaigns, {identifiable} identifiable: {arguments.output_dir}")


if __name__ == "__main__":
    main()
