"""Names of answers and models, in reports and in sentences."""

from collections.abc import Mapping, Sequence

from underskin.mechanisms.base import Kind

EXPLAINED = 0.8  # least probability of an answer that is stated without alternatives
NAMED = 0.02  # least probability of a rival, or of a group of mechanisms, that is named
RIVAL_SHARE = 0.1  # of the leader's probability: a rival with more cannot be told from it
CERTAIN = 0.95  # probability from which on more recordings, or more rivals, change no conclusion
MOST_QUOTED = 2  # with their numbers, in a sentence
MOST_NAMED = 3  # of a kind, such as mechanisms, sensors or changes, in a sentence
NOTHING_MISSING, NONE_OF_THESE = "nothing_missing", "none_of_these"
SIMPLEST: Mapping[Kind, str] = {  # the name of the model without mechanisms, for each kind of recording
    "frf": "the paper's model",
    "indentation": "Hertz's law",
    "compression": "the neo-Hookean law",
}


_PLAIN = {  # of parameters whose names need an explanation
    "youngs_modulus": "Young's modulus",
    "second_over_first": "Yeoh's c₂ over c₁",
    "pickup_charge": "charge picked up",
}


def in_words(names: Sequence[str]) -> str:
    """An answer's names in a sentence."""
    special = {NOTHING_MISSING: "nothing missing", NONE_OF_THESE: "something unlisted"}
    return " and ".join(special.get(name, name.replace("_", " ")) for name in names)


def quantity_in_words(parameter: str) -> str:
    """A quantity of a skin, or `mechanism.parameter`, in a sentence: "tip mass of contact resonance"."""
    mechanism, _, name = parameter.rpartition(".")
    called = _PLAIN.get(name, name.replace("_", " "))
    return f"{called} of {in_words([mechanism])}" if mechanism else called
