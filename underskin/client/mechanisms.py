"""The catalogue of mechanisms through the client: `client.mechanisms`.

client.mechanisms.keep_found(diagnosis_id, "warm_skin")
[entry.name for entry in client.mechanisms.all() if entry.own]
"""

from underskin.client.documents.mechanisms import MechanismEntry
from underskin.client.http_session import Session, path_of


class Mechanisms:
    """What diagnoses know by name; the lab's own can be kept and discarded."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def all(self) -> list[MechanismEntry]:
        """Every mechanism, in the order in which a model composes them."""
        return [MechanismEntry.of(entry) for entry in self._session.json("GET", "/v1/mechanisms")["mechanisms"]]

    def keep(self, document: str) -> MechanismEntry:
        """Keep a document (`mechanism/1`, YAML) as one of the lab's own; raises ServiceError (409) for a taken name."""
        headers = {"Content-Type": "application/yaml"}
        return MechanismEntry.of(
            self._session.json("POST", "/v1/mechanisms", content=document.encode(), headers=headers)
        )

    def keep_found(self, diagnosis_id: str, name: str, description: str | None = None) -> MechanismEntry:
        """Keep the law that a diagnosis found beside the catalogue; raises ServiceError (422) where it found none."""
        asked = {"diagnosis_id": diagnosis_id, "name": name, "description": description}
        return MechanismEntry.of(self._session.json("POST", "/v1/mechanisms", json=asked))

    def discard(self, name: str) -> MechanismEntry:
        """Take one of the lab's own out of the catalogue; raises ServiceError (409) while a model in force needs it."""
        return MechanismEntry.of(self._session.json("DELETE", path_of("mechanisms", name)))
