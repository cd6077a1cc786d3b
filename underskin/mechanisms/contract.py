"""The contract of a mechanism: texts, traits, parameters with unit, bounds and prior, and a law with finite values.

A test checks the mechanisms of this package against it; those of other packages are checked when they are loaded.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar, get_args

import numpy as np

from underskin.errors import InvalidInput, not_finite, not_unique
from underskin.extensions import described
from underskin.mechanisms import base
from underskin.mechanisms.base import HeavyTailed, Kind, Mechanism, Normal, Origin, Parameter, Stage, Uniform
from underskin.mechanisms.models.composition import D33, STRAIN_SHARE, THICKNESS, YOUNGS_MODULUS
from underskin.mechanisms.models.contact_state import joined
from underskin.mechanisms.models.curves import CompressionModel
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.models.indentation import IndentationModel
from underskin.mechanisms.reference_campaigns import reference_campaign
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats

T = TypeVar("T")
_NAME = re.compile(r"[a-z][a-z0-9_]*")
_NUISANCES = (*(parameter.name for parameter in (D33, YOUNGS_MODULUS, THICKNESS, STRAIN_SHARE)), "contact_point")


def check(mechanism: Mechanism, others: Sequence[Mechanism] = ()) -> None:
    """Check that a mechanism keeps the contract and can be composed with the others.

    Parameters
    ----------
    mechanism
        The mechanism to check.
    others
        Mechanisms whose names, and whose parameters' names, are taken.

    Raises
    ------
    InvalidInput
        Names the attribute that breaks the contract, its value and what is allowed.
    """
    _check_traits(mechanism)
    if mechanism.name in {other.name for other in others}:
        raise not_unique("name", mechanism.name, "is taken by another mechanism")
    owners = {
        parameter.name: other.name for other in others for kind in other.kinds for parameter in _parameters(other, kind)
    }
    owners |= dict.fromkeys(_NUISANCES, "the base model")
    spreads = [
        other.name for other in others for parameter in _parameters(other, "frf") if parameter.acts_on == "gain_spread"
    ]
    for kind in mechanism.kinds:
        parameters: Any = _parameters(mechanism, kind)
        _require("parameters", parameters, isinstance(parameters, tuple), "must be a tuple of Parameter")
        for index, parameter in enumerate(parameters):
            _check_parameter(mechanism, parameter)
            _check_relative(parameter, parameters)
            if parameter.name in {other.name for other in parameters[:index]}:
                raise not_unique(_field(parameter, "name"), parameter.name, "must be that of one parameter")
            if parameter.name in owners:
                raise not_unique(_field(parameter, "name"), parameter.name, f"is taken by {owners[parameter.name]}")
            if parameter.acts_on == "gain_spread" and spreads:
                raise not_unique(_field(parameter, "acts_on"), parameter.acts_on, f"is taken by {spreads[0]}")
    check_numbers(mechanism)


def check_numbers(mechanism: Mechanism) -> None:
    """Check that a law gives finite numbers on a synthetic campaign of each kind that supports it.

    Raises InvalidInput where it does not.
    """
    for kind in mechanism.kinds:
        _check_numbers(mechanism, kind)


def _check_traits(mechanism: Mechanism) -> None:
    name: Any = getattr(mechanism, "name", None)
    _require("name", name, isinstance(name, str) and _NAME.fullmatch(name), "must be lower case letters, digits and _")
    for field in base.TEXTS:
        text: Any = getattr(mechanism, field, None)
        _require(field, text, isinstance(text, str) and text.strip(), "must be a text")
    stage: Any = getattr(mechanism, "stage", None)
    _require("stage", stage, isinstance(stage, Stage), f"must be one of Stage: {', '.join(Stage.__members__)}")
    _require("order", mechanism.order, isinstance(mechanism.order, int), "must be a whole number")
    _require("of", mechanism.of, mechanism.of in get_args(Origin), f"must be one of {', '.join(get_args(Origin))}")
    for field, allowed, needed in (
        ("kinds", get_args(Kind), True),
        ("axes", base.AXES, True),
        ("reads", base.READS, False),
    ):
        values: Any = getattr(mechanism, field, None)
        is_valid = isinstance(values, tuple) and set(values) <= set(allowed) and (values or not needed)
        _require(field, values, is_valid, f"must be a tuple of {', '.join(allowed)}")


def _check_parameter(mechanism: Mechanism, parameter: Any) -> None:
    _require("parameters", parameter, isinstance(parameter, Parameter), "must be a tuple of Parameter")

    def require(field: str, is_valid: object, allowed: str) -> None:
        _require(_field(parameter, field), getattr(parameter, field), is_valid, allowed)

    require(
        "name", isinstance(parameter.name, str) and _NAME.fullmatch(parameter.name), "must be lower case letters and _"
    )
    require("unit", parameter.unit in base.UNITS, f"must be one of {', '.join(base.UNITS)}")
    require("scale", parameter.scale in ("linear", "log"), "must be linear or log")
    for field in ("low", "high"):
        number = _is_finite(getattr(parameter, field)) and (
            parameter.scale == "linear" or getattr(parameter, field) > 0
        )
        require(field, number, "must be a finite number" + ("" if parameter.scale == "linear" else " above 0"))
    require("high", parameter.low < parameter.high, f"must be above low, {parameter.low!r}")
    require("limit", parameter.limit is None or isinstance(parameter.limit, int | float), "must be a number or None")
    require("reason", isinstance(parameter.reason, str) and parameter.reason.strip(), "must be a text")
    require(
        "prior",
        isinstance(parameter.prior, Normal | Uniform),
        "must be Normal(mean, sd), HeavyTailed(mean, sd) or Uniform()",
    )
    if isinstance(parameter.prior, Normal):
        is_valid = _is_finite(parameter.prior.mean) and _is_finite(parameter.prior.sd) and parameter.prior.sd > 0
        with np.errstate(divide="ignore"):
            require(
                "prior",
                is_valid and np.isfinite(parameter.log_prior(parameter.start)),
                "must have mass within the bounds",
            )
    heavy = parameter.moves_covariance and isinstance(parameter.prior, HeavyTailed)
    require("prior", not heavy, "must be Normal(mean, sd) or Uniform() where it does not act on the mean")
    acts_on, where = "gain_spread", "act is not overridden"
    if mechanism.moves_predictions:
        acts_on, where = "mean", "act is overridden"
    if mechanism.stage is Stage.ADDED_CHARGE:
        acts_on, where = "line_variance", "the stage is ADDED_CHARGE"
    require("acts_on", parameter.acts_on == acts_on, f"must be {acts_on} where {where}")
    require(
        "scale", parameter.scale == "log" or not parameter.moves_covariance, "must be log: it does not act on the mean"
    )


def _check_relative(parameter: Parameter, parameters: Sequence[Parameter]) -> None:
    """`relative_to` must name another log parameter of the mechanism that is itself relative to none."""
    units = {other.name for other in parameters if other.scale == "log" and other.relative_to is None} - {
        parameter.name
    }
    is_valid = parameter.relative_to is None or (parameter.relative_to in units and parameter.scale == "log")
    allowed = "must be None, or of a log parameter another log parameter of this mechanism that is relative to none"
    _require(_field(parameter, "relative_to"), parameter.relative_to, is_valid, allowed)


def _check_numbers(mechanism: Mechanism, kind: Kind) -> None:
    """The prediction and its derivatives must be finite at the centres of the priors and at every bound."""
    campaign = reference_campaign(kind)
    if _result_of(f"unsupported ({kind})", lambda: mechanism.unsupported(campaign, kind)) is not None:
        return
    field = f"law ({kind})"
    model = _result_of(field, lambda: _MODELS[kind](mechanism, campaign))
    count = len(_parameters(mechanism, kind))
    points = list(_points(model.parameters[:count], model.parameters[count:]))
    values = []
    for fit, label in points:
        with np.errstate(all="ignore"):
            answer = _result_of(f"{field} at {label}", partial(model.predict, fit))
        numbers = [answer.value, answer.slopes, *([] if answer.pickup is None else [answer.pickup])]
        if not all(np.isfinite(part).all() for part in numbers):
            raise not_finite(f"{field} at {label}", None, "gives numbers that are not finite")
        values.append(answer.value)
    same = count > 0 and mechanism.moves_predictions and all(np.array_equal(value, values[0]) for value in values)
    _require(field, None, not same, "must change the recordings: act sets what is listed for its stage")
    if isinstance(model, FrfModel):
        _check_several_points(model, np.array([fit for fit, _ in points]), field)


def _check_several_points(model: FrfModel, fits: Floats, field: str) -> None:
    """Evaluated at several points at once, as in a diagnosis, a law must give the values of single points."""
    with np.errstate(all="ignore"):
        batch = _result_of(f"{field} at several points", lambda: model.respond(fits))
        singles = joined([_result_of(field, partial(model.respond, fit[None])) for fit in fits])
    real = np.isrealobj(batch.level.value)
    _require(f"{field}, level", None, real, "must be real: a complex factor belongs at the stage LINES")
    allowed = "must be what each point gives alone: act must treat the last axis as rows and keep those before it"
    for batch_part, single_part in ((batch.level, singles.level), (batch.lines, singles.lines)):
        if batch_part is not None and single_part is not None:
            same = batch_part.value.shape == single_part.value.shape and np.allclose(
                batch_part.value, single_part.value, 1e-9, 0, equal_nan=True
            )
            _require(f"{field} at several points", None, same, allowed)


_MODELS: Mapping[Kind, Callable[[Mechanism, Campaign], FrfModel | IndentationModel | CompressionModel]] = {
    "frf": lambda mechanism, campaign: FrfModel([mechanism], campaign, load_table()),
    "indentation": lambda mechanism, campaign: IndentationModel([mechanism], campaign),
    "compression": lambda mechanism, campaign: CompressionModel([mechanism], campaign),
}


def _points(parameters: Sequence[Parameter], nuisances: Sequence[Parameter]) -> Iterator[tuple[Floats, str]]:
    """Points of fit coordinates with a label for messages: the centre, then each parameter at either bound."""
    centre = np.array([parameter.start for parameter in (*parameters, *nuisances)])
    yield centre, "the priors' centres"
    for index, parameter in enumerate(parameters):
        for end, value in zip(parameter.bounds, (parameter.low, parameter.high), strict=True):
            moved = centre.copy()
            moved[index] = end
            yield moved, f"{parameter.name} = {value:g} {parameter.unit}"


def _parameters(mechanism: Mechanism, kind: Kind) -> tuple[Parameter, ...]:
    return _result_of("parameters", lambda: mechanism.parameters(reference_campaign(kind), kind))


def _result_of(field: str, function: Callable[[], T]) -> T:
    """The result of another package's code; an exception becomes InvalidInput for the field."""
    try:
        return function()
    except Exception as error:
        raise InvalidInput(field, None, described(error)) from error


def _field(parameter: Parameter, name: str) -> str:
    return f"parameters[{parameter.name}].{name}"


def _require(field: str, value: Any, is_valid: object, allowed: str) -> None:
    if not is_valid:
        raise InvalidInput(field, value, allowed)


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and bool(np.isfinite(value))
