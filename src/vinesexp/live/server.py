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
from vinesexp.live.live_page import Parts, whole_page
from vinesexp.live.session import ChangedMeanwhileError, Session

_WAIT = 20.0  # s that a page waits for news before it asks again
_LARGEST = 1 << 16  # bytes of a correction


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
    server = _Server(("127.0.0.1", port), partial(_Handler, session, Parts(session), token))
    server.daemon_threads = True
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

    def __init__(self, session: Session, parts: Parts, token: str, *connection: Any) -> None:
        self.session, self.parts, self.token = session, parts, token
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
        """Everything that changes, as soon as there is something new."""
        known = int(since) if since.lstrip("-").isdigit() else -1
        session = self.session
        with session.changed:
            session.changed.wait_for(lambda: session.status.version != known, timeout=_WAIT)
        self._answer(lambda: self.parts.since(known))

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
