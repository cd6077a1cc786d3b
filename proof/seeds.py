"""Command lines that judge a part of the proof on another seed: `python -m proof.PART --seed N --count K`."""

import argparse


def parser(part: str, about: str | None) -> argparse.ArgumentParser:
    """For the seed and how many campaigns; `about` is the part's docstring, of which the first line is shown."""
    made = argparse.ArgumentParser(prog=f"proof.{part}", description=(about or "").partition("\n")[0])
    made.add_argument("--seed", type=int, required=True)
    made.add_argument("--count", type=int, required=True)
    return made
