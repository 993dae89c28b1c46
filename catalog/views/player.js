// Plays motions as figures that can be turned, scrubbed and compared. One file for the notebook (anywidget), the
// report (inlined) and the web page; it needs nothing but a browser. `figures.py` makes the scenes it takes.
//
// World: right-handed, Y up, a figure facing +Z has its left at +X, as everywhere in motionary. Figures are drawn at
// one size (the longest chain of bones is 1), stand on the floor, and begin at their own place facing the viewer.
//
// In reading order: createPlayer, mountAll and anywidget's entry; then, each below a ruler, the player; the one loop;
// figures (which moment is shown, and where its joints are); what is offered; the camera; drawing; colours; pointer
// and keyboard; controls, with the template.

/**
 * Build a player of a scene in an element; the answer is its handle: play(), pause(), seek(seconds), step(frames),
 * set({speed, layout, aligned, colour, trails, contacts, inPlace, follow, loop, view}), state, positions(figure,
 * seconds), load(scene), destroy(). Options: `height` of the picture in pixels, `autoplay`.
 */
export function createPlayer(element, scene, options = {}) {
  const player = new Player(element, options);
  try {
    player.load(scene);
  } catch (error) {
    player.destroy();
    throw error;
  }
  if (options.autoplay && !matchMedia("(prefers-reduced-motion: reduce)").matches) player.play();
  return player;
}

/** Build a player in every `.motionary-player` below `root`, each when it is scrolled into view. */
export function mountAll(root = document) {
  const seen = new IntersectionObserver(
    (entries) => {
      for (const { isIntersecting, target } of entries) {
        if (!isIntersecting) continue;
        seen.unobserve(target);
        mount(target);
      }
    },
    { rootMargin: "200px" },
  );
  for (const element of root.querySelectorAll(".motionary-player")) {
    if (element.dataset.mounted) continue;
    element.dataset.mounted = "waiting";
    element.style.minHeight = "360px"; // else all of a page would lie in view at first
    seen.observe(element);
  }
}

async function mount(element) {
  try {
    const scene = await sceneOf(element);
    if (!element.isConnected) return; // the page has gone on meanwhile
    element.style.minHeight = "";
    element.player = createPlayer(element, scene);
    element.dataset.mounted = "yes";
  } catch (error) {
    element.dataset.mounted = "failed";
    element.textContent = `This motion cannot be played: ${error.message}`;
  }
}

async function sceneOf(element) {
  if (element.dataset.scene) return JSON.parse(document.getElementById(element.dataset.scene).textContent);
  const answer = await fetch(element.dataset.sceneUrl);
  if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
  return answer.json();
}

/** The entry of anywidget: `model.get("scene")` is what is played. */
export default {
  render({ model, el }) {
    const player = createPlayer(el, model.get("scene"));
    const reload = () => player.load(model.get("scene"));
    model.on("change:scene", reload);
    return () => {
      model.off?.("change:scene", reload);
      player.destroy();
    };
  },
};

// ---- the player: settings, the clock, what holds the figures

class Player {
  constructor(element, options) {
    this.options = options;
    this.host = document.createElement("div");
    this.root = this.host.attachShadow({ mode: "open" });
    this.root.innerHTML = TEMPLATE;
    this.canvas = this.root.querySelector("canvas");
    this.pen = this.canvas.getContext("2d");
    this.settings = {
      speed: 1, layout: "side", aligned: false, colour: "plain", trails: [], contacts: false, inPlace: false,
      follow: false, loop: true, view: "front",
    };
    this.time = this.duration = 0;
    this.playing = false;
    this.visible = true;
    this.finest = 2; // pixels of the canvas for one of the page
    this.slow = 0;
    this.figures = [];
    this.camera = new Camera();
    element.append(this.host);
    this.controls = new Controls(this);
    this.watch();
  }

  load(scene) {
    this.figures = scene.figures.map((made, index) => new Figure(made, index));
    this.offer = offered(this.figures);
    this.hottest = hottestOf(this.figures);
    this.time = 0;
    this.playing = false;
    const { layout = "side", aligned = false, colour = "plain", trails = [] } = scene;
    Object.assign(this.settings, { layout, aligned, colour, trails });
    this.controls.show();
    this.allow();
    Object.assign(this.settings, { follow: false, inPlace: false });
    this.arrange();
    const going = this.box.footprint;
    this.set({ inPlace: true });
    // Of one that goes far the camera goes along; several would part, or run into each other.
    const far = going > 1.6 * this.box.footprint;
    if (!far || this.figures.length === 1) this.set({ inPlace: false, follow: far });
  }

  play() {
    if (this.time >= this.duration) this.time = 0;
    this.playing = this.duration > 0;
    this.last = null;
    this.changed();
  }

  pause() {
    this.playing = false;
    this.changed();
  }

  seek(seconds) {
    this.time = Math.min(Math.max(seconds, 0), this.duration);
    this.changed();
  }

  step(frames) {
    this.playing = false;
    this.seek((Math.round(this.time * this.rate) + frames) / this.rate);
  }

  set(changes) {
    const { aligned } = this.settings;
    const warped = this.figures.find(isWarped);
    const own = warped?.ownTime(this.time, aligned);
    Object.assign(this.settings, changes);
    this.allow();
    if ("view" in changes) this.camera.look(changes.view);
    if (["layout", "aligned", "follow", "inPlace", "view"].some((key) => key in changes)) this.arrange();
    // The pose stays: what is compared is that moment in the other time, not another one.
    if (this.settings.aligned !== aligned) this.time = warped.clockTime(own, !aligned);
    this.changed();
  }

  get state() {
    return { time: this.time, duration: this.duration, playing: this.playing, ...this.settings };
  }

  /** Where a figure's joints are (3 J) at a time of the player's clock, in the source's units. */
  positions(figure, seconds = this.time) {
    const one = this.figures[figure];
    return one.positions(one.ownTime(seconds, this.settings.aligned));
  }

  destroy() {
    waiting.delete(this);
    this.ends.abort();
    this.host.remove();
  }

  // What makes no sense for these figures stays off.
  allow() {
    const { settings, offer } = this;
    if (!offer.aligned) settings.aligned = false;
    if (!offer.overlaid) settings.layout = "side";
    if (!offer.residual) settings.colour = "plain";
    if (!offer.contacts) settings.contacts = false;
  }

  // Where each figure begins, how long it all takes, and a camera that sees it.
  arrange() {
    const { aligned, layout } = this.settings;
    this.duration = Math.max(...this.figures.map((one) => one.duration(aligned)));
    this.rate = Math.max(...this.figures.map((one) => (aligned && one.warp ? one.warp.fps : one.fps)));
    this.time = Math.min(this.time, this.duration);
    const reach = Math.max(...this.figures.map((one) => one.reach));
    const apart = layout === "side" ? Math.min(Math.max(1.5 * reach, 0.7), 2) : 0;
    const [x, , z] = this.camera.row;
    this.figures.forEach((one, index) => {
      const place = apart * (index - (this.figures.length - 1) / 2);
      one.place = [place * x, place * z];
      one.inPlace = this.settings.inPlace;
    });
    this.box = this.room(this.settings.follow);
    this.camera.fit(this.box, this.canvas.width / this.canvas.height);
  }

  // What holds every pose, seen from where the camera looks at that moment.
  room(follow) {
    const box = new Box();
    const moments = Math.min(80, Math.ceil(this.duration * 10) + 1);
    for (let k = 0; k < moments; k++) {
      const time = (this.duration * k) / Math.max(moments - 1, 1);
      const [x, z] = follow ? this.middle(time) : [0, 0];
      for (const one of this.figures) {
        const places = one.drawn(one.ownTime(time, this.settings.aligned));
        for (let p = 0; p < places.length; p += 3) box.add([places[p] - x, places[p + 1], places[p + 2] - z]);
      }
    }
    return box;
  }

  // Between the figures' roots, over a second so that the camera does not shake with every step.
  middle(time) {
    let x = 0;
    let z = 0;
    for (let k = -2; k <= 2; k++) {
      for (const one of this.figures) {
        const root = one.drawnJoint(one.ownTime(Math.max(time + k / 4, 0), this.settings.aligned), 0);
        x += root[0] / (5 * this.figures.length);
        z += root[2] / (5 * this.figures.length);
      }
    }
    return [x, z];
  }

  changed() {
    this.controls.update();
    ask(this);
  }

  // One picture, and the next if time goes on. Called by the one loop that all players of a page share.
  advance(now) {
    if (!this.visible) return;
    if (this.playing) {
      const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.1); // a hidden tab stands still
      this.last = now;
      this.spare(passed);
      this.time += passed * this.settings.speed;
      if (this.time >= this.duration) {
        if (this.settings.loop) this.time %= this.duration;
        else [this.time, this.playing] = [this.duration, false];
      }
      this.controls.update();
      ask(this);
    }
    this.draw();
  }

  // Without a graphics card twice the pixels are too many: coarser, then, rather than jerky.
  spare(passed) {
    this.slow = Math.max(0, this.slow + (passed > 1 / 45 ? 1 : -1));
    if (this.slow < 20 || this.finest === 1) return;
    this.finest = 1;
    this.resize();
  }

  draw() {
    const [x, z] = this.settings.follow ? this.middle(this.time) : [0, 0];
    this.camera.aim(this.box, x, z, this.canvas.width, this.canvas.height);
    paint(this);
  }

  watch() {
    this.ends = new AbortController();
    const { signal } = this.ends;
    const inView = new IntersectionObserver((entries) => {
      this.visible = entries.at(-1).isIntersecting;
      this.last = null;
      if (this.visible) ask(this);
    });
    const sized = new ResizeObserver(() => this.resize());
    inView.observe(this.host);
    sized.observe(this.canvas);
    signal.addEventListener("abort", () => [inView, sized].forEach((one) => one.disconnect()));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour(), { signal });
    pointing(this, signal);
    this.root.addEventListener("keydown", (event) => pressed(this, event), { signal });
    this.recolour();
  }

  resize() {
    const fine = Math.min(devicePixelRatio || 1, this.finest);
    const { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * fine));
    this.canvas.height = Math.max(1, Math.round(clientHeight * fine));
    if (this.box) this.camera.fit(this.box, this.canvas.width / this.canvas.height);
    this.recolour();
  }

  recolour() {
    if (!this.host.isConnected) return; // taken out of the page it has no colours
    this.inks = inksOf(this.host);
    this.host.style.setProperty("--cool", this.inks.cool);
    this.host.style.setProperty("--hot", this.inks.hot);
    ask(this);
  }
}

// ---- the one loop: it runs only while something plays or has changed

const waiting = new Set();
let asked = false;

function ask(player) {
  waiting.add(player);
  if (!asked) requestAnimationFrame(tick);
  asked = true;
}

function tick(now) {
  const round = [...waiting];
  waiting.clear();
  asked = false;
  for (const player of round) player.advance(now);
}

// ---- figures

class Figure {
  constructor(made, index) {
    const { positions, ...rest } = made;
    Object.assign(this, rest);
    this.index = index;
    this.count = made.joints.length;
    this.values = unpacked(bytesOf(positions), made.frames, 3 * this.count);
    this.times = made.warp ? new Float32Array(bytesOf(made.warp.times).buffer) : null;
    this.heat = made.residual ? bytesOf(made.residual.values) : null;
    this.stands = made.contacts ? bytesOf(made.contacts.bits) : null;
    this.now = new Float64Array(3 * this.count);
    this.out = new Float64Array(3 * this.count);
    this.screen = new Float64Array(3 * this.count);
    this.cos = Math.cos(made.turn);
    this.sin = Math.sin(made.turn);
    this.place = [0, 0];
    this.inPlace = false;
    Object.assign(this, shapeOf(made));
    this.reach = this.widest();
  }

  duration(aligned) {
    return aligned && this.times ? (this.times.length - 1) / this.warp.fps : this.seconds;
  }

  /** This motion's own seconds at a time of the player's clock; one that is over holds its last frame. */
  ownTime(time, aligned) {
    if (!aligned || !this.times) return Math.min(time, this.seconds);
    const place = Math.min(time * this.warp.fps, this.times.length - 1);
    const before = Math.floor(place);
    const after = Math.min(before + 1, this.times.length - 1);
    const own = this.times[before] + (place - before) * (this.times[after] - this.times[before]);
    return Math.min(own, this.seconds);
  }

  /** The reverse: the first time of the player's clock that shows this motion nearest to its own seconds. */
  clockTime(own, aligned) {
    if (!aligned || !this.times) return own;
    const { times } = this;
    let [place, least] = [0, Infinity];
    for (let k = 0; k < times.length; k++) {
      const step = k + 1 < times.length ? times[k + 1] - times[k] : 0; // below 0 where it plays backwards
      const share = step ? Math.min(Math.max((own - times[k]) / step, 0), 1) : 0;
      const off = Math.abs(times[k] + share * step - own);
      if (off < least) [place, least] = [k + share, off];
    }
    return place / this.warp.fps;
  }

  /** The frame of the reference at a time of the player's clock, which in its own time shows `own`. */
  referenceFrame(time, own, aligned) {
    if (!this.times) return 0;
    const clock = aligned ? time : this.clockTime(own, true);
    return Math.min(Math.round(clock * this.warp.fps), this.times.length - 1);
  }

  // The values from the k-th to the m-th between two frames; a whole frame's as they are.
  sample(own, k = 0, m = 3 * this.count) {
    const { values, now, frames } = this;
    const place = Math.min(own * this.fps, frames - 1);
    const whole = Math.abs(place - Math.round(place)) < 1e-6;
    const before = whole ? Math.round(place) : Math.floor(place);
    const share = whole ? 0 : place - before;
    const from = before * 3 * this.count;
    const to = Math.min(before + 1, frames - 1) * 3 * this.count;
    for (; k < m; k++) now[k] = values[from + k] + share * (values[to + k] - values[from + k]);
    return now;
  }

  positions(own) {
    return Float64Array.from(this.sample(own), (value, k) => this.origin[k % 3] + this.scale * value);
  }

  /** The joints as they are drawn: of one size, on the floor, from their own place, facing the viewer at first. */
  drawn(own) {
    const now = this.sample(own);
    this.hold(now);
    for (let k = 0; k < now.length; k += 3) this.put(now, k, this.out);
    return this.out;
  }

  /** One of them, left in `spot`. */
  drawnJoint(own, joint) {
    this.hold(this.sample(own, 0, 3));
    spot.set(this.sample(own, 3 * joint, 3 * joint + 3).subarray(3 * joint, 3 * joint + 3));
    this.put(spot, 0, spot);
    return spot;
  }

  // What stands over the figure's place: the root as it begins, or as it is.
  hold(now) {
    const [x, z] = this.inPlace ? [now[0], now[2]] : [this.values[0], this.values[2]];
    this.rootX = x * this.scale;
    this.rootZ = z * this.scale;
  }

  put(from, k, to) {
    const { scale, size, cos, sin, place } = this;
    const x = (from[k] * scale - this.rootX) / size;
    const z = (from[k + 2] * scale - this.rootZ) / size;
    to[k] = x * cos - z * sin + place[0];
    to[k + 1] = (from[k + 1] * scale + this.origin[1] - this.floor) / size;
    to[k + 2] = z * cos + x * sin + place[1];
  }

  /** How far a joint is from the reference's at a frame of it, leg lengths. */
  heatAt(frame, joint) {
    if (!this.heat || !this.times) return 0;
    const columns = this.heat.length / this.times.length;
    return (this.heat[frame * columns + this.residual.column[joint]] / 255) * this.residual.max;
  }

  /** The joints that stand on the floor. */
  standing(own) {
    if (!this.stands) return [];
    const frame = Math.round(Math.min(own * this.fps, this.frames - 1));
    const { joints } = this.contacts;
    return joints.filter((_, k) => {
      const bit = frame * joints.length + k;
      return (this.stands[bit >> 3] >> (bit & 7)) & 1;
    });
  }

  jointOf(name) {
    return this.body[name] ?? this.joints.indexOf(name);
  }

  widest() {
    let widest = 0;
    const step = Math.max(1, Math.floor(this.frames / 40));
    for (let frame = 0; frame < this.frames; frame += step) {
      const row = frame * 3 * this.count;
      for (let k = 0; k < 3 * this.count; k += 3) {
        const x = this.values[row + k] - this.values[row];
        const z = this.values[row + k + 2] - this.values[row + 2];
        widest = Math.max(widest, Math.hypot(x, z));
      }
    }
    return (widest * this.scale) / this.size;
  }
}

// How thick a figure is at each joint, in body sizes, and which joints are of its right side.
const THICK = {
  pelvis: 0.05, spine: 0.05, chest: 0.052, neck: 0.026, head: 0.026, shoulder: 0.034, elbow: 0.026, wrist: 0.02,
  hip: 0.046, knee: 0.034, ankle: 0.024, toe: 0.016,
};

function shapeOf({ joints, parents, body }) {
  const canonical = new Map(Object.entries(body).map(([name, joint]) => [joint, name]));
  const thick = new Float64Array(joints.length);
  const right = new Uint8Array(joints.length);
  parents.forEach((parent, joint) => {
    const name = canonical.get(joint);
    const part = name?.replace(/^(left|right)_/, "");
    thick[joint] = part ? THICK[part] : canonical.size ? 0.007 : 0.022;
    right[joint] = name ? Number(name.startsWith("right")) : parent >= 0 ? right[parent] : 0;
  });
  if (!canonical.size) return { thick, right };
  // A joint between two canonical ones, such as a clavicle, is nearly as thick as the one it leads to.
  const leads = joints.map((_, joint) => canonical.has(joint));
  for (let joint = joints.length - 1; joint > 0; joint--) {
    const parent = parents[joint];
    if (parent < 0 || !leads[joint] || canonical.has(parent)) continue;
    thick[parent] = Math.max(thick[parent], 0.8 * thick[joint]);
    leads[parent] = true;
  }
  // Of the others fingers and toes are drawn. Twist bones and faces are inside what is drawn already.
  const ends = joints.map((_, joint) => /wrist|ankle|toe/.test(canonical.get(joint)));
  parents.forEach((parent, joint) => {
    if (!canonical.has(joint) && parent >= 0) ends[joint] = ends[parent];
    if (!leads[joint] && !ends[joint]) thick[joint] = 0;
  });
  return { thick, right };
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

// The reverse of `packed` in figure_data.py: second differences in time, one byte each or -128 and then four.
function unpacked(stream, frames, width) {
  const values = new Int16Array(frames * width);
  const view = new DataView(stream.buffer);
  let at = 0;
  for (let k = 0; k < values.length; k++) {
    let turn = view.getInt8(at++);
    if (turn === -128) {
      turn = view.getInt32(at, true);
      at += 4;
    }
    const last = k >= width ? values[k - width] : 0;
    const step = k >= 2 * width ? last - values[k - 2 * width] : 0;
    values[k] = last + step + turn;
  }
  return values;
}

// What the strongest colour means: what 98 of 100 joints stay under, for one that flies off would leave the rest pale.
function hottestOf(figures) {
  const counts = figures.filter((one) => one.heat && one.residual.max > 0).map((one) => {
    const of256 = new Float64Array(256);
    for (const value of one.heat) of256[value]++;
    let [value, left] = [255, 0.02 * one.heat.length];
    while (value > 1 && (left -= of256[value]) > 0) value--;
    return (value / 255) * one.residual.max;
  });
  return Math.max(0, ...counts) || 1;
}

// ---- what is offered

// Whether its alignment changes its time; that of a reference to itself does not.
function isWarped({ warp, clip_id }) {
  return Boolean(warp) && (clip_id === null || warp.reference !== clip_id);
}

// Whether all of them have a place in the time of one reference: by a warp to it, or by being it.
function alignable(figures) {
  const warped = figures.find(isWarped);
  if (!warped) return false;
  const { reference } = warped.warp;
  const is = ({ clip_id }) => clip_id !== null && clip_id === reference;
  return figures.every((one) => (one.warp ? one.warp.reference === reference : is(one)));
}

// Which settings make sense for these figures.
function offered(figures) {
  return {
    time: figures.some((one) => one.frames > 1),
    overlaid: figures.length > 1,
    aligned: alignable(figures),
    residual: figures.some((one) => one.heat && one.times && one.residual.max > 0),
    contacts: figures.some((one) => one.stands),
    trails: figures.some((one) => TRAILS.hips[0] in one.body),
  };
}

// ---- the camera

const VIEWS = { front: [0.4, 0.2], side: [Math.PI / 2, 0.1], top: [0, 1.5] }; // yaw and pitch
const FIELD = Math.tan((14 * Math.PI) / 180); // of half the angle of view

class Box {
  constructor() {
    this.low = [Infinity, 0, Infinity];
    this.high = [-Infinity, 0.5, -Infinity];
    this.points = [];
  }

  add(point) {
    for (let k = 0; k < 3; k++) {
      if (point[k] < this.low[k]) this.low[k] = point[k];
      if (point[k] > this.high[k]) this.high[k] = point[k];
    }
    this.points.push(point);
  }

  get footprint() {
    return Math.max(this.high[0] - this.low[0], this.high[2] - this.low[2]);
  }

  get middle() {
    return this.low.map((value, k) => (value + this.high[k]) / 2);
  }
}

class Camera {
  constructor() {
    this.free = null;
    this.look("front");
  }

  look(view) {
    const [yaw, pitch] = VIEWS[view] ?? this.free ?? [this.yaw, this.pitch];
    Object.assign(this, { yaw, pitch, zoom: 1, across: 0, up: 0 });
    if (view in VIEWS) this.row = this.axes()[0]; // along which figures stand, so that none hides another
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(Math.max(this.pitch + pitch, -0.2), 1.55);
    this.free = [this.yaw, this.pitch];
  }

  magnify(factor) {
    this.zoom = Math.min(Math.max(this.zoom / factor, 0.1), 8);
  }

  move(across, up) {
    this.across += across * this.distance * FIELD;
    this.up += up * this.distance * FIELD;
  }

  /** Stand as far away as shows every point of the box, and a head's width more. */
  fit({ points, middle: [x, y, z] }, aspect) {
    const [right, up, back] = this.axes();
    const wide = FIELD * (aspect || 16 / 9);
    this.far = 0.5;
    for (const one of points) {
      const point = [one[0] - x, one[1] - y, one[2] - z];
      const side = Math.max((Math.abs(dot(point, right)) + 0.2) / wide, (Math.abs(dot(point, up)) + 0.17) / FIELD);
      this.far = Math.max(this.far, dot(point, back) + side);
    }
  }

  aim(box, x, z, width, height) {
    const [right, up, back] = this.axes();
    const middle = box.middle;
    this.distance = this.far * this.zoom;
    this.target = [0, 1, 2].map((k) => middle[k] + [x, 0, z][k] + this.across * right[k] + this.up * up[k]);
    Object.assign(this, { rightward: right, upward: up, back, width, height, focal: height / 2 / FIELD });
  }

  /** Write a point's place on the canvas, and how many pixels one is long there, into `out` from `at`. */
  project(x, y, z, out, at) {
    const { target, rightward: r, upward: u, back: b } = this;
    const [dx, dy, dz] = [x - target[0], y - target[1], z - target[2]];
    const depth = Math.max(this.distance - (dx * b[0] + dy * b[1] + dz * b[2]), 0.05);
    const scale = this.focal / depth;
    out[at] = this.width / 2 + (dx * r[0] + dy * r[1] + dz * r[2]) * scale;
    out[at + 1] = this.height / 2 - (dx * u[0] + dy * u[1] + dz * u[2]) * scale;
    out[at + 2] = scale;
  }

  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[cy, 0, -sy], [-sy * sp, cp, -cy * sp], [sy * cp, sp, cy * cp]];
  }
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// ---- drawing, from the floor up

const COLOURS = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"]; // those of colours.py
const TRAIL = 1.5; // seconds
const spot = new Float64Array(3); // where a function leaves one point for its caller

function paint(player) {
  const { pen, canvas, camera, settings } = player;
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.lineCap = pen.lineJoin = "round";
  drawGrid(player);
  const shown = player.figures.map((figure) => {
    const own = figure.ownTime(player.time, settings.aligned);
    const places = figure.drawn(own);
    for (let k = 0; k < places.length; k += 3) {
      camera.project(places[k], places[k + 1], places[k + 2], figure.screen, k);
    }
    return { figure, own, frame: figure.referenceFrame(player.time, own, settings.aligned) };
  });
  for (const { figure } of shown) drawShadow(player, figure);
  if (settings.contacts) for (const { figure, own } of shown) drawContacts(player, figure, own);
  drawBodies(player, shown);
  for (const name of settings.trails) for (const { figure } of shown) drawTrail(player, figure, figure.jointOf(name));
}

// Lines a quarter of a body apart, fading with distance from where the camera looks.
function drawGrid({ pen, camera, inks, box }) {
  const cell = 0.25;
  const cells = Math.min(Math.max(Math.ceil((box.footprint * 0.75 + 0.6) / cell), 8), 28);
  const [x0, z0] = [Math.round(camera.target[0] / cell), Math.round(camera.target[2] / cell)];
  const paths = [0, 1, 2, 3, 4, 5].map(() => new Path2D());
  const line = (path, ax, az, bx, bz) => {
    camera.project(ax * cell, 0, az * cell, spot, 0);
    path.moveTo(spot[0], spot[1]);
    camera.project(bx * cell, 0, bz * cell, spot, 0);
    path.lineTo(spot[0], spot[1]);
  };
  for (let i = -cells; i <= cells; i++) {
    for (let k = -cells; k < cells; k++) {
      const away = Math.hypot(i, k + 0.5) / cells;
      if (away >= 1) continue;
      const faint = Math.min(2, Math.floor(3 * away));
      line(paths[faint + ((x0 + i) % 4 ? 0 : 3)], x0 + i, z0 + k, x0 + i, z0 + k + 1);
      line(paths[faint + ((z0 + i) % 4 ? 0 : 3)], x0 + k, z0 + i, x0 + k + 1, z0 + i);
    }
  }
  paths.forEach((path, k) => {
    pen.globalAlpha = [0.5, 0.34, 0.16][k % 3];
    pen.strokeStyle = k < 3 ? inks.line : inks.strong;
    pen.lineWidth = camera.height / 500;
    pen.stroke(path);
  });
  pen.globalAlpha = 1;
}

// What a lamp straight above would leave on the floor.
function drawShadow({ pen, camera, inks }, figure) {
  const { out, parents, thick, count } = figure;
  pen.strokeStyle = inks.shadow;
  const path = new Path2D();
  let wide = 0;
  for (let joint = 0; joint < count; joint++) {
    const parent = parents[joint];
    if (parent < 0 || thick[joint] < 0.01) continue;
    camera.project(out[3 * parent], 0, out[3 * parent + 2], spot, 0);
    path.moveTo(spot[0], spot[1]);
    camera.project(out[3 * joint], 0, out[3 * joint + 2], spot, 0);
    path.lineTo(spot[0], spot[1]);
    wide = spot[2];
  }
  pen.lineWidth = 0.07 * wide;
  pen.stroke(path);
}

function drawContacts({ pen, camera, inks }, figure, own) {
  for (const joint of figure.standing(own)) {
    const [x, z] = [figure.out[3 * joint], figure.out[3 * joint + 2]];
    pen.beginPath();
    for (let k = 0; k <= 24; k++) {
      const turn = (k * Math.PI) / 12;
      camera.project(x + 0.1 * Math.cos(turn), 0, z + 0.1 * Math.sin(turn), spot, 0);
      pen.lineTo(spot[0], spot[1]);
    }
    pen.fillStyle = mixed(inks.ground, inks.figures[figure.index % COLOURS.length], 0.35);
    pen.fill();
    pen.strokeStyle = inks.ink;
    pen.lineWidth = camera.height / 200;
    pen.stroke();
  }
}

// Of a head and a trunk.
const NEEDED = [
  "head", "neck", "chest", "pelvis", "left_shoulder", "right_shoulder", "left_hip", "right_hip",
];

// Every bone and head, the furthest first.
function drawBodies(player, shown) {
  const parts = [];
  for (const { figure, frame } of shown) {
    const { parents, screen, count, body } = figure;
    const near = (joint) => screen[3 * joint + 2];
    for (let joint = 0; joint < count; joint++) {
      const parent = parents[joint];
      if (parent < 0 || !figure.thick[joint]) continue;
      parts.push({ draw: drawBone, figure, frame, joint, parent, near: near(joint) + near(parent) });
    }
    if (!NEEDED.every((name) => name in body)) continue;
    parts.push({ draw: drawHead, figure, near: 2.04 * near(body.head) });
    parts.push({ draw: drawTrunk, figure, near: near(body.chest) + near(body.pelvis) - 0.04 });
  }
  parts.sort((a, b) => a.near - b.near);
  const nearest = parts.at(-1)?.near ?? 1;
  for (const part of parts) {
    const fog = Math.min(Math.max(1.6 * (1 - part.near / nearest), 0), 0.3);
    part.draw(player, part, fog);
  }
}

function drawBone(player, { figure, frame, joint, parent }, fog) {
  const { pen, inks, settings } = player;
  const { screen, thick } = figure;
  const near = Math.min(thick[parent], 1.5 * thick[joint]);
  const [x1, y1, r1] = [screen[3 * parent], screen[3 * parent + 1], near * screen[3 * parent + 2]];
  const [x2, y2, r2] = [screen[3 * joint], screen[3 * joint + 1], thick[joint] * screen[3 * joint + 2]];
  const heat = settings.colour === "residual" ? Math.min(figure.heatAt(frame, joint) / player.hottest, 1) : -1;
  capsule(pen, x1, y1, r1, x2, y2, r2 * (1 + 0.7 * Math.max(heat, 0)));
  const shade = shadeOf(inks, figure.index, heat, figure.right[joint], fog);
  fill(player, figure.index, shade, heat >= 0);
  if (heat <= 0.1) return;
  pen.beginPath();
  pen.arc(x2, y2, r2 * (0.9 + heat), 0, 2 * Math.PI);
  pen.fillStyle = shade.solid;
  pen.fill();
}

// Filled figures and hollow ones by turns, so that two laid over each other are told apart in grey.
// Where the colour is the residual's, their outlines have their own.
function fill({ pen, inks, camera, settings }, index, { solid, pale }, heated = false) {
  const hollow = index % 2 === 1 && !heated;
  pen.lineWidth = camera.height / (hollow ? 170 : 220);
  pen.strokeStyle = heated ? inks.figures[index % COLOURS.length] : hollow ? solid : inks.ground;
  pen.stroke();
  pen.globalAlpha = settings.layout === "overlaid" ? 0.75 : 1;
  pen.fillStyle = hollow ? pale : solid;
  pen.fill();
  pen.globalAlpha = 1;
}

function capsule(pen, x1, y1, r1, x2, y2, r2) {
  const length = Math.hypot(x2 - x1, y2 - y1);
  pen.beginPath();
  if (length <= Math.abs(r1 - r2)) {
    if (r1 > r2) pen.arc(x1, y1, r1, 0, 2 * Math.PI);
    else pen.arc(x2, y2, r2, 0, 2 * Math.PI);
    return;
  }
  const turn = Math.atan2(y2 - y1, x2 - x1);
  const open = Math.acos((r1 - r2) / length);
  pen.arc(x1, y1, r1, turn + open, turn - open + 2 * Math.PI);
  pen.arc(x2, y2, r2, turn - open, turn + open);
  pen.closePath();
}

// What is between shoulders and hips, so that one sees which way the body is turned.
function drawTrunk({ pen, inks, settings }, { figure }, fog) {
  const { screen, body } = figure;
  const corners = ["left_shoulder", "right_shoulder", "right_hip", "left_hip"].map((name) => 3 * body[name]);
  const { solid, pale } = shadeOf(inks, figure.index, settings.colour === "residual" ? 0 : -1, 0, fog);
  pen.beginPath();
  for (const k of corners) pen.lineTo(screen[k], screen[k + 1]);
  pen.closePath();
  pen.globalAlpha = 0.5;
  pen.fillStyle = pen.strokeStyle = figure.index % 2 ? pale : mixed(solid, pale, 0.45);
  pen.lineWidth = 0.04 * screen[corners[0] + 2];
  pen.stroke();
  pen.fill();
  pen.globalAlpha = 1;
}

// A head, with a nose for where it looks.
function drawHead(player, { figure }, fog) {
  const { pen, inks, camera } = player;
  const { out, body } = figure;
  const from = (a, b) => [0, 1, 2].map((k) => out[3 * body[a] + k] - out[3 * body[b] + k]);
  const up = unit(from("head", "neck"));
  const ahead = unit(cross(from("left_shoulder", "right_shoulder"), up));
  const at = (rise, forward) => {
    camera.project(...[0, 1, 2].map((k) => out[3 * body.head + k] + rise * up[k] + forward * ahead[k]), spot, 0);
    return [...spot];
  };
  const shade = shadeOf(inks, figure.index, -1, 0, fog);
  const [x, y, scale] = at(0.055, 0);
  const [nx, ny, near] = at(0.045, 0.105);
  const nose = () => {
    capsule(pen, nx, ny, 0.016 * near, ...at(0.045, 0.05).slice(0, 2), 0.026 * near);
    pen.fillStyle = shadeOf(inks, figure.index, -1, 1, fog).solid;
    pen.fill();
  };
  if (near < scale) nose();
  capsule(pen, x, y, 0.084 * scale, ...at(0.02, 0.012).slice(0, 2), 0.07 * scale);
  fill(player, figure.index, shade);
  if (near >= scale) nose();
}

function unit(vector) {
  const length = Math.hypot(...vector) || 1;
  return vector.map((value) => value / length);
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function drawTrail({ pen, camera, inks, time, settings }, figure, joint) {
  if (joint < 0) return;
  const first = Math.max(time - TRAIL, 0);
  const steps = Math.ceil((time - first) * 30);
  if (!steps) return;
  const points = [];
  for (let k = 0; k <= steps; k++) {
    const [x, y, z] = figure.drawnJoint(figure.ownTime(first + ((time - first) * k) / steps, settings.aligned), joint);
    camera.project(x, y, z, spot, 0);
    points.push([spot[0], spot[1]]);
  }
  pen.strokeStyle = inks.figures[figure.index % COLOURS.length];
  pen.lineWidth = camera.height / 220;
  for (let third = 0; third < 3; third++) {
    pen.globalAlpha = [0.3, 0.6, 1][third];
    pen.beginPath();
    const from = Math.floor((third * steps) / 3);
    for (let k = from; k <= Math.floor(((third + 1) * steps) / 3); k++) pen.lineTo(...points[k]);
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

// ---- colours: the page's, so that light and dark are its choice

function inksOf(host) {
  const { color, backgroundColor } = getComputedStyle(host);
  const [ink, ground] = [color, backgroundColor].map((colour) => mixed(colour, colour, 0));
  const dark = luminance(ground) < luminance(ink);
  return {
    ink, ground, dark,
    line: mixed(ground, ink, 0.3),
    strong: mixed(ground, ink, 0.6),
    shadow: dark ? "rgba(0,0,0,.55)" : "rgba(0,0,0,.13)",
    cool: mixed(ground, ink, 0.25),
    hot: dark ? "rgb(255,140,60)" : "rgb(190,60,0)",
    figures: COLOURS.map((colour) => (dark ? mixed(colour, ink, 0.15) : colour)),
    shades: new Map(),
  };
}

const STEPS = 16; // of residual and of fog: colours are mixed once, not for every bone of every picture

// A bone's colour: a figure's (residual -1) or that of how far it is off; the right side darker, the far one fainter.
function shadeOf(inks, figure, heat, right, fog) {
  const [hot, far] = [Math.round(heat * STEPS), Math.round(fog * STEPS)];
  const key = (((figure % COLOURS.length) * 64 + hot + STEPS) * 2 + right) * 64 + far;
  let shade = inks.shades.get(key);
  if (!shade) {
    const colour = heat < 0 ? inks.figures[figure % COLOURS.length] : mixed(inks.cool, inks.hot, hot / STEPS);
    const solid = mixed(right ? mixed(colour, inks.ink, 0.28) : colour, inks.ground, far / STEPS);
    shade = { solid, pale: mixed(inks.ground, solid, 0.25) };
    inks.shades.set(key, shade);
  }
  return shade;
}

function numbers(colour) {
  const hex = /^#(..)(..)(..)$/.exec(colour);
  if (hex) return hex.slice(1).map((part) => parseInt(part, 16));
  return colour.match(/[\d.]+/g).slice(0, 3).map(Number);
}

function mixed(from, to, share) {
  const [a, b] = [numbers(from), numbers(to)];
  return `rgb(${a.map((value, k) => Math.round(value + share * (b[k] - value))).join(",")})`;
}

function luminance(colour) {
  const [r, g, b] = numbers(colour);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

// ---- pointer and keyboard

function pointing(player, signal) {
  const { canvas, camera } = player;
  const held = new Map();
  const freed = () => {
    player.settings.view = "free";
    player.changed();
  };
  const listen = (name, heard, options = {}) => canvas.addEventListener(name, heard, { signal, ...options });
  listen("contextmenu", (event) => event.preventDefault());
  listen("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const name of ["pointerup", "pointercancel"]) listen(name, (event) => held.delete(event.pointerId));
  listen("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const here = [event.clientX, event.clientY];
    const [dx, dy] = [here[0] - before[0], here[1] - before[1]];
    const half = canvas.clientHeight / 2;
    const others = [...held].filter(([id]) => id !== event.pointerId);
    held.set(event.pointerId, here);
    if (others.length) {
      const [x, y] = others[0][1];
      const spread = Math.hypot(here[0] - x, here[1] - y) / Math.hypot(before[0] - x, before[1] - y);
      if (Number.isFinite(spread) && spread > 0) camera.magnify(spread);
      camera.move(-dx / half / 2, dy / half / 2);
    } else if (event.shiftKey || event.buttons & 6) camera.move(-dx / half, dy / half);
    else camera.turn(-dx / 150, dy / 150);
    freed();
  });
  // Without focus the wheel is the page's; with the control key it is a pinch.
  listen("wheel", (event) => {
    if (player.root.activeElement === null && !event.ctrlKey) return;
    event.preventDefault();
    camera.magnify(Math.exp(-event.deltaY / (event.ctrlKey ? 100 : 500)));
    freed();
  }, { passive: false });
}

function pressed(player, event) {
  const { tagName } = event.target;
  if (event.ctrlKey || event.metaKey || event.altKey || tagName === "SELECT") return;
  if (tagName === "BUTTON" && (event.key === " " || event.key === "Enter")) return;
  if (event.key === "Escape" && player.controls.helping) {
    event.preventDefault();
    event.stopPropagation();
    return player.controls.help();
  }
  const act = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!act) return;
  event.preventDefault();
  event.stopPropagation();
  act(player, event.shiftKey);
}

const onOff = (key) => (player) => player.set({ [key]: !player.settings[key] });
const zoomed = (factor) => (player) => {
  player.camera.magnify(factor);
  player.changed();
};
const KEYS = {
  " ": (player) => (player.playing ? player.pause() : player.play()),
  ArrowLeft: (player, second) => (second ? player.seek(player.time - 1) : player.step(-1)),
  ArrowRight: (player, second) => (second ? player.seek(player.time + 1) : player.step(1)),
  Home: (player) => player.seek(0),
  End: (player) => player.seek(player.duration),
  "+": zoomed(1.2), "=": zoomed(1.2), "-": zoomed(1 / 1.2), _: zoomed(1 / 1.2),
  1: (player) => player.set({ view: "front" }),
  2: (player) => player.set({ view: "side" }),
  3: (player) => player.set({ view: "top" }),
  4: (player) => player.set({ view: "free" }),
  a: onOff("aligned"), c: onOff("contacts"), f: onOff("follow"), l: onOff("loop"), p: onOff("inPlace"),
  o: (player) => player.set({ layout: player.settings.layout === "side" ? "overlaid" : "side" }),
  r: (player) => player.set({ colour: player.settings.colour === "plain" ? "residual" : "plain" }),
  t: (player) => player.set({ trails: player.settings.trails.length ? [] : TRAILS.both }),
  "?": (player) => player.controls.help(),
};

// ---- controls

const SPEEDS = [0.1, 0.25, 0.5, 1, 1.5, 2, 4];
const TRAILS = {
  hands: ["left_wrist", "right_wrist"],
  feet: ["left_ankle", "right_ankle"],
  both: ["left_wrist", "right_wrist", "left_ankle", "right_ankle"],
  hips: ["pelvis"],
  head: ["head"],
};

class Controls {
  constructor(player) {
    this.player = player;
    this.frames = [];
    this.part = (name) => player.root.querySelector(`[data-part="${name}"]`);
    const click = (name, act) => this.part(name).addEventListener("click", () => act(player));
    click("play", KEYS[" "]);
    click("back", KEYS.ArrowLeft);
    click("on", KEYS.ArrowRight);
    click("help", () => this.help());
    for (const [name, key] of Object.entries({ aligned: "a", overlaid: "o", residual: "r", contacts: "c", inPlace: "p", follow: "f", loop: "l" })) {
      click(name, KEYS[key]);
    }
    const choose = (name, act) => this.part(name).addEventListener("input", ({ target }) => act(target.value));
    choose("time", (value) => player.seek(Number(value)));
    choose("speed", (value) => player.set({ speed: Number(value) }));
    choose("view", (value) => player.set({ view: value }));
    choose("trails", (value) => player.set({ trails: TRAILS[value] ?? [] }));
  }

  /** Show what these figures can do, and what they are called. */
  show() {
    const { figures, offer, root, options, canvas, hottest } = this.player;
    for (const name of ["overlaid", "aligned", "residual", "contacts"]) this.part(name).hidden = !offer[name];
    for (const name of ["play", "back", "on", "time", "clock", "inPlace", "follow", "loop"]) this.part(name).hidden = !offer.time;
    this.part("speed").parentElement.hidden = !offer.time;
    this.part("trails").parentElement.hidden = !offer.trails || !offer.time;
    this.part("hottest").textContent = `${hottest.toFixed(2)} leg lengths, or more`;
    this.part("legend").replaceChildren(...figures.map(legendOf));
    this.frames = [...this.part("legend").querySelectorAll(".frame")];
    const names = figures.map((one) => one.name).join("; ");
    root.querySelector(".player").setAttribute("aria-label", `Motion player: ${names}`);
    canvas.setAttribute("aria-label", `${figures.length === 1 ? "Figure" : "Figures"} of ${names}; press ? for keys`);
    if (options.height) canvas.style.height = `${options.height}px`;
  }

  update() {
    const { playing, time, duration, settings, rate, host, figures } = this.player;
    this.part("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    this.part("play").classList.toggle("playing", playing);
    const bar = this.part("time");
    bar.max = duration;
    bar.step = 1 / (rate || 30);
    bar.value = time;
    bar.setAttribute("aria-valuetext", `${time.toFixed(2)} of ${duration.toFixed(2)} seconds`);
    bar.style.setProperty("--done", `${duration ? (100 * time) / duration : 0}%`);
    this.part("clock").textContent = `${time.toFixed(2)} / ${duration.toFixed(2)} s`;
    this.frames.forEach((place, index) => {
      const one = figures[index]; // frames of the file, from 0, as in the catalog's tables
      const frame = Math.round(one.ownTime(time, settings.aligned) * one.source_fps);
      place.textContent = `frame ${frame} at ${Number(one.source_fps.toFixed(2))}/s`;
    });
    const press = (name, on) => this.part(name).setAttribute("aria-pressed", String(on));
    for (const name of ["aligned", "contacts", "inPlace", "follow", "loop"]) press(name, settings[name]);
    press("overlaid", settings.layout === "overlaid");
    press("residual", settings.colour === "residual");
    this.part("scale").hidden = settings.colour !== "residual";
    this.part("speed").value = settings.speed;
    this.part("view").value = settings.view;
    const given = JSON.stringify(settings.trails);
    const known = Object.keys(TRAILS).find((name) => JSON.stringify(TRAILS[name]) === given);
    this.part("trails").value = known ?? (settings.trails.length ? "given" : "none");
    host.dataset.playing = playing;
  }

  get helping() {
    return !this.part("keys").hidden;
  }

  help() {
    this.part("keys").toggleAttribute("hidden");
    this.part("help").setAttribute("aria-expanded", String(this.helping));
  }
}

const SHAPES = [
  '<circle cx="8" cy="8" r="6"/>',
  '<rect x="2.5" y="2.5" width="11" height="11"/>',
  '<path d="M8 1 15 8 8 15 1 8Z"/>',
  '<path d="M8 1.5 15 14 1 14Z"/>',
];

function legendOf({ name, clip_id, label, seconds, index }, _, figures) {
  const item = document.createElement("li");
  const held = clip_id && figures.some((one) => one.clip_id !== clip_id && one.warp?.reference === clip_id);
  const colour = COLOURS[index % COLOURS.length];
  const fill = index % 2 ? `fill="${colour}" fill-opacity=".25"` : `fill="${colour}"`;
  item.innerHTML = `<svg viewBox="0 0 16 16" aria-hidden="true" ${fill} stroke="${colour}" stroke-width="2">${
    SHAPES[index % SHAPES.length]
  }</svg><bdi class="name"></bdi><bdi></bdi><span>${held ? "reference, " : ""}${seconds.toFixed(1)} s</span><span class="frame" aria-hidden="true"></span>`;
  const [named, labelled] = item.querySelectorAll("bdi");
  named.textContent = item.title = name;
  labelled.textContent = label ?? "";
  return item;
}

const option = ([value, text]) => `<option value="${value}">${text}</option>`;
const toggle = (name, text, hint) => `<button type="button" data-part="${name}" aria-pressed="false" title="${hint}"><span>${text}</span></button>`;

const TEMPLATE = `<style>
:host { display: block; --edge: var(--line, color-mix(in srgb, currentColor 25%, transparent));
  color: var(--ink, var(--jp-content-font-color1, CanvasText));
  background: var(--ground, var(--jp-layout-color0, Canvas)); font: 13px/1.4 system-ui, sans-serif; }
.player { border: 1px solid var(--edge); border-radius: 8px; overflow: hidden; position: relative; }
[hidden] { display: none !important; }
canvas { display: block; width: 100%; height: clamp(220px, 46vw, 420px); cursor: grab; touch-action: pan-y; }
canvas:focus { touch-action: none; }
canvas:active { cursor: grabbing; }
:focus-visible { outline: 2px solid var(--focus, #0072B2); outline-offset: -2px; }
.row { display: flex; flex-wrap: wrap; align-items: center; gap: 6px; padding: 6px 10px; }
button, select { font: inherit; color: inherit; background: transparent; border: 1px solid var(--edge);
  border-radius: 6px; min-height: 28px; padding: 2px 9px; cursor: pointer; }
select option { color: CanvasText; background: Canvas; }
button:hover, select:hover { border-color: currentColor; }
button[aria-pressed="true"] { background: currentColor; }
button[aria-pressed="true"] > span { color: var(--ground, var(--jp-layout-color0, Canvas)); }
button svg { width: 14px; height: 14px; fill: currentColor; display: block; }
.play { width: 38px; } .play .two, .play.playing .one { display: none; } .play.playing .two { display: block; }
.play svg { margin: auto; }
input[type=range] { flex: 1 1 120px; min-width: 80px; height: 24px; margin: 0; accent-color: #0072B2; }
.clock { font-variant-numeric: tabular-nums; }
label { display: inline-flex; align-items: center; gap: 5px; }
ul { list-style: none; margin: 0; padding: 8px 10px 0; display: flex; flex-wrap: wrap; gap: 2px 16px; }
li { display: flex; align-items: baseline; gap: 6px; max-width: 100%; min-width: 0; }
li svg { width: 11px; height: 11px; flex: none; align-self: center; }
li :is(bdi, span) { color: var(--quiet, inherit); white-space: nowrap; }
li bdi { overflow: hidden; text-overflow: ellipsis; min-width: 0; }
li .name { color: inherit; min-width: 6rem; }
li .frame { min-width: 7.5rem; font-variant-numeric: tabular-nums; }
.scale { padding: 6px 10px 0; display: flex; gap: 6px; align-items: center; }
.scale i { width: 110px; height: 9px; border-radius: 4px; border: 1px solid var(--edge);
  background: linear-gradient(90deg, var(--cool), var(--hot)); }
.keys { padding: 2px 12px 10px; columns: 15rem; margin: 0; }
.keys div { display: flex; gap: 8px; break-inside: avoid; } .keys dt { min-width: 6.5rem; font-weight: 600; }
.keys dd { margin: 0; }
</style>
<div class="player" role="group">
<ul data-part="legend"></ul>
<div class="scale" data-part="scale" hidden>Off the reference: 0 <i></i> <span data-part="hottest"></span></div>
<canvas tabindex="0" role="img"></canvas>
<div class="row">
<button type="button" class="play" data-part="play" aria-label="Play"><svg class="one" viewBox="0 0 14 14"
aria-hidden="true"><path d="M2 0v14l11-7z"/></svg><svg class="two" viewBox="0 0 14 14" aria-hidden="true"><path
d="M2 0h4v14H2zM8 0h4v14H8z"/></svg></button>
<button type="button" data-part="back" aria-label="Frame back"><svg viewBox="0 0 14 14" aria-hidden="true"><path
d="M12 1v12L4 7zM1 1h2v12H1z"/></svg></button>
<button type="button" data-part="on" aria-label="Frame forward"><svg viewBox="0 0 14 14" aria-hidden="true"><path
d="M2 1v12l8-6zM11 1h2v12h-2z"/></svg></button>
<input type="range" data-part="time" min="0" max="1" value="0" aria-label="Time">
<span class="clock" data-part="clock"></span>
<button type="button" data-part="help" aria-label="Keys" aria-expanded="false" aria-controls="keys">?</button>
</div>
<div class="row">
${toggle("aligned", "Aligned", "In the time of the reference (a)")}
${toggle("overlaid", "Overlaid", "At one place instead of side by side (o)")}
${toggle("residual", "Residual", "Coloured by how far each joint is from the reference's (r)")}
${toggle("contacts", "Contacts", "Where feet stand (c)")}
${toggle("inPlace", "In place", "Without going anywhere: hips stay where they began (p)")}
${toggle("follow", "Follow", "The camera goes with them (f)")}
${toggle("loop", "Loop", "Begin again at the end (l)")}
<label>Trails <select data-part="trails"><option value="none">none</option><option value="hands">hands</option>
<option value="feet">feet</option><option value="both">hands and feet</option><option value="hips">hips</option>
<option value="head">head</option><option value="given" hidden disabled>chosen</option></select></label>
<label>Speed <select data-part="speed">${SPEEDS.map((one) => option([one, `${one}×`])).join("")}</select></label>
<label>View <select data-part="view">${["front", "side", "top", "free"].map((one) => option([one, one])).join("")}</select></label>
</div>
<dl class="keys" id="keys" data-part="keys" hidden>${[
  ["Space", "play or pause"], ["← →", "a frame back, on"], ["Shift ← →", "a second back, on"],
  ["Home, End", "beginning, end"], ["+ −", "nearer, further"], ["1 2 3 4", "front, side, top, free view"],
  ["a", "aligned in time"], ["o", "overlaid"], ["r", "residual"], ["t", "trails"], ["c", "contacts"], ["p", "in place"],
  ["f", "follow"], ["l", "loop"], ["drag", "turn"], ["Shift + drag", "move"], ["wheel", "nearer, further (once clicked)"],
].map(([key, what]) => `<div><dt>${key}</dt><dd>${what}</dd></div>`).join("")}</dl>
</div>`;
