"""Diagnoses, fleets and mechanisms through the client.

    started = client.diagnoses.start(campaign_id)
    report = client.diagnoses.wait(started.id, progress=print).report

    started = client.fleets.diagnose(["palm-1", "palm-2", "palm-3"], "palms of batch 7")

    client.mechanisms.keep_found(diagnosis_id, "warm_skin")
    [mechanism.name for mechanism in client.mechanisms.all() if mechanism.own]

Answers are the documents of the HTTP interface (docs/store.md, /openapi.json); see `underskin.client.documents`.
"""

import time
from collections.abc import Callable, Iterator, Sequence

from underskin.client.documents import Asked, Diagnosis, DiagnosisEntry, MechanismEntry
from underskin.client.http_session import Resource, path_of
from underskin.errors import Unreachable

_POLL_S = 0.5
_ANSWER_TIMEOUT_S = 60.0


class Diagnoses(Resource):
    """Diagnoses of stored campaigns: start, wait, read, cancel."""

    def start(self, campaign_id: str, *, without: Sequence[str] = ()) -> Asked:
        """Start a diagnosis; its `id` and `state`. A campaign that was diagnosed as it is now is `done` at once.

        `without`: mechanisms to leave out of the catalogue, "suppose that it is not these".
        """
        body = {"json": {"without": list(without)}} if without else {}
        return self._asked(Asked, "POST", path_of("campaigns", campaign_id, "diagnosis"), **body)

    def get(self, diagnosis_id: str) -> Diagnosis:
        """A diagnosis: its `state` and `progress` and, once it is done, its `report`."""
        return self._asked(Diagnosis, "GET", path_of("diagnoses", diagnosis_id))

    def all(
        self,
        *,
        campaign: str | None = None,
        skin: str | None = None,
        state: str | None = None,
        kind: str | None = None,
    ) -> Iterator[DiagnosisEntry]:
        """Diagnoses, the latest first, without their reports; `kind`: `campaign`, `skin` or `fleet`."""
        filters = {"campaign": campaign, "skin": skin, "state": state, "kind": kind}
        return self._session.pages(DiagnosisEntry, "diagnoses", **filters)

    def wait(
        self, diagnosis_id: str, *, progress: Callable[[float], object] = lambda _: None, timeout: float | None = None
    ) -> Diagnosis:
        """The diagnosis once it is done, has failed or was cancelled; `progress` is called with its progress, 0 to 1.

        A server that does not answer, for instance while it restarts, is tried again for a minute. Raises TimeoutError
        after `timeout` seconds.
        """
        start = answered_at = time.monotonic()
        while True:
            try:
                diagnosis = self.get(diagnosis_id)
                answered_at = time.monotonic()
                progress(diagnosis.progress)
                if diagnosis.state not in ("queued", "running"):
                    return diagnosis
            except Unreachable:
                if time.monotonic() - answered_at > _ANSWER_TIMEOUT_S:
                    raise
            if timeout is not None and time.monotonic() - start > timeout:
                raise TimeoutError(f"diagnosis {diagnosis_id} is not done after {timeout:g} s; it goes on")
            time.sleep(_POLL_S)

    def cancel(self, diagnosis_id: str) -> DiagnosisEntry:
        """Cancel a diagnosis; raises ServiceError (409) if it is done or has failed."""
        return self._asked(DiagnosisEntry, "DELETE", path_of("diagnoses", diagnosis_id))


class Fleets(Resource):
    """Skins of one batch, diagnosed together."""

    def diagnose(self, skins: Sequence[str], name: str, *, without: Sequence[str] = ()) -> Asked:
        """Start one diagnosis of all campaigns of three or more skins; its `id` and `state`.

        `name` is what the report is called; `without` as in `client.diagnoses.start`. The same request on campaigns
        that have not changed is answered with the diagnosis that there is.
        """
        body = {"skins": list(skins), "name": name, "without": list(without)}
        return self._asked(Asked, "POST", "/v1/fleets/diagnosis", json=body)


class Mechanisms(Resource):
    """The catalogue of mechanisms; the lab's own can be kept and discarded."""

    def all(self) -> list[MechanismEntry]:
        """Every mechanism, in the order in which a model composes them."""
        return [
            MechanismEntry.from_json(mechanism)
            for mechanism in self._session.json("GET", "/v1/mechanisms")["mechanisms"]
        ]

    def keep(self, document: str) -> MechanismEntry:
        """Keep a document (`mechanism/1`, YAML) as one of the lab's own; raises ServiceError (409) for a taken name."""
        headers = {"Content-Type": "application/yaml"}
        return self._asked(MechanismEntry, "POST", "/v1/mechanisms", content=document.encode(), headers=headers)

    def keep_found(self, diagnosis_id: str, name: str, description: str | None = None) -> MechanismEntry:
        """Keep the law that a diagnosis found beside the catalogue; raises ServiceError (422) where it found none."""
        body = {"diagnosis_id": diagnosis_id, "name": name, "description": description}
        return self._asked(MechanismEntry, "POST", "/v1/mechanisms", json=body)

    def discard(self, name: str) -> MechanismEntry:
        """Take one of the lab's own out of the catalogue; raises ServiceError (409) while a model in force needs it."""
        return self._asked(MechanismEntry, "DELETE", path_of("mechanisms", name))
