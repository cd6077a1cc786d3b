"""The server that most tests over HTTP share, and the markers that say what a test needs."""

import fcntl
import gc
import os
import signal
import sys
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadFileScheduling

from bench import soak
from tests.support.server import Server, running
from underskin.parallel import one_blas_thread

# As in commands and in the server's workers: more in each process of a run wait for each other's turn on the cores,
# which took diagnoses two to five times their processor time. NumPy is not imported yet, here and in those processes.
one_blas_thread()

# A busy machine is slow and fails no test for it; the examples of a run are those of the next, but in a soak, which
# draws other ones, and four times as many.
settings.register_profile(
    "tests",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize=not soak.SOAK,
    max_examples=100 if soak.SOAK else 25,
)
settings.load_profile("tests")

# A request waits for a busy machine, not for the 5 s after which httpx gives up by itself.
for call in (httpx.Client.__init__, httpx.get, httpx.post, httpx.put, httpx.patch, httpx.delete, httpx.request):
    assert call.__kwdefaults__ is not None
    call.__kwdefaults__["timeout"] = httpx.Timeout(300)

# To read all that a system trusts takes each client and command longer than its requests: looked up one by one instead.
if Path("/etc/ssl/certs").is_dir():
    os.environ.pop("SSL_CERT_FILE", None)
    os.environ["SSL_CERT_DIR"] = "/etc/ssl/certs"

# A shell that runs the tests in the background has them ignore it, and the servers would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


# Fixtures that start something; a test that uses one, directly or through another, gets the marker.
_STARTED_BY = {
    "server": {"shared_server", "server", "servers", "working", "diagnosing", "idle", "locked"},
    "browser": {"browser"},
    "database": {"cluster"},
}
_NO_UNIT = {"server", "browser", "database", "slow", "soak"}
# Folders of which one process of a run tests all, so that it starts servers, database and browser once; those before
# others that hold them.
_SHARING = ("tests/service/pages", "tests/service/store", "tests/service/jobs", "tests/service")
_unit_test_under_way = ""


class _ByServers(LoadFileScheduling):  # type: ignore[misc]  # which has no types
    """Tests are handed out by the file, those that share servers by the folder."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return next((folder for folder in _SHARING if file.startswith(f"{folder}/")), file)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> LoadFileScheduling:
    """Hand out tests to the processes of a run."""
    return _ByServers(config, log)


@pytest.fixture(scope="session")
def shared_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One server for all tests that change nothing on it."""
    with running(tmp_path_factory.mktemp("server")) as started:
        yield started


@pytest.fixture(scope="session")
def server_url(shared_server: Server) -> str:
    """Its address."""
    return shared_server.url


@pytest.fixture(scope="session")
def http(shared_server: Server) -> Iterator[httpx.Client]:
    """A client of it."""
    with httpx.Client(base_url=shared_server.url, timeout=300) as client:
        yield client


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without looking for garbage: tests and their parameters are there to stay, and are many."""
    gc.disable()
    try:
        with _after_one_has_compiled():
            return (yield)
    finally:
        gc.freeze()
        gc.enable()


@contextmanager
def _after_one_has_compiled() -> Iterator[None]:
    """Of several processes in a fresh clone let one collect first, and so compile for all: most of it is compiling."""
    compiled = Path(__file__).parent / "tablegen" / "__pycache__"  # of the last that are collected
    if "PYTEST_XDIST_WORKER" not in os.environ or sys.dont_write_bytecode or compiled.exists():
        yield
        return
    with Path(__file__).open(encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            fcntl.flock(lock, fcntl.LOCK_SH)  # once the first has collected
        yield


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark each test with what it needs, and `unit` where that is nothing but a second of this process.

    Those of the soak are left out of other runs. Folders that share servers come first, files of quick tests last, so
    that all processes of a run end together; those with a browser after others, which then still can have event loops.
    """
    if not soak.SOAK:
        of_the_soak = [item for item in items if item.get_closest_marker("soak")]
        config.hook.pytest_deselected(items=of_the_soak)
        items[:] = [item for item in items if item not in of_the_soak]
    for item in items:
        for marker in _needs(item):
            item.add_marker(marker)
        if _NO_UNIT.isdisjoint(marker.name for marker in item.iter_markers()):
            item.add_marker("unit")
    slow = {item.path for item in items if item.get_closest_marker("unit") is None}
    seen = {item.path for item in items if item.get_closest_marker("browser")}
    shared = {item.path for item in items if item.nodeid.startswith(_SHARING)}
    items.sort(key=lambda item: (item.path not in shared, item.path in seen & shared, item.path not in slow))


def _needs(item: pytest.Item) -> set[str]:
    """Markers by the fixtures of a test, by its case (`postgresql`), and by its module: one that imports `running`."""
    if not isinstance(item, pytest.Function):
        return set()
    needs = {marker for marker, fixtures in _STARTED_BY.items() if fixtures & set(item.fixturenames)}
    if "[" in item.name and "postgresql" in item.name.partition("[")[2].rstrip("]").split("-"):
        needs.add("database")
    if any(getattr(value, "__name__", "") == "running" for value in vars(item.module).values()):
        needs.add("server")
    return needs


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what an interrupted soak has done."""
    if soak.SOAK and soak.passed(item.nodeid):
        pytest.skip("passed on this code already; remove build/soak to run it again")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Keep what a soak has done; of tests in processes of their own, in the one that collects their reports."""
    if soak.SOAK and report.when == "call" and report.passed and "PYTEST_XDIST_WORKER" not in os.environ:
        soak.keep_passed(report.nodeid)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Let unit tests start no server, browser or database."""
    global _unit_test_under_way
    _unit_test_under_way = item.nodeid if item.get_closest_marker("unit") else ""
    try:
        return (yield)
    finally:
        _unit_test_under_way = ""


def _refuse_servers_in_unit_tests(event: str, arguments: tuple[object, ...]) -> None:
    if event in ("subprocess.Popen", "tests.underskin") and _unit_test_under_way:
        program, given = ("underskin", ["underskin", *arguments]) if event == "tests.underskin" else arguments[:2]
        words = [Path(str(word)).name for word in (given if isinstance(given, Sequence) else [program])]
        if (words[1:2] == ["serve"] and "--help" not in words) or words[0] in ("chromium", "initdb"):
            raise RuntimeError(f"{_unit_test_under_way} starts {words[0]}: it needs a marker (CONTRIBUTING.md)")


sys.addaudithook(_refuse_servers_in_unit_tests)
