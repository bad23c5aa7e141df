"""The live page: a shell, and the parts of it that follow the session."""

from __future__ import annotations

import threading
from typing import Any

from vinesexp.live.session import EDITABLE, Seen, Session
from vinesexp.records.campaign.missing_cells import asked_in
from vinesexp.records.campaign.records_xlsx import head_of
from vinesexp.records.campaign.schema import TESTS, Record
from vinesexp.report.rendering import environment, rendered

#: Parts that are written anew, each from its own template.
PARTS = ("status", "record", "next", "campaign", "rows")
_KINDS = ("differ", "agree", "open")  # of rows of `tables_shown`
_CELLS = tuple(c for c in EDITABLE if c not in ("test", "exclude", "note"))


def whole_page(session: Session, nonce: str) -> str:
    """The page as it is first sent; its script asks for the parts."""
    style = environment("vinesexp.report").get_template("report.css").render()
    campaign = session.campaign
    content = {
        "title": campaign.title if campaign else session.folder.name,
        "style": style,
        "nonce": nonce,
        "tests": TESTS,
        "cells": [(column, head_of(column)) for column in _CELLS],
        "parts": PARTS,
        "sheet": campaign.sheet.name if campaign else "records.csv",
    }
    return rendered("vinesexp.live", "live.html.j2", content)


def parts_of(session: Session) -> dict[str, str]:
    """The parts as they are now, as markup."""
    content = _content(session)
    return {part: rendered("vinesexp.live", f"{part}.html.j2", content) for part in PARTS}


class Parts:
    """The parts of a session's page: made once a change, and sent only where they changed."""

    def __init__(self, session: Session) -> None:
        self._session, self._lock = session, threading.Lock()
        self._made = -1
        self._parts: dict[str, tuple[int, str]] = {}  # of which version, and the markup

    def since(self, version: int) -> dict[str, Any]:
        """The version that the page has then, and the parts that changed after `version`."""
        with self._lock:
            now = self._session.status.version
            if now != self._made:
                for name, markup in parts_of(self._session).items():
                    if self._parts.get(name, (0, None))[1] != markup:
                        self._parts[name] = (now, markup)
                self._made = now
            changed = {name: text for name, (of, text) in self._parts.items() if of > version}
            return {"version": now, "parts": changed}


def _content(session: Session) -> dict[str, Any]:
    status, campaign = session.status, session.campaign
    records = list(reversed(campaign.records)) if campaign else []
    by_id = {record.id: record for record in records}
    newest = by_id.get(status.newest) or next(iter(records), None)
    seen = session.seen.get(newest.id, Seen()) if newest else Seen()
    view = status.campaign
    stated = {kind: [row for row in view.stated if row["kind"] == kind] for kind in _KINDS}
    return {
        "status": status,
        "growing": [path.name for path in session.growing],
        "newest": newest,
        "words": _row_words(newest) if newest else "",
        "seen": seen,
        "short": _is_short(seen, newest, view.record),
        "open": sorted(asked_in(newest)) if newest else [],
        "view": view,
        "finding": session.finding,
        "contradicted": stated["differ"],
        "others": [*stated["open"], *stated["agree"]],
        "rows": [(one, _row_words(one), session.seen.get(one.id, Seen())) for one in records],
        "counted": _counted(session, records),
        "head_of": head_of,
    }


def _is_short(seen: Seen, record: Record | None, wanted: float | None) -> str:
    """That a steady test is shorter than the rig needs, in words."""
    if record is None or record.test != "periodic" or seen.view is None or wanted is None:
        return ""
    length = seen.view.length
    if length is None or length >= 0.5 * wanted:
        return ""
    return f"{length:.3g} s are short: this rig takes {wanted:.0f} s for a sure mean"


def _counted(session: Session, records: list[Record]) -> str:
    done = sum(session.seen.get(r.id, Seen()).state == "done" for r in records)
    return f"{len(records)} records, {done} analysed"


def _row_words(record: Record) -> str:
    """A row as one says it."""
    parts = [record.test]
    if record.clearance:
        parts.append(" + ".join(f"{1e3 * b:.4g}" for b in record.clearance) + " mm clearance")
    if record.base_amplitude is not None:
        parts.append(f"{1e3 * record.base_amplitude:.4g} mm base")
    if record.frequency:
        low, high = record.frequency
        parts.append(f"{low:.5g} Hz" if low == high else f"{low:.4g} to {high:.4g} Hz")
    if record.release is not None:
        parts.append(f"{1e3 * record.release:.4g} mm release")
    if record.added_mass:
        parts.append(f"{1e3 * record.added_mass:.4g} g added")
    if record.exclude:
        parts.append("left out")
    return ", ".join(parts)
