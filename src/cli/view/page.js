// The page. Its state is `options`, which are those of `lanecast render`; the server answers a list
// of them with pictures, the last of which has the bytes of the file that the command would write.

const $ = id => document.getElementById(id);
const canvas = $("picture"), context = canvas.getContext("2d");
const SIDES = ["front", "back", "left", "right", "top", "bottom", "iso"];
const CHOICES = {
  integrator: [["", "by the scene"], ["direct", "direct light"], ["path", "paths of light"],
    ["ao", "ambient occlusion"], ["normals", "normals"], ["uv", "uv"], ["ids", "ids"],
    ["depth", "depth"], ["albedo", "colours without light"],
    ["edges", "feature lines"], ["heat", "cost of rays"], ["heat:nodes", "cost: nodes"],
    ["heat:tests", "cost: tests"], ["heat:escalations", "cost: exact decisions"]],
  precision: [["", "guarded"], ["fast", "fast"], ["exact", "exact"]],
  spp: [["", "as the command"], ...[1, 4, 16, 64, 256, 1024, 4096].map(n => [String(n), String(n)])],
  scale: [["1", "of the window"], ["0.5", "a half"], ["0.25", "a fourth"]],
  background: [["", "by the scene"], ["transparent", "transparent"], ["white", "white"], ["black", "black"]],
  "view-transform": [["", "by the light"], ["none", "none"], ["neutral", "neutral"], ["agx", "AgX"], ["aces", "ACES"]],
};
const KEYS = [
  ["drag, arrows", "orbit"], ["right or shift drag", "pan"], ["wheel, + −", "nearer, farther"],
  ["click", "list the ray's solids"], ["1 … 7", SIDES.join(", ")], ["f", "frame the whole scene"],
  ["h", "back to the first view"], ["[ ]", "exposure"], ["c", "copy the command line"],
  ["s", "save the picture"], ["p", "panel"], ["?", "these keys"], ["Esc", "close messages and marks"],
];
// What replaces one another as the place of the camera.
const PLACES = ["camera", "view", "orbit", "fit", "eye", "look-at", "up", "fov-y", "orthographic"];

let socket = null, began = null, options = {}, home = {}, pose = null, seen = null;
let asked = 0;          // id of the last look that was sent
let waits = false;      // whether nothing of it has come yet
let wanted = false;     // whether another look has to be sent
let final = null;       // the last picture that is complete: {id, revision, bytes, width, height}
let fixedSize = false;
let queue = Promise.resolve();

// ---- what the server is asked ----

function windowSize() {
  const box = $("stage").getBoundingClientRect();
  const scale = Number($("scale").value) * Math.min(window.devicePixelRatio || 1, 2);
  const side = length => Math.max(1, Math.round(length * scale));
  return `${side(box.width)}x${side(box.height)}`;
}

/** Asks for the picture of the options, once that of those before has begun to come. */
function look() {
  wanted = true;
  if (waits || !socket || socket.readyState !== WebSocket.OPEN) return;
  wanted = false;
  waits = true;
  asked += 1;
  if (!fixedSize) options.size = windowSize();
  socket.send(JSON.stringify({kind: "look", id: asked, options}));
}

function set(name, value) {
  if (value === "") delete options[name];
  else options[name] = value;
  look();
}

/** Places the camera by options that replace all others of a place. */
function place(placing) {
  PLACES.forEach(name => delete options[name]);
  Object.assign(options, placing);
  pose = null;
  unmark();
  look();
}

/** Moves the camera from where it is: pose to pose. */
function move(change) {
  if (!pose) return;
  pose = change(pose);
  const {camera, "fov-y": angle} = options;
  PLACES.forEach(name => delete options[name]);
  // The camera that was chosen goes along with its lens and projection.
  if (camera !== undefined) options.camera = camera;
  if (angle !== undefined && !pose.isParallel) options["fov-y"] = angle;
  Object.assign(options, optionsOf(pose));
  unmark();
  look();
}

// ---- what the server says ----

function connect() {
  const token = new URLSearchParams(location.search).get("token") || "";
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/ws?token=${encodeURIComponent(token)}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    notice("");
    waits = false;
  };
  socket.onmessage = event => {
    // One after the other: a picture takes a while to decode.
    queue = queue.then(() => hear(event.data)).catch(error => notice(String(error)));
  };
  socket.onclose = () => {
    waits = false;
    notice("The server has ended; the page tries to reach it again.");
    setTimeout(connect, 1000);
  };
}

async function hear(data) {
  if (typeof data === "string") {
    const said = JSON.parse(data);
    if (said.kind === "scene") onScene(said);
    else if (said.kind === "seen") onSeen(said);
    else if (said.kind === "probed") onProbed(said);
    else if (said.kind === "failed") onFailed(said);
    return;
  }
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  const body = new Uint8Array(data, 4 + length);
  if (header.kind === "tiles") onTiles(header, body);
  else await onPicture(header, body);
}

function onScene(scene) {
  if (!began) {
    began = scene;
    options = {...scene.options};
    fixedSize = "size" in options;
    home = {};
    PLACES.filter(name => name in options).forEach(name => { home[name] = options[name]; });
    for (const name of Object.keys(CHOICES)) fill($(name), CHOICES[name]);
    for (const name of ["integrator", "precision", "spp", "background", "view-transform"]) {
      choose($(name), options[name] || "");
    }
    if (fixedSize) fill($("scale"), [["1", options.size.replace("x", " × ")]]);
    $("exposure").value = options.exposure || 0;
    $("stops").textContent = stops();
  }
  const names = [["", "the first"], ...scene.cameras.map((name, row) => [name, `${row}  ${name}`])];
  fill($("camera"), scene.cameras.length ? names : [["", "framed"]]);
  choose($("camera"), options.camera || "");
  $("time").hidden = !scene.frames;
  $("blur").hidden = !scene.blurs;
  const open = [...new Set([...scene.shutters, "0..0.5", "0..1"])];
  fill($("shutter"), [["", "closed"], ...open.map(range => [range, `open ${range.replace("..", " to ")}`])]);
  choose($("shutter"), options.shutter === "0" ? "" : options.shutter || "");
  $("frame").max = scene.frames;
  const file = scene.name.split(/[\\/]/).pop();
  $("name").textContent = file;
  $("name").title = scene.name;
  document.title = `${file} – Lanecast`;
  const count = (n, what) => n ? `${n.toLocaleString("en")} ${what}${n === 1 ? "" : "s"}` : "";
  $("about").textContent = [count(scene.instances, "instance"), count(scene.triangles, "triangle"),
    count(scene.lights, "light"), `ready in ${scene.seconds.toFixed(2)} s`].filter(x => x).join(", ");
  notice(scene.error ? `${scene.error}\nThe picture is of the last version that could be read.`
    : scene.warning && scene.revision !== onScene.told ? `warning: ${scene.warning}` : "");
  onScene.told = scene.revision;
  if (asked === 0 || wanted) look();
}

function onSeen(said) {
  seen = said;
  $("command").textContent = said.command;
  const {eye, right, up, forward, depth} = said;
  // While the camera moves, the page's own pose is ahead of the server's.
  if (!pose || !held.size) pose = {eye, right, up, forward, halfHeight: said.half_height,
    isParallel: said.is_parallel, depth: pose ? pose.depth : depth};
}

function onFailed(said) {
  notice(said.text);
  began_to_come(said.id);
}

function began_to_come(id) {
  if (id !== asked && id !== 0) return;
  waits = false;
  if (wanted) look();
}

function sizeTo(width, height) {
  if (canvas.width === width && canvas.height === height) return;
  // What was shown stays, in the new size.
  const before = canvas.width && final ? canvas : null;
  const kept = before && Object.assign(document.createElement("canvas"), {width, height});
  if (kept) kept.getContext("2d").drawImage(before, 0, 0, width, height);
  [canvas.width, canvas.height] = [width, height];
  if (kept) context.drawImage(kept, 0, 0);
  const ratio = window.devicePixelRatio || 1;
  canvas.style.width = fixedSize ? `${width / ratio}px` : "100%";
  canvas.style.height = fixedSize ? "auto" : "100%";
}

async function onPicture(header, body) {
  const bytes = body.slice();
  const exact = {colorSpaceConversion: "none", premultiplyAlpha: "none"};
  const image = await createImageBitmap(new Blob([bytes], {type: "image/png"}), exact);
  if (!seen) return;
  sizeTo(seen.width, seen.height);
  const clear = options.background === "transparent";
  canvas.classList.toggle("clear", clear);
  if (clear) context.clearRect(0, 0, canvas.width, canvas.height);
  context.imageSmoothingEnabled = image.width < canvas.width;
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  image.close();
  if (header.is_final) final = {id: header.id, revision: seen.revision, bytes, width: header.width, height: header.height};
  tell(header);
  began_to_come(header.id);
}

/** Draws tiles: x, y, width and height as u16, then red, green and blue of each pixel. */
function onTiles(header, body) {
  if (header.id !== asked || !seen) return;
  sizeTo(seen.width, seen.height);
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  for (let at = 0; at < body.length;) {
    const [x, y, width, height] = [0, 2, 4, 6].map(k => view.getUint16(at + k, true));
    at += 8;
    const tile = context.createImageData(width, height);
    for (let pixel = 0; pixel < width * height; pixel += 1, at += 3) {
      tile.data.set([body[at], body[at + 1], body[at + 2], 255], 4 * pixel);
    }
    context.putImageData(tile, x, y);
  }
  began_to_come(header.id);
}

// ---- what the page tells ----

function tell(header) {
  const share = header.is_final ? 1 : header.width < seen.width ? 0.02 : header.samples / header.of_samples;
  $("bar").style.width = `${100 * share}%`;
  $("bar").classList.toggle("done", header.is_final);
  const samples = header.of_samples > 1 ? `${header.samples} of ${header.of_samples} samples` : "";
  const coarse = header.width < seen.width ? "coarse" : "";
  const rays = header.is_final ? `${(header.rays / 1e6).toFixed(1)} M rays` : "";
  $("what").textContent = [`${seen.width} × ${seen.height}`, seen.integrator, coarse || samples,
    header.is_final ? "complete" : ""].filter(x => x).join(" · ");
  $("how").textContent = header.legend || [rays, `${header.seconds.toFixed(2)} s`].filter(x => x).join(" · ");
}

function notice(text) {
  $("notice").textContent = text;
  $("notice").hidden = !text;
}

function line(parent, kind, text, name) {
  const element = document.createElement(kind);
  element.textContent = text;
  if (name) element.className = name;
  parent.append(element);
  return element;
}

function number(x) {
  if (x === null) return "∞";
  return Math.abs(x) >= 1e5 || (x !== 0 && Math.abs(x) < 1e-3) ? x.toExponential(6) : String(Number(x.toPrecision(9)));
}

function onProbed(said) {
  const box = $("ray");
  box.replaceChildren();
  window.lanecast.probed = said;
  if (!said.report) {
    line(box, "p", said.error, "quiet");
    return;
  }
  const {dir, spans, surfaces_left_out: left} = said.report;
  const length = Math.hypot(...dir);
  line(box, "p", `Pixel ${said.x}, ${said.y}: ${spans.length || "no"} span${spans.length === 1 ? "" : "s"} in solids`, "quiet");
  for (const span of spans) {
    const row = line(box, "div", "", `span ${span.side}`);
    line(row, "b", span.solid);
    const thick = span.t_enter === null || span.t_exit === null ? null : (span.t_exit - span.t_enter) * length;
    line(row, "div", `${span.side}, t ${span.t_enter === null ? "−∞" : number(span.t_enter)} to ${number(span.t_exit)}`);
    line(row, "div", `length ${number(thick)}`);
    for (const [what, end] of [["in", span.enter], ["out", span.exit]]) {
      if (!end) continue;
      const point = line(row, "div", `${what}: ${end.shape}, ${end.material || "no material"}`);
      point.title = `point ${end.point.join(", ")}\nnormal ${end.normal.join(", ")}`;
    }
  }
  if (left) line(box, "p", `${left} instance${left === 1 ? "" : "s"} without an inside left out`, "quiet");
  if (said.command) line(box, "code", said.command);
}

// ---- hands ----

const held = new Map();   // pointers that are down, by id
let way = 0, pinch = null;

function at(event) {
  return [event.clientX, event.clientY];
}

canvas.addEventListener("pointerdown", event => {
  canvas.setPointerCapture(event.pointerId);
  held.set(event.pointerId, at(event));
  canvas.classList.add("held");
  canvas.focus();
  way = held.size > 1 ? Infinity : 0;
  pinch = null;
});

canvas.addEventListener("pointermove", event => {
  const before = held.get(event.pointerId);
  if (!before) return;
  const now = at(event);
  held.set(event.pointerId, now);
  const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
  way += Math.hypot(dx, dy);
  // A hand that clicks shakes a little.
  const STILL = 4;
  if (way < STILL) return;
  const height = canvas.getBoundingClientRect().height;
  if (held.size > 1) {
    const [a, b] = [...held.values()];
    const apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
    const factor = pinch ? pinch / Math.max(apart, 1) : 1;
    pinch = apart;
    move(from => zoomed(panned(from, dx / height / 2, dy / height / 2), factor));
  } else if (event.shiftKey || event.buttons & 6) {
    move(from => panned(from, dx / height, dy / height));
  } else {
    // A drag over the picture's height is half a turn.
    move(from => orbited(from, Math.PI * dx / height, Math.PI * dy / height));
  }
});

function release(event) {
  if (!held.delete(event.pointerId)) return;
  if (!held.size) canvas.classList.remove("held");
  if (event.type === "pointerup" && way < 4 && event.button === 0) probe(event);
}
canvas.addEventListener("pointerup", release);
canvas.addEventListener("pointercancel", release);
canvas.addEventListener("contextmenu", event => event.preventDefault());
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  const lines = event.deltaMode === 1 ? 33 : 1;
  move(from => zoomed(from, Math.exp(event.deltaY * lines * 0.0015)));
}, {passive: false});

function probe(event) {
  if (!seen || !socket || socket.readyState !== WebSocket.OPEN) return;
  const box = canvas.getBoundingClientRect();
  const pixel = (place, from, length, count) =>
    Math.min(count - 1, Math.max(0, Math.floor((place - from) / length * count)));
  const x = pixel(event.clientX, box.left, box.width, seen.width);
  const y = pixel(event.clientY, box.top, box.height, seen.height);
  const stage = $("stage").getBoundingClientRect();
  $("mark").style.left = `${event.clientX - stage.left}px`;
  $("mark").style.top = `${event.clientY - stage.top}px`;
  $("mark").hidden = false;
  socket.send(JSON.stringify({kind: "probe", id: asked, options, x, y}));
}

function unmark() {
  $("mark").hidden = true;
}

function stops() {
  const value = Number(options.exposure || 0);
  return value > 0 ? `+${value}` : String(value);
}

function expose(value) {
  const bounded = Math.min(6, Math.max(-6, value));
  $("exposure").value = bounded;
  set("exposure", bounded === 0 ? "" : String(bounded));
  $("stops").textContent = stops();
}

const ACTIONS = {
  // The direction stays, and so does the projection.
  fit: () => { options.fit = ""; pose = null; unmark(); look(); },
  home: () => { choose($("camera"), home.camera || ""); place(home); },
  help: () => $("help").showModal(),
  panel: () => document.body.classList.toggle("folded"),
  copy: () => navigator.clipboard.writeText($("command").textContent).catch(() => {
    // Without the right to write, what is to be copied is selected.
    getSelection().selectAllChildren($("command"));
  }),
  save: () => {
    if (!final) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([final.bytes], {type: "image/png"}));
    link.download = `${$("name").textContent.replace(/\.[^.]*$/, "") || "lanecast"}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  },
};

window.addEventListener("keydown", event => {
  if ($("help").open || event.ctrlKey || event.metaKey || event.altKey || /SELECT|INPUT/.test(event.target.tagName)) return;
  const TURN = Math.PI / 24, PACE = 1.15;
  const act = {
    f: ACTIONS.fit, h: ACTIONS.home, c: ACTIONS.copy, s: ACTIONS.save, p: ACTIONS.panel, "?": ACTIONS.help,
    "[": () => expose(Number(options.exposure || 0) - 0.25),
    "]": () => expose(Number(options.exposure || 0) + 0.25),
    "+": () => move(from => zoomed(from, 1 / PACE)), "=": () => move(from => zoomed(from, 1 / PACE)),
    "-": () => move(from => zoomed(from, PACE)),
    ArrowLeft: () => move(from => orbited(from, TURN, 0)), ArrowRight: () => move(from => orbited(from, -TURN, 0)),
    ArrowUp: () => move(from => orbited(from, 0, TURN)), ArrowDown: () => move(from => orbited(from, 0, -TURN)),
    Escape: () => { unmark(); notice(""); },
  }[event.key] || (SIDES[event.key - 1] && (() => place({view: SIDES[event.key - 1]})));
  if (!act) return;
  event.preventDefault();
  act();
});

// ---- the panel ----

function fill(select, rows) {
  select.replaceChildren(...rows.map(([value, text]) => new Option(text, value)));
}

/** Chooses a value, which is added if it is not among those that are known. */
function choose(select, value) {
  if (![...select.options].some(option => option.value === value)) select.add(new Option(value, value));
  select.value = value;
}

for (const [row, side] of SIDES.entries()) {
  const button = line($("sides"), "button", side);
  button.title = `From ${side}, by parallel rays (${row + 1})`;
  button.onclick = () => place({view: side});
}
for (const button of document.querySelectorAll("[data-do]")) button.onclick = ACTIONS[button.dataset.do];
for (const name of ["integrator", "precision", "spp", "background", "view-transform", "shutter"]) {
  $(name).onchange = () => set(name, $(name).value);
}
$("camera").onchange = () => place($("camera").value === "" ? {} : {camera: $("camera").value});
$("scale").onchange = look;
$("exposure").oninput = () => expose(Number($("exposure").value));
$("frame").oninput = () => {
  const frame = Number($("frame").value);
  $("number").textContent = frame;
  // The beginning needs no frame to be named.
  set("frames", frame === 0 ? "" : `${frame}..${frame + 1}`);
};
$("fold").onclick = ACTIONS.panel;
for (const [key, what] of KEYS) {
  line($("keys"), "dt", key);
  line($("keys"), "dd", what);
}
new ResizeObserver(() => { if (began && !fixedSize) look(); }).observe($("stage"));

// What scripts read: the state, and the last complete picture.
window.lanecast = {
  get state() {
    const isFinal = final && final.id === asked && final.revision === seen.revision;
    return {asked, waits, wanted, options: {...options}, seen, final: isFinal};
  },
  get bytes() { return final && final.bytes; },
  probed: null,
};
connect();
