"""Jobs of a run that Slurm cannot start as the cluster is: said once a reason, within a minute."""

from __future__ import annotations

import subprocess
import threading
from collections import Counter
from collections.abc import Callable

#: Reasons to wait that pass by themselves: others come first, or use the nodes now.
PASSING = {"None", "Priority", "Resources", "Dependency", "BeginTime", "Prolog", "Cleaning"}
_EVERY = 20.0  # s
_LOOKS = 2  # in which a reason has to be seen


def watch(run: str, say: Callable[[str], None]) -> None:
    """Look at the queue until this process ends, and say why jobs stay there.

    Parameters
    ----------
    run : str
        The name that all jobs of the run carry.
    say : callable
        Takes a line for the console.
    """
    threading.Thread(target=_look, args=(run, say), daemon=True).start()


def _look(run: str, say: Callable[[str], None]) -> None:
    seen: Counter[str] = Counter()
    while True:
        threading.Event().wait(_EVERY)
        try:
            told = subprocess.run(
                ["squeue", "-h", "-t", "PENDING", "--name", run, "-o", "%i|%r"],
                capture_output=True,
                text=True,
                check=True,
                timeout=60,
            ).stdout
        except (OSError, subprocess.SubprocessError):
            continue  # the executor says so itself where Slurm does not answer
        jobs: dict[str, list[str]] = {}
        for line in told.splitlines():
            job, _, reason = line.partition("|")
            jobs.setdefault(reason, []).append(job)
        for reason, ids in jobs.items():
            seen[reason] += 1
            if reason not in PASSING and seen[reason] == _LOOKS:
                say(sentence(reason, ids))


def sentence(reason: str, ids: list[str]) -> str:
    """What a person reads about jobs that wait.

    Examples
    --------
    >>> print(sentence("PartitionConfig", ["12"]))
    1 job waits and cannot start as the cluster is: PartitionConfig (scontrol show job 12 says
    what it asks for, sinfo -N -l what the nodes have)
    """
    many = f"{len(ids)} jobs wait" if len(ids) > 1 else "1 job waits"
    return (
        f"{many} and cannot start as the cluster is: {reason} (scontrol show job {ids[0]} says "
        "what it asks for, sinfo -N -l what the nodes have)"
    )
