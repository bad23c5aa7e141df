"""The page is for this machine and this person: other pages and hosts get nothing."""

import http.client
import json
import threading

import pytest

from vinesexp.live.server import serve
from vinesexp.live.session import Session

TABLE = "record,file,test,clearance_mm,note\nring,raw/<b>.csv,ringdown,,<script>x</script>\n"


@pytest.fixture
def served(bench, tmp_path):
    (bench / "records.csv").write_text(TABLE)
    session = Session(bench, tmp_path / "results")
    session.begin()
    found = serve(session, token="secret")
    threading.Thread(target=found.server.serve_forever, args=[0.01], daemon=True).start()
    yield found
    found.server.shutdown()
    session.stop()


def ask(served, method, path, body=None, **headers):
    port = served.server.server_port
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, body, named)
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer.headers


def correction(record="ring", cells=None, before=None):
    cells = {"clearance_mm": "34"} if cells is None else cells
    return json.dumps(
        {"record": record, "cells": cells, "before": before or dict.fromkeys(cells, "")}
    )


JSON = {"Content_Type": "application/json"}


def test_the_page_follows_and_loads_nothing_from_outside(served):
    status, page, headers = ask(served, "GET", "/secret/")
    assert status == 200
    assert "https://" not in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert served.server.server_address[0] == "127.0.0.1"
    status, state, _ = ask(served, "GET", "/secret/state?since=-1")
    parts = json.loads(state)["parts"]
    assert "ring" in parts["rows"]
    assert "<script>" not in "".join(parts.values())


@pytest.mark.parametrize("path", ["/", "/state", "/secre/", "/SECRET/", "/x/../secret"])
def test_without_the_token_there_is_nothing(served, path):
    status, text, _ = ask(served, "GET", path)
    assert (status, text) == (404, "nothing here")


def test_another_host_that_leads_here_gets_nothing(served):
    assert ask(served, "GET", "/secret/", Host="evil.example")[0] == 404
    assert ask(served, "POST", "/secret/row", correction(), Host="evil.example", **JSON)[0] == 404


def test_a_correction_is_written(served, bench):
    status, _, _ = ask(served, "POST", "/secret/row", correction(), **JSON)
    assert status == 200
    assert "ringdown,34," in (bench / "records.csv").read_text()
    status, row, _ = ask(served, "GET", "/secret/row?record=ring")
    assert json.loads(row)["clearance_mm"] == "34"
    status, said, _ = ask(
        served, "POST", "/secret/row", correction(cells={"clearance_mm": "36"}), **JSON
    )
    assert status == 409
    assert "by now" in json.loads(said)["error"]


@pytest.mark.parametrize(
    ("body", "headers", "expected"),
    [
        (correction(), JSON | {"Origin": "http://evil.example"}, 403),
        (correction(), JSON | {"Origin": "null"}, 403),
        (correction(), {"Content_Type": "text/plain"}, 400),
        (correction(), {"Content_Type": "application/x-www-form-urlencoded"}, 400),
        ("{", JSON, 400),
        ("[]", JSON, 400),
        ('{"record": "ring", "cells": [], "before": {}}', JSON, 400),
        (correction(record="gone"), JSON, 400),
        (correction(cells={"file": "/etc/passwd"}), JSON, 400),
        ("x" * 70000, JSON, 413),
    ],
)
def test_whatever_else_is_sent_writes_nothing(served, bench, body, headers, expected):
    status, _, _ = ask(served, "POST", "/secret/row", body, **headers)
    assert status == expected
    assert (bench / "records.csv").read_text() == TABLE


def test_other_methods_and_other_origins_are_told_nothing(served):
    status, _, headers = ask(served, "OPTIONS", "/secret/row", Origin="http://evil.example")
    assert status == 501
    assert "Access-Control-Allow-Origin" not in headers
