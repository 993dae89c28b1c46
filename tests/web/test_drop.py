"""A file dropped on the page: what is told of it, what it may cost, and that nothing of it stays."""

import json
import re
import socket
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.web import drop
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.readers.markers import MARKER_SETS, terms_of
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from tests.web.serving import served, tree

WALK = "walk/walk_tired_alex_01.bvh"


@pytest.fixture(scope="module")
def client(demo_catalog):
    with served(demo_catalog) as client:
        yield client


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch) -> Path:
    """The folder of temporary files, which must be empty at the end."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield folder
    wait_until(lambda: not [*folder.glob("motionary-*")])


def wait_until(fulfilled, seconds: float = 20) -> None:
    end = time.monotonic() + seconds
    while not fulfilled() and time.monotonic() < end:
        time.sleep(0.05)
    assert fulfilled()


def sent(client, *files: tuple[str, bytes]):
    listed = json.dumps([{"name": name, "size": len(content)} for name, content in files])
    given = {"X-Motionary-Files": quote(listed), "Content-Type": "application/octet-stream"}
    return client.post("/drop", content=b"".join(content for _, content in files), headers=given)


def scene(page: str) -> dict:
    return json.loads(re.search(r'id="dropped-scene">(.*?)</script>', page, re.DOTALL)[1])


def nearest(page: str) -> list[str]:
    return re.findall(r'data-beside="/data/figure\?clip=([^"&]*)', page)


def test_a_bvh_of_the_library_finds_itself(client, demo_library, demo_catalog):
    before = tree(demo_catalog)
    page = sent(client, ("some take.bvh", (demo_library / WALK).read_bytes())).text
    assert nearest(page)[0] == quote(WALK, safe="")
    assert [one["name"] for one in scene(page)["figures"]] == ["some take.bvh", WALK]
    assert re.search(r"belongs to cluster.*?would be called <strong><bdi>walk</bdi>", page, re.DOTALL)
    assert "confidence" in page
    assert "It is the same motion as the nearest" in page
    assert tree(demo_catalog) == before


def test_what_is_told_is_what_the_catalog_answers(client, demo_library, demo_catalog, tmp_path):
    """Of a file that it does not hold: half of a take."""
    text = (demo_library / "run/run_tired_bea_01.bvh").read_text().splitlines(keepends=True)
    at = next(number for number, line in enumerate(text) if line.startswith("Frames:"))
    half = (len(text) - at - 2) // 2
    content = "".join([*text[:at], f"Frames: {half}\n", text[at + 1], *text[at + 2 : at + 2 + half]]).encode()
    (tmp_path / "half.bvh").write_bytes(content)
    page = sent(client, ("half.bvh", content)).text
    with Catalog.open(demo_catalog) as catalog:
        near = catalog.similar(tmp_path / "half.bvh", 8).table.to_pylist()
        (row,) = catalog.assign(tmp_path / "half.bvh").to_pylist()
        why = catalog.explain(tmp_path / "half.bvh", near[0]["clip_id"])
    assert nearest(page) == [quote(one["clip_id"], safe="") for one in near]
    told = re.sub(r"<[^>]*>|\s+", " ", page)
    if row["status"] == "assigned":
        assert f"belongs to cluster {row['cluster_id']}" in re.sub(" +", " ", told)
    else:
        assert row["reason"] in told
    assert f"Why it is {near[0]['distance']:.3f} from the nearest" in told
    for point in why.curve:
        assert f"{point.distance:.3f}" in page


def test_an_amc_and_its_asf_are_read_together(client, shared_data):
    pairs = shared_data / "pairs"
    body, motion = (pairs / "01.asf").read_bytes(), (pairs / "01_01.amc").read_bytes()
    for files in (
        [("x.asf", body), ("01_01.amc", motion)],
        [("a_120.AMC", motion), ("other name.ASF", body)],
    ):
        answer = sent(client, *files)
        assert answer.status_code == 200, answer.text
        assert "frames at 120 a second" in answer.text
        assert len(nearest(answer.text)) == 8


def test_amass(client, tmp_path):
    frames, width = 60, 156
    poses = np.zeros((frames, width))
    poses[:, 0] = np.pi / 2
    poses[:, 12] = np.linspace(0, 1, frames)
    np.savez_compressed(
        tmp_path / "t.npz", poses=poses, trans=np.zeros((frames, 3)), mocap_framerate=60.0, betas=np.zeros(16)
    )
    answer = sent(client, ("take_poses.npz", (tmp_path / "t.npz").read_bytes()))
    assert answer.status_code == 200
    assert len(nearest(answer.text)) == 8


def test_c3d(client, tmp_path):
    ezc3d = pytest.importorskip("ezc3d")
    markers = sorted({term for joint in MARKER_SETS[0].joints.values() for term in terms_of(joint)})
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = markers
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    points = np.ones((4, len(markers), 30))
    points[:3] = np.random.default_rng(0).normal(size=(3, len(markers), 1)) * 500
    file["data"]["points"] = points
    file.write(str(tmp_path / "t.c3d"))
    answer = sent(client, ("take.c3d", (tmp_path / "t.c3d").read_bytes()))
    assert answer.status_code == 200
    assert "dropped-scene" in answer.text


BAD = [
    ([("take.bvh", b"HIERARCHY\nROOT Hips\n{\n OFFSET 0 0\n")], 422, "line 4"),
    ([("take.bvh", b"")], 422, "It cannot be looked at"),
    ([("take.npz", b"PK\x05\x06" + bytes(18))], 422, "It cannot be looked at"),
    ([("take.c3d", b"\x02P" + bytes(510))], 422, "It cannot be looked at"),
    ([("take.zip", b"PK")], 415, ".zip is not read here"),
    ([("take", b"x")], 415, "such a file is not read here"),
    ([("a.bvh", b"x"), ("b.bvh", b"x")], 415, "of which 2 are motions"),
    ([("a.amc", b"x")], 415, "an AMC came without its ASF"),
    ([("a.bvh", b"x"), ("a.asf", b"x")], 415, "an ASF came with a BVH"),
    ([("a.amc", b"1\nroot 0\n"), ("a.asf", b"nonsense")], 422, "It cannot be looked at"),
    ([(f"{n}.bvh", b"") for n in range(500)], 415, "of which 500 are motions"),
]


@pytest.mark.parametrize(("files", "status", "told"), BAD)
def test_what_cannot_be_looked_at_is_told_with_its_mend(client, temporary, files, status, told):
    answer = sent(client, *files)
    assert (answer.status_code, told in answer.text) == (status, True), answer.text
    assert str(temporary) not in answer.text
    assert "dropped-scene" not in answer.text


@pytest.mark.parametrize("listed", ["[" * 20_000, '[{"name": "a.bvh", "size": 1e400}]'])
def test_a_list_of_files_that_is_none_is_told(client, listed):
    headers = {"X-Motionary-Files": quote(listed), "Origin": str(client.base_url).rstrip("/")}
    answer = client.post("/drop", content=b"x", headers=headers)
    assert (answer.status_code, "names and sizes" in answer.text) == (400, True)


def test_a_name_that_no_file_can_have_harms_nothing(client):
    headers = {
        "X-Motionary-Files": quote('[{"name": "\\ud800.bvh", "size": 1}]'),
        "Origin": str(client.base_url).rstrip("/"),
    }
    answer = client.post("/drop", content=b"x", headers=headers)
    assert (answer.status_code, "cannot be looked at" in answer.text) == (422, True)


def test_a_skeleton_that_no_convention_fits_can_be_played(client):
    skeleton = "HIERARCHY\nROOT blob\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    arm = "JOINT arm\n{\nOFFSET 0 1 0\nCHANNELS 1 Xrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\n"
    text = skeleton + arm + "MOTION\nFrames: 20\nFrame Time: 0.0333333\n" + "0 0 0 10\n" * 20
    answer = sent(client, ("blob.bvh", text.encode()))
    assert answer.status_code == 200, answer.text
    assert "It can be played, but not compared" in answer.text
    assert [one["name"] for one in scene(answer.text)["figures"]] == ["blob.bvh"]


@pytest.mark.parametrize(
    "name",
    ["../../../etc/cron.d/take.bvh", "/etc/passwd.bvh", "C:\\windows\\take.bvh", "a\x00b.bvh", "%2e%2e/x.bvh",
     "<script>alert(1)</script>.bvh", "x" * 400 + ".bvh", "\u202egnp.bvh", "'\"&.bvh", "..bvh",
     "a\r\nX: y.bvh",
     "$(touch x).bvh", "é\ud83d.bvh".encode("utf-8", "surrogatepass").decode("utf-8", "replace")],
)  # fmt: skip
def test_a_name_is_text_and_no_path(client, demo_library, temporary, name):
    around = {file for file in temporary.parent.rglob("*")}
    answer = sent(client, (name, (demo_library / WALK).read_bytes()))
    assert answer.status_code in (200, 415), answer.text  # "..bvh" has no suffix
    assert "<script>alert" not in answer.text
    wait_until(lambda: {file for file in temporary.parent.rglob("*")} == around)


def test_what_is_written_to_disk_is_called_by_plain_letters(demo_library):
    one = drop.Sent("Ä b_120.AMC", 1)
    assert drop._named([one, drop.Sent("x.asf", 1)])[1] == {
        one: "__b_120.amc", drop.Sent("x.asf", 1): "__b_120.asf",
    }  # fmt: skip


def raw(client, head: str, body: bytes = b"") -> socket.socket:
    connection = socket.create_connection((client.base_url.host, client.base_url.port), timeout=30)
    origin = str(client.base_url).rstrip("/")
    connection.sendall(
        f"POST /drop HTTP/1.1\r\nHost: {client.base_url.netloc.decode()}\r\n"
        f"Origin: {origin}\r\n{head}\r\n\r\n".encode()
        + body
    )
    return connection


def answer_on(connection: socket.socket) -> str:
    """Read one answer; what the server did not read of the file may keep the connection open after it."""
    got = b""
    while not _whole(got) and (more := connection.recv(65536)):
        got += more
    return got.decode()


def _whole(answer: bytes) -> bool:
    head, ended, body = answer.partition(b"\r\n\r\n")
    size = re.search(rb"(?i)content-length: (\d+)", head)
    return bool(ended and size) and len(body) >= int(size[1])


def announced(size: int) -> str:
    listed = quote(json.dumps([{"name": "a.bvh", "size": size}]))
    return f"Content-Length: {size}\r\nX-Motionary-Files: {listed}"


def test_too_large_a_file_is_refused_before_it_comes(client):
    with raw(client, announced(10**12)) as connection:
        answer = answer_on(connection)
    assert " 413 " in answer.splitlines()[0]
    assert f"1000000.0 MB were given, and {drop.LARGEST / 1e6:.0f} MB are looked at" in answer


@pytest.mark.parametrize(
    "head",
    [
        "Content-Length: 3",
        "Content-Length: 3\r\nX-Motionary-Files: %5B%5D",
        "Content-Length: 3\r\nX-Motionary-Files: 7",
        "Content-Length: 4\r\n" + announced(3).split("\r\n")[1],
        "Transfer-Encoding: chunked\r\n" + announced(3).split("\r\n")[1],
        "Content-Length: -3\r\n" + announced(-3).split("\r\n")[1],
        "Content-Length: 3\r\nX-Motionary-Files: %FF",
    ],
)
def test_what_does_not_say_what_comes_is_refused(client, head):
    with raw(client, head) as connection:
        assert " 400 " in answer_on(connection).splitlines()[0]


def test_what_comes_too_slowly_is_given_up(client, temporary, monkeypatch):
    monkeypatch.setattr(drop, "SLOWEST", 0.5)
    with raw(client, announced(1000), b"HIERARCHY") as connection:
        wait_until(lambda: [*temporary.iterdir()])
        answer = answer_on(connection)
    assert " 408 " in answer.splitlines()[0]


def test_what_breaks_off_leaves_nothing(client, temporary):
    with raw(client, announced(1000), b"HIERARCHY"):
        wait_until(lambda: [*temporary.iterdir()])
    wait_until(lambda: not [*temporary.iterdir()])


def test_few_are_looked_at_together_and_the_place_is_free_again(client, demo_library, temporary):
    open_ = [raw(client, announced(1000), b"HIER") for _ in range(drop._MOST_WAITING)]
    wait_until(lambda: len([*temporary.iterdir()]) == drop._MOST_WAITING)
    assert sent(client, ("a.bvh", b"x")).status_code == 503
    for connection in open_:
        connection.close()
    wait_until(lambda: not [*temporary.iterdir()])
    assert sent(client, ("a.bvh", (demo_library / WALK).read_bytes())).status_code == 200


def test_one_is_read_at_a_time(client, demo_library, monkeypatch):
    at_work, most = 0, 0
    read = drop._read

    def counted(*given):
        nonlocal at_work, most
        at_work += 1
        most = max(most, at_work)
        time.sleep(0.2)
        at_work -= 1
        return read(*given)

    monkeypatch.setattr(drop, "_read", counted)
    content = (demo_library / WALK).read_bytes()
    threads = [threading.Thread(target=sent, args=(client, ("a.bvh", content))) for _ in range(3)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert most == 1


def test_a_store_that_is_slow_keeps_no_other_page_waiting(client, demo_library, monkeypatch):
    """What a dropped file is compared with is opened in a thread, not where all requests are taken."""
    asked, answers = threading.Event(), threading.Event()
    opened = drop.shown_to

    def slow(request):
        asked.set()
        assert answers.wait(30)
        return opened(request)

    monkeypatch.setattr(drop, "shown_to", slow)
    thread = threading.Thread(target=sent, args=(client, ("a.bvh", (demo_library / WALK).read_bytes())))
    thread.start()
    try:
        assert asked.wait(30)
        assert client.get("/static/style.css", timeout=10).status_code == 200
    finally:
        answers.set()
        thread.join()


def test_a_damaged_catalog_is_not_one_without_clips(demo_catalog, demo_library, monkeypatch, client):
    def damaged(*given):
        raise CatalogError("a part is damaged")

    monkeypatch.setattr(drop, "_compared", damaged)
    answer = sent(client, ("a.bvh", (demo_library / WALK).read_bytes()))
    assert (answer.status_code, "a part is damaged" in answer.text) == (500, True)


def test_too_long_a_motion_is_refused_by_both_numbers(client, demo_library, monkeypatch):
    monkeypatch.setattr(drop, "LONGEST", 1.0)
    answer = sent(client, ("a.bvh", (demo_library / WALK).read_bytes()))
    assert answer.status_code == 413
    assert re.search(r"it lasts \d s, and 1 s are looked at", answer.text)


def test_zeros_that_unpack_to_much_more_are_refused(client, tmp_path):
    np.savez_compressed(
        tmp_path / "t.npz", poses=np.zeros((100_000, 156)), trans=np.zeros((100_000, 3)), mocap_framerate=60.0
    )
    content = (tmp_path / "t.npz").read_bytes()
    assert len(content) < 1_000_000
    answer = sent(client, ("bomb.npz", content))
    assert answer.status_code == 422
    assert "unpacks from" in answer.text


def test_a_catalog_without_clips_still_plays_it(tmp_path, demo_library, silent_progress):
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "bad.bvh").write_text("nothing")
    url = str(tmp_path / "catalog")
    run(Job([str(tmp_path / "library")], url, PipelineConfig(), workers=1), silent_progress)
    with served(url) as client:
        answer = sent(client, ("a.bvh", (demo_library / WALK).read_bytes()))
    assert answer.status_code == 200, answer.text
    assert "has no clips" in answer.text
