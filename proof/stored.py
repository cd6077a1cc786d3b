"""Results stored in files under a digest of their input and of the sources that made them.

A run that was stopped resumes; a result of changed sources is calculated again.
"""

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

import proof
import rig
import underskin
from proof.cases import Case
from proof.imported import of_a_diagnosis
from underskin.parallel import processes
from underskin.source_digest import source_digest

Item = TypeVar("Item")
FAILED = "failed"


@dataclass(frozen=True)
class Work:
    """Folder of the results, number of processes, and the most campaigns of each kind (None: all)."""

    folder: Path
    workers: int = 1
    count: int | None = None


@cache
def sources(*packages: str) -> str:
    """Digest (`underskin.source_digest`) of packages of this project, or of files in them (`package/pattern`).

    Read once in a process, which goes on with the code that it has loaded.
    """
    return _digest(_texts(*packages))


def _texts(*packages: str) -> dict[str, str]:
    roots = {module.__name__: Path(str(module.__file__)).parent for module in (underskin, rig, proof)}
    return {
        ".".join([name, *path.relative_to(roots[name]).with_suffix("").parts]): path.read_text(encoding="utf-8")
        for name, _, file in (package.partition("/") for package in packages)
        for path in roots[name].rglob(file or "*.py")
    }


def _digest(texts: Mapping[str, str]) -> str:
    return source_digest(texts)[:16]


def digest_of(document: Any) -> str:
    """A digest of plain JSON values."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:24]


def stored(folder: Path, key: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The stored result of a key; made and stored if there is none."""
    path = folder / f"{key}.json"
    if path.exists():
        return dict(json.loads(path.read_text(encoding="utf-8")))
    result = make()
    folder.mkdir(parents=True, exist_ok=True)
    unfinished = folder / f".{key}.{os.getpid()}"
    unfinished.write_text(json.dumps(result, ensure_ascii=False), encoding="utf-8")
    unfinished.replace(path)
    return result


def of_each(
    work: Work, items: Sequence[Item], make: Callable[[Item], dict[str, Any]], progress: Callable[[int, int], None]
) -> list[dict[str, Any]]:
    """`make` of each item, in order, on all of the work's processes; `progress` is told how many are done, of
    how many."""
    if work.workers == 1 or len(items) < 2:
        results = []
        for number, item in enumerate(items, 1):
            results.append(make(item))
            progress(number, len(items))
        return results
    with processes(min(work.workers, len(items))) as pool:
        pending: list[Future[dict[str, Any]]] = [pool.submit(make, item) for item in items]
        for number, _ in enumerate(as_completed(pending), 1):
            progress(number, len(items))
        return [future.result() for future in pending]


def reports(work: Work, cases: Sequence[Case], progress: Callable[[int, int], None]) -> list[dict[str, Any]]:
    """The report (`report/1`) of each case."""
    return of_each(work, cases, partial(_report, work.folder / "reports", diagnosing()), progress)


@cache
def of_diagnosis() -> str:
    """Digest of the library's sources on which a report can depend; read once, as `sources`."""
    return _digest(of_a_diagnosis(_texts("underskin")))


def diagnosing() -> str:
    """Digests of all that a report depends on but its campaign: the library's sources, and its table."""
    return f"{of_diagnosis()} {underskin.load_table().sha256}"


def _report(folder: Path, version: str, case: Case) -> dict[str, Any]:
    document = case.document()
    return stored(folder, digest_of([document, version]), partial(diagnosed, document))


def diagnosed(document: dict[str, Any], without: Sequence[str] = ()) -> dict[str, Any]:
    """The report (`report/1`) of a campaign/1 document, these mechanisms left out of the catalogue."""
    return diagnosed_by(lambda readings: underskin.diagnose(readings[0], without=without), [document])


def diagnosed_by(
    diagnose: Callable[[Sequence["underskin.Reading"]], "underskin.Report"], documents: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """The report of `diagnose` on campaign/1 documents; a failure is a report too, which counts as a wrong answer."""
    from underskin.recordings.campaign import from_dict

    try:
        return dict(diagnose([underskin.Reading(*from_dict(document), []) for document in documents]))
    except Exception as error:  # the other campaigns go on
        failed = {"verdict": FAILED, "probability": 0.0, "statement": repr(error), "mechanisms": [{"name": FAILED}]}
        return {**failed, "alternatives": [], "fit": None}
