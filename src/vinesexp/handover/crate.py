"""RO-Crate metadata of a folder that is handed on: what each file is, from what, made by what.

Plain JSON-LD of RO-Crate 1.1 (https://w3id.org/ro/crate/1.1), as archives read it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from vinesexp.codedigest import version_of
from vinesexp.whole_files import digest_of_file

NAME = "ro-crate-metadata.json"
_CRATE = "https://w3id.org/ro/crate/1.1"
_SPDX = "https://spdx.org/licenses/"
_TYPES = {
    ".csv": "text/csv",
    ".mat": "application/x-matlab-data",
    ".uff": "application/octet-stream",
    ".html": "text/html",
    ".nc": "application/x-netcdf",
}


@dataclass(frozen=True)
class Described:
    """A file of the folder: what it is, and the instrument files (name to SHA-256) behind it."""

    path: Path
    about: str
    sources: Mapping[str, str]


def write_crate(
    folder: Path,
    *,
    title: str,
    files: Sequence[Described],
    authors: Sequence[str] = (),
    license: str = "",
    made: str = "",
) -> Path:
    """Write the metadata of a folder.

    Parameters
    ----------
    folder : Path
        Every file of `files` lies in it.
    title : str
        Of the campaign.
    authors : sequence of str
        Names, each followed by an ORCID address in brackets where there is one.
    license : str
        SPDX identifier, such as ``CC-BY-4.0``; empty: none is given, and nobody may reuse it.
    made : str, optional
        ISO date of publication; left out: today.
    """
    date = made or datetime.now(UTC).date().isoformat()
    people = [_person(author, number) for number, author in enumerate(authors, start=1)]
    sources = {name: digest for file in files for name, digest in file.sources.items()}
    parts = [_at(_id(folder, file.path)) for file in files]
    graph = [
        _entity(NAME, "CreativeWork", conformsTo=_at(_CRATE), about=_at("./")),
        _entity(
            *("./", "Dataset"),
            name=title,
            description=f"Results of the campaign '{title}': channels, impacts and tables, SI.",
            datePublished=date,
            **({"license": _at(_SPDX + license)} if license else {}),
            **({"author": [_at(person["@id"]) for person in people]} if people else {}),
            hasPart=parts,
            mentions=[_at("#analysis")],
        ),
        _entity(
            *("#vinesexp", "SoftwareApplication"),
            name="vinesexp",
            version=version_of("vinesexp") or "unknown",
        ),
        _entity(
            *("#analysis", "CreateAction"),
            name=f"Analysis of {title}",
            instrument=_at("#vinesexp"),
            object=[_at(_source(digest)) for digest in sources.values()],
            result=parts,
        ),
    ]
    for name, digest in sources.items():
        identifier = f"sha256:{digest}"
        graph.append(_entity(_source(digest), "CreativeWork", name=name, identifier=identifier))
    graph += people
    if license:
        graph.append(_entity(_SPDX + license, "CreativeWork", name=license))
    graph += [_file(folder, file) for file in files]
    path = folder / NAME
    crate = {"@context": f"{_CRATE}/context", "@graph": graph}
    path.write_text(json.dumps(crate, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def _entity(id: str, kind: str, /, **about: Any) -> dict[str, Any]:
    return {"@id": id, "@type": kind, **about}


def _at(id: str) -> dict[str, str]:
    return {"@id": id}


def _source(digest: str) -> str:
    return f"#source-{digest[:16]}"


def _person(author: str, number: int) -> dict[str, Any]:
    """An author as the metadata name one.

    Examples
    --------
    >>> _person("Ada Example (https://orcid.org/0000-0002-1825-0097)", 1)["@id"]
    'https://orcid.org/0000-0002-1825-0097'
    >>> _person("Ada Example", 1)
    {'@id': '#author-1', '@type': 'Person', 'name': 'Ada Example'}
    """
    name, _, orcid = author.partition("(")
    return _entity(orcid.strip(" )") or f"#author-{number}", "Person", name=name.strip())


def _file(folder: Path, file: Described) -> dict[str, Any]:
    behind = {"isBasedOn": [_at(_source(digest)) for digest in file.sources.values()]}
    return _entity(
        *(_id(folder, file.path), "File"),
        name=file.path.name,
        description=file.about,
        encodingFormat=_TYPES.get(file.path.suffix, "application/octet-stream"),
        contentSize=str(file.path.stat().st_size),
        identifier=f"sha256:{digest_of_file(file.path)}",
        **(behind if file.sources else {}),
    )


def _id(folder: Path, path: Path) -> str:
    from urllib.parse import quote

    return quote(path.relative_to(folder).as_posix())
