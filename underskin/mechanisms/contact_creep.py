"""The skin slowly gives way under the preload, so the contact grows and the response changes with the time for which
the preload has been held.

Law: E(t) = E (1 − g (1 − e^(−t/τ))), with t the time held; a³ ∝ 1/E(t), L ∝ 1/E(t).

Assumptions: quasi-elastic: each instant as an elastic layer of modulus E(t), one Prony pair, the declared E is the
instantaneous one. (Exact creep under a constant force uses J(t), whose time is τ/(1 − g).) A held oscillation is felt
through the contact radius alone, since transmission through a linear layer under force control has no modulus in it.
Curves: F(t) = u − g ∫ (1 − e^(−(t−s)/τ)) du(s) of the elastic force u(t), exact for a linear material while the contact
grows; where it shrinks Ting's theory would take the same history up to the moment of equal contact.

Source: Lee & Radok, J. Appl. Mech. 27 (1960) 438; Ting, J. Appl. Mech. 33 (1966) 845.
"""

from underskin.mechanisms.contact_state import Contacts
from underskin.mechanisms.curve_state import Curve
from underskin.mechanisms.curve_timing import time_runs_with_displacement
from underskin.mechanisms.differentiated import exp
from underskin.mechanisms.mechanism import Kind, Mechanism, Normal, Parameter, Uniform, Values
from underskin.recordings.campaign import Campaign, CompressionRecording, IndentationRecording


class ContactCreep(Mechanism):
    """See the module."""

    name = "contact_creep"
    kinds = ("frf", "indentation", "compression")
    axes = ("dwell_s", "preload_n", "indenter_radius_mm", "time_s")
    needs = "frf: dwell_s of every recording, not all the same; curves: time_s, and two speeds, a hold or a way back"
    contact_axes = ("dwell_s",)

    def parameters(self, campaign: Campaign, kind: Kind = "frf") -> tuple[Parameter, ...]:
        """One Prony pair."""
        return (
            Parameter(
                name="relaxed_fraction",
                unit="-",
                low=0.0,
                high=0.9,
                prior=Uniform(),
                scale="linear",
                limit=0.0,
                reason="from a few percent in a well cured silicone to most of the modulus in a gel",
            ),
            Parameter(
                name="relaxation_time",
                unit="s",
                low=0.05,
                high=5e4,
                prior=Normal(3.7, 1.5),
                scale="log",
                limit=None,
                reason="what a bench can see lies between seconds and an hour; 40 s within a factor of 4.5",
            ),
        )

    def unsupported(self, campaign: Campaign, kind: Kind) -> str | None:
        """Times are needed that say more than the loads: dwell_s that differ, or time_s apart from displacement."""
        if kind != "frf":
            curves = [
                entry
                for entry in campaign.recordings
                if isinstance(entry, IndentationRecording | CompressionRecording) and entry.kind == kind
            ]
            lacking = [entry.id for entry in curves if entry.time_s is None]
            if lacking:
                return f"recording {lacking[0]!r} has no time_s"
            if time_runs_with_displacement(curves):
                return "all curves go one way at one speed: time cannot be told from displacement"
            return None
        dwell = {entry.id: entry.dwell_s for entry in campaign.recordings if entry.kind == kind}
        lacking = [name for name, value in dwell.items() if value is None]
        if lacking:
            return f"recording {lacking[0]!r} has no dwell_s"
        return "dwell_s is the same in all recordings" if len(set(dwell.values())) == 1 else None

    def on_material(self, contacts: Contacts, values: Values) -> None:
        """Relax the modulus."""
        times = -contacts.dwell * (1.0 / values["relaxation_time"])
        contacts.modulus = contacts.modulus * (1.0 - values["relaxed_fraction"] * (1.0 - exp(times)))

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Relax the force."""
        curve.relaxation = values["relaxed_fraction"], values["relaxation_time"]
