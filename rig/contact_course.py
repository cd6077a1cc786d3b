"""The evolution of a contact in time: stage, sphere and viscoelastic body, step by step.

The stage's far end is at X(t), 0 where the surfaces touch, and gives by its compliance C:  X = δ + C F. Each ring x of
the contact (`sphere`) remembers its own history from the moment it joined,
    f(x, t) = ∫ E(t − s) dθ(x, s),    F = ∫₀^a f(x, t) dk(x),
so one rule covers loading, hold and unloading. With G = f(a)²/(E p²), E unrelaxed as the edge is fast:
- the edge advances where a fresh ring can carry the work of adhesion, δ > δ₀(a) − p √(w/E);
- it recedes where the tension of the outermost ring exceeds what the work of separation holds, f(a) < −p √(w_s E);
- between the two it rests, and the contact is a flat punch.
Without adhesion the first is Lee and Radok's solution (1960) and the second Ting's (1966), without memory they are
those of Johnson, Kendall and Roberts. Jumps happen at constant X. A course has one way back: an edge that has receded
does not advance again, as it would over a surface that has not recovered.
"""

from dataclasses import dataclass, field

import numpy as np

from rig.errors import RigError
from rig.layer import Floats
from rig.relaxation import Relaxation
from rig.sphere import SphereLaw

_STILL = 0.5  # nodes; an edge that has receded by less may advance again


@dataclass(frozen=True)
class Body:
    """The pressed body.

    Attributes
    ----------
    law : SphereLaw
        Law of the sphere on the body with E = 1.
    modulus : float
        E before relaxation [MPa].
    relaxation : Relaxation
        Relaxation of E.
    approach, separation : float
        Work of adhesion w and of separation w_s [N/mm].
    """

    law: SphereLaw
    modulus: float
    relaxation: Relaxation = field(default_factory=Relaxation)
    approach: float = 0.0
    separation: float = 0.0

    def elastic(self, depth: float) -> float:
        """Force [N] at a depth during loading, before any relaxation."""
        depths, forces = self.law.on_branch(self.approach / self.modulus)
        start = int(np.argmin(depths))
        return self.modulus * float(np.interp(depth, depths[start:], forces[start:]))

    def last_touch(self, compliance: float) -> float:
        """The travel X [mm] at which the elastic contact breaks during unloading."""
        depths, forces = self.law.on_branch(self.separation / self.modulus)
        return float(np.min(depths + compliance * self.modulus * forces))


def contact_history(body: Body, time: Floats, travel: Floats, compliance: float) -> tuple[Floats, Floats]:
    """Depth and force of a contact while the stage moves.

    Parameters
    ----------
    body : Body
    time, travel : ndarray, (samples,)
        Time [s] and travel X [mm] of the stage's far end; the first is before contact.
    compliance : float
        C of the stage [mm/N]; 0 is rigid.

    Returns
    -------
    tuple of ndarray, (samples,)
        Depth δ of the sphere [mm], negative in the air, and force F [N].

    Raises
    ------
    RigError
        Where the contact becomes wider than the law of the sphere.
    """
    contact = _Contact(body, compliance * body.modulus)
    depth, force = travel.copy(), np.zeros_like(travel)
    for index in range(1, len(time)):
        if contact.broken or (not contact.made and travel[index] <= 0):
            continue
        contact.advance(time[index] - time[index - 1], float(travel[index]))
        depth[index], force[index] = contact.depth, body.modulus * contact.force
    return depth, force


class _Contact:
    """The state of a contact; forces over E, compliance times E."""

    def __init__(self, body: Body, compliance: float) -> None:
        law, pairs = body.law, body.relaxation
        self.law, self.compliance = law, compliance
        self.fraction = np.array([1 - sum(pairs.fraction), *pairs.fraction])
        self.rate = np.array([0.0, *(1 / tau for tau in pairs.time_s)])  # the first part never relaxes
        self.joins = law.depth - law.pull * np.sqrt(body.approach / body.modulus / law.stiffer)
        self.holds = law.pull * np.sqrt(body.separation / body.modulus / law.stiffer)
        self.missing = law.missing
        self.parts = np.zeros((len(self.fraction), len(law.radius)))  # of f(x) of each ring, by its relaxation
        self.edge = self.widest = 0.0  # in nodes
        self.depth = self.force = 0.0
        self.made = self.broken = False

    def advance(self, seconds: float, travel: float) -> None:
        """Move the stage to `travel` within `seconds`."""
        elapsed = self.rate * seconds
        self.parts *= np.exp(-elapsed)[:, None]
        retained = np.divide(-np.expm1(-elapsed), elapsed, out=np.ones_like(elapsed), where=elapsed > 0)
        self.added = self.fraction * retained  # to the parts of every ring, for each unit of depth
        self.gain = float(self.added.sum())
        self.stress = self.parts.sum(axis=0)
        rings = np.diff(self.law.punch) * (self.stress[1:] + self.stress[:-1]) / 2
        self.carried = np.append(0.0, np.cumsum(rings))  # ∫ f dk before this step's motion
        depth = self._resting_at_edge(travel)
        if depth > self._at(self.joins) and self.edge > self.widest - _STILL:
            self._grow(travel)
        elif self._at(self.stress) + self.gain * (depth - self.depth) < -self._at(self.holds):
            self._recede(travel)
        else:
            self._move(travel, depth)

    def _at(self, column: Floats) -> float:
        """The value of a column at the contact edge."""
        node = min(int(self.edge), len(column) - 2)
        return float(column[node] + (self.edge - node) * (column[node + 1] - column[node]))

    def _resting_depth(self, travel: float, carried: Floats, punch: Floats, stiffer: Floats) -> Floats:
        """The depth in equilibrium with the stage while the edge rests, for edges (edges,)."""
        spring = self.compliance * stiffer
        still = travel - spring * (carried - punch * self.gain * self.depth)
        return np.asarray(still / (1 + spring * punch * self.gain))

    def _resting_at_edge(self, travel: float) -> float:
        columns = (np.array(self._at(column)) for column in (self.carried, self.law.punch, self.law.stiffer))
        return float(self._resting_depth(travel, *columns))

    def _move(self, travel: float, depth: float) -> None:
        """Let every ring in contact, and the first beyond it, follow the depth."""
        beyond = int(self.edge) + 2
        self.parts[:, :beyond] += self.added[:, None] * (depth - self.depth)
        self.force = self._at(self.law.stiffer) * (
            self._at(self.carried) + self._at(self.law.punch) * self.gain * (depth - self.depth)
        )
        self.depth = travel - self.compliance * self.force

    def _grow(self, travel: float) -> None:
        """Advance the edge to the next radius at which the depth of the new ring and the stage are in equilibrium."""
        first, before, law = int(self.edge) + 1, self.depth, self.law
        carried, punch, missing = (self._at(column) for column in (self.carried, law.punch, self.missing))

        def force(depth: Floats, new_punch: Floats, new_missing: Floats, stiffer: Floats) -> Floats:
            old = carried + punch * self.gain * (depth - before)
            return np.asarray(stiffer * (old + (new_punch - punch) * depth - (new_missing - missing)))

        ahead = [
            np.append(self._at(column), column[first:]) for column in (law.punch, self.missing, law.stiffer, self.joins)
        ]
        joins = ahead[-1]
        reach = joins + self.compliance * force(joins, *ahead[:-1])
        beyond = np.flatnonzero(reach[1:] >= travel)
        if not len(beyond):
            raise RigError("curves.largest_displacement_mm", travel, "makes the contact wider than the rig has solved")
        after = int(beyond[0]) + 1
        low, high = reach[after - 1], reach[after]
        share = float(np.clip((travel - low) / (high - low), 0, 1)) if high > low else 1.0
        start = self.edge if after == 1 else first + after - 2
        self.edge = start + share * (first + after - 1 - start)
        depth = joins[after - 1] + share * (joins[after] - joins[after - 1])
        at = (np.array(self._at(column)) for column in (self.law.punch, self.missing, self.law.stiffer))
        self.force = float(force(np.array(depth), *at))
        depth = travel - self.compliance * self.force
        self.parts[:, :first] += self.added[:, None] * (depth - before)
        fresh = slice(first if self.made else 0, int(self.edge) + 2)
        self.parts[:, fresh] = self.fraction[:, None] * (depth - self.law.depth[fresh])
        self.depth, self.made, self.widest = depth, True, max(self.edge, self.widest)

    def _recede(self, travel: float) -> None:
        """Retract the edge to the widest radius that holds; if none holds, the contact breaks."""
        inside = slice(0, int(self.edge) + 1)
        columns = (column[inside] for column in (self.carried, self.law.punch, self.law.stiffer))
        depth = self._resting_depth(travel, *columns)
        spare = self.stress[inside] + self.gain * (depth - self.depth) + self.holds[inside]
        good = np.flatnonzero(spare >= 0)
        if not len(good):
            self.broken = True
            self.edge = self.force = 0.0
            self.depth = travel
            return
        node = int(good[-1])
        end, lacking = float(node + 1), 0.0
        if node + 1 < len(spare):
            lacking = float(spare[node + 1])
        else:
            end, resting = self.edge, self._resting_at_edge(travel)
            lacking = self._at(self.stress) + self.gain * (resting - self.depth) + self._at(self.holds)
        self.edge = node + (end - node) * float(spare[node] / (spare[node] - lacking))
        self._move(travel, self._resting_at_edge(travel))
