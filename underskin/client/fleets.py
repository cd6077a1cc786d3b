"""Several skins of one make through the client: `client.fleets`.

started = client.fleets.diagnose(["palm-1", "palm-2", "palm-3"], "palms of batch 7")
report = client.diagnoses.wait(started.id).report
"""

from collections.abc import Sequence

from underskin.client.documents.diagnoses import Asked
from underskin.client.http_session import Session


class Fleets:
    """Skins of one make, diagnosed together."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def diagnose(self, skins: Sequence[str], name: str, *, without: Sequence[str] = ()) -> Asked:
        """Start one diagnosis of all campaigns of three or more skins; its `id` and `state`.

        `name` is what the report is called; `without` as in `client.diagnoses.start`. The same request on campaigns
        that have not changed is answered with the diagnosis that there is.
        """
        body = {"skins": list(skins), "name": name, "without": list(without)}
        return Asked.of(self._session.json("POST", "/v1/fleets/diagnosis", json=body))
