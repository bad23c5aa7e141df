"""What compressed samples would save on disk and cost in time, on the records of a results folder.

    python -m benchmarks.compression results/twin

Every channel of every file in `records/` and `conditioned/` is written anew by h5py, in the
chunks of `vinesexp.records.stored.store`, with each filter, and read again in full. Processor
seconds, not wall time; the filters take turns on each file, so that a busy machine treats them
alike. blosc2 is measured where hdf5plugin is installed, which every reader of such files would
need too.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np

FILTERS: dict[str, dict[str, Any]] = {
    "none": {},
    "lzf": {"compression": "lzf", "shuffle": True},
    "deflate 1": {"compression": "gzip", "compression_opts": 1, "shuffle": True},
    "deflate 4": {"compression": "gzip", "compression_opts": 4, "shuffle": True},
}
with contextlib.suppress(ImportError):
    import hdf5plugin

    for level in (1, 5):
        FILTERS[f"blosc2 zstd {level}"] = dict(hdf5plugin.Blosc2(cname="zstd", clevel=level))


def channels(path: Path) -> dict[str, tuple[np.ndarray, tuple[int, ...] | None]]:
    """Samples and chunk shape of every channel of a record."""
    with h5py.File(path) as file:
        return {name: (data[:], data.chunks) for name, data in file.items() if name != "time"}


def write_and_read(content: dict[str, Any], target: Path, options: dict[str, Any]) -> np.ndarray:
    """Bytes on disk, and processor seconds to write and to read all channels once."""
    started = time.process_time()
    with h5py.File(target, "w") as file:
        for name, (samples, chunks) in content.items():
            file.create_dataset(name, data=samples, chunks=chunks, **options)
    written = time.process_time()
    with h5py.File(target) as file:
        for name in content:
            file[name][:]
    return np.array([target.stat().st_size, written - started, time.process_time() - written])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path)
    results = parser.parse_args().results
    print("| files | filter | MB | write, s | read, s |\n|---|---|---|---|---|")
    for folder in ("records", "conditioned"):
        files = sorted((results / folder).glob("*.nc"))
        if not files:
            sys.exit(f"{results / folder}: no records; run `snakemake` first")
        total = {name: np.zeros(3) for name in FILTERS}
        with tempfile.TemporaryDirectory() as temporary:
            for path in files:
                content = channels(path)
                for name, options in FILTERS.items():
                    total[name] += write_and_read(content, Path(temporary, "record.nc"), options)
        for name, (size, write, read) in total.items():
            print(f"| {folder} | {name} | {size / 1e6:.1f} | {write:.2f} | {read:.2f} |")


if __name__ == "__main__":
    main()
