"""The catalogue of mechanisms: the effect of each on an FRF as picture and formula, similar mechanisms, and
diagnoses that found it; also the lab's own mechanisms, stored from diagnoses, which can be discarded."""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import escape

import numpy as np
from fastapi import APIRouter, Request, Response

from service.dependencies import Store, Table
from service.pages.shared import same_request
from service.pages.shared.downloads import Numbers, downloadable
from service.pages.shared.forms import FORM_OF_SESSION, Form, see
from service.pages.shared.html import page
from service.problems import Refusal
from service.usecases import mechanisms as usecase
from service.usecases.mechanism_catalogue import catalogue, effect, findings
from underskin.diagnosis.data.names import EXPLAINED
from underskin.figures.law_effect import RIG, EffectPanel, LawEffect
from underskin.figures.style import COLOURS, GRID, INK
from underskin.mechanisms import Unsupported
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

router = APIRouter(prefix="/mechanisms")


WIDTH, HEIGHT = 440, 400
_LEFT, _RIGHT, _PANEL, _GAP, _TOP = 62, 22, 122, 30, 18
_WIDTHS = (1.2, 2.0, 3.0)  # weak, usual, strong
_BASE = "#6b7680"
_PAPER = (_BASE, 1.8, "7 4")  # colour, width and dashes of the paper's model, which is dashed in every figure
_FONT = 'font-family="system-ui, -apple-system, Segoe UI, Helvetica, Arial, sans-serif" font-size="12"'
_QUIET = "#55626f"
_GROUND = "#ffffff"

# What each colour is where the reader prefers a dark scheme; the other ones stay.
_DARK = {
    INK: "#e4e9ee", _QUIET: "#a9b5c0", _BASE: "#a9b5c0", GRID: "#38434e", _GROUND: "#14191f", COLOURS[0]: "#56a7dc",
}  # fmt: skip
_RULES = "".join(f'[fill="{light}"]{{fill:{dark}}}[stroke="{light}"]{{stroke:{dark}}}' for light, dark in _DARK.items())
STYLE = f"@media (prefers-color-scheme:dark){{{_RULES}}}"
_STYLE_HASH = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
_SHOWN = 8  # diagnoses of each mechanism; the file of numbers has all


def picture(name: str, effect: LawEffect) -> str:
    """The panels one above the other, below them the lines with the strengths that they have."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" {_FONT} fill="{INK}">',
        f"<title>{escape(name)}</title>",
        f"<style>{STYLE}</style>",
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="8" fill="{_GROUND}"/>',
    ]
    along = _scaled(_axis(effect.x, effect), _LEFT, WIDTH - _RIGHT)
    for number, panel in enumerate(effect.panels):
        parts += _panel(effect, panel, along, _TOP + number * (_PANEL + _GAP), last=number == len(effect.panels) - 1)
    rows = [("without it", "", _PAPER)]
    rows += [
        (f"{words}:", change, look)
        for words, change, look in zip(effect.strengths, effect.changes, _looks(effect), strict=True)
    ]
    for number, (words, change, look) in enumerate(rows):
        y = _TOP + 2 * (_PANEL + _GAP) + 20 + 17 * number
        parts.append(f'<path d="M8 {y - 4}h34" {_stroke(*look)}/>')
        parts.append(f'<text x="50" y="{y}">{escape(words)} <tspan fill="{_QUIET}">{escape(change)}</tspan></text>')
    return "\n".join([*parts, "</svg>\n"])


def _looks(effect: LawEffect) -> list[tuple[str, float, str]]:
    """Colour, width and dashes of each strength, of a single one those of the usual one: solid, the wider the
    stronger."""
    count = len(effect.strengths)
    places = range(count) if count > 1 else (1,)
    return [(COLOURS[index], _WIDTHS[index], "") for index in places]


def _stroke(colour: str, width: float, dashes: str) -> str:
    """As attributes."""
    return f'stroke="{colour}" stroke-width="{width}"' + (f' stroke-dasharray="{dashes}"' if dashes else "")


def _panel(effect: LawEffect, panel: EffectPanel, along: Floats, top: float, *, last: bool) -> list[str]:
    low, high = _range([panel.base, *panel.curves])
    bottom = top + _PANEL
    parts = [f'<text x="{_LEFT}" y="{top - 6}">{escape(panel.title)}</text>']
    for tick in _ticks(low, high):
        y = bottom - (tick - low) / (high - low) * _PANEL
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{WIDTH - _RIGHT}" stroke="{GRID}"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end" fill="{_QUIET}">{_number(tick)}</text>')
    ticks = (1.0, 10.0, 100.0, 1000.0) if effect.logarithmic else _ticks(float(effect.x.min()), float(effect.x.max()))
    ends = _axis(effect.x, effect)
    for value in ticks:
        position = float(np.log10(value)) if effect.logarithmic else value
        x = _LEFT + (position - ends.min()) / (ends.max() - ends.min()) * (WIDTH - _LEFT - _RIGHT)
        parts.append(f'<path d="M{x:.1f} {top}v{_PANEL}" stroke="{GRID}"/>')
        if last:
            parts.append(
                f'<text x="{x:.1f}" y="{bottom + 15}" text-anchor="middle" fill="{_QUIET}">{_number(value)}</text>'
            )
    if last:
        middle = (_LEFT + WIDTH - _RIGHT) / 2
        parts.append(f'<text x="{middle}" y="{bottom + 29}" text-anchor="middle">{escape(effect.axis)}</text>')
    for values, look in [*zip(panel.curves, _looks(effect), strict=True), (panel.base, _PAPER)]:
        down = bottom - (values - low) / (high - low) * _PANEL
        points = " ".join(f"{px:.1f},{py:.1f}" for px, py in zip(along.tolist(), down.tolist(), strict=True))
        parts.append(f'<polyline points="{points}" fill="none" {_stroke(*look)}/>')
    return parts


def _axis(x: Floats, effect: LawEffect) -> Floats:
    return np.asarray(np.log10(x)) if effect.logarithmic else x


def _scaled(values: Floats, low: float, high: float) -> Floats:
    span = float(values.max() - values.min())
    return np.asarray(low + (values - values.min()) / span * (high - low))


def _range(curves: Sequence[Floats]) -> tuple[float, float]:
    """The range of all curves with a margin; at least a hundredth of their magnitude, or 1, so that zero does not
    look like noise."""
    low, high = float(np.min(curves)), float(np.max(curves))
    half = max((high - low) / 2 * 1.08, 0.01 * max(abs(low), abs(high)), 1e-6)
    half = max(half, 1.0) if max(abs(low), abs(high)) < 1e-6 else half
    return (low + high) / 2 - half, (low + high) / 2 + half


def _ticks(low: float, high: float) -> list[float]:
    """Three to six round numbers."""
    step = 10 ** np.floor(np.log10((high - low) / 3))
    step = next(step * factor for factor in (1, 2, 5, 10) if (high - low) / (step * factor) <= 5)
    return [float(round(step * k, 10)) for k in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")


@router.get("")
def mechanisms(request: Request, store: Store, table: Table) -> Response:
    """The lab's own first."""
    listed = catalogue(store, table)
    return page(
        request,
        "mechanisms.html",
        own=[row for row in listed.entries if row.entry.own],
        others=[row for row in listed.entries if not row.entry.own],
        unusable=usecase.unusable(),
        diagnoses=listed.diagnoses,
        shown=_SHOWN,
        sure=EXPLAINED,
        rig=RIG,
        same=same_request.get(request, "/v1/mechanisms", "client.mechanisms.all()"),
    )


@router.get("/{name}/picture.svg")
def drawn(name: str, request: Request, table: Table) -> Response:
    """Its effect on the FRF of the reference rig, or on its force curve."""
    content = picture(name, _effect(name, table))
    tag = f'"{hashlib.sha256(content.encode()).hexdigest()[:16]}"'
    headers = {
        "ETag": tag,
        "Cache-Control": "no-cache",
        "X-Content-Type-Options": "nosniff",
        "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{_STYLE_HASH}'",
    }
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(content, headers=headers, media_type="image/svg+xml")


@downloadable(router, "/{name}/effect")
def numbers(name: str, table: Table) -> Numbers:
    """The numbers of the picture."""
    shown = _effect(name, table)
    columns: dict[str, list[float]] = {shown.axis: shown.x.tolist()}
    for panel in shown.panels:
        columns[f"{panel.title}, without it"] = panel.base.tolist()
        for words, curve in zip(shown.strengths, panel.curves, strict=True):
            columns[f"{panel.title}, {words}"] = curve.tolist()
    return Numbers(name, columns)


@downloadable(router, "/{name}/found")
def found_csv(name: str, store: Store) -> Numbers:
    """Every diagnosis that states it."""
    _require_listed(name)
    rows = findings(store).by_mechanism.get(name, ())
    columns: Mapping[str, list[object]] = {
        "diagnosis": [row.diagnosis_id for row in rows],
        "campaign": [row.campaign_id or "" for row in rows],
        "skin": [row.skin_id for row in rows],
        "name": [row.name for row in rows],
        "ended_at": [row.at for row in rows],
        "verdict": [row.verdict for row in rows],
        "probability": [row.probability for row in rows],
    }
    return Numbers(f"{name}-found", columns)


@router.post("")
def keep_found(sent: Form, store: Store) -> Response:
    """Store the law that a diagnosis found as a mechanism."""
    description = sent.get("description", "").strip()[:500] or None
    store.read(usecase.keep_found, sent.get("diagnosis_id", ""), sent.get("name", "").strip(), description)
    return see("/mechanisms")


@router.post("/{name}/discard", dependencies=[FORM_OF_SESSION])
def discard(name: str, store: Store) -> Response:
    """Remove it from the catalogue."""
    store.read(usecase.discard, name)
    return see("/mechanisms")


def _effect(name: str, table: SigmaTable) -> LawEffect:
    """Raises Refusal 404, also if the reference rig lacks the quantity on which the mechanism depends."""
    _require_listed(name)
    try:
        return effect(name, table)
    except Unsupported as lacking:
        raise Refusal(404, f"There is no picture of {name!r}: {lacking.reason}.") from None


def _require_listed(name: str) -> None:
    """Raises Refusal 404."""
    if name not in usecase.catalogue():
        raise Refusal(404, f"There is no mechanism {name!r}.")
