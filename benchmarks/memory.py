"""The largest memory that a process has held."""

from __future__ import annotations

import sys
from pathlib import Path


def peak_memory() -> float | None:
    """Largest memory that this process has held, MiB, where the system says it.

    The usual `ru_maxrss` outlives the start of a new program on Linux, and would show what the
    parent had held; VmHWM is of this program alone. Of the processes that it started and that have
    ended the largest counts too.
    """
    try:
        import resource
    except ImportError:  # Windows
        return None
    size = 2**20 if sys.platform == "darwin" else 2**10
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / size
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        kilobytes = next(line.split()[1] for line in status.splitlines() if "VmHWM" in line)
        return max(int(kilobytes) / 2**10, children)
    except (OSError, StopIteration):
        return max(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / size, children)
