"""The catalogue while files of the lab's own mechanisms come and go."""

from pathlib import Path

import pytest

from service.store import Database, database, open_store
from service.usecases import mechanism_catalogue, mechanisms
from tests.service.conftest import emptied
from tests.service.routes.test_mechanisms import WARM
from tests.support.diagnosed import diagnosed, report, resonant
from tests.support.store_server import Server
from underskin.surrogate.sigma_table import load_table


def test_file_removed_catalogue_read_not_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is removed while the catalogue is read is not shown."""
    file = tmp_path / "warm_amplifier.yaml"
    monkeypatch.setenv("UNDERSKIN_MECHANISMS", str(tmp_path))
    file.write_text(WARM)
    findings = mechanism_catalogue.findings

    def removed(store: Database) -> mechanism_catalogue.Findings:
        file.unlink()
        return findings(store)

    store = open_store("", tmp_path)
    try:
        whole = mechanism_catalogue.catalogue(store, load_table())
        assert [one.file for one in whole.entries if one.entry.own] == [WARM]
        with monkeypatch.context() as patched:
            patched.setattr(mechanism_catalogue, "findings", removed)
            found = mechanism_catalogue.catalogue(store, load_table())
        assert [(one.entry.name, one.file) for one in found.entries if one.entry.own] == [("warm_amplifier", None)]
    finally:
        store.close()
        file.unlink(missing_ok=True)
        mechanisms.catalogue()  # as it was for other tests


def test_what_a_restored_store_holds_under_the_same_numbers_is_read(server: Server) -> None:
    """Another diagnosis may have the number of one that was looked at before."""
    store = database(server.place.database_url, server.place.folder)
    try:
        for mechanism in ("contact_resonance", "modulus_error"):
            emptied(server)
            stated = {**report()["mechanisms"][0], "name": mechanism}
            diagnosed(server, resonant(mechanism), {**report(), "mechanisms": [stated]})
            assert set(mechanism_catalogue.findings(store).by_mechanism) == {mechanism}
    finally:
        store.close()
