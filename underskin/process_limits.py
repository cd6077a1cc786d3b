"""What a child process may take of the machine; on Linux."""

from pathlib import Path


def limit_process(memory_bytes: int, *, file_bytes: int | None = None, cpu_seconds: int | None = None) -> None:
    """Limit this process for good: address space beyond what it has now, files that it writes, time on processors.

    It leaves no core dump.
    """
    import resource  # not on Windows, where no server runs

    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    limits = {resource.RLIMIT_AS: own + memory_bytes, resource.RLIMIT_CORE: 0}
    if file_bytes is not None:
        limits[resource.RLIMIT_FSIZE] = file_bytes
    if cpu_seconds is not None:
        limits[resource.RLIMIT_CPU] = cpu_seconds
    for kind, most in limits.items():
        resource.setrlimit(kind, (most, most))
