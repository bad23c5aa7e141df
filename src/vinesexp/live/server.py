"""The page of a session, served on this machine alone at an address that holds a secret.

Nothing of it comes from outside, and no other page can read it or write through it: every address
begins with the token, requests name this machine as their host, and a change has to be JSON from
this very page.
"""

from __future__ import annotations

import hmac
import json
import secrets
import sys
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from vinesexp.errors import VinesexpError
from vinesexp.figures.numbers import rounded
from vinesexp.figures.record_words import settings_of
from vinesexp.live.session import EDITABLE, ChangedMeanwhileError, Followed, Session
from vinesexp.records.campaign.missing_cells import asked_in
from vinesexp.records.campaign.records_xlsx import head_of
from vinesexp.records.campaign.schema import TESTS, Record
from vinesexp.report.rendering import environment, rendered
from vinesexp.units import counted

_WAIT = 20.0  # s that a page waits for news before it asks again
_LARGEST = 1 << 16  # bytes of a correction

#: Parts of the page that are written anew, each from its own template.
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


def _content(session: Session) -> dict[str, Any]:
    status, campaign = session.status, session.campaign
    records = list(reversed(campaign.records)) if campaign else []
    by_id = {record.id: record for record in records}
    newest = by_id.get(status.newest) or next(iter(records), None)
    seen = session.seen.get(newest.id, Followed()) if newest else Followed()
    view = status.campaign
    done = sum(session.seen.get(r.id, Followed()).state == "done" for r in records)
    stated = {kind: [row for row in view.stated if row["kind"] == kind] for kind in _KINDS}
    return {
        "status": status,
        "growing": [path.name for path in session.arrivals.growing],
        "newest": newest,
        "words": _row_words(newest) if newest else "",
        "seen": seen,
        "short": _is_short(seen, newest, view.record),
        "open": sorted(asked_in(newest)) if newest else [],
        "view": view,
        "finding": session.identifying.busy,
        "contradicted": stated["differ"],
        "others": [*stated["open"], *stated["agree"]],
        "rows": [
            _shown_row(one, session.seen.get(one.id, Followed()), view.record) for one in records
        ],
        "counted": f"{counted(len(records), 'record')}, {done} analysed",
        "head_of": head_of,
    }


def _is_short(seen: Followed, record: Record | None, wanted: float | None) -> str:
    """That a steady test is shorter than the rig needs, in words."""
    length = seen.view.length if seen.view else None
    if record is None or record.test != "periodic" or length is None or wanted is None:
        return ""
    if length >= 0.5 * wanted:
        return ""
    return f"recorded for {length:.3g} s: this rig needs {rounded(wanted)} s for a certain mean"


def _shown_row(
    record: Record, seen: Followed, wanted: float | None
) -> tuple[Record, str, Followed, str, str]:
    """A record of the list, with its state and why."""
    if seen.view is None:
        return record, _row_words(record), seen, seen.state, ""
    short = _is_short(seen, record, wanted)
    words = [*([short] if short else []), *seen.view.words]
    state = "look" if short and seen.view.verdict == "good" else seen.view.verdict
    return record, _row_words(record), seen, state, words[0] if words else ""


def _row_words(record: Record) -> str:
    """A row as one says it."""
    taken = [words or value for _, value, words in settings_of(record)]
    return ", ".join([record.test, *taken, *(["left out"] if record.exclude else [])])


@dataclass(frozen=True)
class Served:
    """A server and the address of its page."""

    server: ThreadingHTTPServer
    address: str


def serve(session: Session, *, port: int = 0, token: str | None = None) -> Served:
    """A server for a session; call its ``serve_forever``.

    Parameters
    ----------
    session : Session
    port : int
        0: any free one.
    token : str, optional
        Secret part of the address; by default a new one.
    """
    token = token or secrets.token_urlsafe(24)
    server = _Server(("127.0.0.1", port), partial(_Handler, session, token))
    return Served(server, f"http://127.0.0.1:{server.server_port}/{token}/")


class _Server(ThreadingHTTPServer):
    """A browser that goes away in the middle of an answer is no error."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "vinesexp", ""

    def __init__(self, session: Session, token: str, *connection: Any) -> None:
        self.session, self.token = session, token
        super().__init__(*connection)

    def do_GET(self) -> None:
        """The page, and what it asks for."""
        asked = self._asked()
        if asked is None:
            return
        name, query = asked
        record = query.get("record", [""])[0]
        if name == "":
            nonce = secrets.token_urlsafe(16)
            self._send(HTTPStatus.OK, whole_page(self.session, nonce), "text/html", nonce)
        elif name == "state":
            self._send_state(query.get("since", ["-1"])[0])
        elif name == "figures":
            self._answer(lambda: [list(one) for one in self.session.figures_of(record)])
        elif name == "row":
            self._answer(lambda: self.session.row(record))
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "nothing here")

    def do_POST(self) -> None:
        """A correction."""
        asked = self._asked()
        if asked is None:
            return
        own = f"http://{self.headers.get('Host', '')}"
        length = self.headers.get("Content-Length", "")
        if self.headers.get("Origin", own) != own:
            self._refuse(HTTPStatus.FORBIDDEN, "from another page")
        elif self.headers.get_content_type() != "application/json" or asked[0] != "row":
            self._refuse(HTTPStatus.BAD_REQUEST, "no correction")
        elif not length.isdigit() or int(length) > _LARGEST:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "too long")
        else:
            body = self.rfile.read(int(length))
            try:
                said = json.loads(body)
                record = str(said["record"])
                cells, before = (
                    {str(k): str(v) for k, v in said[part].items()} for part in ("cells", "before")
                )
            except (ValueError, KeyError, TypeError, AttributeError):
                self._refuse(HTTPStatus.BAD_REQUEST, "no correction")
                return
            self._answer(lambda: self.session.correct(record, cells, before))

    def _asked(self) -> tuple[str, dict[str, list[str]]] | None:
        """What is asked for; None where the request is none of the page's, and was refused."""
        port = self.connection.getsockname()[1]
        hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
        address = urlsplit(self.path)
        token, _, name = address.path.lstrip("/").partition("/")
        if self.headers.get("Host") not in hosts or not hmac.compare_digest(
            token.encode(), self.token.encode()
        ):
            self._refuse(HTTPStatus.NOT_FOUND, "nothing here")
            return None
        return name, parse_qs(address.query)

    def _send_state(self, since: str) -> None:
        """Every part, as soon as there is something new: the page keeps those that are the same."""
        known = int(since) if since.lstrip("-").isdigit() else -1
        session = self.session
        with session.changed:
            session.changed.wait_for(lambda: session.status.version != known, timeout=_WAIT)
        self._answer(lambda: {"version": session.status.version, "parts": parts_of(session)})

    def _answer(self, make: Any) -> None:
        """JSON of what is made, or the mistake in one line."""
        try:
            content, status = make(), HTTPStatus.OK
        except ChangedMeanwhileError as error:
            content, status = {"error": str(error)}, HTTPStatus.CONFLICT
        except VinesexpError as error:
            content, status = {"error": str(error)}, HTTPStatus.BAD_REQUEST
        except OSError as error:
            content, status = {"error": error.strerror or str(error)}, HTTPStatus.CONFLICT
        self._send(status, json.dumps(content), "application/json")

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self.close_connection = True
        self._send(status, why, "text/plain")

    def _send(self, status: HTTPStatus, text: str, kind: str, nonce: str = "none") -> None:
        content = text.encode()
        self.send_response(status)
        for name, value in (
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(content))),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
            ("X-Frame-Options", "DENY"),
            (
                "Content-Security-Policy",
                f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; "
                "connect-src 'self'; img-src data:; form-action 'none'; frame-ancestors 'none'; "
                "base-uri 'none'",
            ),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing: the address holds the secret."""
