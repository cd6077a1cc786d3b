"""Settings, from the environment (docs/settings.md)."""

import ipaddress
import os
import re
from pathlib import Path

from pydantic import Field, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from service import durable
from underskin.recordings.readers.parsing_limits import ParsingLimits
from underskin.surrogate.hdf5_format import tables_folder

_PREFIX = "UNDERSKIN_"
_PLAIN_UNFOLDS = 4  # times: a number of two bytes, be it a digit and a comma, is kept in eight
_READ_ELSEWHERE = tuple(  # by the library, commands and tests
    f"{_PREFIX}{name}"
    for name in (
        "URL", "API_KEY", "MECHANISMS", "TIME_ZONE", "READING_MEMORY_MB", "READING_SECONDS", "READING_EXPANSION",
        "SOAK", "ORACLE", "RECORDINGS", "CAMPAIGNS", "CASES",
    )
)  # fmt: skip
_HOST_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*|\[[0-9A-Fa-f:.]+\]")


def make_data_folder(folder: Path) -> None:
    """Make it where it is missing, for its owner alone; one that is there keeps the mode that somebody gave it."""
    durable.make_folder(folder, 0o700)


class Settings(BaseSettings):
    """Read from variables named UNDERSKIN_ and the field in capitals."""

    model_config = SettingsConfigDict(env_prefix=_PREFIX, env_ignore_empty=True, validate_default=True)

    data: Path = Field(
        default=Path("~/.local/share/underskin"),
        description="Folder of what the service keeps: API keys, the SQLite store, backups made before migrations. "
        "Made at start if missing; must be writable.",
    )
    tables: Path = Field(
        default_factory=tables_folder, description="Folder of the tables; by default those that ship with underskin."
    )
    max_body_mb: float = Field(
        default=64, gt=0, le=1e6, description="Largest request body in MB (10^6 bytes), counted as it streams in."
    )
    max_upload_mb: float = Field(
        default=1024,
        gt=0,
        le=1e6,
        description="Largest upload of files in MB (10^6 bytes), counted as it streams in; JSON has max_body_mb.",
    )
    max_header_kb: int = Field(
        default=64, ge=4, le=1024, description="Longest request line with all headers, in kB (10^3 bytes)."
    )
    idle_seconds: float = Field(
        default=30.0,
        ge=1,
        le=3600,
        description="After how many seconds a client is disconnected that does not end its headers, sends no more of "
        "its body, or takes no more of its answer.",
    )
    max_connections: int = Field(
        default=1000,
        ge=8,
        le=100_000,
        description="How many connections are open at once; beyond it new ones take the place of idle ones, and where "
        "none is idle only /health and /ready are answered on them.",
    )
    database_url: str = Field(
        default="",
        description="Where campaigns are kept: postgresql://user:password@host/database. Left out: SQLite in the data "
        "folder.",
    )
    diagnosis_workers: int = Field(
        default_factory=lambda: len(os.sched_getaffinity(0)),
        ge=0,
        le=1024,
        description="How many diagnoses run at once, each in a process of its own; 0: this server runs none.",
    )
    diagnosis_memory_mb: float = Field(
        default=2000.0,
        ge=100,
        le=1e6,
        description="Memory that one diagnosis may take, in MB (10^6 bytes); one that needs more fails.",
    )
    diagnosis_seconds: float = Field(
        default=1800.0,
        ge=1,
        le=1e6,
        description="Seconds on a processor that one diagnosis may take, and five times as many by the clock; one that "
        "needs more fails.",
    )
    diagnosis_ready: bool = Field(
        default=True,
        description="Whether a process with the program loaded waits to fork the next diagnosis (some 200 MB of "
        "memory); without it a diagnosis begins a second or two later.",
    )
    hosts: str = Field(
        default="",
        description="Names, separated by commas, by which clients reach the service, besides localhost, "
        "127.0.0.1, [::1] and the address it is bound to. A request with another Host is refused.",
    )

    proxies: str = Field(
        default="",
        description="Addresses or networks of proxies, separated by commas, besides those on this machine: the client "
        "of a request through one is the last address in X-Forwarded-For.",
    )

    backup_to: Path | None = Field(
        default=None,
        description="Folder into which the server writes backups of its store on a schedule; left out: it makes none.",
    )
    backup_every: float = Field(default=24.0, gt=0, le=8760, description="Hours between two of them.")
    backup_keep: int = Field(default=14, ge=1, le=10_000, description="How many are kept; older ones are deleted.")

    @field_validator("data", "backup_to")
    @classmethod
    def _home(cls, data: Path | None) -> Path | None:
        if data is None:
            return None
        try:
            return data.expanduser()
        except RuntimeError as error:
            raise ValueError(f"{error} Name the folder in full.") from error

    @field_validator("hosts")
    @classmethod
    def _names(cls, hosts: str) -> str:
        for name in _listed(hosts):
            if not _HOST_NAME.fullmatch(name):
                raise ValueError(f"{name!r} must be a name or an address, without scheme, port and path")
        return hosts

    @field_validator("proxies")
    @classmethod
    def _networks(cls, proxies: str) -> str:
        for name in _listed(proxies):
            try:
                ipaddress.ip_network(name)
            except ValueError as error:
                raise ValueError(f"{error}; allowed: 192.0.2.7 or 192.0.2.0/24") from error
        return proxies

    @property
    def max_body_bytes(self) -> int:
        """`max_body_mb` in bytes."""
        return int(self.max_body_mb * 1e6)

    @property
    def max_upload_bytes(self) -> int:
        """`max_upload_mb` in bytes."""
        return int(self.max_upload_mb * 1e6)

    @property
    def max_unfolded_bytes(self) -> int:
        """What the files of one request may have in all when they are read: as much as any plain ones do, and any
        single one may."""
        return max(_PLAIN_UNFOLDS * self.max_upload_bytes, ParsingLimits.from_environment().memory_bytes)

    @property
    def host_names(self) -> frozenset[str]:
        """`hosts`, in lower case."""
        return frozenset(map(str.lower, _listed(self.hosts)))

    @property
    def proxy_networks(self) -> tuple[ipaddress.IPv4Network | ipaddress.IPv6Network, ...]:
        """`proxies`, as networks."""
        return tuple(map(ipaddress.ip_network, _listed(self.proxies)))


def _listed(text: str) -> list[str]:
    """What commas separate."""
    return [part.strip() for part in text.split(",") if part.strip()]


def unknown_settings() -> list[str]:
    """Variables of the environment that are named like settings and are none, as where one was misspelt."""
    read = {f"{_PREFIX}{field.upper()}" for field in Settings.model_fields} | set(_READ_ELSEWHERE)
    return sorted(name for name in os.environ if name.startswith(_PREFIX) and name not in read)
