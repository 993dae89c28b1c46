"""`motionary browse`: the address it says, the token it asks for, how it ends, what it refuses."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from motionary.catalog import Catalog
from motionary.workflows.browse import TOKEN, find_token, take_place
from motionary.workflows.errors import UserError
from tests.catalogs import copied

PROGRAM = [sys.executable, "-c", "from motionary.workflows.cli import main; main()", "browse"]
GIVEN = "a-token-that-nobody-guesses"


@contextmanager
def running(*arguments: object, **environment: str) -> Iterator[tuple[subprocess.Popen, str]]:
    """Start the command with --json on a free port; gives the process and what it says."""
    process = subprocess.Popen(
        [*PROGRAM, *map(str, arguments), "--port", "0", "--json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | environment,
    )  # fmt: skip
    try:
        yield process, json.loads(process.stdout.readline() or process.stderr.read())["url"]
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_it_says_where_answers_and_ends_quietly(demo_catalog, how):
    with running(demo_catalog) as (process, url):
        assert httpx.get(url).status_code == 200
        process.send_signal(how)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out, err) == (0, "", "")


def test_it_ends_while_somebody_waits_for_an_answer(demo_catalog):
    """A file is on its way, and will not come."""
    with running(demo_catalog) as (process, url):
        place = httpx.URL(url)
        with socket.create_connection((place.host, place.port)) as connection:
            connection.sendall(
                f"POST /drop HTTP/1.1\r\nHost: {place.netloc.decode()}\r\nOrigin: {url.rstrip('/')}\r\n"
                "Content-Length: 9\r\nX-Motionary-Files: "
                "%5B%7B%22name%22%3A%22a.bvh%22%2C%22size%22%3A9%7D%5D\r\n\r\nHIER".encode()
            )
            assert httpx.get(url).status_code == 200
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
            assert process.returncode == 0


def test_without_json_stdout_is_empty(demo_catalog):
    process = subprocess.Popen(
        [*PROGRAM, demo_catalog, "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    line = process.stderr.readline()
    assert line.startswith("http://127.0.0.1:")
    assert line.endswith("; Ctrl-C ends it\n")
    assert httpx.get(line.split(";")[0]).status_code == 200
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60) == ("", "")


@pytest.mark.slow
def test_labels_are_changed_only_with_edit(demo_catalog, tmp_path):
    url = copied(demo_catalog, tmp_path)
    change = {"clip": "walk/walk_tired_alex_01.bvh", "label": "trudge"}
    for options, status in (((), 403), (("--edit",), 200)):
        with running(url, *options) as (_, site):
            answer = httpx.post(f"{site}edit/relabel", json=change, headers={"Origin": site.rstrip("/")})
            assert answer.status_code == status, answer.text
    with Catalog.open(url) as catalog:
        (row,) = catalog.labels.to_arrow().to_pylist()
    assert row["label"] == "trudge"


def test_any_other_address_gets_a_token_that_is_told_once(demo_catalog):
    with running(demo_catalog, "--host", "0.0.0.0") as (_, url):
        told = httpx.URL(url)
        assert len(told.params["token"]) == 43
        here = f"http://127.0.0.1:{told.port}/"
        assert httpx.get(here).status_code == 401
        assert httpx.get(here, params={"token": told.params["token"]}).status_code == 303


def test_a_given_token_is_asked_for_on_loopback_too_and_not_told(demo_catalog, tmp_path):
    file = tmp_path / "token"
    file.write_text(GIVEN + "\n")
    for arguments, environment in ((("--token-file", file), {}), ((), {TOKEN: GIVEN})):
        with running(demo_catalog, *arguments, **environment) as (_, url):
            assert GIVEN not in url
            assert httpx.get(url).status_code == 401
            assert httpx.get(url, params={"token": GIVEN}).status_code == 303


def test_what_is_wrong_is_told_before_anything_is_served(motionary, demo_catalog, tmp_path):
    short = tmp_path / "token"
    short.write_text("short")
    older = tmp_path / "nothing"
    for arguments, told in (
        ((older,), "is not a catalog; make one with: motionary run"),
        ((demo_catalog, "--token-file", tmp_path / "none"), "cannot be read (no such file or directory)"),
        ((demo_catalog, "--token-file", tmp_path), "cannot be read (is a directory)"),
        ((demo_catalog, "--token-file", short), "the token has 5 characters; give 16 or more"),
        ((demo_catalog, "--host", "none.invalid"), "there is no host 'none.invalid'"),
        ((demo_catalog, "--host", "203.0.113.7"), "this machine has no such address"),
    ):
        code, out, err = motionary("browse", *arguments, "--port", 0)
        assert (code, out) == (1, "")
        assert told in err
        assert err.count("\n") == 1


def test_a_port_that_is_taken_is_told(motionary, demo_catalog):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, _, err = motionary("browse", demo_catalog, "--port", port)
    assert code == 1
    assert err == (
        f"motionary: cannot listen on 127.0.0.1 port {port}: another program has that port; "
        "name another by --port, or 0 for any that is free\n"
    )


@pytest.mark.parametrize(
    ("host", "loopback"), [("127.0.0.1", True), ("localhost", True), ("127.0.0.5", True), ("0.0.0.0", False)]
)
def test_what_is_loopback(host, loopback):
    place = take_place(host, 0)
    place.socket.close()
    assert place.loopback == loopback
    assert (find_token(None, place.loopback).value is None) == loopback
    assert "0.0.0.0" not in place.url


def test_a_token_file_without_text_is_refused(tmp_path: Path):
    (tmp_path / "token").write_bytes(b"\xff\xfe")
    with pytest.raises(UserError, match="no text"):
        find_token(tmp_path / "token", True)


def test_tokens_differ():
    assert find_token(None, False).value != find_token(None, False).value
