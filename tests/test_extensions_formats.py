"""File formats of other packages: what is refused when they are loaded, and how a file is read by one."""

import io
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.support.installed_package import installed
from underskin import ExtensionError, FileError
from underskin.recordings.channels import Contents
from underskin.recordings.readers import formats


@pytest.fixture
def format_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Installs a file format and loads it."""

    def load(source: str) -> Mapping[str, formats.FileFormat]:
        head = (
            "from underskin.recordings.channels import Block, Channel, Contents\n"
            "from underskin.recordings.readers.formats import FileFormat\n"
        )
        monkeypatch.syspath_prepend(installed(tmp_path, formats.GROUP, "THING", head + source))
        monkeypatch.delitem(sys.modules, "lab_tools", raising=False)
        formats.formats_of_other_packages.cache_clear()
        return formats.formats_of_other_packages()

    yield load
    formats.formats_of_other_packages.cache_clear()


@pytest.mark.parametrize(
    ("source", "field", "reason"),
    [
        ("THING = print", "the entry point", "FileFormat"),
        ("THING = FileFormat('', ('.lab',), print)", "name", "text"),
        ("THING = FileFormat('CSV', ('.lab',), print)", "name", "taken"),
        ("THING = FileFormat('lab', (), print)", "suffixes", "at least one"),
        ("THING = FileFormat('lab', ('lab',), print)", "suffixes", "point"),
        ("THING = FileFormat('lab', ('.csv',), print)", "suffixes", "taken"),
        ("THING = FileFormat('lab', ('.lab',), 3)", "read", "function"),
    ],
)
def test_a_file_format_that_cannot_be_used_is_refused(source: str, field: str, reason: str, format_of: Any) -> None:
    with pytest.raises(ExtensionError, match=reason) as refusal:
        format_of(source)
    assert refusal.value.package == "lab-tools 2.1"
    assert refusal.value.field == field


def test_a_file_is_read_by_the_format_of_its_suffix(format_of: Any) -> None:
    format_of(
        "THING = FileFormat('lab', ('.lab',), lambda stream, file: Contents((), {'said': stream.read().decode()}))"
    )
    stream = io.BytesIO(b"anything")
    assert formats.detect(stream, "Monday.LAB") == "lab"
    assert formats.is_parsed_apart("lab")
    answer = formats.parse("lab", stream, "Monday.LAB")
    assert isinstance(answer, Contents)
    assert answer.properties == {"said": "anything"}


@pytest.mark.parametrize(
    ("answer", "reason"),
    [("None", "must answer with Contents"), ("Contents((Block('1', (Channel('F', 'N', [1.0]),)),))", "one axis")],
)
def test_what_a_reader_of_another_package_answers_is_checked(answer: str, reason: str, format_of: Any) -> None:
    format_of(f"THING = FileFormat('lab', ('.lab',), lambda stream, file: {answer})")
    with pytest.raises(FileError, match=reason):
        formats.parse("lab", io.BytesIO(b"x"), "a.lab")
