// SPDX-License-Identifier: MIT
// A character that the browser skins and draws: features/pages/viewer_page.py writes the page, docs/viewer.md describes it.

(async () => {
const find = (id) => document.getElementById(id);
const header = JSON.parse(find("header").textContent);
const sources = JSON.parse(find("shaders").textContent);
const prefersDark = matchMedia("(prefers-color-scheme: dark)");
const METHODS = { lbs: 0, dq: 1, cor: 2 }, HIERARCHY = 4, BONE = 8, FORMS = { kim_han: 1 };
// Of the grid: lines each way, each in pieces that fade out.
const LINES = 31, PIECES = 12, GROUND_ENDS = 2 * 2 * LINES * PIECES;

function fail(text) {
  find("message").textContent = text;
  find("message").hidden = false;
}

// --- The arrays

async function readArrays() {
  const packed = Uint8Array.from(atob(find("arrays").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const types = { float32: Float32Array, uint16: Uint16Array, uint32: Uint32Array, int16: Int16Array, int32: Int32Array };
  return header.parts.map((part) => Object.fromEntries(Object.entries(part.arrays).map(([name, place]) => {
    const count = place.shape.reduce((a, b) => a * b, 1);
    return [name, new types[place.type](buffer, place.offset, count)];
  })));
}

if (typeof DecompressionStream === "undefined") {
  fail("This page needs a newer browser: Chromium 80, Firefox 113 or Safari 16.4.");
  return;
}

// --- What draws: gpu.js or gl.js

const wanted = new URLSearchParams(location.search).get("draw");
let canvas = find("view"), way, meshes, ramps, isFast = false;

// Begins with the first that can draw. Where it ends later, the next one goes on, on a canvas of its own.
async function begin([make, ...others]) {
  const next = (text) => {
    if (!others.length) return fail(text);
    const old = canvas, hasFocus = document.activeElement === old;
    canvas = old.cloneNode();
    old.replaceWith(canvas);
    if (hasFocus) canvas.focus();
    return begin(others);
  };
  try {
    way = await make(canvas, sources, { LINES, PIECES }, next);
  } catch (error) {
    return next(error.message);
  }
  meshes = header.parts.map((about, i) => new Mesh(about, arrays[i]));
  ramps = header.measures.map(({ ramp }) => {
    const stops = Array.from({ length: ramp.length / 3 }, (_, i) => [...ramp.slice(3 * i, 3 * i + 3), 255]).flat();
    return way.array("float4", Float32Array.from(stops, (x) => x / 255), stops.length / 4, stops.length / 4);
  });
  skinnedFor = "";
  connectCanvas();
  listNotes();
  // What ended meanwhile is not fast.
  isFast = await measureSpeed().catch(() => false);
  changed();
}

// --- Meshes

// What lies around each vertex: rows of `list`, `width` numbers each, sorted by the vertex that each belongs to.
function sorted(count, owners, list, width) {
  const first = new Uint32Array(count + 1);
  for (const owner of owners) first[owner + 1]++;
  for (let v = 0; v < count; ++v) first[v + 1] += first[v];
  const next = first.slice(), rows = new Uint32Array(list.length);
  owners.forEach((owner, k) => {
    const to = next[owner]++;
    for (let i = 0; i < width; ++i) rows[to * width + i] = list[k * width + i];
  });
  return { first, rows };
}

// The most influences of a vertex, 1 where none has any.
function mostOf({ offsets }) {
  return offsets.reduce((most, end, v) => Math.max(most, end - (offsets[v - 1] ?? end)), 1);
}

class Mesh {
  constructor(about, arrays) {
    Object.assign(this, { about, arrays, packed: new Map() });
    this.count = arrays.rest.length / 3;
    this.bones = about.arrays.palettes.shape[1];
    this.most = mostOf(arrays);
    const wide = (points, last) => {
      const found = new Float32Array(4 * this.count);
      for (let v = 0; v < this.count; ++v) {
        for (let i = 0; i < 3; ++i) found[4 * v + i] = points[3 * v + i];
        found[4 * v + 3] = last ? last[v] : 0;
      }
      return found;
    };
    this.restRows = wide(arrays.rest, arrays.shares);
    this.rest = way.array("float4", this.restRows, this.count);
    this.centres = way.array("float4", wide(arrays.centres || arrays.rest), this.count);
    this.amounts = new Map();
    this.palette = way.array("float4", arrays.palettes.subarray(0, 4 * BONE * this.bones), BONE * this.bones, BONE);
    this.offsetRows = new Float32Array(4 * this.count);
    this.offsets = way.array("float4", this.offsetRows, this.count);
    this.drawAround(arrays.triangles, arrays.edges);
    const target = () => way.array("float4", null, this.count);
    this.panes = [0, 1].map(() => ({ points: target(), surface: target() }));
    this.reference = target();
    this.triangles = way.triangles(arrays.triangles);
  }

  drawAround(triangles, edges) {
    const others = new Uint32Array(2 * triangles.length), ends = new Uint32Array(edges.length);
    for (let k = 0; k < triangles.length; ++k) {
      const start = k - k % 3;
      others[2 * k] = triangles[start + (k + 1) % 3];
      others[2 * k + 1] = triangles[start + (k + 2) % 3];
    }
    for (let k = 0; k < edges.length; ++k) ends[k] = edges[k ^ 1];
    const corners = sorted(this.count, triangles, others, 2), links = sorted(this.count, edges, ends, 1);
    const spans = new Uint32Array(4 * this.count);
    for (let v = 0; v < this.count; ++v) {
      [corners, links].forEach(({ first }, i) => spans.set([first[v], first[v + 1] - first[v]], 4 * v + 2 * i));
    }
    this.around = way.array("whole4", spans, this.count);
    this.corners = way.array("whole2", corners.rows, triangles.length);
    this.ends = way.array("whole1", links.rows, edges.length);
  }

  // The `most` heaviest influences of each vertex, in the order that they have in Blender.
  influences(most) {
    const number = Math.min(most, this.most);
    if (!this.packed.has(number)) {
      const { offsets, bones, weights } = this.arrays;
      const rows = new Float32Array(2 * number * this.count);
      for (let v = 0; v < this.count; ++v) {
        let own = Array.from({ length: offsets[v + 1] - offsets[v] }, (_, i) => offsets[v] + i);
        if (own.length > number) {
          own = own.sort((a, b) => weights[b] - weights[a] || a - b).slice(0, number).sort((a, b) => a - b);
        }
        own.forEach((k, i) => rows.set([bones[k], weights[k]], 2 * (v * number + i)));
      }
      this.packed.set(number, way.array("float2", rows, number * this.count));
    }
    return { number, influences: this.packed.get(number) };
  }

  setFrame(index) {
    this.frame = index;
    const size = 4 * BONE * this.bones;
    this.palette.write(this.arrays.palettes.subarray(index * size, (index + 1) * size));
    if (this.arrays.moving) this.moveRest(index);
    this.world = transposed(this.arrays.worlds.subarray(16 * index, 16 * index + 16));
  }

  // By shape keys, or modifiers in front of the skinning.
  moveRest(index) {
    const { moving, moved } = this.arrays, first = 3 * moving.length * index;
    moving.forEach((vertex, k) => this.restRows.set(moved.subarray(first + 3 * k, first + 3 * k + 3), 4 * vertex));
    this.rest.write(this.restRows);
  }

  // How much each vertex gets of Twist Spread and of Limit Bulge, 0 to 1.
  amountsOf(strengths) {
    const key = strengths.join(), { masks } = this.arrays;
    if (!this.amounts.has(key)) {
      const own = masks ? masks.map((mask, k) => Math.min(Math.max(mask * strengths[k % 2], 0), 1)) : new Float32Array(2 * this.count);
      this.amounts.set(key, way.array("float2", own, this.count));
    }
    return this.amounts.get(key);
  }

  // Of a shape that the shaders lack: what is to be added to the one that they have.
  readOffsets({ recorded, step }) {
    const first = 3 * this.count * this.frame, own = this.arrays[recorded];
    for (let i = 0; i < 3; ++i) {
      for (let v = 0; v < this.count; ++v) this.offsetRows[4 * v + i] = step * own[first + i * this.count + v];
    }
    this.offsets.write(this.offsetRows);
  }

  skin(name, limit, target) {
    const look = this.about.looks[name], { method, mix, by_hierarchy, strengths, form } = look;
    const { blender } = this.about, hasStages = state.stages || !isStaged(name);
    const isRecorded = look.recorded && hasStages, most = isRecorded ? Infinity : limit;
    if (isRecorded) this.readOffsets(look);
    const isOwn = method !== "blender", isMixed = isOwn && mix && this.arrays.shares;
    const [first, second] = (isOwn ? [method, isMixed ? mix : method] : [blender, blender])
      .map((one) => METHODS[one] + (isOwn && by_hierarchy.includes(one) ? HIERARCHY : 0));
    const { number, influences } = this.influences(most), amounts = this.amountsOf(strengths);
    const { palette: sinew_bones, rest, centres, offsets } = this;
    way.run("skin", target, { sinew_bones, rest, centres, amounts, offsets, influences }, {
      SINEW_INFLUENCES: number, METHOD: first, SECOND_METHOD: second, BULGE_FORM: FORMS[form] ?? 0,
      STAGES: isOwn && hasStages && strengths.some((x) => x > 0) && this.arrays.masks ? 1 : 0, RECORDED: isRecorded ? 1 : 0,
    });
  }

  measure(pane, measure) {
    way.run("surface", pane.surface, {
      points: pane.points, reference: this.reference, rest: this.rest, around: this.around,
      corners: this.corners, ends: this.ends, world_from_armature: this.world,
    }, { MEASURE: measure });
  }
}

// --- Matrices by columns, as shaders take them

function transposed(m) {
  return Float32Array.from(m, (_, i) => m[(i % 4) * 4 + (i >> 2)]);
}

function product(a, b) {
  return Float32Array.from(a, (_, i) => {
    const [row, column] = [i % 4, i >> 2];
    return [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + row] * b[4 * column + k], 0);
  });
}

const moved = (m, v) => [0, 1, 2, 3].map((row) => [0, 1, 2, 3].reduce((sum, k) => sum + m[4 * k + row] * v[k], 0));
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [1, 2, 0].map((i) => a[i] * b[(i + 1) % 3] - a[(i + 1) % 3] * b[i]);
const plus = (a, b, factor = 1) => a.map((x, i) => x + factor * b[i]);

// --- The state

const names = Object.keys(header.methods), last = header.frames.length - 1;
const { findings = [], verdict = "" } = header.flex ?? {};
const state = {
  frame: header.start, playing: false, panes: !header.flex && !header.sheet && names.length > 1 && innerWidth > 560 ? 2 : 1, methods: [names[0], names[names.length - 1]],
  // Where two are shown over each other: the share of the width that is the left one's.
  wipe: null,
  // Whether the contact sheet is shown, and the row and column that were chosen there.
  isSheet: Boolean(header.sheet), cell: null,
  measure: 0, most: Infinity, stages: true, finding: -1, yaw: 0.6, pitch: 0.12, zoom: 1, offset: [0, 0, 0],
};
const isWiped = () => state.panes === 2 && state.wipe !== null;
// How many views are beside each other.
const viewCount = () => (isWiped() ? 1 : state.panes);

// Where the character is at a frame. One that walks away is followed; others stay where they are.
function boxOver(frames) {
  const pick = (of, choose) => [0, 1, 2].map((i) => frames.reduce((a, f) => choose(a, of[f][i]), of[frames[0]][i]));
  return [pick(header.low, Math.min), pick(header.high, Math.max)];
}
const whole = boxOver(header.frames.map((_, f) => f));
const extent = (box) => plus(box[1], box[0], -1);
const tallest = [0, 1, 2].map((i) => Math.max(...header.frames.map((_, f) => header.high[f][i] - header.low[f][i])));
const isTravelling = Math.hypot(...extent(whole)) > 1.8 * Math.hypot(...tallest);
const [wide, deep, tall] = (isTravelling ? tallest : extent(whole)).map((x) => x / 2);
const radius = Math.hypot(wide, deep, tall) || 1;

// Between the lines of the ground: 1, 2 or 5 of a power of ten.
const power = 10 ** Math.floor(Math.log10(radius / 1.5));
const spacing = [1, 2, 5].map((step) => step * power).findLast((step) => step <= radius / 1.5) ?? power;

const backOf = ({ yaw, pitch }) => [Math.sin(yaw) * Math.cos(pitch), -Math.cos(yaw) * Math.cos(pitch), Math.sin(pitch)];

function camera(aspect) {
  const box = isTravelling ? boxOver([state.frame]) : whole;
  const middle = plus(box[0], box[1]).map((x) => x / 2);
  const [cy, sy, cp, sp] = [Math.cos(state.yaw), Math.sin(state.yaw), Math.cos(state.pitch), Math.sin(state.pitch)];
  const back = backOf(state), right = [cy, sy, 0], up = [-sy * sp, cy * sp, cp];
  // The character fits however it is turned about the vertical.
  const half = Math.tan(Math.PI / 12), around = Math.hypot(wide, deep) || radius;
  const distance = Math.max(1.04 * tall / half + 0.3 * around, 1.06 * around / (half * aspect) + 0.7 * around) / state.zoom;
  const eye = plus(plus(middle, state.offset), back, distance);
  const near = Math.max(distance - 4 * radius, 0.02 * distance), far = distance + 12 * radius;
  const view = [right, up, back].map((axis) => [...axis, -dot(axis, eye)]).concat([[0, 0, 0, 1]]).flat();
  const depth = near - far;
  const lens = [1 / (half * aspect), 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, (far + near) / depth, -1, 0, 0, 2 * far * near / depth, 0];
  const towards = (x, y) => plus(plus(back, right, x), up, y), unit = (v) => v.map((x) => x / Math.hypot(...v));
  const lights = { key_light: unit(towards(-0.6, 0.7)), fill_light: unit(towards(0.9, 0.1)) };
  const clip_from_world = product(Float32Array.from(lens), transposed(view));
  return { ...lights, eye, right, up, middle, distance, half, clip_from_world };
}

let arrays;
try {
  arrays = await readArrays();
} catch (error) {
  fail("The data of this page is damaged: " + error.message);
  return;
}
const most = Math.max(...arrays.map(mostOf));

// --- Drawing

// What the points on the graphics card were made for: a camera that moves needs no others.
let skinnedFor = "";
// Of each pane, where the vertex of the chosen finding is in the world, and its normal; and when they are known.
let marks = [], marking;

function skinAll() {
  const { frame, panes, methods, measure, most, stages, finding } = state;
  const wanted = [frame, panes, ...methods, measure, most, stages, finding].join();
  if (wanted === skinnedFor) return;
  skinnedFor = wanted;
  for (const mesh of meshes) {
    mesh.setFrame(frame);
    if (measure === 1) mesh.skin("blender", Infinity, mesh.reference);
    mesh.panes.slice(0, panes).forEach((pane, i) => {
      mesh.skin(methods[i], most, pane.points);
      mesh.measure(pane, measure);
    });
  }
  marking = readMarks(wanted);
}

async function readMarks(wanted) {
  const found = await Promise.all([0, 1].slice(0, state.panes).map(markOf));
  if (wanted !== skinnedFor) return;
  marks = found;
  showMarks();
}

async function markOf(pane) {
  const { mesh: name, vertex } = findings[state.finding] ?? {}, mesh = meshes.find(({ about }) => about.name === name);
  if (!mesh || vertex >= mesh.count) return null;
  const { points, surface } = mesh.panes[pane], { world } = mesh;
  const [point, normal] = await Promise.all([points, surface].map((array) => way.read(array, vertex, 1)));
  return { point: moved(world, point).slice(0, 3), normal: Array.from(normal.slice(0, 3)) };
}

function showMarks() {
  const { clip_from_world } = camera(canvas.clientWidth / viewCount() / canvas.clientHeight);
  for (const i of [0, 1]) {
    const mark = find(`mark-${i}`), place = marks[i] && moved(clip_from_world, [...marks[i].point, 1]);
    const [x, y] = place ? [place[0] / place[3], place[1] / place[3]] : [2, 2];
    const isCovered = isWiped() && (1 + x) / 2 < state.wipe !== (i === 0);
    mark.hidden = isCovered || !(Math.abs(x) < 1 && Math.abs(y) < 1 && place[3] > 0);
    mark.style.left = `${50 * (1 + x + 2 * (isWiped() ? 0 : i)) / viewCount()}%`;
    mark.style.top = `${50 * (1 - y)}%`;
  }
}

function inPane(pane, aspect) {
  const its = camera(aspect), measure = header.measures[state.measure - 1];
  const constants = { HAS_HEAT: measure ? 1 : 0, IS_LOGARITHMIC: measure && measure.isLogarithmic ? 1 : 0 };
  const range = measure ? [measure.low, measure.high] : [0, 1];
  const shared = { ...its, ramp: ramps[Math.max(state.measure - 1, 0)], range };
  const ground = {
    ...its, middle: [its.middle[0], its.middle[1], whole[0][2]], spacing, radius: 3 * radius,
    line: prefersDark.matches ? [0.27, 0.28, 0.29] : [0.1, 0.11, 0.12],
  };
  return [...meshes.map((mesh) => ({
    name: "draw", constants, triangles: mesh.triangles,
    values: { ...shared, ...mesh.panes[pane], world_from_armature: mesh.world },
  })), { name: "ground", ends: GROUND_ENDS, values: ground }];
}

// The left edge and the width, in pixels, of what a pane draws, and of what is seen of it.
function placesOf(pane, width) {
  const each = Math.floor(width / viewCount()), cut = Math.round(width * state.wipe);
  if (!isWiped()) return { port: [pane * each, each], seen: [pane * each, each] };
  return { port: [0, width], seen: pane ? [cut, width - cut] : [0, cut] };
}

function draw(isSmooth = false) {
  const density = Math.min(devicePixelRatio, 2);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(Math.round(x * density), 1));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  skinAll();
  const aspect = Math.floor(width / viewCount()) / height, panes = [0, 1].slice(0, state.panes);
  way.draw(panes.flatMap((pane) => inPane(pane, aspect).map((own) => ({ ...own, ...placesOf(pane, width) }))), isSmooth);
  showMarks();
}

// --- For tests and for the curious

function read(array, mesh) {
  skinnedFor = "";
  changed();
  return way.read(array, 0, mesh.count);
}

// Soon the points of a mesh in armature space, four numbers each, of which the last is 1.
function points(part, method, frame, influences = Infinity) {
  const mesh = meshes[part], target = mesh.panes[0].points;
  mesh.setFrame(frame);
  mesh.skin(method, influences, target);
  return read(target, mesh);
}

// The normals of a mesh in the world, and as fourth number the value of a measure: 1 for the first one.
function values(part, method, frame, measure) {
  const mesh = meshes[part], pane = mesh.panes[0];
  mesh.setFrame(frame);
  mesh.skin("blender", Infinity, mesh.reference);
  mesh.skin(method, Infinity, pane.points);
  mesh.measure(pane, measure);
  return read(pane.surface, mesh);
}

// --- The page

const SLOW_MILLISECONDS = 20, STILL_MILLISECONDS = 150;
const FLIGHT_MILLISECONDS = 700, prefersStill = matchMedia("(prefers-reduced-motion: reduce)");
let isWaiting = false, playedFrom = null, whenStill = 0, flight = null;

// Whether a smooth frame is drawn fast enough to draw none but smooth ones.
async function measureSpeed() {
  draw(true);
  await way.finish();
  const started = performance.now();
  draw(true);
  await way.finish();
  return performance.now() - started < SLOW_MILLISECONDS;
}

function changed() {
  if (isWaiting) return;
  isWaiting = true;
  requestAnimationFrame((now) => {
    isWaiting = false;
    if (state.playing) {
      playedFrom ??= { now, frame: state.frame };
      const passed = Math.floor((now - playedFrom.now) * header.rate / 1000);
      state.frame = (playedFrom.frame + passed) % (last + 1);
      showFrame();
    }
    if (flight) flyOn();
    draw(isFast);
    clearTimeout(whenStill);
    if (state.playing || flight) changed();
    else if (!isFast) whenStill = setTimeout(() => draw(true), STILL_MILLISECONDS);
  });
}

const methodLabel = (name) => header.methods[name];
const staged = [...new Set(header.parts.flatMap((part) => part.stages))], stagesLabel = staged.join(" and ");
// The stages of a variant and of a method that the shaders lack can not be taken off.
const isStaged = (name) => name in METHODS || name === "mix";
const hasStages = (name) => staged.length && name !== "blender" && !name.includes("=") && (state.stages || !isStaged(name));
const hasAllBones = (name) => header.parts.some(({ looks }) => looks[name].recorded) && (state.stages || !isStaged(name));
const shownLabel = (name) => methodLabel(name) + (hasStages(name) ? ` with ${stagesLabel}` : "")
  + (state.most < Infinity && hasAllBones(name) ? ", all bones" : "");

function say(text) {
  find("said").textContent = text;
}

function showFrame() {
  find("frame").value = state.frame;
  find("frame").setAttribute("aria-valuetext", `${step} ${header.frames[state.frame]}`);
  find("frame-shown").textContent = header.frames[state.frame];
}

// What a frame is called.
const step = header.isOfPoses ? "pose" : "frame";
// The stops of the slider.
const stops = [1, 2, 3, 4, 8].filter((n) => n < most).concat(Infinity);

function show() {
  showFrame();
  document.body.classList.toggle("playing", state.playing);
  find("play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
  const panes = isWiped() ? "wipe" : String(state.panes);
  for (const input of document.querySelectorAll("[name=panes]")) input.checked = input.value === panes;
  if (header.sheet) showSheet();
  findings.forEach((_, i) => {
    const [button, more] = find("findings").children[i].children;
    button.setAttribute("aria-pressed", i === state.finding);
    more.hidden = i !== state.finding;
  });
  for (const input of document.querySelectorAll("[name=measure]")) input.checked = Number(input.value) === state.measure;
  state.methods.forEach((name, i) => {
    find(`method-${i}`).value = name;
    find(`label-${i}`).textContent = state.panes === 2 ? ["Left", "Right"][i] : ["Shown", "Flip to"][i];
    const pane = find(`pane-${i}`);
    pane.textContent = shownLabel(name);
    pane.hidden = i >= state.panes;
    pane.style.left = `${100 * (i + 0.5) / state.panes}%`;
    pane.style.maxWidth = `calc(${100 / state.panes}% - 24px)`;
  });
  find("stage").classList.toggle("has-two", viewCount() === 2);
  find("wipe").hidden = !isWiped();
  find("wipe").style.left = `${100 * state.wipe}%`;
  find("wipe").setAttribute("aria-valuenow", Math.round(100 * state.wipe));
  const shown = state.methods.slice(0, state.panes).map(shownLabel).join(" and ");
  const measure = header.measures[state.measure - 1];
  canvas.setAttribute("aria-label", `${header.title}: ${shown}${measure ? `, ${measure.label}` : ""}`);
  find("legend").hidden = !measure;
  if (measure) {
    const colours = [];
    for (let i = 0; i < measure.ramp.length; i += 3) colours.push(`rgb(${measure.ramp.slice(i, i + 3)})`);
    find("ramp").style.background = `linear-gradient(to right, ${colours})`;
    find("measure-text").textContent = measure.text;
    find("ticks").replaceChildren(...[0, 2, 4].map((i) => {
      const tick = document.createElement("span");
      tick.textContent = measure.ticks[i];
      return tick;
    }));
  }
  find("stages").checked = state.stages;
  find("influences").value = stops.indexOf(state.most);
  const bones = state.most === Infinity ? `all (${most})` : String(state.most);
  find("influences-shown").textContent = bones;
  find("influences").setAttribute("aria-valuetext", bones);
  changed();
}

function set(values) {
  Object.assign(state, values);
  if ("frame" in values || "playing" in values) playedFrom = null;
  if ("yaw" in values || "zoom" in values || "offset" in values) flight = null;
  show();
}

function flip() {
  set({ methods: [state.methods[1], state.methods[0]] });
  say(`Now ${state.methods.slice(0, state.panes).map(shownLabel).join(" and ")}`);
}

// --- The contact sheet

function listCells() {
  for (const one of document.querySelectorAll(".of-sheet")) one.hidden = !header.sheet;
  if (!header.sheet) return;
  const { picture, width, rows, columns } = header.sheet, image = document.createElement("img");
  const button = ([left, top, wide, high], label, values) => {
    const made = Object.assign(document.createElement("button"), { type: "button", ...values });
    Object.entries({ left, top, width: wide, height: high }).forEach(([name, share]) => {
      made.style[name] = `${100 * share}%`;
    });
    made.setAttribute("aria-label", label);
    return made;
  };
  find("cells").style.width = `min(100%, ${width}px)`;
  find("cells").replaceChildren(Object.assign(image, { src: picture, alt: "" }), ...rows.flatMap((row, i) => [
    button(row.label, methodLabel(row.name), { onclick: () => chooseRow(i) }),
    ...row.cells.map((box, k) => button(box, `${columns[k].title}, ${methodLabel(row.name)}`, { onclick: () => chooseCell(i, k) })),
  ]));
}

function showSheet() {
  find("sheet").hidden = !state.isSheet;
  find("sheet-shown").textContent = state.isSheet ? "Close" : "Show";
  const buttons = [...find("cells").querySelectorAll("button")], { columns } = header.sheet;
  buttons.forEach((button, k) => {
    const place = [Math.floor(k / (columns.length + 1)), k % (columns.length + 1) - 1];
    button.setAttribute("aria-pressed", String(place) === String(state.cell));
  });
}

// Beside the first row, or the second beside the first: F flips between both.
function chooseRow(row) {
  const { rows } = header.sheet;
  set({ methods: [rows[row].name, rows[row ? 0 : rows.length - 1].name], isSheet: false });
}

function chooseCell(row, column) {
  const { frame, direction, target, width, title } = header.sheet.columns[column];
  set({ frame, playing: false, cell: [row, column] });
  chooseRow(row);
  const its = camera(canvas.clientWidth / viewCount() / canvas.clientHeight);
  fly({
    yaw: Math.atan2(direction[0], -direction[1]), pitch: Math.asin(Math.min(Math.max(direction[2], -1), 1)),
    zoom: state.zoom * its.distance * its.half / (0.55 * width), offset: plus(target, its.middle, -1),
  });
  say(`${title}, ${methodLabel(state.methods[0])}`);
}

// --- Flex

const HOME = { yaw: 0.6, pitch: 0.12, zoom: 1, offset: [0, 0, 0] };

async function choose(index) {
  const { joint, measure, value, limit, size, frame, mends } = findings[index];
  // A method that mends it is a flip away.
  const methods = [names[0], mends.find((name) => names.includes(name)) ?? state.methods[1]];
  set({ finding: index, frame, playing: false, methods });
  say([`${joint}: ${measure}`, value, limit, header.frames[frame]].filter(Boolean).join(", "));
  const button = find("findings").children[index].firstChild;
  button.scrollIntoView({ block: "nearest" });
  marks = [];
  showMarks();
  skinAll();
  await marking;
  const to = marks[0] ? await viewOf(marks[0], size) : HOME;
  if (state.finding === index) fly(to);
}

// Along the normal, or as near to that as nothing is in between; some lengths of the bone around the place.
async function viewOf({ point, normal }, size) {
  const its = camera(canvas.clientWidth / viewCount() / canvas.clientHeight);
  const reach = Math.min(Math.max(1.6 * size, radius / 12), radius / 2);
  const [yaw, pitch] = [Math.atan2(normal[0], -normal[1]), Math.min(Math.max(Math.asin(normal[2]), -1), 1)];
  const views = [{ yaw, pitch }];
  for (let k = 0; k < 12; ++k) for (const other of [-0.5, 0, 0.5, 1]) views.push({ yaw: yaw + k * Math.PI / 6, pitch: other });
  const closeness = new Map(views.map((view) => [view, dot(backOf(view), normal)]));
  views.sort((a, b) => closeness.get(b) - closeness.get(a));
  const corners = (await Promise.all(meshes.map((mesh) => trianglesNear(mesh, point, reach / its.half)))).flat();
  const best = views.find((view) => !isHidden(point, backOf(view), 0.03 * reach, reach / its.half, corners)) ?? views[0];
  return { ...best, zoom: state.zoom * its.distance * its.half / reach, offset: plus(point, its.middle, -1) };
}

// Of the left pane, in the world: the corners of triangles of which one is within a distance.
async function trianglesNear(mesh, point, distance) {
  const shape = await way.read(mesh.panes[0].points, 0, mesh.count), { triangles } = mesh.arrays, found = [];
  const world = Array.from({ length: mesh.count }, (_, v) => moved(mesh.world, shape.subarray(4 * v, 4 * v + 4)));
  const isNear = world.map((p) => Math.hypot(p[0] - point[0], p[1] - point[1], p[2] - point[2]) < distance);
  for (let k = 0; k < triangles.length; k += 3) {
    const own = triangles.subarray(k, k + 3);
    if (own.some((v) => isNear[v])) found.push(Array.from(own, (v) => world[v].slice(0, 3)));
  }
  return found;
}

// Whether a ray goes through one of the triangles between two distances.
function isHidden(from, direction, least, most, triangles) {
  return triangles.some(([a, b, c]) => {
    const first = plus(b, a, -1), second = plus(c, a, -1), across = cross(direction, second), scale = dot(first, across);
    const start = plus(from, a, -1), u = dot(start, across) / scale, other = cross(start, first);
    const v = dot(direction, other) / scale, along = dot(second, other) / scale;
    return u >= 0 && v >= 0 && u + v <= 1 && along > least && along < most;
  });
}

function fly(to) {
  const { yaw, pitch, zoom, offset } = state, turn = to.yaw - yaw;
  const from = { yaw: yaw + Math.round(turn / (2 * Math.PI)) * 2 * Math.PI, pitch, zoom, offset };
  if (prefersStill.matches) set(to);
  else flight = { from, to, started: performance.now() };
  changed();
}

function flyOn() {
  const { from, to, started } = flight, passed = Math.min((performance.now() - started) / FLIGHT_MILLISECONDS, 1);
  const share = passed * passed * (3 - 2 * passed), between = (a, b) => a + share * (b - a);
  Object.assign(state, {
    yaw: between(from.yaw, to.yaw), pitch: between(from.pitch, to.pitch),
    zoom: from.zoom * (to.zoom / from.zoom) ** share, offset: from.offset.map((x, i) => between(x, to.offset[i])),
  });
  if (passed === 1) flight = null;
}

function listFindings() {
  for (const one of document.querySelectorAll(".of-flex")) one.hidden = !header.flex;
  document.body.classList.toggle("has-poses", header.isOfPoses);
  const made = (name, text) => Object.assign(document.createElement(name), { textContent: text });
  find("verdict").textContent = verdict;
  find("findings").replaceChildren(...findings.map(({ joint, measure, value, limit, frame, meaning, advice }, i) => {
    const item = made("li", ""), button = Object.assign(made("button", ""), { type: "button" });
    button.append(made("b", joint), ` ${measure}`, made("span", [value, limit].filter(Boolean).join(", ")));
    button.append(made("span", header.frames[frame]));
    button.addEventListener("click", () => choose(i));
    item.append(button, made("p", `${meaning} ${advice}`));
    return item;
  }));
}

const actions = {
  ...(findings.length && {
    n: () => choose((state.finding + 1) % findings.length),
    p: () => choose((Math.max(state.finding, 0) + findings.length - 1) % findings.length),
  }),
  " ": () => set({ playing: !state.playing }),
  ",": () => set({ playing: false, frame: (state.frame + last) % (last + 1) }),
  ".": () => set({ playing: false, frame: (state.frame + 1) % (last + 1) }),
  f: flip,
  w: () => {
    set({ panes: 2, wipe: isWiped() ? null : 0.5 });
    say(isWiped() ? "Wipe" : "Side by side");
  },
  ...(header.sheet && {
    c: () => set({ isSheet: !state.isSheet }),
    Escape: () => set({ isSheet: !state.isSheet }),
  }),
  ...(staged.length && {
    s: () => {
      set({ stages: !state.stages });
      say(`${stagesLabel} ${state.stages ? "on" : "off"}`);
    },
  }),
  h: () => {
    set({ measure: (state.measure + 1) % (header.measures.length + 1) });
    say(state.measure ? header.measures[state.measure - 1].label : "No heat map");
  },
  "+": () => zoomBy(1.15),
  "=": () => zoomBy(1.15),
  "-": () => zoomBy(1 / 1.15),
  Home: () => set(HOME),
};

function zoomBy(factor) {
  set({ zoom: Math.min(Math.max(state.zoom * factor, 0.3), 60) });
}

function orbit(dx, dy) {
  set({ yaw: state.yaw - dx, pitch: Math.min(Math.max(state.pitch + dy, -1.5), 1.5) });
}

// By shares of the pane's shorter side.
function pan(dx, dy) {
  const its = camera(1), reach = 2 * its.half * its.distance;
  set({ offset: plus(plus(state.offset, its.right, -dx * reach), its.up, dy * reach) });
}

function connect() {
  for (const i of [0, 1]) {
    find(`method-${i}`).replaceChildren(...names.map((name) => new Option(methodLabel(name), name)));
    find(`method-${i}`).addEventListener("change", (event) => {
      set({ methods: state.methods.map((name, k) => (k === i ? event.target.value : name)) });
    });
  }
  find("measures").replaceChildren(...["None", ...header.measures.map(({ label }) => label)].map((text, i) => {
    const label = document.createElement("label"), input = document.createElement("input");
    Object.assign(input, { type: "radio", name: "measure", value: i });
    label.append(input, ` ${text}`);
    return label;
  }));
  find("panel").addEventListener("change", ({ target }) => {
    if (target.name === "measure") set({ measure: Number(target.value) });
    if (target.name === "panes") set({ panes: target.value === "1" ? 1 : 2, wipe: target.value === "wipe" ? 0.5 : null });
  });
  for (const form of ["panel", "time"]) find(form).addEventListener("submit", (event) => event.preventDefault());
  find("flip").addEventListener("click", flip);
  find("sheet-shown").addEventListener("click", () => set({ isSheet: !state.isSheet }));
  find("play").addEventListener("click", actions[" "]);
  find("frame").max = last;
  find("frame").setAttribute("aria-label", header.isOfPoses ? "Pose" : "Frame");
  find("frame").addEventListener("input", ({ target }) => set({ playing: false, frame: Number(target.value) }));
  find("time").hidden = last === 0;
  find("stages-set").hidden = !staged.length;
  find("stages-shown").textContent = stagesLabel;
  find("stages").addEventListener("change", ({ target }) => set({ stages: target.checked }));
  find("influences").max = stops.length - 1;
  find("influences-set").hidden = stops.length === 1;
  find("influences").addEventListener("input", ({ target }) => set({ most: stops[Number(target.value)] }));
  const vertices = meshes.reduce((sum, mesh) => sum + mesh.count, 0);
  const frames = last ? `${last + 1} ${step}s` : `${step} ${header.frames[0]}`;
  find("facts").textContent = `${vertices.toLocaleString("en")} vertices, ${frames}`;
}

function listNotes() {
  find("notes").replaceChildren(...[...header.notes, `${way.name} draws it.`].map((textContent) => {
    return Object.assign(document.createElement("li"), { textContent });
  }));
}

function connectKeys() {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const tag = event.target.tagName, isTyped = tag === "SELECT" || tag === "INPUT";
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    // A button has a space of its own, and a slider and a list their keys.
    if (key === " " && (tag === "BUTTON" || tag === "SUMMARY" || isTyped)) return;
    if (isTyped && (tag === "SELECT" || key.length > 1)) return;
    if (arrows[key] && tag === "CANVAS") {
      const [x, y] = arrows[key];
      if (event.shiftKey) pan(0.05 * x, 0.05 * y);
      else orbit(0.09 * x, 0.09 * y);
    } else if (actions[key]) actions[key]();
    else return;
    event.preventDefault();
  });
}

// Between the two that a wipe shows.
function connectWipe() {
  const handle = find("wipe"), move = (share) => set({ wipe: Math.min(Math.max(share, 0), 1) });
  handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
  handle.addEventListener("pointermove", (event) => {
    const box = find("stage").getBoundingClientRect();
    if (handle.hasPointerCapture(event.pointerId)) move((event.clientX - box.left) / box.width);
  });
  const steps = { ArrowLeft: -0.02, ArrowDown: -0.02, ArrowRight: 0.02, ArrowUp: 0.02, Home: -1, End: 1 };
  handle.addEventListener("keydown", (event) => {
    if (!(event.key in steps)) return;
    event.preventDefault();
    event.stopPropagation();
    move(state.wipe + steps[event.key]);
  });
}

function connectCanvas() {
  const pointers = new Map();
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    const shorter = Math.min(canvas.clientWidth / viewCount(), canvas.clientHeight);
    const other = [...pointers.values()].find((pointer) => pointer.pointerId !== event.pointerId);
    pointers.set(event.pointerId, event);
    if (other) {
      const apart = (pointer) => Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY) || 1;
      zoomBy(apart(event) / apart(before));
      pan(dx / shorter / 2, dy / shorter / 2);
    } else if (event.shiftKey || event.buttons > 1) pan(dx / shorter, dy / shorter);
    else orbit(dx / 140, dy / 140);
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
  }, { passive: false });
  new ResizeObserver(changed).observe(canvas);
}

const ways = { webgl, webgpu }, named = (wanted ?? "").split(",").filter((name) => name in ways);
// Where no card computes, WebGL is faster than WebGPU.
await begin(named.length ? named.map((name) => ways[name]) : [(...given) => webgpu(...given, true), webgl]);
if (!way) return;
connect();
connectWipe();
listFindings();
listCells();
connectKeys();
prefersDark.addEventListener("change", changed);
show();
window.sinew = { header, state, set, draw, points, values, get way() { return way; } };
})();
