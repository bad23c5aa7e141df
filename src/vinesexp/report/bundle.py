"""Everything a campaign's results hold for others, in one zip."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

from vinesexp.whole_files import whole_file

#: Folders that only later steps read.
_INNER = ("steps",)
#: Already as small as they get.
_STORED = (".nc", ".pdf")
#: A date for every file: the same results give the same zip.
_DATE = (1980, 1, 1, 0, 0, 0)
_BLOCK = 1 << 20


def write_bundle(results: Path, files: Iterable[Path], out: Path) -> int:
    """Put report, pages, tables, figures, records and logs of a results folder into one zip.

    Parameters
    ----------
    results : Path
        results/<campaign>; in the zip everything lies in a folder of its name.
    files : iterable of Path
        What the steps of the campaign wrote there. Those that only later steps read, and those that
        are not there, are left out; what else lies in the folder is nobody's to hand on.
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
    >>> for name in ("report.html", "steps/identify.csv", "my notes.txt"):
    ...     _ = (folder / name).write_text("x")
    >>> made = [folder / "report.html", folder / "steps/identify.csv"]
    >>> write_bundle(folder, made, folder / "twin.zip")
    1
    >>> zipfile.ZipFile(folder / "twin.zip").namelist()
    ['twin/report.html']
    """
    count = 0
    with whole_file(out) as growing, zipfile.ZipFile(growing, "w") as bundle:
        home = results.resolve()
        for path in sorted(_contents(home, files) - {out.resolve()}):
            name = f"{home.name}/{path.relative_to(home).as_posix()}"
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


def _contents(home: Path, files: Iterable[Path]) -> set[Path]:
    """Of these files those in the results folder, for people, that are there."""
    found = {path.resolve() for path in files if path.is_file()}
    inside = {path for path in found if path.is_relative_to(home)}
    return {path for path in inside if path.relative_to(home).parts[0] not in _INNER}
