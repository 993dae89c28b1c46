"""Public sets come whole, from a server that does what servers do, and no archive writes elsewhere."""

import bz2
import csv
import errno
import gzip
import hashlib
import io
import json
import random
import re
import shutil
import socket
import stat
import tarfile
import threading
import time
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import requests
from rich.console import Console

from motionary.catalog import Catalog
from motionary.workflows.fetch import job, transfer
from motionary.workflows.fetch.labels import clips_among
from motionary.workflows.fetch.meter import download_meter
from motionary.workflows.fetch.registry import LABELS, load_registry, set_named
from motionary.workflows.fetch.registry import FetchError as Refused
from motionary.workflows.fetch.transfer import Resuming, download
from motionary.workflows.fetch.unpack import unpack

BIG = bytes(range(256)) * 4096  # a megabyte
ENDLESS = 2**26  # where a test fails, the disk is not to be filled
LASTING = {"length": False, "endless": True}
PIECE = 2**18  # in whole chunks: of one that is broken off nothing is kept


@dataclass
class Offer:
    """What the server does when a file is asked for."""

    content: bytes
    ranges: bool = True
    etag: str | None = '"one"'
    status: int = 200
    length: bool = True  # whether it says how long the file is
    chunked: bool = False
    packed: str | None = None  # the Content-Encoding that it claims
    endless: bool = False
    step: int | None = None  # the most that a part has
    of: int | None = None  # the complete size that it says with a part, instead of the true one
    breaks_after: list[int] = field(default_factory=list)  # bytes sent by the first, second, ... answer
    hangs: bool = False


@dataclass
class Site:
    """A server on this machine, and what it was asked for."""

    address: str
    offers: dict[str, Offer] = field(default_factory=dict)
    asked: list[tuple[str, str | None]] = field(default_factory=list)  # path, Range
    sent: int = 0

    def url(self, name: str) -> str:
        return f"{self.address}/{name}"


@pytest.fixture
def site(monkeypatch) -> Iterator[Site]:
    monkeypatch.setattr(transfer, "_PAUSE", 0)
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    made = Site("")

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self):
            with suppress(ConnectionError):  # of who has heard enough
                answer(self, made)

        def log_message(self, *arguments):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        server.daemon_threads = True
        made.address = f"http://127.0.0.1:{server.server_port}"
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield made
        server.shutdown()
        thread.join()


def answer(request: BaseHTTPRequestHandler, site: Site) -> None:
    asked = request.headers.get("Range")
    site.asked.append((request.path, asked))
    offer = site.offers.get(request.path.lstrip("/"))
    if offer is None or offer.status != 200:
        request.send_error(404 if offer is None else offer.status)
        return
    if offer.hangs:
        time.sleep(1)
        return
    same = request.headers.get("If-Range") in (None, offer.etag)
    start = int(asked[6:-1]) if asked and offer.ranges and same else 0
    size = len(offer.content)
    if start >= size > 0:
        request.send_response(416)
        request.send_header("Content-Range", f"bytes */{size}")
        request.end_headers()
        return
    end = min(start + offer.step, size) if start and offer.step else size
    request.send_response(206 if start else 200)
    if start:
        request.send_header("Content-Range", f"bytes {start}-{end - 1}/{offer.of or size}")
    if offer.packed:
        request.send_header("Content-Encoding", offer.packed)
    if offer.chunked:
        request.send_header("Transfer-Encoding", "chunked")
    elif offer.length:
        request.send_header("Content-Length", str(end - start))
    if offer.etag:
        request.send_header("ETag", offer.etag)
    request.end_headers()
    stop = start + offer.breaks_after.pop(0) if offer.breaks_after else end
    sent = offer.content[start:stop]
    while offer.endless and site.sent < ENDLESS:
        request.wfile.write(sent)
        site.sent += len(sent)
    site.sent += len(sent)
    request.wfile.write(b"%x\r\n%b\r\n0\r\n\r\n" % (len(sent), sent) if offer.chunked else sent)


class Told:
    """A meter that keeps what it is told."""

    def __init__(self):
        self.begun, self.count = [], 0

    def begin(self, name, total, done):
        self.begun.append((name, total, done))

    def advance(self, count):
        self.count += count


def sha256(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()}"


def get(site: Site, folder: Path, name: str = "a.zip", meter=None, **fields) -> Path:
    """Download a file of the site into a folder."""
    folder.mkdir(exist_ok=True)
    one = transfer.SetFile(**{"name": name, "url": site.url(name), **fields})
    return download(one, folder, "http://source.example", meter or Told())


def part_of(site: Site, folder: Path, content: bytes) -> None:
    """Leave what an earlier call would have of a file of the site."""
    (folder / "a.zip.part").write_bytes(content)
    note = {"url": site.url("a.zip"), "validator": '"one"'}
    (folder / "a.zip.part.json").write_text(json.dumps(note))


def zipped(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in files.items():
            packed.writestr(name, content)
    return out.getvalue()


def tarred(*members: tarfile.TarInfo | tuple[str, bytes]) -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as packed:
        for one in members:
            if isinstance(one, tarfile.TarInfo):
                packed.addfile(one)
            else:
                info = tarfile.TarInfo(one[0])
                info.size = len(one[1])
                packed.addfile(info, io.BytesIO(one[1]))
    return out.getvalue()


def registry(tmp_path: Path, site: Site, offers: dict[str, bytes], **fields: object) -> Path:
    """Write a registry of one set, "small", whose files the site has."""
    given = {
        "title": "A small set", "source": site.address, "licence": "CC BY 4.0", "terms": "Name us.",
        "attribution": "Somebody, 2020.", "keep": ["*.bvh", "*.amc", "*.asf"],
        "pattern": r"^(?P<action>[a-z]+)_(?P<style>[a-z]+)_(?P<subject>[a-z]+)_(?P<take>\d+)\.bvh$",
    } | fields  # fmt: skip
    lines = ["[small]", *(f"{name} = {json.dumps(value)}" for name, value in given.items())]
    for name, content in offers.items():
        site.offers[name] = Offer(content)
        lines += ["[[small.files]]", f'name = "{name}"', f'url = "{site.url(name)}"']
        lines += [f"bytes = {len(content)}", f'digest = "{sha256(content)}"']
    file = tmp_path / "registry.toml"
    file.write_text("\n".join(lines))
    return file


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "labels.csv").open(newline="") as text:
        return list(csv.DictReader(text))


# the registry


def test_the_built_in_sets_are_whole_and_say_where_from():
    sets = load_registry()
    assert set(sets) == {"cmu", "hdm05", "hdm05-cuts", "bandai-namco", "lafan1", "100style"}
    for one in sets.values():
        assert one.citations, one.name
        assert one.pattern, one.name
        if any(file.digest is None or file.bytes is None or file.url is None for file in one.files):
            assert "Not documented" in one.notes, one.name


@pytest.mark.parametrize(
    ("name", "file", "labels"),
    [
        ("cmu", "01_01.amc", ("", "", "01", "01")),
        ("hdm05", "HDM_dg_06-03_03_120.amc", ("", "", "dg", "06-03_03")),
        ("lafan1", "fallAndGetUp2_subject3.bvh", ("fallAndGetUp", "", "subject3", "2")),
        ("100style", "HandsInPockets_TR2.bvh", ("TR2", "HandsInPockets", "", "")),
    ],
)
def test_documented_names_tell_labels(name, file, labels):
    found = re.search(load_registry()[name].pattern, file).groupdict()
    assert tuple(found.get(label, "") for label in LABELS) == labels


@pytest.mark.parametrize(("name", "dataset"), [("bandai-namco", "bandai"), ("hdm05-cuts", "hdm05")])
def test_names_of_real_clips_tell_the_labels_that_people_wrote(shared_data, name, dataset):
    pattern = re.compile(load_registry()[name].pattern, re.IGNORECASE)
    with (shared_data / "labels.csv").open(newline="") as text:
        rows = [row for row in csv.DictReader(text) if row["dataset"].startswith(dataset)]
    assert len(rows) > 100
    for row in rows:
        found = pattern.search(Path(row["path"]).name)
        assert found, row["path"]
        assert found.groupdict() == {label: row[label] for label in found.groupdict()}


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"licence": ""}, "small.licence"),
        ({"colour": "red"}, "small.colour"),
        ({"source": "ftp://there"}, "http://"),
        ({"pattern": "(?P<colour>.)"}, "must name groups, of action"),
        ({"pattern": "("}, "no regular expression"),
        ({"keep": []}, "small.keep"),
    ],
)
def test_a_wrong_registry_names_the_field(tmp_path, site, motionary, fields, said):
    file = registry(tmp_path, site, {"a.zip": b"x"}, **fields)
    code, _, err = motionary("fetch", "--registry", file)
    assert code == 1
    assert str(file) in err
    assert said in err


@pytest.mark.parametrize("name", ["../a.zip", ".lock", "a/b.zip", ""])
def test_a_registry_names_no_file_elsewhere(tmp_path, name):
    file = tmp_path / "r.toml"
    shutil.copy(job.__file__.replace("job.py", "public_libraries.toml"), file)
    file.write_text(file.read_text().replace('name = "lafan1.zip"', f'name = "{name}"'))
    with pytest.raises(Refused, match="no plain file name"):
        load_registry(file)


def test_the_list_is_a_table_and_json(motionary):
    code, out, err = motionary("fetch")
    assert (code, err) == (0, "")
    assert "CC BY-NC-ND 4.0" in out
    code, out, _ = motionary("fetch", "--format", "json")
    rows = {row["name"]: row for row in json.loads(out)}
    assert rows["lafan1"]["bytes"] == 144051503
    assert rows["cmu"]["bytes"] is None  # is not documented
    assert rows["cmu"]["notes"].startswith("Not documented: size and digest")


def test_a_set_is_described(motionary):
    code, out, _ = motionary("fetch", "100style")
    assert code == 0
    assert "Licence: CC BY 4.0\n" in out
    assert "Attribution: The 100STYLE Dataset - Ian Mason" in out
    code, out, _ = motionary("fetch", "100style", "--format", "json")
    assert [row["name"] for row in json.loads(out)] == ["100style"]


def test_a_name_that_is_none_is_told_the_nearest():
    with pytest.raises(Refused, match="did you mean lafan1"):
        set_named("lafan", load_registry())


# the command


def test_without_the_licence_accepted_nothing_is_downloaded(tmp_path, site, motionary):
    file = registry(tmp_path, site, {"a.zip": zipped({"a.bvh": b"x"})})
    code, out, err = motionary("fetch", "small", tmp_path / "set", "--registry", file)
    assert (code, out, site.asked) == (1, "", [])
    assert "Licence: CC BY 4.0" in err
    assert "Terms: Name us." in err
    assert "add --accept-licence" in err
    assert not (tmp_path / "set").exists()


def test_a_set_is_fetched_and_run_and_not_downloaded_again(tmp_path, site, motionary, demo_library):
    takes = sorted(demo_library.rglob("*.bvh"))
    some = [take for take in takes if re.match("(walk|jump)_(neutral|tired)", take.name)][::3][:6]
    files = {f"takes/{take.parent.name}/{take.name}": take.read_bytes() for take in some}
    archive = zipped({**files, "takes/film.mp4": b"a film", "takes/walk/odd name.bvh": some[0].read_bytes()})
    file = registry(tmp_path, site, {"takes.zip": archive})
    folder = tmp_path / "set"
    arguments = ("fetch", "small", folder, "--accept-licence", "--registry", file)
    code, out, err = motionary(*arguments)
    assert code == 0, err
    assert f"{len(some) + 1} clips of small" in out
    assert "the names of 1 clip do not tell their labels" in err
    assert "takes.zip: " in err  # plain lines where no terminal is
    rows = {row["path"]: row for row in rows_of(folder)}
    assert set(rows) == {*files, "takes/walk/odd name.bvh"}
    assert not (folder / "takes/film.mp4").exists()
    for path, row in rows.items():
        told = re.fullmatch(r"([a-z]+)_([a-z]+)_([a-z]+)_(\d+)\.bvh", Path(path).name)
        assert tuple(row[label] for label in LABELS) == (told.groups() if told else ("",) * 4)
        assert (row["dataset"], row["licence"]) == ("small", "CC BY 4.0")
    assert "Attribution: Somebody, 2020." in (folder / "SOURCE.txt").read_text()

    asked = len(site.asked)
    code, out, _ = motionary(*arguments)
    assert code == 0
    assert "were there already" in out
    assert len(site.asked) == asked

    labels = folder / "labels.csv"
    code, _, err = motionary("run", folder, tmp_path / "catalog", "--labels", labels, "--workers", 1)
    assert code == 0, err
    clips = Catalog.open(str(tmp_path / "catalog")).clips.to_pandas().set_index("clip_id")
    assert set(clips.index) == set(rows)
    assert set(clips["licence"]) == {"CC BY 4.0"}
    path, take = next(iter(files)), some[0].name.split("_")
    assert list(clips.loc[path, ["action", "style", "subject"]]) == take[:3]


@pytest.mark.slow
def test_a_set_without_labels_in_its_names_runs_too(tmp_path, site, motionary, demo_library):
    takes = sorted(demo_library.rglob("walk*.bvh"))[:3]
    archive = zipped({f"{index}.bvh": take.read_bytes() for index, take in enumerate(takes)})
    file = registry(tmp_path, site, {"a.zip": archive}, pattern=r"^(?P<take>\d+)\.bvh$")
    assert motionary("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)[0] == 0
    labels = tmp_path / "set" / "labels.csv"
    code, _, err = motionary(
        "run", tmp_path / "set", tmp_path / "catalog", "--labels", labels, "--workers", 1
    )
    assert code == 0, err


def test_what_is_lost_of_a_set_comes_back_and_edited_labels_stay(tmp_path, site, motionary):
    file = registry(tmp_path, site, {"a.zip": zipped({"a.bvh": b"a", "b.bvh": b"b"})})
    folder = tmp_path / "set"
    arguments = ("fetch", "small", folder, "--accept-licence", "--registry", file)
    assert motionary(*arguments)[0] == 0
    labels = folder / "labels.csv"
    labels.write_text(labels.read_text().replace("a.bvh,small,CC BY 4.0,", "a.bvh,small,CC BY 4.0,mine"))
    edited = labels.read_text()
    (folder / "b.bvh").unlink()
    code, _, err = motionary(*arguments)
    assert code == 0
    assert "is as it was" in err
    assert labels.read_text() == edited
    assert (folder / "b.bvh").read_bytes() == b"b"
    assert len(site.asked) == 1  # the archive is there


@pytest.mark.parametrize("there", ["notes.txt", "labels.csv"])
def test_a_folder_with_something_else_is_refused(tmp_path, site, motionary, there):
    file = registry(tmp_path, site, {"a.zip": zipped({"a.bvh": b"a"})})
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / there).write_text("path,dataset\na.bvh,other\n")
    code, _, err = motionary("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)
    assert (code, site.asked) == (1, [])
    assert re.search("name a(nother| new) folder", err)


def test_every_amc_gets_its_skeleton_beside_it(tmp_path, site, motionary):
    offers = {
        "HDM_bd.asf": b"skeleton of bd",
        "a.zip": zipped(
            {"kick/HDM_bd_kick_001_120.AMC": b"1", "own/HDM_bd_x_1_120.amc": b"2", "own/HDM.asf": b"3"}
        ),
    }
    file = registry(tmp_path, site, offers)
    folder = tmp_path / "set"
    assert motionary("fetch", "small", folder, "--accept-licence", "--registry", file)[0] == 0
    assert (folder / "kick/HDM_bd.asf").read_bytes() == b"skeleton of bd"
    assert not (folder / "own/HDM_bd.asf").exists()
    assert [row["path"] for row in rows_of(folder)] == [
        "kick/HDM_bd_kick_001_120.AMC",
        "own/HDM_bd_x_1_120.amc",
    ]


def test_a_set_without_motion_is_told(tmp_path, site, motionary):
    file = registry(tmp_path, site, {"a.zip": zipped({"readme.txt": b"a"})})
    code, _, err = motionary("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)
    assert code == 1
    assert "no motion files" in err


def test_a_damaged_archive_is_removed_and_fetched_anew(tmp_path, site, motionary):
    good = zipped({"a.bvh": b"a"})
    file = registry(tmp_path, site, {"a.zip": good})
    folder = tmp_path / "set"
    text = file.read_text()
    file.write_text(re.sub("digest = .*|bytes = .*", "", text))
    site.offers["a.zip"].content = good[:-10]
    arguments = ("fetch", "small", folder, "--accept-licence", "--registry", file)
    code, _, err = motionary(*arguments)
    assert code == 1
    assert "damaged or no archive" in err
    site.offers["a.zip"].content = good
    assert motionary(*arguments)[0] == 0


def test_two_processes_do_not_fetch_into_one_folder(tmp_path, site, motionary):
    file = registry(tmp_path, site, {"a.zip": zipped({"a.bvh": b"a"})})
    downloads = tmp_path / "set" / ".fetch" / "small"
    downloads.mkdir(parents=True)
    with job.FileLock(downloads / ".lock"):
        code, _, err = motionary("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)
    assert (code, site.asked) == (1, [])
    assert "another process" in err


def test_a_file_without_a_documented_address_is_taken_from_where_it_was_put(tmp_path, site, motionary):
    file = registry(tmp_path, site, {"a.zip": b""})
    file.write_text(re.sub("url = .*|bytes = .*|digest = .*", "", file.read_text()))
    arguments = ("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)
    code, _, err = motionary(*arguments)
    assert code == 1
    place = tmp_path / "set/.fetch/small/a.zip"
    assert "the address of a.zip is not documented" in err
    assert f"get it in a browser from {site.address} and put it at {place}, then run this again" in err
    place.write_bytes(zipped({"a.bvh": b"a"}))
    sound = file.read_text()
    file.write_text(f'{sound}digest = "{sha256(b"other")}"')
    assert "has not the published digest sha256:" in motionary(*arguments)[2]
    file.write_text(sound)
    assert motionary(*arguments)[0] == 0


# the transfer


def test_a_file_comes_whole_and_only_once(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG)
    told = Told()
    for _ in range(2):
        place = get(site, tmp_path, meter=told, digest=sha256(BIG), bytes=len(BIG))
        assert place.read_bytes() == BIG
    assert len(site.asked) == 1
    assert (told.begun, told.count) == ([("a.zip", len(BIG), 0)], len(BIG))
    assert [path.name for path in tmp_path.iterdir()] == ["a.zip"]


@pytest.mark.parametrize("algorithm", ["md5", "sha1", "sha512"])
def test_digests_are_of_the_published_kind(tmp_path, site, algorithm):
    site.offers["a.zip"] = Offer(BIG)
    get(site, tmp_path, digest=f"{algorithm}:{hashlib.new(algorithm, BIG).hexdigest().upper()}")


def test_a_wrong_digest_removes_the_file(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG)
    with pytest.raises(Refused, match=r"SHA256 hash .* does not match") as told:
        get(site, tmp_path, digest=sha256(b"other"))
    assert site.url("a.zip") in str(told.value)
    assert list(tmp_path.iterdir()) == []


def test_another_size_than_documented_is_refused_before_it_comes(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG)
    with pytest.raises(Refused, match="of 1,048,576 bytes, but 7 are documented"):
        get(site, tmp_path, bytes=7)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("offer", [{"length": False}, {"chunked": True}, LASTING])
def test_more_than_the_documented_size_is_not_read(tmp_path, site, offer):
    site.offers["a.zip"] = Offer(BIG, **offer)
    told = Told()
    with pytest.raises(Refused, match="of more than 20,000 bytes, but 20,000 are documented"):
        get(site, tmp_path, meter=told, bytes=20_000)
    assert told.count <= 20_000
    assert list(tmp_path.iterdir()) == []


def test_less_than_the_documented_size_is_refused_once_it_is_whole(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, chunked=True)
    with pytest.raises(Refused, match="of 1,048,576 bytes, but 2,000,000 are documented"):
        get(site, tmp_path, bytes=2_000_000)
    assert (len(site.asked), list(tmp_path.iterdir())) == (1, [])


@pytest.mark.parametrize("offer", [{"length": False}, {"chunked": True}])
def test_the_documented_size_is_taken_however_it_comes(tmp_path, site, offer):
    site.offers["a.zip"] = Offer(BIG, **offer)
    assert get(site, tmp_path, bytes=len(BIG)).read_bytes() == BIG


@pytest.mark.parametrize("size", [1000, 1500])
def test_a_part_that_a_server_calls_complete_is_held_against_the_documented_size(tmp_path, site, size):
    site.offers["a.zip"] = Offer(BIG[:500])
    part_of(site, tmp_path, BIG[:500])
    with pytest.raises(Refused, match=f"of 500 bytes, but {size:,} are documented"):
        get(site, tmp_path, bytes=size)
    assert list(tmp_path.iterdir()) == []


def test_the_rest_of_a_file_of_another_size_is_refused(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG[:1000], of=9999)
    part_of(site, tmp_path, BIG[:500])
    with pytest.raises(Refused, match="of 9,999 bytes, but 1,000 are documented"):
        get(site, tmp_path, bytes=1000)


def test_a_shorter_part_than_was_asked_for_is_gone_on_with(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG[:1500], step=600)
    part_of(site, tmp_path, BIG[:500])
    assert get(site, tmp_path).read_bytes() == BIG[:1500]
    assert [asked for _, asked in site.asked] == ["bytes=500-", "bytes=1100-"]


@pytest.mark.parametrize("offer", [{}, {"length": False}, LASTING])
def test_a_file_of_undocumented_size_leaves_the_reserve_free(tmp_path, site, monkeypatch, offer):
    site.offers["a.zip"] = Offer(BIG, **offer)
    free = transfer._RESERVE + PIECE
    monkeypatch.setattr("shutil.disk_usage", lambda path: shutil._ntuple_diskusage(free, 0, free))
    told = Told()
    with pytest.raises(Refused, match="no room for .* more than 262,144 bytes") as refused:
        get(site, tmp_path, meter=told)
    assert told.count == (0 if offer == {} else PIECE)
    assert f"remove {tmp_path / 'a.zip.part'}" in str(refused.value)
    if offer != LASTING:
        monkeypatch.undo()
        monkeypatch.setenv("NO_PROXY", "127.0.0.1")
        assert get(site, tmp_path).read_bytes() == BIG


@pytest.mark.parametrize("documented", [True, False])
def test_a_packed_answer_is_refused_and_not_unpacked(tmp_path, site, documented):
    packed = gzip.compress(bytes(2**20), mtime=0)
    site.offers["a.zip"] = Offer(packed, packed="gzip")
    with pytest.raises(Refused, match=r"sends it packed \(gzip\) though it was asked not to"):
        get(site, tmp_path, bytes=len(packed) if documented else None)
    assert list(tmp_path.iterdir()) == []


def test_an_answer_that_says_it_is_not_packed_comes(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, packed="identity")
    assert get(site, tmp_path).read_bytes() == BIG


@pytest.mark.parametrize("address", [True, False])
def test_a_file_that_is_there_is_held_against_the_documented_size(tmp_path, site, address):
    (tmp_path / "a.zip").write_bytes(b"half")
    with pytest.raises(Refused, match=r"a\.zip is of 4 bytes, but 8 are documented; remove it"):
        get(site, tmp_path, bytes=8, **({} if address else {"url": None}))
    assert (tmp_path / "a.zip").read_bytes() == b"half"


def test_a_broken_connection_is_gone_on_with_at_once(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, breaks_after=[PIECE, PIECE])
    told = Told()
    assert get(site, tmp_path, meter=told).read_bytes() == BIG
    assert [asked for _, asked in site.asked] == [None, f"bytes={PIECE}-", f"bytes={2 * PIECE}-"]
    assert site.sent == len(BIG)  # no byte twice
    assert told.begun[-1] == ("a.zip", len(BIG), 2 * PIECE)


def test_a_later_call_goes_on_where_one_was_stopped(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, breaks_after=[PIECE, 0])
    with pytest.raises(Refused, match="broke off; run this again to go on with it"):
        get(site, tmp_path)
    assert (tmp_path / "a.zip.part").stat().st_size == PIECE
    assert not (tmp_path / "a.zip").exists()
    assert get(site, tmp_path, digest=sha256(BIG)).read_bytes() == BIG
    assert site.asked[-1][1] == f"bytes={PIECE}-"
    assert site.sent == len(BIG)


def test_a_server_without_ranges_is_begun_with_anew(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, ranges=False, breaks_after=[PIECE])
    told = Told()
    assert get(site, tmp_path, meter=told, digest=sha256(BIG)).read_bytes() == BIG
    assert site.sent == len(BIG) + PIECE
    assert told.begun[-1] == ("a.zip", len(BIG), 0)


def test_a_server_without_ranges_that_always_breaks_is_given_up(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, ranges=False, breaks_after=[PIECE] * 20)
    with pytest.raises(Refused, match="broke off"):
        get(site, tmp_path)
    assert len(site.asked) == 2


def test_a_part_of_an_earlier_version_is_thrown_away(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, breaks_after=[PIECE, 0])
    with pytest.raises(Refused):
        get(site, tmp_path)
    other = BIG[::-1]
    site.offers["a.zip"] = Offer(other, etag='"two"')
    assert get(site, tmp_path).read_bytes() == other


@pytest.mark.parametrize("etag", [None, 'W/"weak"'])
def test_a_part_that_nothing_tells_the_version_of_is_thrown_away(tmp_path, site, etag):
    site.offers["a.zip"] = Offer(BIG, etag=etag, breaks_after=[PIECE, 0])
    with pytest.raises(Refused):
        get(site, tmp_path)
    other = BIG[::-1]
    site.offers["a.zip"] = Offer(other, etag=etag)
    assert get(site, tmp_path).read_bytes() == other


def test_a_published_digest_tells_the_version_too(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, etag=None, breaks_after=[PIECE])
    assert get(site, tmp_path, digest=sha256(BIG)).read_bytes() == BIG
    assert site.sent == len(BIG)


def test_a_part_of_another_address_is_thrown_away(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, breaks_after=[PIECE, 0])
    with pytest.raises(Refused):
        get(site, tmp_path)
    site.offers["b.zip"] = Offer(BIG[::-1])
    assert get(site, tmp_path, url=site.url("b.zip")).read_bytes() == BIG[::-1]


def test_a_part_that_is_complete_or_too_long_does_no_harm(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG)
    for part in (BIG, BIG + b"more"):
        part_of(site, tmp_path, part)
        assert get(site, tmp_path).read_bytes() == BIG
        (tmp_path / "a.zip").unlink()


def test_a_note_that_is_damaged_does_no_harm(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG)
    for note in ("", "[]", "null", '{"url": 3}'):
        (tmp_path / "a.zip.part").write_bytes(b"rest")
        (tmp_path / "a.zip.part.json").write_text(note)
        assert get(site, tmp_path).read_bytes() == BIG
        (tmp_path / "a.zip").unlink()


def test_a_file_of_unknown_size_comes(tmp_path, site):
    site.offers["a.zip"] = Offer(BIG, length=False)
    told = Told()
    assert get(site, tmp_path, meter=told).read_bytes() == BIG
    assert told.begun == [("a.zip", None, 0)]


@pytest.mark.parametrize(
    ("status", "said"),
    [(404, r"there is nothing at .*a\.zip \(404\)"), (403, "refuses it: 403"), (503, "refuses it: 503")],
)
def test_a_refusal_says_how_to_get_it_in_a_browser(tmp_path, site, status, said):
    site.offers["a.zip"] = Offer(BIG, status=status)
    with pytest.raises(Refused, match=said) as told:
        get(site, tmp_path)
    assert f"put it at {tmp_path / 'a.zip'}, then run this again" in str(told.value)


def test_a_server_that_is_silent_is_left(tmp_path, site, monkeypatch):
    monkeypatch.setattr(transfer, "TIMEOUT", (1, 0.1))
    site.offers["a.zip"] = Offer(BIG, hangs=True)
    with pytest.raises(Refused, match="does not answer; run this again"):
        get(site, tmp_path)


def test_a_server_that_is_down_is_told(tmp_path, site):
    with pytest.raises(Refused, match="no network, or the server is down"):
        get(site, tmp_path, url="http://127.0.0.1:1/a.zip")


def test_no_network_is_told(tmp_path, site, monkeypatch):
    def unknown(*arguments, **options):
        raise socket.gaierror(-3, "Temporary failure in name resolution")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(Refused, match="no network, or no such server"):
        get(site, tmp_path, url="http://mocap.example/a.zip")


@pytest.mark.parametrize("fault", [errno.ENOSPC, errno.EACCES])
def test_a_disk_that_is_full_keeps_the_part(tmp_path, site, monkeypatch, fault):
    site.offers["a.zip"] = Offer(BIG)
    arrived = requests.Response.iter_content

    def first_chunk_only(answer, size):
        yield next(arrived(answer, size))
        raise OSError(fault, "No space left on device" if fault == errno.ENOSPC else "Permission denied")

    monkeypatch.setattr(requests.Response, "iter_content", first_chunk_only)
    said = (
        "no room for .* make room and run this again"
        if fault == errno.ENOSPC
        else "let this user write there"
    )
    with pytest.raises(Refused, match=said):
        get(site, tmp_path)
    had = (tmp_path / "a.zip.part").stat().st_size
    assert had > 0
    monkeypatch.undo()
    get(site, tmp_path)
    assert site.asked[-1][1] == f"bytes={had}-"


def test_a_disk_that_is_too_small_is_told_before(tmp_path, site, motionary, monkeypatch):
    file = registry(tmp_path, site, {"a.zip": zipped({"a.bvh": b"a"})})
    monkeypatch.setattr(job.shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(9, 9, 3))
    code, _, err = motionary("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)
    assert (code, site.asked) == (1, [])
    assert "are to come and 3 are free" in err


def test_an_interruption_keeps_the_part(tmp_path, site, motionary, monkeypatch):
    file = registry(tmp_path, site, {"a.zip": zipped({"a.bvh": BIG})})

    def stopped(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(Resuming, "_receive", stopped)
    code, _, err = motionary("fetch", "small", tmp_path / "set", "--accept-licence", "--registry", file)
    assert code == 1
    assert "interrupted; the same command goes on with it" in err


def test_lines_tell_how_far_it_is_and_do_not_grow_with_the_file():
    out = io.StringIO()
    with download_meter(Console(file=out, width=40)) as meter:
        meter.begin("a.zip", 10**9, 3 * 10**8)
        for _ in range(7_000):
            meter.advance(10**5)
        meter.begin("b.zip", None, 0)
        meter.advance(60 * 10**6)
    lines = out.getvalue().splitlines()
    assert lines[:2] == ["a.zip: 1,000.0 MB, going on after 300.0 MB", "a.zip: 400.0 MB of 1,000.0 MB"]
    assert lines[-2:] == ["b.zip: size unknown", "b.zip: 60.0 MB"]
    assert len(lines) == 10


def test_a_terminal_gets_bars():
    out = io.StringIO()
    with download_meter(Console(file=out, width=100, force_terminal=True)) as meter:
        meter.begin("a.zip", 100, 0)
        meter.begin("a.zip", 100, 50)
        meter.advance(50)
    assert "100/100 bytes" in out.getvalue()


# the archives


@contextmanager
def no_progress(totals):
    yield lambda stage: None


def unpacked(tmp_path: Path, name: str, content: bytes) -> list[str]:
    (tmp_path / name).write_bytes(content)
    folder = tmp_path / "in" / "here"
    folder.mkdir(parents=True, exist_ok=True)
    return unpack([tmp_path / name], folder, lambda path: True, no_progress)


def special(kind: bytes, name: str = "a.bvh", target: str = "b.bvh") -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.type, info.linkname = kind, target
    return info


def linked_zip() -> bytes:
    info = zipfile.ZipInfo("a.bvh")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as packed:
        packed.writestr(info, "/etc/passwd")
    return out.getvalue()


def nul_tar() -> bytes:
    info = tarfile.TarInfo("a.bvh")
    info.pax_headers = {"path": "a\0.bvh"}
    return tarred(info)


def encrypted_zip() -> bytes:
    content = bytearray(zipped({"a.bvh": b"a"}))
    content[6] |= 1  # the flag, in the local header and in the directory
    content[content.index(b"PK\1\2") + 8] |= 1
    return bytes(content)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.zip", zipped({"a.bvh": b"1", "b/c.bvh": b"2"})),
        ("a.tar.gz", tarred(("./a.bvh", b"1"), ("b/c.bvh", b"2"))),
    ],
)
def test_archives_are_unpacked(tmp_path, name, content):
    assert sorted(unpacked(tmp_path, name, content)) == ["a.bvh", "b/c.bvh"]
    assert (tmp_path / "in/here/b/c.bvh").read_bytes() == b"2"
    assert {path.name for path in (tmp_path / "in/here").rglob("*")} == {"a.bvh", "b", "c.bvh"}


def test_a_tar_of_a_folder_begins_with_the_folder(tmp_path):
    folder = tarfile.TarInfo("./")
    folder.type = tarfile.DIRTYPE
    assert unpacked(tmp_path, "a.tgz", tarred(folder, ("./a.bvh", b"1"))) == ["a.bvh"]


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.zip", zipped({"good.bvh": b"", "../a.bvh": b"x"}), "'../a.bvh' is a path out of its folder"),
        ("a.zip", zipped({"good.bvh": b"", "b/../../a.bvh": b"x"}), "a path out of its folder"),
        ("a.zip", zipped({"good.bvh": b"", "/tmp/a.bvh": b"x"}), "an absolute path"),
        ("a.zip", zipped({"good.bvh": b"", "..\\a.bvh": b"x"}), "a path out of its folder"),
        ("a.zip", zipped({"good.bvh": b"", "C:\\a.bvh": b"x"}), "an absolute path"),
        ("a.zip", zipped({"a": b"", "a/b.bvh": b"x"}), "its member 'a/b.bvh' is under 'a', which is a file"),
        ("a.zip", zipped({"a/b/c.bvh": b"", "a": b"x"}), "its member 'a/b/c.bvh' is under 'a'"),
        ("a.zip", zipped({"good.bvh": b"", ".fetch/s/b.zip": b"x"}), "'.fetch/s/b.zip' is in .fetch, where"),
        ("a.zip", zipped({"good.bvh": b"", "./.fetch": b"x"}), "'.fetch' is in .fetch, where downloads lie"),
        ("a.tar.gz", tarred(("a", b"1"), ("a/b.bvh", b"x")), "its member 'a/b.bvh' is under 'a'"),
        ("a.tar.gz", tarred(("good.bvh", b""), (".fetch/s/b", b"x")), "where downloads lie"),
        ("a.tar.gz", nul_tar(), "'a\\x00.bvh' is no name of a file"),
        ("a.zip", linked_zip(), "a link or a device"),
        ("a.zip", encrypted_zip(), "encrypted"),
        ("a.tar.gz", tarred(("good.bvh", b""), ("../a.bvh", b"x")), "a path out of its folder"),
        ("a.tar.gz", tarred(("good.bvh", b""), ("/tmp/a.bvh", b"x")), "an absolute path"),
        ("a.tar.gz", tarred(("good.bvh", b""), special(tarfile.SYMTYPE)), "a link or a device"),
        ("a.tar.gz", tarred(("b.bvh", b""), special(tarfile.LNKTYPE)), "a link or a device"),
        ("a.tar.gz", tarred(("good.bvh", b""), special(tarfile.FIFOTYPE)), "a link or a device"),
        ("a.zip", zipped({"good.bvh": b"", "bomb.bvh": bytes(2**24)}), "100 times its size"),
        ("a.tar.gz", tarred(("good.bvh", b""), ("bomb.bvh", bytes(2**24))), "100 times its size"),
    ],
)
def test_unsafe_archives_are_refused_and_nothing_is_written(tmp_path, name, content, said):
    with pytest.raises(Refused, match=re.escape(said)):
        unpacked(tmp_path, name, content)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == [name]


def test_one_unsafe_archive_keeps_all_of_a_set_from_being_written(tmp_path):
    (tmp_path / "a.zip").write_bytes(zipped({"a.bvh": b"1"}))
    (tmp_path / "b.zip").write_bytes(zipped({"../b.bvh": b"2"}))
    (tmp_path / "in").mkdir()
    with pytest.raises(Refused, match=r"b\.zip is not unpacked"):
        unpack([tmp_path / "a.zip", tmp_path / "b.zip"], tmp_path / "in", lambda path: True, no_progress)
    assert list((tmp_path / "in").iterdir()) == []


def spoilt(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + b"spoilt" + content[middle + 6 :]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.zip", b"<html>sign in</html>"),
        ("a.zip", zipped({"a.bvh": BIG})[:-5]),
        ("a.tar.gz", tarred(("a.bvh", BIG))[:-400]),
        ("a.tar.gz", gzip.compress(b"no tar", mtime=0)),
        ("a.tar.bz2", b"BZh9 but not more"),
        (
            "a.tar.bz2",
            spoilt(bz2.compress(gzip.decompress(tarred(("a.bvh", random.Random(0).randbytes(10**6)))))),
        ),
    ],
)
def test_damaged_archives_are_removed(tmp_path, name, content):
    with pytest.raises(Refused, match="damaged or no archive"):
        unpacked(tmp_path, name, content)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == []


def test_a_checksum_that_does_not_fit_is_damage(tmp_path):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as packed:
        packed.writestr("a.bvh", b"abcabc")
    with pytest.raises(Refused, match="damaged or no archive"):
        unpacked(tmp_path, "a.zip", out.getvalue().replace(b"abcabc", b"xxxxxx"))
    assert list((tmp_path / "in/here").iterdir()) == []


def test_a_link_that_is_there_already_is_not_followed_out(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "in/here").mkdir(parents=True)
    (tmp_path / "in/here/b").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(Refused, match="through a link"):
        unpacked(tmp_path, "a.zip", zipped({"b/a.bvh": b"x"}))
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_a_name_that_the_disk_does_not_take_is_told(tmp_path):
    name = "x" * 300 + ".bvh"
    with pytest.raises(Refused, match=rf"a\.zip: its member '{name}' cannot .*: File name too long"):
        unpacked(tmp_path, "a.zip", zipped({name: b"x"}))
    assert list((tmp_path / "in/here").iterdir()) == []


@pytest.mark.parametrize(("there", "name"), [("a", "a/b/c.bvh"), ("a/b.bvh/c", "a/b.bvh")])
def test_what_is_in_the_way_is_told(tmp_path, there, name):
    place = tmp_path / "in/here" / there
    place.parent.mkdir(parents=True)
    place.write_bytes(b"old")
    with pytest.raises(Refused, match=rf"a\.zip: its member '{name}' cannot be written .*in the way"):
        unpacked(tmp_path, "a.zip", zipped({name: b"x"}))
    assert [path for path in (tmp_path / "in/here").rglob("*") if path.is_file()] == [place]


def test_a_set_does_not_unpack_into_its_downloads(tmp_path, site, motionary):
    file = registry(tmp_path, site, {"a.zip": zipped({".fetch/small/b.bvh": b"b"}), "b.zip": zipped({})})
    folder = tmp_path / "set"
    code, _, err = motionary("fetch", "small", folder, "--accept-licence", "--registry", file)
    assert code == 1
    assert "'.fetch/small/b.bvh' is in .fetch, where downloads lie" in err
    assert not (folder / ".fetch/small/b.bvh").exists()


def test_no_room_to_unpack_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda path: shutil._ntuple_diskusage(9, 9, 3))
    with pytest.raises(Refused, match="no room to unpack"):
        unpacked(tmp_path, "a.zip", zipped({"a.bvh": b"four"}))


def test_clips_are_what_a_run_reads():
    assert clips_among(["b.bvh", "a.AMC", "a.asf", "readme.txt", "LICENSE"]) == ["a.AMC", "b.bvh"]


def test_a_wrong_file_put_there_by_hand_is_told(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"not it")
    nobody = transfer.SetFile(name="a.zip", url="http://127.0.0.1:9/a.zip", digest=f"md5:{'0' * 32}")
    with pytest.raises(Refused, match="what is there now, 6 bytes, has not the published digest md5:0"):
        download(nobody, tmp_path, "http://source.example", Told())
