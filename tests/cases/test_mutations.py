"""Files of everyday measurements with a slip in them: whatever it is, a command ends with an answer or an error."""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from bench.soak import SOAK
from tests.cases.rows import ROWS
from underskin.cli.app import app

CASES = os.environ.get("UNDERSKIN_CASES")
FILES = 2000 if SOAK else 24
DIAGNOSED = 20 if SOAK else 24  # one of so many is diagnosed as well, which takes seconds
EXTREME = (
    "0",
    "-1",
    "1e300",
    "-1e300",
    "1e-300",
    "1e400",
    "nan",
    "inf",
    "",
    "abc",
    "1,5",
    "1e",
    "٣",
    "0x1F",
    "9" * 400,
)
NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")

Random = np.random.Generator
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CASES is None, reason="UNDERSKIN_CASES names no folder of cases"),
]


def one_number(content: bytes, random: Random) -> bytes:
    """With one number replaced by an extreme one, or by none."""
    found = list(NUMBER.finditer(content))
    if not found:
        return content
    chosen = found[random.integers(len(found))]
    return content[: chosen.start()] + str(random.choice(EXTREME)).encode() + content[chosen.end() :]


def one_line(content: bytes, random: Random) -> bytes:
    """With one line removed, twice, or at another place."""
    lines = content.splitlines(keepends=True)
    line = lines.pop(random.integers(len(lines))) if len(lines) > 1 else b""
    for _ in range(random.integers(3)):
        lines.insert(random.integers(len(lines) + 1), line)
    return b"".join(lines)


def rows_turned(content: bytes, random: Random) -> bytes:
    """With the order of the lines of one part reversed."""
    lines = content.splitlines(keepends=True)
    first, last = sorted(random.integers(len(lines) + 1, size=2))
    return b"".join([*lines[:first], *lines[first:last][::-1], *lines[last:]])


def one_column(content: bytes, random: Random) -> bytes:
    """With the numbers of one column negative, a thousand times as large, all alike, or rounded."""
    changes: tuple[Callable[[bytes], bytes], ...] = (
        lambda number: b"-" + number.lstrip(b"-"),
        lambda number: number + b"e3" if b"e" not in number.lower() else number,
        lambda _: b"1.0",
        lambda number: number[:3],
    )
    change, column = changes[random.integers(len(changes))], int(random.integers(4))

    def changed(line: bytes) -> bytes:
        found = list(NUMBER.finditer(line))
        if len(found) <= column:
            return line
        return line[: found[column].start()] + change(found[column].group()) + line[found[column].end() :]

    return b"".join(changed(line) for line in content.splitlines(keepends=True))


def cut(content: bytes, random: Random) -> bytes:
    """Up to some byte."""
    return content[: random.integers(1, len(content) + 1)]


def some_bytes(content: bytes, random: Random) -> bytes:
    """With a few bytes replaced."""
    changed = bytearray(content)
    for place in random.integers(len(changed), size=random.integers(1, 8)):
        changed[place] = random.integers(256)
    return bytes(changed)


def one_leaf(content: bytes, random: Random) -> bytes:
    """A JSON document with one value replaced; a list may be shortened, reversed or scaled."""
    document = json.loads(content)
    place: Any = document
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return content
        key = keys[random.integers(len(keys))]
        value = place[key]
        holds_more = isinstance(value, dict) or (
            isinstance(value, list) and value and isinstance(value[0], dict | list)
        )
        if not holds_more or random.random() < 0.2:
            break
        place = value
    numbers = isinstance(value, list) and bool(value) and isinstance(value[0], int | float)
    if numbers and random.random() < 0.7:
        scaled = np.asarray(value, float)
        place[key] = [value[::-1], value[:3], [], (scaled * 1e6).tolist(), (-scaled).tolist(), (0 * scaled).tolist()][
            random.integers(6)
        ]
    else:
        leaves = [
            None,
            True,
            0,
            -1,
            1e300,
            1e-300,
            10**30,
            "",
            "abc",
            "\ud800",
            [],
            {},
            [[]],
            "0001-01-01T00:00:00Z",
            value,
        ]
        place[key] = leaves[random.integers(len(leaves))]
    return json.dumps(document).encode()


TEXT = (one_number, one_number, one_line, rows_turned, one_column, one_column, cut, some_bytes)


def mutated(file: Path, random: Random) -> bytes:
    """The file's content with one slip, or two."""
    content = file.read_bytes()
    if file.suffix == ".json" and random.random() < 0.8:
        return one_leaf(content, random)
    kinds = (cut, some_bytes) if file.suffix in (".xlsx", ".tdms", ".mat", ".h5") else TEXT
    for _ in range(random.integers(1, 3)):
        content = kinds[random.integers(len(kinds))](content, random) or b"\n"
    return content


@pytest.mark.filterwarnings("default")  # of NumPy, of which a user sees nothing
def test_no_slip_in_a_file_ends_in_a_traceback(tmp_path: Path) -> None:
    """`d33` of every mutated file, and `diagnose` of some, end with an answer or an error."""
    singles = [(folder, given) for folder, given, *_ in ROWS if "--together" not in given and folder != "service"]
    random = np.random.default_rng(46)
    failed: list[str] = []
    for number in range(FILES):
        folder, given = singles[random.integers(len(singles))]
        name, *rest = given.split()
        place = Path(CASES or "") / folder
        file = tmp_path / f"{number}-{Path(name).name}"
        file.write_bytes(mutated(place / name, random))
        arguments = [str(file), *(str(place / part) if (place / part).is_file() else part for part in rest)]
        commands = [["d33", *arguments]]
        if number % DIAGNOSED == 0 and "--estimator" not in rest:
            commands.append(["diagnose", *arguments, "--output-dir", str(tmp_path / "reports"), "--workers", "1"])
        for command in commands:
            answer = CliRunner().invoke(app, command)
            if answer.exception is not None and not isinstance(answer.exception, SystemExit):
                failed.append(f"{command[0]} {number} {folder}/{name}: {answer.exception!r}")
    assert failed == []
