"""Search for skins with a required resolution: thickness, sensor radius and pitch over the domain of the table.

The requirement is the two-point separation of `POST /v1/design`: the distance from which two equal contacts show as two
for every position of the row of sensors. The contacts are with the layer itself (`solved`). A thin layer spreads the
stress less and a fine pitch samples it more densely; a sensor cannot be wider than the pitch, and two contacts cannot
be nearer than touching.

Two contacts show as two if a sensor between two others reads less than both, by `dip` times the reading above a sensor,
for every position of the row of sensors and from that distance on (`underskin.prediction.skin_design`); it is evaluated
on few placements and distances, in order to search many designs. The pitch cannot exceed half the distance: if the
middle between the contacts lies midway between two sensors, each of these is nearer to its contact than the sensor
beyond it and reads more, so that there is no dip.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from service.schemas.design import DesignAnswer, DesignDemand, DesignRequest
from service.usecases.design import design_answer, design_of
from underskin import Indenter, Skin
from underskin.prediction.pressed_skin import transmission
from underskin.prediction.skin_design import are_resolved, resolution
from underskin.surrogate.off_centre_sigma import sigma_off_centre
from underskin.surrogate.sigma_table import ContactModel, ContactName, SigmaTable
from underskin.surrogate.solved_contact import contact_model
from underskin.units import Floats, Mask, checked, to_lab, to_si

_PLACEMENTS = 7  # over half a pitch: the other half is its mirror image
_DISTANCES = 16
_BISECTIONS = 7
THICKNESS_MM, RADIUS_MM = (0.2, 20.0), (0.1, 10.0)  # the search range, within the table
_THICKNESSES, _RADII = 8, 6
_CONTACT: ContactName = "solved"
NEARLY = 0.95  # of the largest pitch: nearly as few sensors
_INSIDE = 1.0001  # times the thinnest layer of the table

# Beyond what it misses by, by how much at most in a step, and how often, a pitch is reduced until it meets the demand.
_FINER, _STEP, _TIMES = 0.995, 0.95, 8


def largest_pitch(offset: Floats, response: Floats, distance: float, finest: float, dip: float) -> float:
    """The largest pitch [m], from `finest` on, at which two contacts are told apart from `distance` [m] on; NaN where
    they are not even at `finest`.

    Parameters
    ----------
    offset, response
        (n,) distance of a contact from the sensor's centre [m], from 0 on, and the response there [-].
    dip
        Over the response above a sensor [-].
    """
    if finest > distance / 2 or not _are_all_resolved(offset, response, finest, distance, dip):
        return float("nan")
    low, high = finest, distance / 2
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if _are_all_resolved(offset, response, middle, distance, dip):
            low = middle
        else:
            high = middle
    return low


def _are_all_resolved(offset: Floats, response: Floats, pitch: float, distance: float, dip: float) -> bool:
    """Whether two contacts show as two at this and every larger distance, for every placement of the row."""
    width = 2 * float(offset[int(np.argmax(response < response[0] / 2))])
    farthest = distance + 2 * pitch + 2 * width  # beyond it each contact is seen on its own, again and again
    distances = np.linspace(distance, farthest, _DISTANCES)
    return bool(are_resolved(offset, response, pitch, distances, _PLACEMENTS, dip).all())


@dataclass(frozen=True)
class Region:
    """Contact radii (n,) on thicknesses (n,), and sensor radii (m,) [mm]; of each pair (m, n) the largest pitch [mm],
    to about 5 %, that resolves what is asked by the calculation of `POST /v1/design`, NaN where none does, and charge
    over force [pC/N], NaN outside the table."""

    contact_radius_mm: Floats
    thickness_mm: Floats
    sensor_radius_mm: Floats
    largest_pitch_mm: Floats
    frf_pc_per_n: Floats


@dataclass(frozen=True)
class Offer:
    """A design that meets the demand, by the calculation of `POST /v1/design`; `merit`: what it is best in."""

    merit: str
    request: DesignRequest
    answer: DesignAnswer


@dataclass(frozen=True)
class Searched:
    """The region, the mask of feasible pairs, the offers (best first) and, if there are none, sentences on the limit
    that excludes all designs."""

    region: Region
    feasible: Mask
    offers: Sequence[Offer]
    binding: Sequence[str]


def search(table: SigmaTable, demand: DesignDemand) -> Searched:
    """Every design that meets a demand, and the best; raises InvalidInput."""
    anything = {"thinnest_mm": 0.0, "least_pitch_mm": 0.0, "least_frf_pc_per_n": 0.0}
    region = _region(table, demand.model_copy(update=anything))
    resolves = np.isfinite(region.largest_pitch_mm)
    limits = _limits(region, demand)
    feasible = resolves & np.all([limit.satisfied for limit in limits], axis=0)
    offers = _offers(table, demand, region, feasible)
    return Searched(region, feasible, offers, [] if offers else _binding(table, demand, region, resolves, limits))


@lru_cache(maxsize=32)
def _region(table: SigmaTable, demand: DesignDemand) -> Region:
    """All pairs, whether or not they can be made."""
    indenter = Indenter.from_lab(indenter_radius_mm=demand.indenter_radius_mm)
    force = float(checked("preload_n", demand.preload_n))
    d33 = float(checked("d33_pc_per_n", demand.d33_pc_per_n))
    any_skin = Skin.from_lab(thickness_mm=1.0, youngs_modulus_mpa=demand.youngs_modulus_mpa, sensor_radius_mm=1.0)
    used = contact_model(table, _CONTACT)
    thinnest = max(THICKNESS_MM[0], _rounded_up(_INSIDE * _thinnest_mm(used, any_skin, indenter, force)))
    thickness = _steps(thinnest, max(demand.resolution_mm, 2 * thinnest), THICKNESS_MM[1], _THICKNESSES)
    radii = _steps(RADIUS_MM[0], max(0.28 * demand.resolution_mm, 2 * RADIUS_MM[0]), RADIUS_MM[1], _RADII)
    h, radius = np.meshgrid(to_si("thickness_mm", thickness), to_si("sensor_radius_mm", radii))
    skin = Skin(h, any_skin.youngs_modulus, radius, any_skin.poisson_ratio)
    reached = transmission(used, skin, indenter, force)
    contact = to_lab("contact_radius_mm", reached.contact_radius[0])
    numbers = reached.small_strain_a_over_h, reached.rt_over_h, reached.load_parameter
    apart = (2 * contact <= demand.resolution_mm) & (4 * radii[:, None] <= demand.resolution_mm)
    pitch = np.full(h.shape, np.nan)
    for index in zip(*np.nonzero(reached.inside & apart), strict=True):
        offset, response = sigma_off_centre(used, *(float(part[index]) for part in numbers))
        if np.isfinite(response).all():
            finest, touching = 2 * float(radii[index[0]]), float(contact[index[1]])
            pitch[index] = _largest_pitch_mm(offset * float(h[index]), response, finest, touching, demand)
    return Region(contact, thickness, radii, pitch, np.asarray(to_lab("frf_pc_per_n", reached.frf(d33))))


def _thinnest_mm(contact: ContactModel, skin: Skin, indenter: Indenter, force: float) -> float:
    """The thickness at which a/h is the largest of the table."""
    most = np.array(contact.domain["a_over_h"][1])
    over_cube, _ = contact.load_over_cube(most)
    plane_modulus = skin.youngs_modulus / (1 - skin.poisson_ratio**2)
    return float(to_lab("thickness_mm", np.cbrt(force * indenter.radius / (plane_modulus * over_cube * most**3))))


def _largest_pitch_mm(
    offset: Floats, response: Floats, finest_mm: float, contact_mm: float, demand: DesignDemand
) -> float:
    """From `finest_mm` on, in steps of 0.01 mm: the pitch from few placements and distances, reduced until all of
    `POST /v1/design` agree; NaN if none nearby does. `offset`: in m."""
    distance, finest, touching = (
        float(to_si("x_mm", value)) for value in (demand.resolution_mm, finest_mm, 2 * contact_mm)
    )
    dip = demand.dip_percent / 100
    pitch = float(to_lab("x_mm", largest_pitch(offset, response, distance, finest, dip)))
    for _ in range(_TIMES):
        pitch = float(np.floor(100 * pitch) / 100)
        if not pitch >= finest_mm:
            break
        apart = float(to_lab("x_mm", resolution(offset, response, pitch * 1e-3, touching, dip).separation))
        if apart <= demand.resolution_mm:
            return pitch
        pitch *= float(np.fmax(_STEP, _FINER * demand.resolution_mm / apart))
    return float("nan")


def _steps(low: float, high: float, most: float, count: int) -> Floats:
    """Geometric steps, as round numbers."""
    return np.array([float(f"{value:.3g}") for value in np.geomspace(low, min(high, most), count)])


def _rounded_up(value: float) -> float:
    """To three digits, as `_steps` writes it: what is thinner is outside the table."""
    if not np.isfinite(value) or value <= 0:
        return value
    unit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(f"{np.ceil(value / unit) * unit:.3g}")


@dataclass(frozen=True)
class _Limit:
    """The mask of pairs that satisfy a limit, the words for the value that would suffice, and the largest such value
    for each pair."""

    satisfied: Mask
    words: str
    number: Floats


def _limits(region: Region, demand: DesignDemand) -> list[_Limit]:
    """What can be made, and what must be seen."""
    thickness = np.broadcast_to(region.thickness_mm, region.frf_pc_per_n.shape)
    return [
        _Limit(
            thickness >= demand.thinnest_mm,
            "The thinnest layer that can be made: none of them that does the rest is thicker than {:.3g} mm",
            thickness,
        ),
        _Limit(
            region.largest_pitch_mm >= demand.least_pitch_mm,
            "The smallest pitch that can be made: none of them that does the rest has a pitch above {:.3g} mm",
            region.largest_pitch_mm,
        ),
        _Limit(
            region.frf_pc_per_n >= demand.least_frf_pc_per_n,
            "The least charge over force: none of them that does the rest gives more than {:.3g} pC/N",
            region.frf_pc_per_n,
        ),
    ]


def _binding(
    table: SigmaTable, demand: DesignDemand, region: Region, resolves: Mask, limits: Sequence[_Limit]
) -> list[str]:
    """Which limit excludes all designs, each with the value that would suffice."""
    finest = float(region.thickness_mm[0]), RADIUS_MM[0], 2 * RADIUS_MM[0]
    if not np.isfinite(region.frf_pc_per_n).any():
        return [f"The table of σ: {_forward(table, demand, *finest)[1].limit}"]
    touch = 2 * float(region.contact_radius_mm.min())
    if demand.resolution_mm < touch:
        touching = f"at this force two of them touch at {touch:.3g} mm on the thinnest skin, and farther off on others"
        return [
            f"The contacts themselves: {touching}. A smaller sphere, less force or a stiffer layer has smaller ones"
        ]
    if not resolves.any():
        apart = _forward(table, demand, *finest)[1].two_point_separation_mm
        reached = "tells no two contacts apart" if apart is None else f"tells them apart from {apart:.3g} mm on"
        skin = f"h {finest[0]:g} mm, rT {finest[1]:g} mm, pitch {finest[2]:g} mm"
        return [f"The spread of the stress: even the finest skin of the search ({skin}) {reached}"]
    messages = []
    for limit in limits:
        other_limits = resolves & np.all([another.satisfied for another in limits if another is not limit], axis=0)
        if other_limits.any() and not (other_limits & limit.satisfied).any():
            messages.append(limit.words.format(float(limit.number[other_limits].max())))
    return messages or ["The limits together: no one of them alone keeps every design out"]


def _offers(table: SigmaTable, demand: DesignDemand, region: Region, feasible: Mask) -> list[Offer]:
    """The best by each merit, one that is best in several once."""
    if not feasible.any():
        return []
    pitch, frf, thickness = (
        np.where(feasible, number, -np.inf)
        for number in (region.largest_pitch_mm, region.frf_pc_per_n, region.thickness_mm)
    )
    # Of those with nearly the fewest sensors the strongest signal; then the others by their pitch, all below 0.
    few = np.where(pitch >= NEARLY * pitch.max(), frf, pitch - 2 * pitch.max())
    # Of equally thick ones the strongest signal.
    merits = {"fewest sensors": few, "strongest signal": frf, "thickest layer": thickness + 1e-9 * frf}
    offers: list[Offer] = []
    for merit, value in merits.items():
        made = _offer(table, demand, region, int(np.argmax(value)), merit)
        same = [index for index, offer in enumerate(offers) if offer.request == made.request]
        if not same:
            offers.append(made)
        for index in same:
            offers[index] = replace(offers[index], merit=f"{offers[index].merit}, {merit}")
    return offers


def _offer(table: SigmaTable, demand: DesignDemand, region: Region, index: int, merit: str) -> Offer:
    """One pair at its largest pitch, as `POST /v1/design` has it."""
    row, column = np.unravel_index(index, region.largest_pitch_mm.shape)
    thickness, radius = float(region.thickness_mm[column]), float(region.sensor_radius_mm[row])
    return Offer(merit, *_forward(table, demand, thickness, radius, float(region.largest_pitch_mm[row, column])))


def _forward(
    table: SigmaTable, demand: DesignDemand, thickness: float, radius: float, pitch: float
) -> tuple[DesignRequest, DesignAnswer]:
    """What `POST /v1/design` says of one design [mm]."""
    fields = demand.model_dump(exclude={"resolution_mm", "thinnest_mm", "least_pitch_mm", "least_frf_pc_per_n"})
    request = DesignRequest(thickness_mm=thickness, sensor_radius_mm=radius, pitch_mm=pitch, **fields)
    return request, design_answer(table, request, design_of(table, request))
