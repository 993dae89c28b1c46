"""The player in a real browser: what it shows is the motion, and what one does to it does what it says."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from motionary.catalog import Catalog
from motionary.catalog.views.assets import asset
from motionary.catalog.views.figures import clip_figure, figure_of, scene
from motionary.catalog.views.page import page as html_page
from motionary.catalog.views.player import json_in_script, play, player_html
from motionary.pipeline.features import sample_times
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import template

NASTY = [
    "</script><script>alert(1)</script>",
    "\"'<img src=x onerror=alert(1)>&amp;",
    "long " + "x" * 300,
    "\u202eright to left \u05e9\u05dc\u05d5\u05dd",
]


@pytest.fixture
def shown(page, tmp_path):
    """Return a way of opening a page with players of scenes, each built."""

    def show(*scenes: dict, before: str = "", after: str = ""):
        asked = "mountAll(); Object.assign(window, { createPlayer, mountAll });"
        script = f'<script type="module">\n{asset("player.js")}\n{asked}</script>'
        players = [player_html(one, name=f"p{k}") for k, one in enumerate(scenes)]
        file = tmp_path / "page.html"
        file.write_text(html_page("Players", [before, *players, after, script]), encoding="utf-8")
        page.goto(file.as_uri())
        page.wait_for_function("document.querySelector('.motionary-player').player")
        return page

    return show


@pytest.fixture(scope="module")
def demo(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def pair(demo):
    """Return a clip that its alignment slows and hastens, after its reference."""
    sql = "select clip_id, reference_id from alignments order by distortion desc limit 1"
    row = demo.sql(sql).to_pylist()[0]
    return [clip_figure(demo, row[name]) for name in ("reference_id", "clip_id")]


def call(page, expression: str, player: int = 0):
    return page.evaluate(f"(p => ({expression}))(document.getElementById('p{player}').player)")


def places(page, figure: int, seconds: float):
    return np.reshape(call(page, f"[...p.positions({figure}, {seconds!r})]"), (-1, 3))


def made_up(unit: float, frames: int, markers: bool) -> Motion:
    rng = np.random.default_rng(frames)
    skeleton = Skeleton(("a", "b", "c", "d"), (-1, 0, 1, 1), unit * rng.normal(size=(4, 3)))
    seen = unit * rng.normal(size=(frames, 4, 3)).cumsum(axis=0)
    seen[:, 0] = 0
    root = 1e3 * unit + unit * rng.normal(size=(frames, 3)).cumsum(axis=0)
    turned = rng.normal(size=(frames, 0 if markers else 4, 4))
    return Motion(f"{unit:g}", skeleton, 48.0, root, turned, places=seen if markers else None)


def test_places_are_those_of_the_motions(shown):
    motions = [template("walk"), replace(template("kick"), fps=24.0)]
    motions += [
        made_up(unit, frames, markers) for unit in (1e-6, 1e6) for frames in (1, 40) for markers in (0, 1)
    ]
    page = shown(scene([figure_of(one) for one in motions]))
    for index, motion in enumerate(motions):
        figure = figure_of(motion)
        times = sample_times(motion.frames, motion.fps, figure.fps)
        true = motion.sampled(times).positions()
        for frame in {0, 1, len(times) // 2, len(times) - 1} & set(range(len(times))):
            got = places(page, index, frame / figure.fps)
            np.testing.assert_allclose(got, true[frame], rtol=0, atol=0.5001 * figure.scale)


@pytest.mark.parametrize(
    "file",
    [
        "bandai/dataset-1_walk_masculinity_001.bvh",
        "hdm05/HDM_dg_kickLFront1Reps_015_120.amc",
        "cmu/006_14.bvh",
    ],
)
def test_places_are_those_of_real_motions(shown, shared_data, file):
    motion = read_motion(shared_data / file)
    figure = figure_of(motion)
    page = shown(scene([figure]))
    times = sample_times(motion.frames, motion.fps, figure.fps)
    true = motion.sampled(times).positions()
    frames = range(0, len(times), max(1, len(times) // 12))
    got = [places(page, 0, frame / figure.fps) for frame in frames]
    np.testing.assert_allclose(got, true[frames], rtol=0, atol=0.5001 * figure.scale)


def test_aligned_is_what_the_warp_says(shown, demo, pair):
    page = shown(scene(pair))
    raw = places(page, 1, 0.5)
    np.testing.assert_allclose(raw, pair[1].positions()[15], atol=1e-6 * pair[1].size)
    call(page, "p.set({aligned: true})")
    assert call(page, "p.state.aligned")
    assert call(page, "p.state.duration") == pytest.approx((len(pair[1].warp_times) - 1) / pair[1].warp_fps)
    figure = pair[1]
    every = figure.positions()
    for frame in range(0, len(figure.warp_times), 7):
        place = min(float(np.float32(figure.warp_times[frame])) * figure.fps, figure.frames - 1)
        before = min(int(place), figure.frames - 2)
        true = every[before] + (place - before) * (every[before + 1] - every[before])
        got = places(page, 1, frame / figure.warp_fps)
        np.testing.assert_allclose(got, true, rtol=0, atol=1e-5 * figure.size)
    page.get_by_role("button", name="Aligned").click()
    assert not call(page, "p.state.aligned")
    np.testing.assert_array_equal(places(page, 1, 0.5), raw)


@pytest.mark.parametrize("backwards", [False, True])
def test_the_pose_stays_when_the_clock_changes(shown, pair, backwards):
    reference, clip = pair
    if backwards:
        clip = replace(clip, warp_times=clip.warp_times[::-1])
    page = shown(scene([reference, clip]))
    span = float(np.ptp(clip.warp_times))
    for moment in (clip.warp_times.min() + span * np.array([0.1, 0.45, 0.8])).tolist():
        call(page, f"p.set({{aligned: false}}), p.seek({moment!r})")
        before = places(page, 1, call(page, "p.state.time"))
        page.get_by_role("button", name="Aligned").click()
        assert call(page, "p.state.aligned")
        np.testing.assert_allclose(places(page, 1, call(page, "p.state.time")), before, atol=1e-4 * clip.size)
        page.get_by_role("button", name="Aligned").click()
        assert call(page, "p.state.time") == pytest.approx(moment, abs=1e-5)
    # Over already, it is at its end; and what is not offered changes nothing.
    call(page, "p.set({aligned: true}), p.seek(99), p.set({aligned: false})")
    assert call(page, "p.state.time") == pytest.approx(clip.warp_times[-1], abs=1e-5)
    page = shown(scene([figure_of(template("walk"))]))
    call(page, "p.seek(.5), p.set({aligned: true})")
    assert call(page, "p.state.time") == 0.5


def test_plays_pauses_and_scrubs(shown):
    page = shown(scene([figure_of(template("walk"))]))
    page.get_by_role("button", name="Play", exact=True).click()
    page.wait_for_function("document.getElementById('p0').player.time > .1")
    page.get_by_role("button", name="Pause").click()
    assert not call(page, "p.state.playing")
    stopped = call(page, "p.state.time")
    page.wait_for_timeout(100)
    assert call(page, "p.state.time") == stopped
    slider = page.get_by_role("slider", name="Time")
    slider.fill("1")
    assert call(page, "p.state.time") == pytest.approx(1)
    assert slider.get_attribute("aria-valuetext").startswith("1.00 of ")
    call(page, "p.seek(99)")
    assert call(page, "p.state.time === p.state.duration")
    call(page, "p.set({loop: false, speed: 4}), p.seek(0), p.play()")
    page.wait_for_function("!document.getElementById('p0').player.state.playing")
    assert call(page, "p.state.time === p.state.duration")


def test_every_key_does_what_the_help_says(shown, pair):
    page = shown(scene(pair))
    call(page, "p.set({inPlace: false})")
    canvas = page.locator("#p0 canvas")
    canvas.focus()
    page.keyboard.press("?")
    assert page.get_by_text("a second back, on").is_visible()
    page.keyboard.press("?")
    assert not page.get_by_text("a second back, on").is_visible()
    for keys, time in (
        (["ArrowRight"] * 3, 0.1),
        (["ArrowLeft"], 2 / 30),
        (["Shift+ArrowRight"], 1 + 2 / 30),
        (["Home"], 0),
    ):
        for key in keys:
            page.keyboard.press(key)
        assert call(page, "p.state.time") == pytest.approx(time)
    page.keyboard.press("End")
    assert call(page, "p.state.time === p.state.duration")
    for key, name, on in (
        ("a", "aligned", True), ("o", "layout", "overlaid"), ("r", "colour", "residual"),
        ("c", "contacts", True), ("p", "inPlace", True), ("l", "loop", False),
    ):  # fmt: skip
        before = call(page, f"p.state.{name}")
        page.keyboard.press(key)
        assert call(page, f"p.state.{name}") == on
        page.keyboard.press(key)
        assert call(page, f"p.state.{name}") == before
    page.keyboard.press("t")
    assert call(page, "p.state.trails.length") == 4
    for key, view in (("2", "side"), ("3", "top"), ("1", "front"), ("4", "free")):
        page.keyboard.press(key)
        assert call(page, "p.state.view") == view
    page.keyboard.press("+")
    assert call(page, "p.camera.zoom") < 1
    page.keyboard.press("Space")
    assert call(page, "p.state.playing")
    page.get_by_role("button", name="Pause").focus()
    page.keyboard.press("Space")
    assert not call(page, "p.state.playing")


def test_figures_in_place_and_followed_ones_stay_in_view(shown, pair):
    page = shown(scene(pair, layout="overlaid"))
    call(page, "p.set({inPlace: false})")
    hips = "p.figures.map((one) => [...one.drawnJoint(one.ownTime(p.duration / 2, false), 0)])"
    first, second = np.array(call(page, hips))
    assert np.hypot(*(first - second)[[0, 2]]) > 0.05
    call(page, "p.set({inPlace: true})")
    first, second = np.array(call(page, hips))
    np.testing.assert_allclose(first[[0, 2]], 0, atol=1e-9)
    np.testing.assert_allclose(second[[0, 2]], 0, atol=1e-9)
    call(page, "p.set({inPlace: false, follow: true, layout: 'side'})")
    for share in (0, 0.4, 0.8, 1):
        for view in ("front", "side", "top"):
            call(page, f"p.set({{view: {view!r}}}), p.seek(p.duration * {share}), p.draw()")
            seen = np.array(call(page, "p.figures.flatMap((one) => [...one.screen])")).reshape(-1, 3)
            width, height = call(page, "[p.canvas.width, p.canvas.height]")
            assert ((seen[:, :2] >= 0) & (seen[:, :2] <= [width, height])).all()


def test_pointer_turns_moves_and_zooms(shown):
    page = shown(scene([figure_of(template("walk"))]), after='<div style="height: 3000px"></div>')
    box = page.locator("#p0 canvas").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(*middle)
    page.mouse.wheel(0, 100)
    page.wait_for_function("scrollY > 0")
    assert call(page, "p.camera.zoom") == 1
    page.evaluate("scrollTo(0, 0)")
    yaw = call(page, "p.camera.yaw")
    page.mouse.down()
    page.mouse.move(middle[0] + 50, middle[1])
    page.mouse.up()
    assert call(page, "p.camera.yaw") < yaw
    assert call(page, "p.state.view") == "free"
    page.mouse.wheel(0, 100)
    page.wait_for_function("document.getElementById('p0').player.camera.zoom > 1")
    assert page.evaluate("scrollY") == 0
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(middle[0], middle[1])
    page.mouse.up()
    assert call(page, "p.camera.across") != 0


def test_what_makes_no_sense_is_not_offered(shown, pair):
    still = Motion(
        "m", Skeleton(("a", "b"), (-1, 0), np.eye(2, 3)), 30, np.zeros((1, 3)), [[[0, 0, 0, 1]] * 2]
    )
    page = shown(scene([figure_of(still)], layout="overlaid", aligned=True, colour="residual"))
    assert page.get_by_role("button").all_text_contents() == ["?"]
    assert not page.get_by_role("slider").is_visible()
    assert page.get_by_role("combobox").count() == 1
    state = call(page, "p.state")
    assert (state["layout"], state["aligned"], state["colour"]) == ("side", False, "plain")
    page = shown(scene(pair))
    assert {"Aligned", "Overlaid", "Residual", "Contacts"} <= set(
        page.get_by_role("button").all_text_contents()
    )
    strangers = [pair[1], replace(pair[0], reference="another")]
    unnamed = figure_of(template("walk"))
    unwarped = replace(pair[1], warp_times=None)
    # To two references; a reference alone; one with a time of its own beside others.
    for figures in (strangers, [pair[0]], [unnamed, pair[1]], [*pair, unnamed], [pair[0], unwarped]):
        page = shown(scene(figures))
        assert "Aligned" not in page.get_by_role("button").all_text_contents()
    by_hand = replace(pair[1], clip_id=None, reference=None)
    # Alone; beside its reference, which needs no warp to itself; to a reference without a name.
    for figures in ([pair[1]], [replace(pair[0], warp_times=None), pair[1]], [by_hand]):
        page = shown(scene(figures))
        assert "Aligned" in page.get_by_role("button").all_text_contents()


def test_the_legend_tells_which_is_the_reference_and_the_frame_of_each_file(shown, pair):
    page = shown(scene(pair))
    reference, member = page.locator(".motionary-player li").all_inner_texts()
    assert "reference" in reference
    assert "reference" not in member
    figure = pair[1]
    for frame in (0, 1, figure.frames // 2):
        call(page, f"p.seek({frame / figure.fps!r})")
        told = f"frame {round(frame / figure.fps * figure.source_fps)} at {figure.source_fps:g}/s"
        assert told in page.locator(".motionary-player li").nth(1).inner_text()


def test_esc_closes_the_list_of_keys(shown, pair):
    page = shown(scene(pair))
    page.locator("canvas").click()
    page.keyboard.press("?")
    assert page.get_by_text("play or pause").is_visible()
    page.keyboard.press("Escape")
    assert not page.get_by_text("play or pause").is_visible()


def test_the_camera_keeps_figures_large(shown):
    walk = template("walk")
    end = np.linspace(0, 1, walk.frames)[:, None]
    far = 20 * walk.positions()[0, :, 1].max()
    left, right = (replace(walk, root_position=walk.root_position + end * [x, 0, 0]) for x in (-far, far))
    page = shown(
        scene([figure_of(template("wave"))]),
        scene([figure_of(left)]),
        scene(list(map(figure_of, (left, right)))),
    )
    for player, (follow, in_place) in enumerate([(False, False), (True, False), (False, True)]):
        page.locator(f"#p{player}").scroll_into_view_if_needed()
        page.wait_for_function(f"document.getElementById('p{player}').player")
        state = call(page, "p.state", player)
        assert (state["follow"], state["inPlace"]) == (follow, in_place)


def test_residual_and_contacts_follow_their_frames(shown, pair):
    page = shown(scene(pair, aligned=True))
    figure = pair[1]
    figures = "p.figures[1]"
    for frame in range(0, len(figure.residual), 9):
        time = frame / figure.warp_fps
        own = call(page, f"{figures}.ownTime({time!r}, true)")
        assert call(page, f"{figures}.referenceFrame({time!r}, {own!r}, true)") == frame
        found = call(page, f"{figures}.referenceFrame(99, {own!r}, false)")
        assert figure.warp_times[found] == pytest.approx(own, abs=1e-6)
        got = call(page, f"{figures}.joints.map((_, joint) => {figures}.heatAt({frame}, joint))")
        np.testing.assert_allclose(got, figure.residual[frame] / 255 * figure.residual_max, rtol=1e-9)
    for frame in range(0, figure.frames, 5):
        standing = call(page, f"{figures}.standing({frame / figure.fps!r})")
        assert standing == [joint for joint, on in figure.contacts.items() if on[frame]]


def test_few_joints_and_unknown_rigs_are_drawn(shown):
    walk = template("walk")
    names = [walk.skeleton.names[joint] for joint in (0, 3, 4, 5)]
    arms = figure_of(walk, joints=[name for name in walk.skeleton.names if "Arm" in name or "Hand" in name])
    page = shown(scene([figure_of(walk, joints=names), figure_of(made_up(1, 40, True)), arms]))
    call(page, "p.set({trails: ['a', 'left_wrist', 'nowhere']}), p.seek(.5), p.draw()")
    pixels = "new Uint32Array(p.pen.getImageData(0, 0, p.canvas.width, p.canvas.height).data.buffer)"
    assert call(page, f"new Set({pixels}).size") > 50


def test_hostile_names_are_shown_as_text(shown, pair, accessible, screenshot):
    figures = [replace(pair[k % 2], name=name, label=name) for k, name in enumerate(NASTY)]
    page = shown(scene(figures))
    assert page.locator("#p0 li bdi.name").all_text_contents() == NASTY
    assert page.locator("img").count() == 0
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert NASTY[0] in page.locator("#p0 canvas").get_attribute("aria-label")
    accessible(page)
    screenshot(page, "names")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [320, 1280])
def test_is_drawn_and_accessible(page, shown, pair, accessible, screenshot, scheme, width):
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 900})
    shown(scene(pair, colour="residual", trails=["left_wrist"]), before="<h1>Players</h1>")
    call(page, "p.set({contacts: true}), p.seek(.6)")
    page.keyboard.press("Tab")
    page.keyboard.press("?")
    page.wait_for_timeout(100)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    pixels = "p.pen.getImageData(0, 0, p.canvas.width, p.canvas.height).data.buffer"
    used = call(page, f"new Set(new Uint32Array({pixels})).size")
    assert used > 100
    accessible(page)
    screenshot(page, f"{scheme}-{width}")


def test_still_players_do_not_draw_and_one_loop_serves_all(page, shown):
    page.add_init_script(
        "window.asked = 0; const ask = requestAnimationFrame;"
        "window.requestAnimationFrame = (act) => (window.asked++, ask(act));"
    )
    walk = scene([figure_of(template("walk"))])
    shown(walk, walk, walk, after='<div style="height: 4000px"></div>')
    page.evaluate("scrollTo(0, 400)")
    page.wait_for_function("[0, 1].every((k) => document.getElementById(`p${k}`).player)")
    # Playwright's own waiting for a condition asks for frames as well, unless it looks at intervals.
    page.wait_for_timeout(200)
    page.evaluate("window.asked = 0")
    page.wait_for_timeout(200)
    assert page.evaluate("asked") == 0
    counted = """(p) => { p.draws = 0; const draw = p.draw.bind(p);
        p.draw = () => { p.draws++; draw(); }; p.play(); }"""
    page.evaluate(f"[0, 1].forEach((k) => ({counted})(document.getElementById(`p${{k}}`).player))")
    page.wait_for_function(
        "[0, 1].every((k) => document.getElementById(`p${k}`).player.draws > 5)", polling=50
    )
    asked, *draws = page.evaluate(
        "[window.asked, ...[0, 1].map((k) => document.getElementById(`p${k}`).player.draws)]"
    )
    assert asked <= max(draws) + 2
    page.evaluate("scrollTo(0, 3900)")
    page.wait_for_function(
        "!document.getElementById('p0').player.visible && !document.getElementById('p1').player.visible"
    )
    page.wait_for_timeout(100)
    stopped = [call(page, "[p.time, p.draws]", k) for k in (0, 1)]
    page.wait_for_timeout(150)
    assert [call(page, "[p.time, p.draws]", k) for k in (0, 1)] == stopped
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_function(f"document.getElementById('p0').player.draws > {stopped[0][1]}")


def test_player_far_down_is_built_when_it_comes_into_view(shown):
    walk = scene([figure_of(template("walk"))])
    page = shown(walk, walk, before="", after="")
    page.evaluate("document.getElementById('p1').remove()")
    page.evaluate(
        """() => {
        const [far, late] = [0, 1].map(() => document.createElement("div"));
        far.style.height = "5000px";
        Object.assign(late, { className: "motionary-player", id: "late" });
        late.dataset.scene = "p0-scene";
        document.body.append(far, late); }"""
    )
    page.evaluate("mountAll()")
    page.wait_for_timeout(150)
    assert page.evaluate("document.getElementById('late').player === undefined")
    page.evaluate("document.getElementById('late').scrollIntoView()")
    page.wait_for_function("document.getElementById('late').player")
    assert page.locator("#p0 canvas").count() == 1


@pytest.mark.parametrize(("motion", "plays"), [("no-preference", True), ("reduce", False)])
def test_starts_by_itself_only_where_motion_is_welcome(page, shown, motion, plays):
    page.emulate_media(reduced_motion=motion)
    shown(scene([figure_of(template("walk"))]))
    playing = page.evaluate(
        """() => { const data = JSON.parse(document.getElementById("p0-scene").textContent);
        return createPlayer(document.body, data, { autoplay: true }).state.playing; }"""
    )
    assert playing is plays


def test_anywidget_entry_follows_its_scene(page):
    """As anywidget calls it: the file is a module whose default has `render({model, el})`."""
    first, second = (scene([figure_of(template(name), name=name)]) for name in ("walk", "kick"))
    page.goto("about:blank")
    page.set_content(
        f"<main id=here></main><script type=application/json id=s>{json_in_script([first, second])}</script>"
    )
    page.evaluate(
        """async (text) => {
        const blob = new Blob([text], { type: "text/javascript" });
        const { default: widget } = await import(URL.createObjectURL(blob));
        const scenes = JSON.parse(document.getElementById("s").textContent);
        const heard = {};
        const model = { scene: scenes[0], get: (key) => model[key], on: (what, act) => (heard[what] = act),
          off: (what) => delete heard[what] };
        window.change = () => { model.scene = scenes[1]; heard["change:scene"](); };
        window.heard = heard;
        window.clean = widget.render({ model, el: document.getElementById("here") });
        }""",
        asset("player.js"),
    )
    names = page.locator("#here li bdi.name")
    assert names.all_text_contents() == ["walk"]
    page.evaluate("change()")
    assert names.all_text_contents() == ["kick"]
    page.evaluate("clean()")
    assert page.locator("#here canvas").count() == 0
    assert page.evaluate("Object.keys(heard)") == []


def test_notebook_page_plays_in_its_frame(page, tmp_path):
    """As a rendered notebook shows it, without a kernel."""
    file = tmp_path / "notebook.html"
    file.write_text(
        f"<!DOCTYPE html><html lang=en><title>n</title><main>{play(template('walk'))._repr_html_()}</main>"
    )
    page.goto(file.as_uri())
    frame = page.frame_locator("iframe")
    frame.get_by_role("button", name="Play", exact=True).click()
    frame.get_by_role("button", name="Pause").wait_for()
    clock = frame.locator(".clock")
    page.frames[1].wait_for_function("document.querySelector('.motionary-player').player.time >= .01")
    assert re.match(r"\d\.\d\d / ", clock.inner_text())
    assert not clock.inner_text().startswith("0.00")


def test_broken_scene_says_so(shown, page, tmp_path):
    shown(scene([figure_of(template("walk"))]))
    page.evaluate(
        """() => {
        const [bad, data] = ["div", "script"].map((tag) => document.createElement(tag));
        Object.assign(bad, { className: "motionary-player", id: "bad" }).dataset.scene = "bad-scene";
        Object.assign(data, { type: "application/json", id: "bad-scene" });
        data.textContent = JSON.stringify({ figures: [{ name: "x" }] });
        document.body.prepend(data, bad); }"""
    )
    page.evaluate("mountAll()")
    page.wait_for_function("document.getElementById('bad').textContent.includes('cannot be played')")
    assert json.loads(page.locator("#p0-scene").text_content())["figures"]
