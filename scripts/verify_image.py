"""Execute the Dockerfile without a container engine, and try the image as compose.yaml would run it.

Usage, as root on Debian: python scripts/verify_image.py [WORK_DIRECTORY]. Needs debootstrap and util-linux.

Each stage of the Dockerfile runs in a root of its own: `FROM` is stood in for by a fresh Debian bookworm
with its Python 3.11 (the official image is that release with the same Python under /usr/local), `COPY`
takes committed files that .dockerignore lets through, `RUN` runs in a chroot. The last root is then mounted
read-only in fresh mount, process and network namespaces, without capabilities, and the entry point is
tried: no start without keys, then a key, health and an answer. What this cannot show is the engine's own
part: pulling, layers, published ports.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
PYTHON_PACKAGES = "python3,python3-venv,ca-certificates"
CERTIFICATES = "etc/ssl/certs/ca-certificates.crt"


@dataclass
class Stage:
    """One stage of the Dockerfile: its root and what its instructions have set so far."""

    root: Path
    environment: dict[str, str] = field(
        default_factory=lambda: {"PATH": "/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin"}
    )
    settings: dict[str, str] = field(default_factory=lambda: {"USER": "0:0", "WORKDIR": "/"})

    def inside(self, path: str) -> Path:
        """The place on this machine of an absolute path in the stage."""
        return self.root / path.lstrip("/")


def instructions(dockerfile: Path) -> list[tuple[str, str]]:
    """(keyword, arguments) of each instruction, comments dropped and continued lines joined."""
    lines = [line for line in dockerfile.read_text().splitlines() if not line.startswith("#")]
    joined = re.sub(r"\\\n\s*", "", "\n".join(lines))
    return [(line.split()[0], line.split(maxsplit=1)[1]) for line in joined.splitlines() if line.strip()]


def committed_context(target: Path) -> Path:
    """The build context: committed files under the paths that .dockerignore lets through."""
    rules = (REPOSITORY / ".dockerignore").read_text().splitlines()
    allowed = [rule[1:] for rule in rules if rule.startswith("!")]
    archive = subprocess.run(["git", "archive", "HEAD", *allowed], cwd=REPOSITORY, check=True, capture_output=True)
    target.mkdir(parents=True)
    subprocess.run(["tar", "-x", "-C", str(target)], input=archive.stdout, check=True)
    return target


def base_root(work: Path) -> Path:
    """A fresh Debian bookworm with Python, made once for each work directory."""
    base = work / "base"
    if not (base / "usr/bin/python3").exists():
        print("debootstrap: the stand-in for the base image", flush=True)
        debootstrap = [
            "debootstrap",
            "--variant=minbase",
            f"--include={PYTHON_PACKAGES}",
            "bookworm",
            str(base),
        ]
        subprocess.run(debootstrap, check=True, stdout=subprocess.DEVNULL)
        for name in ("etc/resolv.conf", "etc/hosts", CERTIFICATES):
            shutil.copyfile(Path("/") / name, base / name)
    return base


def run_in(stage: Stage, command: str) -> None:
    """Run a shell command in the stage as `RUN` does, with the caller's pip settings."""
    pip = {name: value for name, value in os.environ.items() if name.startswith("PIP_") and name != "PIP_FIND_LINKS"}
    chroot = ["chroot", str(stage.root), "/bin/sh", "-c", command]
    subprocess.run(chroot, check=True, env=stage.environment | pip)


def copy(stage: Stage, arguments: str, context: Path, stages: dict[str, Stage]) -> None:
    """`COPY [--from=STAGE] SOURCE... TARGET`; a folder's contents go into the target, as with the engine."""
    words = arguments.split()
    source_root = context
    if words[0].startswith("--from="):
        source_root = stages[words.pop(0).removeprefix("--from=")].root
    *sources, target = words
    for source in sources:
        origin = source_root / source.lstrip("/")
        destination = stage.inside(target)
        if origin.is_dir():
            shutil.copytree(origin, destination, symlinks=True, dirs_exist_ok=True)
        else:
            destination = destination / origin.name if target.endswith("/") else destination
            destination.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(origin, destination)


def build(work: Path) -> Stage:
    """Execute every instruction; the last stage is the image."""
    base = base_root(work)
    context = committed_context(work / "context")
    stages: dict[str, Stage] = {}
    stage = Stage(base)
    for keyword, arguments in instructions(REPOSITORY / "Dockerfile"):
        print(f"{keyword} {arguments[:100]}", flush=True)
        match keyword:
            case "FROM":
                name = arguments.split(" AS ")[1] if " AS " in arguments else "final"
                subprocess.run(["cp", "-a", str(base), str(work / name)], check=True)
                stage = stages[name] = Stage(work / name)
            case "ENV":
                stage.environment |= dict(word.split("=", 1) for word in shlex.split(arguments))
            case "RUN":
                run_in(stage, arguments)
            case "COPY":
                copy(stage, arguments, context, stages)
            case "USER" | "WORKDIR" | "VOLUME" | "EXPOSE" | "ENTRYPOINT" | "CMD" | "HEALTHCHECK":
                stage.settings[keyword] = arguments
            case _:
                raise SystemExit(f"verify_image.py does not know the instruction {keyword}: teach it")
    return stage


def prepare(directory: str) -> Path:
    """An empty work directory, keeping only the stand-in for the base image."""
    work = Path(directory)
    work.mkdir(parents=True, exist_ok=True)
    for old in work.iterdir():
        if old.name != "base":
            subprocess.run(["rm", "-rf", str(old)], check=True)
    return work


def main() -> None:
    """Build, measure, then try the image in namespaces of its own (scripts/try_image.py)."""
    if os.geteuid() != 0:
        raise SystemExit("verify_image.py needs root: it uses chroot and mounts")
    work = prepare(sys.argv[1] if len(sys.argv) > 1 else "/var/tmp/underskin-image")
    stage = build(work)
    added = [str(stage.inside(path)) for path in ("/opt/venv", "/app")]
    subprocess.run(["du", "--summarize", "--human-readable", *added], check=True)
    description = {"root": str(stage.root), "environment": stage.environment, "settings": stage.settings}
    (work / "image.json").write_text(json.dumps(description))
    namespaces = ["unshare", "--mount", "--net", "--pid", "--fork", "--kill-child"]
    trial = [sys.executable, str(REPOSITORY / "scripts" / "try_image.py"), str(work)]
    sys.exit(subprocess.run([*namespaces, *trial]).returncode)


if __name__ == "__main__":
    main()
