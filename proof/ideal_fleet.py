"""How well an ideal diagnosis could find the departing skin of a fleet.

It owns the rig's equations and noise, and knows that no mechanism acts: the likelihood of ln E, ln h and ln d33 of a
skin is normal about the truth, with the covariance of Fisher's information there. Mean and spread of the batch, which
recordings of one skin do not determine, have the priors of the diagnosis.
"""

import numpy as np

from rig.joint_campaign import Joint, JointDocument
from rig.joint_hypotheses import skin_covariance
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.several.population import QUANTITIES, REGULAR, Batch, State, populations
from underskin.units import Floats


def departures(joint: Joint) -> dict[str, float]:
    """The probability that each skin departs, at the expected values of its recordings."""
    skins = [_states(document) for document in joint.documents]
    experiment = joint.documents[0].experiment
    declared = [experiment.skin.youngs_modulus_mpa, experiment.skin.thickness_mm, experiment.skin.d33_pc_per_n]
    about_declared = np.array([quantity.declared for quantity in QUANTITIES])  # of d33, about the truth
    batch = Batch(0.0, np.log(declared), about_declared**-2.0)
    fitted = populations(skins, [batch], [quantity.spread for quantity in QUANTITIES])
    return {
        document.skin: 1 - class_probabilities[REGULAR]
        for document, class_probabilities in zip(joint.documents, fitted.departures, strict=True)
    }


def _states(document: JointDocument) -> list[State]:
    truth = np.log([document.true_modulus_mpa, document.true_thickness_mm, document.experiment.skin.d33_pc_per_n])
    precision: Floats = np.linalg.inv(skin_covariance(document)).astype(np.float64)
    estimate = Gaussian.of(truth, precision, 0.0)
    further = np.diag([quantity.far**2 for quantity in QUANTITIES])
    return [
        State(REGULAR, estimate, np.zeros(len(QUANTITIES))),
        *(State(quantity.departure, estimate, row) for quantity, row in zip(QUANTITIES, further, strict=True)),
    ]
