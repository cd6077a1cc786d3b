"""A client of the service: columns of numbers in, columns of numbers out.

    with underskin.Client() as client:
        answer = client.sigma(a_over_h=[0.1, 0.3], rt_over_h=0.6)
        answer.sigma, answer.status

Fields have the names and the lab units of the HTTP interface. A single number applies to all rows; arrays must be
equally long. Answers have one element per row, or shape () where only single numbers were given; a row outside the
model's domain has the status `out_of_domain` and NaN in all that depends on σ. Campaigns and skins:
`client.campaigns` and `client.skins` (`underskin.client.campaigns`); diagnoses, fleets and mechanisms:
`client.diagnoses`, `client.fleets` and `client.mechanisms` (`underskin.client.diagnoses`).
"""

from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from typing import Any, Literal, Self, TypeVar

import numpy as np
import orjson
from numpy.typing import ArrayLike

from underskin.client import answers
from underskin.client.campaigns import Campaigns, Skins
from underskin.client.diagnoses import Diagnoses, Fleets, Mechanisms
from underskin.client.documents import Change, DesignAnswer, FieldAnswer, TableEntry
from underskin.client.http_session import Session, path_of
from underskin.surrogate.sigma_table import ContactName
from underskin.units import Floats

_Answer = TypeVar("_Answer", bound=answers.ServiceAnswer)


class Client:
    """The service at `base_url`. All methods raise ServiceError (it refused or failed) and Unreachable (no answer)."""

    def __init__(
        self,
        base_url: str = "http://127.0.0.1:8000",
        api_key: str | None = None,
        timeout: float = 60.0,
        *,
        npz: bool = False,
    ) -> None:
        """`api_key` where the service requires one; `timeout` [s] between bytes, and 10 s at most to connect.

        `npz`: send and receive columns as NumPy's .npz instead of JSON, which is faster for many rows.
        """
        self._session = Session(base_url, api_key, timeout)
        self._npz = npz
        self.campaigns = Campaigns(self._session)
        self.skins = Skins(self._session)
        self.fleets = Fleets(self._session)
        self.diagnoses = Diagnoses(self._session)
        self.mechanisms = Mechanisms(self._session)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._session.http.close()

    def sigma(
        self,
        a_over_h: ArrayLike,
        rt_over_h: ArrayLike,
        load_parameter: ArrayLike = 0.0,
        model: Literal["layer", "half_space"] = "layer",
    ) -> answers.SigmaAnswer:
        """σ(a/h, rT/h, L) of the layer on a rigid base, or of the half space."""
        return self._columns("sigma", answers.SigmaAnswer, locals())

    def frf(
        self,
        *,
        thickness_mm: ArrayLike,
        youngs_modulus_mpa: ArrayLike,
        sensor_radius_mm: ArrayLike,
        indenter_radius_mm: ArrayLike,
        preload_n: ArrayLike,
        d33_pc_per_n: ArrayLike,
        poisson_ratio: ArrayLike = 0.5,
        frequency_hz: ArrayLike | None = None,
        units_checked: bool = False,
        contact: ContactName | None = None,
        adopted: answers.Adopted | None = None,
    ) -> answers.FrfAnswer:
        """The FRF of a skin under a sphere; `frequency_hz` (a list for all rows) adds spectra.

        `units_checked` accepts unusual magnitudes; `contact`: `paper` if left out, or `solved`; `adopted` uses the
        adopted model of the skin.
        """
        return self._columns("frf", answers.FrfAnswer, locals())

    def d33(
        self,
        *,
        thickness_mm: ArrayLike,
        youngs_modulus_mpa: ArrayLike,
        sensor_radius_mm: ArrayLike,
        indenter_radius_mm: ArrayLike,
        preload_n: ArrayLike,
        frf_pc_per_n: ArrayLike | None = None,
        frf_uncertainty_pc_per_n: ArrayLike | None = None,
        poisson_ratio: ArrayLike = 0.5,
        frequency_hz: ArrayLike | None = None,
        frf_re_pc_per_n: ArrayLike | None = None,
        frf_im_pc_per_n: ArrayLike | None = None,
        band_hz: tuple[float, float] | None = None,
        units_checked: bool = False,
        contact: ContactName | None = None,
        adopted: answers.Adopted | None = None,
    ) -> answers.D33Answer:
        """d33 from plateau values `frf_pc_per_n`, or from lines averaged over a band.

        For lines give `frequency_hz` (for all rows), `frf_re_pc_per_n` and, if measured, `frf_im_pc_per_n` (rows ×
        lines), and `band_hz`. `units_checked` accepts unusual magnitudes; `contact`: `paper` if left out, or
        `solved`; `adopted` uses the adopted model of the skin.
        """
        return self._columns("d33", answers.D33Answer, locals())

    def stress(self, request: Mapping[str, Any]) -> answers.StressAnswer:
        """Charge on every sensor of an array; `request` is the document that `POST /v1/stress` takes."""
        document = self._request("POST", "/v1/stress", request)
        values = {field.name: _field(field.name, document, single=False) for field in fields(answers.StressAnswer)}
        return answers.StressAnswer(**values | {"sensor": tuple(document["sensor"])})

    def design(self, **fields: float | str) -> DesignAnswer:
        """Sensitivity and spatial resolution of a skin's design; `fields` as `POST /v1/design` takes them."""
        return DesignAnswer.from_json(self._request("POST", "/v1/design", fields))

    def field(self, **fields: float | str) -> FieldAnswer:
        """The stress in a section through the layer under a sphere; `fields` as `GET /v1/field` takes them."""
        return FieldAnswer.from_json(self._session.json("GET", "/v1/field", fields))

    def tables(self) -> tuple[TableEntry, ...]:
        """The tables of the service that answers are computed from: σ, influence and contact."""
        return tuple(map(TableEntry.from_json, self._request("GET", "/v1/tables")["tables"]))

    def undo(self, change_id: str) -> Change:
        """Take a change back that `client.campaigns.changes` or `client.skins.changes` lists, unless something builds
        on it."""
        return Change.from_json(self._request("POST", path_of("changes", change_id, "undo")))

    def health(self) -> str:
        """`ok` while the process answers; needs no key."""
        return str(self._request("GET", "/health")["status"])

    def ready(self) -> str:
        """The hash of the table in use, once the service can do its work; needs no key."""
        return str(self._request("GET", "/ready")["table_sha256"])

    def _columns(self, noun: str, kind: type[_Answer], arguments: Mapping[str, Any]) -> _Answer:
        """The answer to a method's arguments, among which are `self` and perhaps `adopted`."""
        adopted = arguments.get("adopted")
        values = {**arguments, **(adopted.fields() if adopted is not None else {})}
        values = {
            name: value for name, value in values.items() if value is not None and name not in ("self", "adopted")
        }
        arrays = {name: _array(value) for name, value in values.items() if name not in _SHARED}
        others = {name: _shared(name, value) for name, value in values.items() if name in _SHARED}
        answer = self._answer_in_arrays if self._npz else partial(self._request, "POST")
        document = answer(f"/v1/{noun}", {**arrays, **others})
        single = all(array.ndim == 0 for array in arrays.values()) and all(np.ndim(values[name]) < 2 for name in others)
        return kind(**{field.name: _field(field.name, document, single) for field in fields(kind)})

    def _answer_in_arrays(self, path: str, sent: Mapping[str, Any]) -> dict[str, Any]:
        """As `_request`, with arrays for the columns."""
        arrays = self._session.arrays(path, sent)
        document: dict[str, Any] = {name: array.item() if array.ndim == 0 else array for name, array in arrays.items()}
        if "findings" in document:
            document["findings"] = orjson.loads(document["findings"])
        return document

    def _request(self, method: str, path: str, body: Mapping[str, Any] | None = None) -> dict[str, Any]:
        # orjson does not take a single number as an array
        content = None if body is None else orjson.dumps(body, float, orjson.OPT_SERIALIZE_NUMPY)
        return self._session.json(method, path, content=content, headers={"Content-Type": "application/json"})


# Rows × lines; a single list is one row.
_LINES = ("frf_re_pc_per_n", "frf_im_pc_per_n")
# Fields of requests that are no columns.
_SHARED = (*_LINES, "frequency_hz", "band_hz", "units_checked", "model", "contact", "skin_id", "sensor")


def _array(value: Any) -> Floats:
    return np.asarray(value, dtype=float, order="C")


def _shared(name: str, value: Any) -> Any:
    """A value that is not a column, in the form of the interface."""
    if isinstance(value, bool | str):
        return value
    return np.atleast_2d(_array(value)) if name in _LINES else _array(value)


def _field(name: str, document: Mapping[str, Any], single: bool) -> Any:
    """A field of the answer: an array, without its rows' axis where only single numbers were given."""
    value = document.get(name)
    if name == "limit":  # null where all rows are inside
        words = value if value is not None else [""] * len(document["status"])
        value = np.asarray([text or "" for text in words])
    if name == "findings":
        return tuple(answers.FindingAnswer(**finding) for finding in value or ())
    if not isinstance(value, list | np.ndarray):
        return value
    array = np.asarray(value, None if name in ("status", "limit", "sensor") else float)  # None becomes NaN
    return array[0, ...] if single and name != "frequency_hz" else array
