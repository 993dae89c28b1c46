"""Who is let in: real requests to a real server, as other sites' pages and other people would make them."""

import asyncio
import re
import socket

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.catalog import Catalog
from motionary.catalog.web import data, drop, pages
from motionary.catalog.web.access import Guard
from motionary.catalog.web.app import create_app
from tests.catalogs import copied
from tests.web.serving import editor_of, served, tree

TOKEN = "a-token-that-nobody-guesses"
CLIP = "walk/walk_tired_alex_01.bvh"


@pytest.fixture(scope="module")
def client(demo_catalog):
    with served(demo_catalog) as client:
        yield client


@pytest.fixture(scope="module")
def behind_token(demo_catalog):
    with served(demo_catalog, guard=Guard(TOKEN)) as client:
        yield client


@pytest.fixture
def stranger(behind_token):
    """A client of its own, without cookies."""
    with httpx.Client(base_url=behind_token.base_url, headers={"Accept": "text/html"}) as client:
        yield client


def exchange(client: httpx.Client, sent: bytes) -> bytes:
    """Send bytes as they are, and read all that comes."""
    with socket.create_connection((client.base_url.host, client.base_url.port), timeout=30) as connection:
        connection.sendall(sent)
        return b"".join(iter(lambda: connection.recv(65536), b""))


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8765", "localhost.evil.example", "127.0.0.1.evil.example", "evil@x", "",
     "127.0.0.1evil", "2130706433.evil", "localhost:1@evil.example", "[::1", "evil.example/127.0.0.1"],
)  # fmt: skip
@pytest.mark.parametrize("path", ["/", "/data/search?q=walk", "/static/style.css", "/nothing"])
def test_another_name_is_not_answered(client, host, path):
    """A page whose name its owner points here: DNS rebinding."""
    answer = client.get(path, headers={"Host": host})
    assert answer.status_code in (400, 421)  # 400 is the server's, of what is no name at all
    assert "walk" not in answer.text


def test_a_request_that_names_no_host_is_not_answered(client):
    assert b" 421 " in exchange(client, b"GET / HTTP/1.0\r\n\r\n").splitlines()[0]


@pytest.mark.parametrize(
    "host", ["127.0.0.1", "127.0.0.1:9", "localhost", "LOCALHOST:80", "[::1]:8765", "192.168.1.20:8765"]
)
def test_names_that_nobody_else_can_have_are_answered(client, host):
    assert client.get("/", headers={"Host": host}).status_code == 200


def test_a_name_that_was_told_is_answered():
    assert Guard(hosts=frozenset({"Mocap-3"})).knows("mocap-3:8765")
    assert not Guard().knows("mocap-3:8765")


@given(
    st.text() | st.from_regex(r"[a-z0-9.:\[\]@/-]{0,20}[g-z][a-z0-9.-]{0,20}(:[0-9]{1,5})?", fullmatch=True)
)
def test_no_other_name_is_known(host):
    known = re.fullmatch(r"(localhost|[0-9.]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?", host, re.IGNORECASE)
    assert known or not Guard().knows(host)


@pytest.mark.parametrize(
    "origin",
    [None, "null", "http://evil.example", "http://127.0.0.1", "http://127.0.0.1:1", "http://localhost:{port}",
     "file://", "http://127.0.0.1:{port}.evil.example", "ftp://127.0.0.1:{port}"],
)  # fmt: skip
@pytest.mark.parametrize("path", ["/edit/relabel", "/edit/undo", "/drop", "/", "/token"])
def test_another_sites_page_changes_nothing(demo_catalog, tmp_path, origin, path):
    """By a form or by fetch, from another host or another port of this one; cookies would come along."""
    url = copied(demo_catalog, tmp_path)
    with served(url, editor=editor_of(url)) as client:
        before = tree(url)
        del client.headers["Origin"]
        given = {} if origin is None else {"Origin": origin.format(port=client.base_url.port)}
        answer = client.post(path, json={"clip": CLIP, "label": "x"}, headers=given)
        assert (answer.status_code, "Origin" in answer.text) == (403, True)
        assert tree(url) == before


def test_a_form_cannot_say_what_a_change_is(demo_catalog, tmp_path):
    """Even from the right origin: a form sends other types than JSON, and without asking first."""
    url = copied(demo_catalog, tmp_path)
    with served(url, editor=editor_of(url)) as client:
        for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
            given = {"Content-Type": kind}
            answer = client.post("/edit/relabel", content='{"clip": "x", "label": "y"}', headers=given)
            assert answer.status_code == 415
        assert client.get("/edit/relabel").status_code == 405
        assert client.put("/edit/relabel", json={}).status_code == 405


def test_every_answer_forbids_frames_foreign_scripts_and_guessing(client, stranger, monkeypatch):
    answers = [
        client.get(path) for path in ("/", "/clip?id=nothing", "/nothing", "/static/style.css", "/drop")
    ]
    answers += [client.get("/", headers={"Host": "evil"}), client.post("/", headers={"Origin": "null"})]
    answers += [stranger.get("/"), client.post("/edit/relabel", json={})]

    def fail(*given: object) -> None:
        raise RuntimeError("of a test")

    monkeypatch.setattr(pages, "clusters_of", fail)
    monkeypatch.setattr(data, "thumbnail_svg", fail)
    monkeypatch.setattr(drop, "_sent", fail)  # of an answer that is a coroutine
    alone = {"Connection": "close"}  # a connection on which something failed is closed
    asked = (("GET", "/clusters"), ("GET", f"/data/thumbnail?clip={CLIP}"), ("POST", "/drop"))
    faults = [client.request(*one, headers=alone) for one in asked]
    assert [one.status_code for one in faults] == [500] * 3
    answers += faults
    assert {one.status_code for one in answers} == {200, 404, 421, 403, 401, 500}
    for one in answers:
        policy = one.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'self';" in policy
        assert "frame-ancestors 'none'" in policy
        assert "form-action 'self'" in policy
        assert one.headers["X-Content-Type-Options"] == "nosniff"
        assert one.headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert one.headers["Referrer-Policy"] == "same-origin"
        assert "server" not in one.headers or one.headers["server"] == "uvicorn"


def test_without_the_token_nothing_is_told(behind_token, demo_catalog, stranger):
    app = create_app(demo_catalog, guard=Guard(TOKEN))
    for route in app.routes:
        path = route.path.replace("{name}", "style.css")
        for method in (*(route.methods or ()), "OPTIONS", "PUT", "DELETE"):
            answer = stranger.request(
                method, path, headers={"Origin": str(behind_token.base_url).rstrip("/")}
            )
            assert answer.status_code == 401, (method, path)
            assert "walk" not in answer.text
            assert "set-cookie" not in answer.headers


def test_the_token_is_asked_for_once(stranger):
    answer = stranger.get("/search", params={"q": "walk & run", "token": TOKEN})
    assert answer.status_code == 303
    assert answer.headers["location"] == "/search?q=walk+%26+run"
    cookie = answer.headers["set-cookie"]
    assert TOKEN not in cookie
    assert {"httponly", "samesite=strict", "path=/"} <= set(cookie.lower().split("; "))
    assert f"motionary_{stranger.base_url.port}=" in cookie
    assert stranger.get("/search", params={"q": "walk"}).status_code == 200


@pytest.mark.parametrize("token", ["", "wrong", TOKEN + "x", TOKEN[:-1], "ü" * 20, TOKEN.upper()])
def test_a_wrong_token_opens_nothing(stranger, token):
    answer = stranger.get("/", params={"token": token})
    assert answer.status_code == 401
    assert "was not the token" in answer.text
    assert not stranger.cookies
    stranger.cookies.set(f"motionary_{stranger.base_url.port}", token.encode("ascii", "replace").decode())
    assert stranger.get("/").status_code == 401


@pytest.mark.parametrize(
    ("onward", "there"),
    [("/clusters?page=2", "/clusters?page=2"), ("//evil.example/", "/"), ("/\\evil.example", "/"),
     ("https://evil.example", "/"), ("/\r\nSet-Cookie: a=b", "/"), ("", "/")],
)  # fmt: skip
def test_the_token_page_leads_on_but_nowhere_else(stranger, onward, there):
    origin = {"Origin": str(stranger.base_url).rstrip("/")}
    answer = stranger.post("/token", data={"token": TOKEN, "onward": onward}, headers=origin)
    assert (answer.status_code, answer.headers["location"]) == (303, there)
    assert stranger.get("/").status_code == 200


def test_the_token_page_takes_little(stranger):
    origin = {"Origin": str(stranger.base_url).rstrip("/")}
    answer = stranger.post("/token", data={"token": TOKEN, "onward": "x" * 10_000}, headers=origin)
    assert answer.status_code == 401


def test_a_path_that_leads_elsewhere_stays_here(stranger):
    answer = stranger.get(f"{str(stranger.base_url).rstrip(chr(47))}//evil.example/x?token={TOKEN}")
    assert answer.headers["location"] == "/"


@pytest.mark.parametrize("token", ["short", "with blanks in between", "ümläüte-sind-nicht-ascii", "\n" * 20])
def test_a_token_that_cannot_serve_is_refused(token):
    with pytest.raises(ValueError, match="token"):
        Guard(token)


def test_a_guard_does_not_show_its_token():
    assert TOKEN not in repr(Guard(TOKEN))


def test_read_only_nothing_can_be_changed(demo_catalog, tmp_path):
    """Every route by every method, with all that an edit would send, as a page of this server."""
    url = copied(demo_catalog, tmp_path)
    before, snapshot = tree(url), Catalog.open(url).snapshot.snapshot_id
    with served(url) as client:
        refused = client.post("/edit/relabel", json={"clip": CLIP, "label": "x"})
        assert refused.status_code == 403
        assert "--edit" in refused.json()["error"]
        assert client.post("/edit/undo", json={"edit": 1}).status_code == 403
        for route in create_app(url, guard=Guard()).routes:
            for method in ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"):
                path = route.path.replace("{name}", "style.css")
                asked = {"clip": CLIP, "id": CLIP, "label": "x", "again": "1"}
                client.request(method, path, params=asked, json={"clip": CLIP, "label": "x", "edit": 1})
    assert tree(url) == before
    assert Catalog.open(url).snapshot.snapshot_id == snapshot


def test_sockets_other_than_http_are_closed(demo_catalog):
    sent = []

    async def send(message):
        sent.append(message)

    async def receive():
        return {"type": "websocket.connect"}

    app = create_app(demo_catalog, guard=Guard())
    asyncio.run(app({"type": "websocket", "path": "/", "headers": []}, receive, send))
    assert [one["type"] for one in sent] == ["websocket.close"]
