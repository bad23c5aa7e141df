"""What libraries read from the environment: where they keep what they reuse, how many threads.

Containers, service users and nodes of a cluster often have neither an installation nor a home that
can be written. What numba, Snakemake and matplotlib keep is only there to save time: it then goes
to a folder for temporary files, and a line says so.

The linear algebra of each process has one thread. A step solves many small systems, of tens of
unknowns. OpenBLAS hands each to as many threads as the machine has cores, which wait for one
another longer than they compute, and most of all where several steps, or other programs, share the
cores. What runs side by side here are processes.
"""

from __future__ import annotations

import os
import sys
import tempfile
from contextlib import AbstractContextManager
from pathlib import Path

#: What tells each library where; the first holds for all that follow the XDG rules.
CACHE_VARIABLES = ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "MPLCONFIGDIR")


def keep_caches_writable() -> None:
    """Point every cache to a temporary folder where neither home nor XDG_CACHE_HOME can be written.

    What the person has set is left alone. Processes started from here inherit it.
    """
    home = os.environ.get("XDG_CACHE_HOME")
    if is_writable(Path(home) if home else _home() / ".cache"):
        return
    missing = [name for name in CACHE_VARIABLES if not _is_set(name)]
    if is_writable(Path(__file__).parent / "solver/__pycache__"):  # numba's first choice
        missing = [name for name in missing if name != "NUMBA_CACHE_DIR"]
    if not missing:
        return
    folder = own_folder()
    for name in missing:
        os.environ[name] = str(folder)
    numba = sys.modules.get("numba")
    if numba is not None and "NUMBA_CACHE_DIR" in missing:  # it has read the environment already
        numba.config.CACHE_DIR = str(folder)
    print(
        f"vinesexp: the home folder cannot be written; caches are kept in {folder}",
        file=sys.stderr,
    )


def own_folder() -> Path:
    """This user's folder among the temporary files; one of a new name where that is not ours."""
    folder = Path(tempfile.gettempdir()) / f"vinesexp-cache-{_user()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        own = folder.stat().st_uid == os.getuid() if hasattr(os, "getuid") else True
    except OSError:
        own = False
    if own and is_writable(folder):
        return folder
    return Path(tempfile.mkdtemp(prefix="vinesexp-cache-"))


def is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made where it is not there yet.

    Examples
    --------
    >>> is_writable(Path("/dev/null/below")), is_writable(Path(tempfile.gettempdir()))
    (False, True)
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _is_set(name: str) -> bool:
    value = os.environ.get(name)
    return value is not None and is_writable(Path(value))


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError:
        return Path("/nonexistent")


def _user() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")


#: What OpenBLAS, OpenMP, MKL and Accelerate read when they are loaded.
THREAD_VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def one_thread_each() -> None:
    """Ask for one thread here and in processes started from here; to be called before numpy loads.

    What the person has set is left alone.

    Examples
    --------
    >>> one_thread_each()
    >>> all(name in os.environ for name in THREAD_VARIABLES)
    True
    """
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")


def one_thread_here() -> AbstractContextManager[object]:
    """One thread for the linear algebra of a block, where numpy has been loaded: in a notebook.

    After the block the threads are those there were before.

    Examples
    --------
    >>> from threadpoolctl import threadpool_info
    >>> with one_thread_here():
    ...     {found["num_threads"] for found in threadpool_info() if found["user_api"] == "blas"}
    {1}
    """
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
