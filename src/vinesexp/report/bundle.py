"""Everything a campaign's results hold for others, in one zip."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

from vinesexp.whole_files import whole_file

#: Folders that only later steps read.
_INNER = ("steps",)
#: Already as small as they get.
_STORED = (".nc", ".pdf")
#: A date for every file: the same results give the same zip.
_DATE = (1980, 1, 1, 0, 0, 0)
_BLOCK = 1 << 20


def write_bundle(results: Path, out: Path) -> int:
    """Put report, pages, tables, figures, records and logs of a results folder into one zip.

    Parameters
    ----------
    results : Path
        results/<campaign>; in the zip everything lies in a folder of its name.
    out : Path
        The zip; it appears only when complete. It may lie in the folder.

    Returns
    -------
    int
        How many files it holds.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp()) / "twin"
    >>> (folder / "steps").mkdir(parents=True)
    >>> for name in ("report.html", "steps/identify.csv"):
    ...     _ = (folder / name).write_text("x")
    >>> write_bundle(folder, folder / "twin.zip")
    1
    >>> zipfile.ZipFile(folder / "twin.zip").namelist()
    ['twin/report.html']
    """
    count = 0
    with whole_file(out) as growing, zipfile.ZipFile(growing, "w") as bundle:
        for path in _contents(results):
            if path == out:
                continue
            name = f"{results.resolve().name}/{path.relative_to(results).as_posix()}"
            entry = zipfile.ZipInfo(name, date_time=_DATE)
            entry.external_attr = 0o644 << 16
            stored = path.suffix in _STORED
            entry.compress_type = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
            entry.file_size = path.stat().st_size  # says whether it needs a large entry
            with path.open("rb") as source, bundle.open(entry, "w") as target:
                while block := source.read(_BLOCK):
                    target.write(block)
            count += 1
    return count


def _contents(results: Path) -> Iterator[Path]:
    """Files to hand on, in order; hidden ones are leftovers and locks."""
    for path in sorted(results.rglob("*")):
        parts = path.relative_to(results).parts
        hidden = any(part.startswith(".") for part in parts)
        if parts[0] not in _INNER and not hidden and path.is_file():
            yield path
