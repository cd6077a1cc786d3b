"""Mechanisms of other packages: what is refused when they are loaded, and in which words."""

import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, get_args

import pytest

from tests.support.cases import first
from tests.support.installed_package import installed
from tests.support.repository import ROOT
from underskin import ExtensionError, InvalidInput, extensions
from underskin.mechanisms import CATALOGUE, FrfState, Kind, Mechanism, Normal, Parameter, Stage, Uniform, Values
from underskin.mechanisms.base import AXES, READS, UNITS, ActsOn
from underskin.mechanisms.contract import check
from underskin.mechanisms.registry import GROUP, built_in
from underskin.recordings.campaign import Conditions

EXAMPLE = ROOT / "examples" / "lab-skin"


class LowPass(Mechanism):
    """One that keeps the contract; a test changes one attribute or one field of its parameter."""

    name = "low_pass"
    plain = "The response falls."
    law = "FRF / (1 + i f/corner)"
    assumptions = "one pole"
    source = "a book"
    stage = Stage.LINES
    axes = ("frequency_hz",)
    changes: Mapping[str, Any] = {}

    def parameters(
        self, conditions: Conditions, kind: Kind = "frf", others: Collection[Mechanism] = ()
    ) -> tuple[Parameter, ...]:
        fields: dict[str, Any] = {
            "name": "upper_corner",
            "unit": "Hz",
            "low": 10.0,
            "high": 1e5,
            "prior": Normal(7.0, 1.5),
            "scale": "log",
            "limit": None,
            "reason": "a guess",
        }
        return (Parameter(**{name: value for name, value in {**fields, **self.changes}.items() if value != "gone"}),)

    def act(self, state: FrfState, values: Values) -> None:
        state.factor = 1.0 / (1.0 + 1j * state.design.line_frequency / values["upper_corner"])


def changed(base: type[Mechanism] = LowPass, **attributes: Any) -> Mechanism:
    return type("Changed", (base,), attributes)()


def test_one_that_keeps_the_contract_is_taken() -> None:
    check(LowPass(), built_in())


@pytest.mark.parametrize(
    ("attributes", "field", "allowed"),
    [
        ({"name": "Low pass"}, "name", "lower case"),
        ({"name": "adhesion"}, "name", "taken"),
        ({"law": " "}, "law", "text"),
        ({"source": None}, "source", "text"),
        ({"stage": "lines"}, "stage", "LINES"),
        ({"order": "last"}, "order", "whole number"),
        ({"kinds": ()}, "kinds", "indentation"),
        ({"axes": ("temperature_c",)}, "axes", "preload_n"),
        ({"reads": ("day",)}, "reads", "dwell_s"),
        ({"act": Mechanism.act}, "parameters[upper_corner].acts_on", "act is not overridden"),
        ({"changes": {"name": "d33"}}, "parameters[d33].name", "the base model"),
        ({"changes": {"name": "corner"}}, "parameters[corner].name", "amplifier_high_pass"),
        ({"changes": {"unit": "furlong"}}, "parameters[upper_corner].unit", "1/MPa"),
        ({"changes": {"unit": None}}, "parameters[upper_corner].unit", "pC/N"),
        ({"changes": {"unit": "gone"}}, "parameters", "unit"),
        ({"changes": {"low": "gone"}}, "parameters", "low"),
        ({"changes": {"prior": "gone"}}, "parameters", "prior"),
        ({"changes": {"prior": None}}, "parameters[upper_corner].prior", "Uniform"),
        ({"changes": {"prior": Normal(1e6, 1.0)}}, "parameters[upper_corner].prior", "mass"),
        ({"changes": {"low": 0.0}}, "parameters[upper_corner].low", "above 0"),
        ({"changes": {"high": float("inf")}}, "parameters[upper_corner].high", "finite"),
        ({"changes": {"high": 1.0}}, "parameters[upper_corner].high", "above low"),
        ({"changes": {"scale": "square"}}, "parameters[upper_corner].scale", "linear or log"),
        ({"changes": {"limit": "0"}}, "parameters[upper_corner].limit", "number"),
        ({"changes": {"reason": ""}}, "parameters[upper_corner].reason", "text"),
        ({"changes": {"relative_to": "corner"}}, "parameters[upper_corner].relative_to", "another"),
        ({"changes": {"relative_to": "upper_corner"}}, "parameters[upper_corner].relative_to", "another"),
        ({"changes": {"acts_on": "line_variance"}}, "parameters[upper_corner].acts_on", "mean"),
        ({"act": lambda *_: 1 / 0}, "law (frf) at the priors' centres", "ZeroDivisionError"),
        ({"act": lambda *_: None}, "law (frf)", "must change the recordings"),
        ({"parameters": lambda *_: None}, "parameters", "tuple"),
    ],
)
def test_the_field_that_breaks_the_contract_is_named(attributes: dict[str, Any], field: str, allowed: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        check(changed(**attributes), built_in())
    assert refusal.value.field == field
    assert allowed in refusal.value.allowed


def test_a_law_that_is_not_finite_at_a_bound_is_refused_there() -> None:
    class Diverging(LowPass):
        parameters_stated = (Parameter("gap", "-", 0.0, 1.0, Uniform(), "linear", None, "a guess"),)
        parameters = Mechanism.parameters

        def act(self, state: FrfState, values: Values) -> None:
            """Divide by zero at a bound."""
            state.factor = values["gap"] / (values["gap"] * state.design.line_frequency)

    with pytest.raises(InvalidInput, match="not finite") as refusal:
        check(Diverging(), built_in())
    assert refusal.value.field == "law (frf) at gap = 0 -"


def test_a_second_spread_of_the_sensors_gains_is_refused() -> None:
    attributes: dict[str, Any] = {
        "stage": Stage.SENSOR,
        "act": Mechanism.act,
        "changes": {"acts_on": "gain_spread"},
    }
    check(changed(**attributes))
    with pytest.raises(InvalidInput, match="is taken by sensor_spread"):
        check(changed(**attributes), built_in())


def test_the_page_lists_all_that_a_mechanism_may_state() -> None:
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    traits = [name for name in vars(Mechanism)["__annotations__"] if not name.startswith("_")]
    for name in (*UNITS, *AXES, *READS, *Stage.__members__, *traits, *get_args(ActsOn), *get_args(Kind)):
        assert f"`{name}`" in page, name


def underskin(*arguments: str, path: Path, data: Path) -> "subprocess.CompletedProcess[str]":
    environment = os.environ | {"UNDERSKIN_DATA": str(data)}
    environment["PYTHONPATH"] = os.pathsep.join([str(path), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "underskin", *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True)


TAKEN = """
from underskin.mechanisms.laws.ageing import Ageing
class Other(Ageing):
    name = "ageing"
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", first(1, [["serve", "--port", "0"], ["diagnose", "examples/campaigns/2017-07.json"]])
)
def test_the_command_line_and_the_start_of_the_service_say_what_is_refused(command: list[str], tmp_path: Path) -> None:
    folder = installed(tmp_path / "site", GROUP, "Other", TAKEN)
    if command[0] == "diagnose":
        command = [*command, "--output-dir", str(tmp_path / "reports")]
    answer = underskin(*command, path=folder, data=tmp_path / "data")
    assert answer.returncode == 2
    assert "'ageing' of the package lab-tools 2.1 cannot be used: name: 'ageing': is taken by another mechanism" in (
        answer.stderr
    )
    assert "Traceback" not in answer.stderr


@pytest.mark.parametrize(
    ("source", "field", "reason"),
    [
        ("1 / 0", "the entry point lab_tools:Other", "ZeroDivisionError: division by zero"),
        ("", "the entry point lab_tools:Other", "AttributeError: module 'lab_tools' has no attribute 'Other'"),
    ],
)
def test_a_module_that_cannot_be_imported_is_refused(
    source: str, field: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(installed(tmp_path, "underskin.test", "Other", source))
    monkeypatch.delitem(sys.modules, "lab_tools", raising=False)
    with pytest.raises(ExtensionError) as refusal:
        extensions.load("underskin.test")
    assert (refusal.value.package, refusal.value.name) == ("lab-tools 2.1", "thing")
    assert (refusal.value.field, refusal.value.reason) == (field, reason)
    assert str(pickle.loads(pickle.dumps(refusal.value))) == str(refusal.value)


def test_without_other_packages_the_catalogue_is_that_of_this_one() -> None:
    assert tuple(CATALOGUE.values()) == built_in()
    assert CATALOGUE.packages == {}


USE = """
import numpy as np
from docs.mechanisms.signatures import panels
from tests.support.mechanism_campaigns import frf_campaign, table
from tests.prediction.test_adopted import D33, recorded, report
from underskin.mechanisms import CATALOGUE, compose
from underskin.parallel import processes
from underskin.prediction.adopted_model import adopted

name, values = "sample_averaging", {"amplifier_high_pass": (1.0, 1.0), "sample_averaging": (0.4,)}
if __name__ == "__main__":
    names = list(CATALOGUE)
    assert names[names.index(name) - 1] == "timing_delay", names
    assert dict(CATALOGUE.packages) == {name: "lab-skin 1.0"}
    assert compose([name, "amplifier_high_pass"], frf_campaign(), table()).names == tuple(values)
    assert all(np.isfinite(y).all() for panel in panels(name, table()) for _, y in panel.curves.values())
    model = adopted(report(values), frf_campaign())
    assert model.of_lines == list(values)
    measured = np.concatenate(
        [entry.frf_re_pc_per_n + 1j * entry.frf_im_pc_per_n for entry in recorded(values).recordings]
    )
    assert np.allclose(D33 * model.response(frf_campaign(), table()).value, measured)
    with processes(1) as pool:
        assert pool.submit(list, CATALOGUE).result() == names
        assert pool.submit(len, CATALOGUE).result() == len(names)
    print("used")
"""


@pytest.mark.slow
def test_one_of_another_package_is_composed_drawn_adopted_and_found_by_worker_processes(tmp_path: Path) -> None:
    site = tmp_path / "site"
    shutil.copytree(EXAMPLE / "lab_skin", site / "lab_skin")
    (site / "lab_skin-1.0.dist-info").mkdir()
    (site / "lab_skin-1.0.dist-info" / "METADATA").write_text("Name: lab-skin\nVersion: 1.0\n")
    entry = f"[{GROUP}]\nsample_averaging = lab_skin.mechanisms:SampleAveraging\n"
    (site / "lab_skin-1.0.dist-info" / "entry_points.txt").write_text(entry)
    (tmp_path / "use.py").write_text(USE, encoding="utf-8")
    path = [str(site), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path)}
    command = [sys.executable, str(tmp_path / "use.py")]
    answer = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == "used\n"
