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

from vinesexp.records.stored.store import package_version
from vinesexp.whole_files import digest_of_file

NAME = "ro-crate-metadata.json"
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
    graph: list[dict[str, Any]] = [
        {
            "@id": NAME,
            "@type": "CreativeWork",
            "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
            "about": {"@id": "./"},
        },
        {
            "@id": "./",
            "@type": "Dataset",
            "name": title,
            "description": f"Results of the campaign '{title}': channels, impacts and tables, SI.",
            "datePublished": date,
            **({"license": {"@id": _SPDX + license}} if license else {}),
            **({"author": [{"@id": person["@id"]} for person in people]} if people else {}),
            "hasPart": [{"@id": _id(folder, file.path)} for file in files],
            "mentions": [{"@id": "#analysis"}],
        },
        {
            "@id": "#vinesexp",
            "@type": "SoftwareApplication",
            "name": "vinesexp",
            "version": package_version() or "unknown",
        },
        {
            "@id": "#analysis",
            "@type": "CreateAction",
            "name": f"Analysis of {title}",
            "instrument": {"@id": "#vinesexp"},
            "object": [{"@id": f"#source-{digest[:16]}"} for digest in sources.values()],
            "result": [{"@id": _id(folder, file.path)} for file in files],
        },
    ]
    for name, digest in sources.items():
        graph.append(
            {
                "@id": f"#source-{digest[:16]}",
                "@type": "CreativeWork",
                "name": name,
                "identifier": f"sha256:{digest}",
            }
        )
    graph += people
    if license:
        graph.append({"@id": _SPDX + license, "@type": "CreativeWork", "name": license})
    graph += [_file(folder, file) for file in files]
    path = folder / NAME
    crate = {"@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph}
    path.write_text(json.dumps(crate, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


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
    found = {"@id": orcid.strip(" )") or f"#author-{number}"}
    return found | {"@type": "Person", "name": name.strip()}


def _file(folder: Path, file: Described) -> dict[str, Any]:
    found: dict[str, Any] = {
        "@id": _id(folder, file.path),
        "@type": "File",
        "name": file.path.name,
        "description": file.about,
        "encodingFormat": _TYPES.get(file.path.suffix, "application/octet-stream"),
        "contentSize": str(file.path.stat().st_size),
        "identifier": f"sha256:{digest_of_file(file.path)}",
    }
    if file.sources:
        found["isBasedOn"] = [{"@id": f"#source-{d[:16]}"} for d in file.sources.values()]
    return found


def _id(folder: Path, path: Path) -> str:
    from urllib.parse import quote

    return quote(path.relative_to(folder).as_posix())
