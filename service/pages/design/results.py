"""The results of a design, in order, and the comparison of two designs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from service.pages.design.sliders import SLIDERS
from service.pages.shared.formats import change_in_percent, short_and_exact
from service.schemas.design import DesignAnswer
from underskin.prediction.answers import OTHER, WORDS

BLIND_PERCENT = 10.0  # of the response above a sensor: below, it is invisible


@dataclass(frozen=True)
class DesignResult:
    """One result of a design: short, exact, and with a remark."""

    name: str
    words: str
    value: float | None
    unit: str
    digits: int
    note: str

    @property
    def text(self) -> str:
        """The value with its unit."""
        shown = short_and_exact(self.value, self.unit, self.digits)[0]
        return shown if self.value is None else f"{shown} {self.unit}".strip()

    @property
    def exact(self) -> str:
        """All its digits."""
        return short_and_exact(self.value, self.unit, self.digits)[1]


def results(answer: DesignAnswer, other_sigma: float | None = None) -> list[DesignResult]:
    """The results of a design, in order; `other_sigma`: σ by the other contact model, if it is shown."""
    apart = answer.two_point_separation_mm
    blind = answer.response_amid_percent is not None and answer.response_amid_percent < BLIND_PERCENT
    point = f"a/h {answer.a_over_h:.3g}, rT/h {answer.rt_over_h:.3g}, L {answer.load_parameter:.2g}"
    if other_sigma is not None:
        point += f"; {WORDS[OTHER[answer.contact]]} σ is {other_sigma:.4g}"
    anywhere = "wherever the array lies" if apart is not None else "not resolved everywhere at this pitch"
    entries = [
        DesignResult("sigma", "transmission σ", answer.sigma, "", 4, point),
        DesignResult("frf", "FRF", answer.frf_pc_per_n, "pC/N", 4, "what an instrument should show above the sensor"),
        DesignResult("gamma", "γ of a point load", answer.gamma, "", 4, "above the sensor, linear layer"),
        DesignResult("stress", "mean stress on the sensor", answer.mean_stress_mpa, "MPa", 3,
             f"contact radius {answer.contact_radius_mm:.3g} mm"),
        DesignResult("resolution", "response width", answer.resolution_mm, "mm", 3,
                     "of one sensor, at half its maximum"),
        DesignResult("apart", "two-point separation", apart, "mm", 3, f"two equal loads, {anywhere}"),
        DesignResult("best", "two-point separation at best", answer.two_point_best_mm, "mm", 3,
             "where the sensors lie best under them"),
        DesignResult("amid", "response amid four sensors", answer.response_amid_percent, "%", 3,
             "of that above one" + (": blind spots" if blind else "")),
    ]  # fmt: skip
    if answer.status == "ok":
        return entries
    return [replace(result, note="outside the table") if result.value is None else result for result in entries]


@dataclass(frozen=True)
class Compared:
    """One number of the pinned and of the present design, and the relative change to the latter."""

    name: str
    words: str
    pinned: str
    stands: str
    change: str


def compared(
    pinned: tuple[Mapping[str, float], DesignAnswer], stands: tuple[Mapping[str, float], DesignAnswer]
) -> list[Compared]:
    """Inputs and results of both designs."""
    numbers = [values for values, _ in (pinned, stands)]
    chosen = [
        _compared(name, words, [(f"{values[name]:g} {unit}", values[name]) for values in numbers])
        for name, words, unit, *_ in SLIDERS
    ]
    comparisons = [
        _compared(f"told-{result.name}", result.words, [(result.text, result.value), (reference.text, reference.value)])
        for result, reference in zip(*(results(answer) for _, answer in (pinned, stands)), strict=True)
    ]
    return chosen + comparisons


def _compared(name: str, words: str, both: Sequence[tuple[str, float | None]]) -> Compared:
    (pinned, before), (stands, after) = both
    change = "–"
    if before and after is not None:
        percent = 100 * (after / before - 1)
        change = "same" if abs(percent) < 0.05 else f"{change_in_percent(percent, 3)} %"
    return Compared(name, words, pinned, stands, change)
