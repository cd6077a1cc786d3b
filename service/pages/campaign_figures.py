"""The figures of a campaign's page, and their numbers."""

from collections.abc import Callable, Mapping, Sequence
from threading import Lock
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from service.pages.figures import Drawn, drawn
from service.store import campaigns
from service.store.engine import Database
from service.store.tables import AnyRow
from underskin import InvalidInput
from underskin.recordings.campaign import Campaign, CompressionRecording, FrfRecording, IndentationRecording
from underskin.surrogate import SigmaTable
from underskin.units import to_lab

if TYPE_CHECKING:
    from underskin.inversion import Inversion
    from underskin.recordings.frf_estimation import Frf

_MOST_SINGLE = 48  # recordings whose lines are drawn one by one
_MOST_CURVES = 24
_MOST_KEPT = 64
Which = tuple[str, int, str, str, str]  # campaign, revision, table, band, what is shown
_kept: dict[Which, list[Drawn]] = {}
_keeping = Lock()


def figures(store: Database, table: SigmaTable, row: AnyRow, answer: Mapping[str, Any], show: str) -> list[Drawn]:
    """All that can be drawn of a campaign as it is now; `answer`: its d33, as `/d33` has it. `show` as `measured` has
    it. What was drawn lately is kept."""
    basis = (row.id, row.revision, table.sha256, _chosen(answer))
    makers: dict[str, Callable[[Campaign], list[Drawn]]] = {
        f"lines {show}": lambda campaign: [*_curves(row, campaign), *_frf(row, campaign, answer, show)],
        "d33": lambda campaign: _d33(row, campaign, answer, table),
    }
    found = {name: _kept.get((*basis, name)) for name in makers}
    if None in found.values():
        campaign = _loaded(store, row)
        for name, make in makers.items():
            if found[name] is None:
                found[name] = _keep((*basis, name), make(campaign))
    return [figure for some in found.values() for figure in some or ()]


def _keep(which: Which, drawn_now: list[Drawn]) -> list[Drawn]:
    with _keeping:
        while len(_kept) >= _MOST_KEPT:
            del _kept[next(iter(_kept))]
        _kept[which] = drawn_now
    return drawn_now


def _loaded(store: Database, row: AnyRow) -> Campaign:
    with store.reading() as connection:
        return campaigns.load(connection, row, with_excluded=False)


def band_query(band_hz: tuple[float, float]) -> str:
    """A band in an address."""
    return f"band_low_hz={band_hz[0]!r}&band_high_hz={band_hz[1]!r}"


def _chosen(answer: Mapping[str, Any]) -> str:
    """The band in an address, where the reader chose it."""
    band = answer["band"]
    return band_query((band["low_hz"], band["high_hz"])) if band is not None and band["chosen_by_user"] else ""


def measured(campaign: Campaign, show: str = "") -> list[tuple[FrfRecording, "Frf"]]:
    """The FRF recordings that have an FRF, or those of them that are called `show` or of the sensor of that name."""
    from underskin.recordings.frf_estimation import lines_of

    found = []
    for recording in campaign.recordings:
        if isinstance(recording, FrfRecording) and show in ("", recording.sensor, recording.id):
            try:
                found.append((recording, lines_of(recording)))
            except InvalidInput:
                continue
    return found


def frf_columns(campaign: Campaign, show: str = "") -> dict[str, list[Any]]:
    """Every line of the recordings, or of those of `show`."""
    names = ("recording", "sensor", "frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence")
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for recording, frf in measured(campaign, show):
        count = len(frf.values)
        columns["recording"] += [recording.id] * count
        columns["sensor"] += [recording.sensor] * count
        columns["frequency_hz"] += frf.frequency.tolist()
        columns["frf_re_pc_per_n"] += to_lab("frf_pc_per_n", frf.values.real).tolist()
        columns["frf_im_pc_per_n"] += to_lab("frf_pc_per_n", frf.values.imag).tolist()
        columns["coherence"] += [None] * count if frf.coherence is None else frf.coherence.tolist()
    return columns


def inversion(campaign: Campaign, answer: Mapping[str, Any], table: SigmaTable) -> "Inversion | None":
    """The campaign's d33 recording by recording, over the band of its answer; None where it has none."""
    from underskin.inversion import invert
    from underskin.recordings.flat_zone import FlatZone

    if answer["band"] is None:
        return None
    band = {**answer["band"], "left_out_hz": tuple(answer["band"]["left_out_hz"])}
    return invert(campaign, table, zone=FlatZone(**band))


def preload_columns(campaign: Campaign, found: "Inversion") -> dict[str, Sequence[Any]]:
    """What the figure of FRF against preload shows, a row a recording."""
    from underskin.campaign_figures import model_frf

    rows = found.recordings
    return {
        "recording": rows.ids,
        "sensor": [found.sensor_ids[number] for number in rows.sensor.tolist()],
        "indenter_radius_mm": to_lab("indenter_radius_mm", rows.indenter_radius).tolist(),
        "preload_n": rows.preload.tolist(),
        "frf_pc_per_n": to_lab("frf_pc_per_n", rows.frf).tolist(),
        "frf_uncertainty_pc_per_n": to_lab("frf_pc_per_n", rows.frf_uncertainty).tolist(),
        "model_frf_pc_per_n": to_lab("frf_pc_per_n", model_frf(campaign, found)).tolist(),
    }


def _frf(row: AnyRow, campaign: Campaign, answer: Mapping[str, Any], show: str) -> list[Drawn]:
    from underskin import frf_summary
    from underskin.figures import frf_overview, frf_recordings

    chosen = measured(campaign, show)
    if not chosen:
        return []
    band = answer["band"]
    zone = None if band is None else (band["low_hz"], band["high_hz"])
    numbers = f"/campaigns/{row.id}/frf.csv?show={quote(show, safe='')}"
    if len(chosen) <= _MOST_SINGLE:
        lines = [frf_summary.lines_of(_title(recording, show), frf) for recording, frf in chosen]
        return [drawn("frf", frf_recordings(lines, zone), "Magnitude, phase and coherence of each recording.", numbers)]
    conditions = [(recording.indenter_radius_mm, recording.preload_n) for recording, _ in chosen]
    spreads = frf_summary.spreads([frf for _, frf in chosen], conditions)
    about = (
        f"{len(chosen)} recordings: for each sphere and preload the median magnitude and phase and the lowest "
        "coherence; as a band, the magnitudes of all its recordings."
    )
    return [drawn("frf", frf_overview(spreads, zone), about, numbers)]


def _title(recording: FrfRecording, show: str) -> str:
    where = "" if show == recording.sensor else f"{recording.sensor}, "
    return f"{where}{recording.indenter_radius_mm:.3g} mm, {recording.preload_n:.3g} N"


def _d33(row: AnyRow, campaign: Campaign, answer: Mapping[str, Any], table: SigmaTable) -> list[Drawn]:
    from underskin import campaign_figures

    found = inversion(campaign, answer, table)
    if found is None:
        return []
    over_array, versus_preload, response = campaign_figures.figures(campaign, found)
    place, chosen = f"/campaigns/{row.id}", _chosen(answer)
    chosen = f"?{chosen}" if chosen else ""
    return [
        drawn(
            "preload",
            versus_preload,
            "FRF in the flat zone against preload, for each sphere; lines are the model with the array's d33.",
            f"{place}/preload.csv{chosen}",
        ),
        drawn("response", response, "d33 of each sensor with its 95 % interval.", f"{place}/d33.csv{chosen}"),
        drawn("map", over_array, "Each sensor where it lies, coloured by its d33.", f"{place}/d33.csv{chosen}"),
    ]


def _curves(row: AnyRow, campaign: Campaign) -> list[Drawn]:
    from underskin.figures import Curve, force_curves

    kinds = (IndentationRecording, CompressionRecording)
    chosen = [recording for recording in campaign.recordings if isinstance(recording, kinds)]
    if not chosen:
        return []
    figure = force_curves([Curve(one.id, one.displacement_mm, one.force_n) for one in chosen[:_MOST_CURVES]])
    about = f"Force against displacement of {min(len(chosen), _MOST_CURVES)} of {len(chosen)} recordings."
    return [drawn("curves", figure, about, f"/campaigns/{row.id}/curves.csv")]
