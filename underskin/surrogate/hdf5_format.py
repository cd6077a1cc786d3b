"""The HDF5 file of a table: its contents, its atomic writing, the checks on reading; and the table of the contact.

A table is self-describing (NeXus style): each group is an NXdata with `@signal` and `@axes`, each dataset
carries `@units` and `@long_name`; the root carries the schema, the versions and settings of its computation, and the
SHA-256 of all its datasets. `tables/README.md` describes the format.

The contact table is the correction by finite strain to the exact linear layer's contact with a rigid frictionless
sphere of radius R, pressed with the force F. All is over α = a/h of the linear layer's frictionless contact at the same
F, R, E, ν, h, and x = L^(1/3), L = F/(R² E) · (0.75/(1 − ν²))². The correction of the incompressible neo-Hookean layer
is the solved stress on the base less that of the linear contact. Over c₂ of Yeoh's energy, (G/2)(K + c₂ K²),
K = I₁ − 3, and over ν the table holds what is added to that correction.
"""

import hashlib
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import h5py
import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from underskin.errors import TableError
from underskin.physics.sphere_law import FULL_SPHERE_OF_LOAD
from underskin.units import Floats

SIGMA_SCHEMA = "underskin-sigma/1"
INFLUENCE_SCHEMA = "underskin-influence/1"
CONTACT_SCHEMA = "underskin-contact/3"
_MAGIC = b"\x89HDF\r\n\x1a\n"


_LARGEST_CBRT_LOAD = 0.222 ** (1 / 3)  # to which the contact table is continued


@dataclass(frozen=True)
class Dataset:
    """One dataset of a table: its values, the names of its axes (empty for an axis itself) and its meaning."""

    values: Floats
    meaning: str
    axes: tuple[str, ...] = ()


Group = Mapping[str, Dataset]


@dataclass(frozen=True)
class TableFile:
    """A table as read: datasets by "group/name", the root's attributes, and the hash that identifies it."""

    data: Mapping[str, Floats]
    attributes: Mapping[str, Any]
    sha256: str


def data_hash(data: Mapping[str, Floats]) -> str:
    """SHA-256 over names, shapes and little-endian doubles of all datasets, in the order of their names."""
    digest = hashlib.sha256()
    for name in sorted(data):
        values = np.ascontiguousarray(data[name], dtype="<f8")
        digest.update(f"{name} {values.shape}\n".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def write_table(
    path: Path, schema: str, groups: Mapping[str, Group], signals: Mapping[str, str], about: Mapping[str, Any]
) -> str:
    """Write a table next to `path`, flush it to the disk and move it into place; returns its hash.

    Raises TableError, and writes nothing, when a value is not finite.
    """
    data = {f"{group}/{name}": d.values for group, datasets in groups.items() for name, d in datasets.items()}
    for name, values in data.items():
        if not np.isfinite(values).all():
            raise TableError(f"table {path} is not written: {name} would hold values that are not finite")
    digest = data_hash(data)
    partial = path.with_name(path.name + ".partial")
    with h5py.File(partial, "w") as file:
        file.attrs.update({"schema": schema, "data_sha256": digest, "default": next(iter(groups)), **about})
        for group, datasets in groups.items():
            _write_group(file.create_group(group), datasets, signals[group])
    with partial.open("rb+") as written:
        os.fsync(written.fileno())
    partial.replace(path)
    _sync_folder(path.parent)
    return digest


def _write_group(group: h5py.Group, datasets: Group, signal: str) -> None:
    group.attrs["NX_class"] = "NXdata"
    group.attrs["signal"] = signal
    group.attrs["axes"] = list(datasets[signal].axes)
    for name, dataset in datasets.items():
        stored = group.create_dataset(
            name, data=np.asarray(dataset.values, dtype="<f8"), compression="gzip", shuffle=True, track_times=False
        )
        stored.attrs["units"] = ""
        stored.attrs["long_name"] = dataset.meaning
        if dataset.axes:
            stored.attrs["axes"] = list(dataset.axes)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read_table(path: Path, schema: str) -> TableFile:
    """Read and verify a table: schema, hash, finite values, ascending axes, and shapes that fit their axes.

    Raises TableError with the file, the reason and what to do.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(len(_MAGIC))
    except OSError as error:
        raise TableError(f"table {path} cannot be read: {error.strerror}. {_REMEDY}") from error
    if magic != _MAGIC:
        raise TableError(f"table {path} is not an HDF5 file, or its beginning is damaged. {_REMEDY}")
    try:
        with h5py.File(path, "r") as file:
            return _verified(path, file, schema)
    except (OSError, KeyError, RuntimeError, ValueError) as error:
        raise TableError(f"table {path} is truncated or damaged: {error}. {_REMEDY}") from error


_REMEDY = "Restore it from the distribution, or make it anew: `underskin tablegen sigma|influence|contact --out FILE`."


def _verified(path: Path, file: h5py.File, schema: str) -> TableFile:
    attributes = dict(file.attrs)
    stored_schema = attributes.get("schema")
    if stored_schema != schema:
        raise TableError(f"table {path} has schema {stored_schema!r}; this version reads {schema!r}. {_REMEDY}")
    data: dict[str, Floats] = {}
    for group_name, group in file.items():
        for name, dataset in group.items():
            data[f"{group_name}/{name}"] = np.asarray(dataset[()], dtype=float)
    for group_name, group in file.items():
        for name, dataset in group.items():
            _verify_values(path, group_name, name, data, list(dataset.attrs.get("axes", ())))
    digest = data_hash(data)
    if digest != attributes.get("data_sha256"):
        raise TableError(f"table {path} was altered after it was written: its SHA-256 does not match. {_REMEDY}")
    return TableFile(data, attributes, digest)


def _verify_values(path: Path, group: str, name: str, data: Mapping[str, Floats], axes: list[str]) -> None:
    values = data[f"{group}/{name}"]
    if not np.isfinite(values).all():
        raise TableError(f"table {path}: {group}/{name} holds values that are not finite. {_REMEDY}")
    least = 2 if name in _FURTHER else 4  # cubic splines run along the other axes
    if not axes and not (values.ndim == 1 and values.size >= least and (np.diff(values) > 0).all()):
        raise TableError(f"table {path}: axis {group}/{name} does not ascend. {_REMEDY}")
    expected = tuple(data[f"{group}/{axis}"].size for axis in axes)
    if axes and values.shape != expected:
        raise TableError(f"table {path}: {group}/{name} has shape {values.shape}, its axes {expected}. {_REMEDY}")


class Table(ABC):
    """A verified table: `path`, `sha256` (which names it) and the file's `attributes`."""

    schema: ClassVar[str]

    def __init__(self, path: Path) -> None:
        """Read and verify the table; raises TableError with the reason."""
        file = read_table(path, self.schema)
        self.path = path
        self.sha256 = file.sha256
        self.attributes = file.attributes
        try:
            self._take(file.data)
        except KeyError as error:
            raise TableError(f"table {path} lacks the dataset {error}") from error

    @abstractmethod
    def _take(self, data: Mapping[str, Floats]) -> None:
        """Store the datasets that the table needs, by "group/name"."""


def tables_folder() -> Path:
    """The folder of the tables: `UNDERSKIN_TABLES`, else in the installed package, else next to it in a checkout."""
    override = os.environ.get("UNDERSKIN_TABLES")
    if override:
        return Path(override)
    package = Path(__file__).parents[1]
    shipped = package / "tables"
    return shipped if shipped.is_dir() else package.parent / "tables"


CONTACT_TABLE = "contact.h5"
_STATE = "frictionless"
# The group of each further property
_FURTHER = {"second_over_first": "yeoh", "poisson_ratio": "compressible", "friction": "sticking"}


class ContactTable(Table):
    """A verified table of the corrections, continued by their splines from the largest solved load to L = 0.222, which
    on a half space is a/R = 0.5.

    23 fresh solves at L from 0.15 to 0.256, among them some with c₂ 3 and 7, ν 0.3 and 0.44 and a sphere that sticks,
    differ from the continuation by at most 0.05 % of σ and 0.3 % of its increment (of neo-Hookean layers:
    `tests/surrogate/test_contact_table.py`).

    Attributes
    ----------
    axes : tuple of ndarray
        a/h of the linear contact, L^(1/3) and r/h.
    correction_error : ndarray, (a, L^(1/3), r)
        Bound on the absolute error of the correction, in σ's scale.
    contact_radius, indentation, stiffness : ndarray, (a, L^(1/3))
        Over those of the linear layer at the same force.
    largest_solved : float
        The largest L^(1/3) that was solved; the nodes above it are continued.
    """

    schema = CONTACT_SCHEMA

    def _take(self, data: Mapping[str, Floats]) -> None:
        state = {name.partition("/")[2]: values for name, values in data.items() if name.startswith(f"{_STATE}/")}
        a, x, r = state["a_over_h"], state["cbrt_load_parameter"], state["r_over_h"]
        self.largest_solved = float(x[-1])
        self.axes = a, np.append(x, _LARGEST_CBRT_LOAD), r
        ratios = (_continued(x, state[name], 1) for name in ("contact_radius", "indentation", "stiffness"))
        self.contact_radius, self.indentation, self.stiffness = ratios
        correction = _continued(x, state["correction"], 1)
        # What the last node moves there is more than what a further one would
        unsure = np.abs(correction[:, -1] - _continued(x[:-1], state["correction"][:, :-1], 1)[:, -1])
        last = state["correction_error"][:, -1] + unsure
        self.correction_error = np.concatenate([state["correction_error"], last[:, None]], axis=1)
        powers = x[1:, None] ** np.array([1.0, 2.0, 3.0])
        coefficients = np.linalg.lstsq(powers, state["indentation"][:, 1:].T - 1, rcond=None)[0]
        self._softening = CubicSpline(a, coefficients.T)
        self._over_radius = make_interp_spline(r, correction, k=3, axis=2)
        further = {name: (data[f"{group}/{name}"], data[f"{group}/correction"]) for name, group in _FURTHER.items()}
        self._further = {
            name: (nodes, make_interp_spline(r, _continued(x, added, 2), k=3, axis=3))
            for name, (nodes, added) in further.items()
        }

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest a_over_h, load_parameter and r_over_h, limits included."""
        a, x, r = self.axes
        return {
            "a_over_h": (float(a[0]), float(a[-1])),
            "load_parameter": (float(x[0]) ** 3, float(x[-1]) ** 3),
            "r_over_h": (float(r[0]), float(r[-1])),
        }

    @property
    def contact_axes(self) -> tuple[Floats, Floats]:
        """a/h and L^(1/3) of the contacts that the table holds."""
        return self.axes[0], self.axes[1]

    def profile_over(self, r_over_h: Floats) -> Floats:
        """The correction at distances inside the domain (radii,), for all of `contact_axes`: (a, L^(1/3), radii).

        In σ's scale: T3 = −(3F/2πh²) · (linear contact + correction).
        """
        return np.asarray(self._over_radius(r_over_h))

    def further_profiles_over(self, name: str, r_over_h: Floats) -> tuple[Floats, Floats]:
        """The nodes of a further property, `second_over_first`, `poisson_ratio` or `friction`, and what is added at
        each of them at these distances (radii,): (nodes, a, L^(1/3), radii)."""
        nodes, over_radius = self._further[name]
        return nodes, np.asarray(over_radius(r_over_h))

    def softening_coefficients(self, a_over_h: Floats) -> Floats:
        """p0, p1 and p2 (…, 3) of δ/δ_linear − 1 = x (p0 + p1 x + p2 x²) at the same force, x = L^(1/3).

        Within 2e-5 of the table at its nodes; wider contacts have the value of the last a/h.
        """
        return np.asarray(self._softening(np.minimum(a_over_h, self.axes[0][-1])))

    def softening(self, a_over_h: Floats, cbrt_load: Floats, full_sphere: bool) -> Floats:
        """δ/δ_linear − 1 at the same force; L above the largest solved one have its value.

        The linear contact is that of a paraboloid, or with `full_sphere` of the full sphere.
        """
        x = np.minimum(cbrt_load, self.largest_solved)
        p0, p1, p2 = np.moveaxis(self.softening_coefficients(a_over_h), -1, 0)
        return np.asarray(x * (p0 + x * (p1 - (FULL_SPHERE_OF_LOAD if full_sphere else 0.0) + x * p2)))


def _continued(x: Floats, values: Floats, axis: int) -> Floats:
    """Values at nodes x of L^(1/3), and their spline's at the largest one."""
    end = make_interp_spline(x, values, k=3, axis=axis)(_LARGEST_CBRT_LOAD)
    return np.concatenate([values, np.expand_dims(end, axis)], axis=axis)


def load_contact(path: Path | None = None) -> ContactTable:
    """The contact table at `path`, or the default one, read once; raises TableError with the reason."""
    return _read(path or tables_folder() / CONTACT_TABLE)


@lru_cache(maxsize=2)
def _read(path: Path) -> ContactTable:
    return ContactTable(path)
