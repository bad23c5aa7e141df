"""A zip archive around one text file, as phyphox exports: `Accelerometer.csv` beside `meta/`."""

from __future__ import annotations

import shutil
import tempfile
import zipfile
from pathlib import Path, PurePosixPath

from vinesexp.errors import RecordError
from vinesexp.records.readers.extras import unreadable
from vinesexp.records.readers.text import TextSource

NAME = "zip of one CSV"

_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".lvm")
_SWELL = 200  # text packs to a twentieth; more than this is no text


def recognises(head: bytes, suffix: str) -> bool:
    """Any other zip archive."""
    return head.startswith(b"PK\x03\x04")


def open_file(path: Path) -> ZippedText:
    """Read the one record of an archive; RecordError where there is none or there are several."""
    try:
        with zipfile.ZipFile(path) as archive:
            texts = [i for i in archive.infolist() if _is_record(i.filename)]
            if len(texts) != 1:
                names = ", ".join(i.filename for i in texts) or "no text file"
                raise RecordError(
                    f"is a zip archive that holds {names}; unpack it and name one file", file=path
                )
            if texts[0].file_size > _SWELL * max(texts[0].compress_size, 1 << 12):
                raise RecordError(
                    f"'{texts[0].filename}' unpacks to {texts[0].file_size} bytes", file=path
                )
            kept = tempfile.NamedTemporaryFile(suffix=".csv")  # noqa: SIM115
            with archive.open(texts[0]) as stream:
                shutil.copyfileobj(stream, kept)
            kept.flush()
    except RecordError:
        raise
    except Exception as error:  # whatever the broken bytes lead to
        raise unreadable("a zip archive", error, path) from None
    return ZippedText(path, kept)


class ZippedText(TextSource):
    """The text file of an archive. The interface is `readers.source.Source`."""

    format = "zip of one CSV"

    def __init__(self, path: Path, kept: tempfile._TemporaryFileWrapper[bytes]) -> None:
        self._kept = kept
        try:
            super().__init__(Path(kept.name))
        except RecordError as error:
            raise RecordError(error.problem, file=path, where=error.where) from None
        self._read_from, self.path = self.path, path


def _is_record(name: str) -> bool:
    place = PurePosixPath(name)
    return (
        place.suffix.lower() in _TEXTS
        and not {"meta", "__MACOSX"} & set(place.parts[:-1])
        and not place.name.startswith(".")
    )
