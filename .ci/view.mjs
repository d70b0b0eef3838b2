// The walk of `.ci/view`: lanecast and a folder for screenshots are its arguments.
import {execFileSync, spawn} from "node:child_process";
import {createHash} from "node:crypto";
import {closeSync, mkdtempSync, openSync, readFileSync, rmSync, writeFileSync, writeSync} from "node:fs";
import {request} from "node:http";
import {tmpdir} from "node:os";
import {join, resolve} from "node:path";

const {chromium} = await import(process.env.PLAYWRIGHT);
const lanecast = resolve(process.argv[2]), shots = resolve(process.argv[3]);
const work = mkdtempSync(join(tmpdir(), "lanecast-view-"));
const play = Number(process.env.SECONDS_OF_PLAY || 20);
const triangles = Number(process.env.TRIANGLES || 0);
let wrong = 0;

function check(is, what) {
  console.log(`${is ? "ok   " : "WRONG"} ${what}`);
  if (!is) wrong += 1;
}
const hash = bytes => createHash("sha256").update(bytes).digest("hex").slice(0, 16);
const sleep = seconds => new Promise(done => setTimeout(done, 1000 * seconds));

/** Starts a server; returns it and its address. */
async function serve(...more) {
  const server = spawn(lanecast, ["view", ...more], {cwd: work, stdio: ["ignore", "pipe", "inherit"]});
  const url = await new Promise((found, fail) => {
    let text = "";
    server.stdout.on("data", bytes => {
      text += bytes;
      if (text.includes("\n")) found(text.split("\n")[0]);
    });
    server.on("exit", code => fail(new Error(`the server ended with ${code}`)));
  });
  server.removeAllListeners("exit");
  return {server, url, pid: server.pid};
}

const state = page => page.evaluate(() => window.lanecast.state);

async function until(page, what, seconds = 60) {
  await page.waitForFunction(what, null, {timeout: 1000 * seconds, polling: 10});
}
const complete = page => until(page, () => {
  const {final, waits, wanted} = window.lanecast.state;
  return final && !waits && !wanted;
}, 300);

/** Compares the last picture with the file that its command writes. */
async function compare(page, what) {
  const bytes = Buffer.from(await page.evaluate(() => Array.from(window.lanecast.bytes)));
  const command = await page.textContent("#command");
  const file = join(work, "made.png");
  execFileSync("sh", ["-c", `"$0" ${command.slice("lanecast ".length)} -o "$1"`, lanecast, file], {cwd: work});
  check(hash(bytes) === hash(readFileSync(file)), `${what}: the bytes of ${command}`);
  // And what the canvas shows are the pixels of the file.
  const same = await page.evaluate(async base64 => {
    const blob = new Blob([Uint8Array.from(atob(base64), c => c.charCodeAt(0))], {type: "image/png"});
    const image = await createImageBitmap(blob, {colorSpaceConversion: "none", premultiplyAlpha: "none"});
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    canvas.getContext("2d").drawImage(image, 0, 0);
    const pixels = c => c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
    const [a, b] = [pixels(canvas), pixels(document.getElementById("picture"))];
    return a.length === b.length && a.every((x, k) => x === b[k]);
  }, readFileSync(file).toString("base64"));
  check(same, `${what}: the canvas shows it`);
}

function status(url, headers) {
  return new Promise((done, fail) => {
    request(url, {headers}, answer => { answer.resume(); done(answer.statusCode); }).on("error", fail).end();
  });
}

const resident = pid => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${pid}/status`, "utf8"))[1]) / 1024;

const profile = mkdtempSync(join(tmpdir(), "lanecast-profile-"));
const browser = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.BROWSER_PATH,
  headless: true,
  viewport: {width: 1280, height: 720},
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync"],
});
const servers = [];
try {
  if (play) await walk();
  if (triangles) await large();
} catch (error) {
  check(false, error.stack);
} finally {
  await browser.close();
  servers.forEach(server => server.kill());
  [work, profile].forEach(folder => rmSync(folder, {recursive: true, force: true}));
}
console.log(`${wrong} wrong; screenshots are in ${shots}`);
process.exit(wrong ? 1 : 0);

/** Looks at a part as a user would. */
async function walk() {
  const scene = join(work, "part.toml");
  const text = readFileSync("scenes/csg_bracket.toml", "utf8");
  writeFileSync(scene, text);
  const {server, url} = await serve("part.toml");
  servers.push(server);

  const page = await browser.newPage();
  const errors = [];
  page.on("pageerror", error => errors.push(String(error)));
  page.on("console", message => { if (message.type() === "error") errors.push(message.text()); });
  const opened = performance.now();
  await page.goto(url);
  await until(page, () => {
    const canvas = document.getElementById("picture");
    if (!canvas.width) return false;
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return data.some((x, k) => k % 4 < 3 && x > 0);
  });
  const first = performance.now() - opened;
  check(first < 1000, `a picture ${first.toFixed(0)} ms after the page is asked for`);
  await complete(page);
  await compare(page, "at first");
  await page.screenshot({path: join(shots, "first.png")});

  // Drags.
  const before = (await state(page)).asked;
  await page.mouse.move(400, 300);
  await page.mouse.down();
  for (let k = 1; k <= 20; k += 1) await page.mouse.move(400 + 12 * k, 300 - 4 * k);
  await page.mouse.up();
  await page.mouse.wheel(0, -240);
  await sleep(0.2);
  await complete(page);
  check((await state(page)).asked > before && "eye" in (await state(page)).options, "a drag moves the eye");
  await compare(page, "after a drag");
  await page.screenshot({path: join(shots, "dragged.png")});

  // A click.
  const box = await page.locator("#picture").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await until(page, () => window.lanecast.probed);
  const probed = await page.evaluate(() => window.lanecast.probed);
  const told = JSON.parse(execFileSync("sh", ["-c", `"$0" ${probed.command.slice("lanecast ".length)} --json -`, lanecast],
    {cwd: work, encoding: "utf8"}));
  check(JSON.stringify(told) === JSON.stringify(probed.report) && told.spans.length > 0,
    `a click lists what probe lists: ${told.spans.length} spans`);
  await page.screenshot({path: join(shots, "probed.png")});

  // Views, integrators, precision.
  for (const [what, act] of [
    ["from the top", () => page.keyboard.press("5")],
    ["feature lines", () => page.selectOption("#integrator", "edges")],
    ["cost", () => page.selectOption("#integrator", "heat")],
    ["iso", () => page.keyboard.press("7")],
    ["depth", () => page.selectOption("#integrator", "depth")],
    ["colours without light", () => page.selectOption("#integrator", "albedo")],
    ["paths", async () => { await page.selectOption("#integrator", "path"); await page.selectOption("#spp", "16"); }],
    ["normals, whatever the samples", () => page.selectOption("#integrator", "normals")],
    ["paths again", () => page.selectOption("#integrator", "path")],
    ["fast", () => page.selectOption("#precision", "fast")],
    ["fitted", () => page.keyboard.press("f")],
    ["brighter", () => page.keyboard.press("]")],
    ["turned by keys", () => page.keyboard.press("ArrowLeft")],
    ["transparent", () => page.selectOption("#background", "transparent")],
    ["home", () => page.keyboard.press("h")],
  ]) {
    await page.locator("#picture").focus();
    await act();
    await sleep(0.1);
    await complete(page);
    await compare(page, what);
  }
  await page.screenshot({path: join(shots, "transparent.png")});
  await page.keyboard.press("?");
  await page.screenshot({path: join(shots, "keys.png")});
  await page.keyboard.press("Escape");

  // Edits.
  const asked = performance.now();
  writeFileSync(scene, text.replace(/base_color = \[[^\]]*\]/, "base_color = [0.05, 0.6, 0.2]"));
  await until(page, () => window.lanecast.state.seen.revision === 2);
  const shown = performance.now() - asked;
  check(shown < 1000, `an edit shows after ${shown.toFixed(0)} ms`);
  await complete(page);
  const bytes = await page.evaluate(() => window.lanecast.bytes.length);
  writeFileSync(scene, text.replace(/\[\[instance\]\]/, "[[instance]]\nshpae = 'x'"));
  await until(page, () => /part\.toml:\d+/.test(document.getElementById("notice").textContent), 5);
  check(bytes === await page.evaluate(() => window.lanecast.bytes.length),
    `a broken edit tells where: ${(await page.textContent("#notice")).split("\n")[0]}`);
  await page.screenshot({path: join(shots, "broken.png")});
  writeFileSync(scene, text);
  await until(page, () => document.getElementById("notice").hidden, 5);
  check(errors.length === 0, `the console is quiet ${errors.join("; ")}`);

  // Strangers.
  const plain = url.split("?")[0];
  check(await status(url, {}) === 200, "who has the token is let in");
  check(await status(url, {Host: "evil.example"}) === 403, "Host: evil.example gets 403");
  check(await status(url, {Origin: "http://evil.example"}) === 403, "a foreign Origin gets 403");
  check(await status(plain, {}) === 403, "a missing token gets 403");

  // Eight at once, and a phone.
  const pages = [];
  for (let k = 0; k < 8; k += 1) pages.push(await browser.newPage());
  const start = performance.now();
  await Promise.all(pages.map(async page => { await page.goto(url); await complete(page); }));
  check(true, `8 pages at once are complete after ${((performance.now() - start) / 1000).toFixed(1)} s`);
  await pages[0].setViewportSize({width: 390, height: 844});
  await sleep(0.3);
  await complete(pages[0]);
  await pages[0].screenshot({path: join(shots, "phone.png")});
  await Promise.all(pages.map(page => page.close()));

  // Hands that do anything.
  let seed = 1;
  const random = most => { seed = (seed * 48271) % 2147483647; return seed % most; };
  const samples = [];
  const end = performance.now() + 1000 * play;
  for (let k = 0; performance.now() < end; k += 1) {
    const at = () => [100 + random(700), 80 + random(560)];
    const [x, y] = at();
    await page.mouse.move(x, y);
    const deed = random(6);
    if (deed < 2) await page.mouse.click(x, y);
    else if (deed < 4) {
      await page.mouse.down();
      await page.mouse.move(...at(), {steps: 5});
      await page.mouse.up();
    } else if (deed < 5) await page.keyboard.press("1234567fh"[random(9)]);
    else if (k % 7 === 0) {
      const shown = ["", "normals", "depth", "albedo", "ids", "edges", "heat", "path"];
      await page.selectOption("#integrator", shown[random(shown.length)]);
      await page.locator("#picture").focus();
    }
    await sleep(0.05);
    if (k % 20 === 0) samples.push(resident(server.pid));
  }
  const early = Math.max(...samples.slice(0, Math.ceil(samples.length / 2)));
  const late = Math.max(...samples.slice(-Math.ceil(samples.length / 4)));
  check(late < 1.25 * early + 10, `${play} s of clicks and drags: ${samples.length} looks at memory, ${early.toFixed(0)} MB, then ${late.toFixed(0)} MB`);
  await page.keyboard.press("h");
  await sleep(0.2);
  await complete(page);
  await compare(page, "after all that");

  // The end.
  const ended = new Promise(done => server.on("exit", (code, signal) => done([code, signal])));
  server.kill("SIGHUP");
  const [code] = await Promise.race([ended, sleep(3).then(() => ["no"])]);
  check(code === 0, `the server ends with its terminal: exit code ${code}`);
}

/** Opens waves of many triangles, and drags them. */
async function large() {
  const side = Math.ceil(Math.sqrt(triangles / 2));
  const file = openSync(join(work, "waves.ply"), "w");
  writeSync(file, `ply\nformat binary_little_endian 1.0\nelement vertex ${(side + 1) ** 2}\nproperty float x\nproperty float y\nproperty float z\nelement face ${2 * side * side}\nproperty list uchar int vertex_indices\nend_header\n`);
  for (let j = 0; j <= side; j += 1) {
    const row = new Float32Array(3 * (side + 1));
    for (let i = 0; i <= side; i += 1) {
      const [x, z] = [2 * i / side - 1, 2 * j / side - 1];
      row.set([x, 0.1 * Math.sin(9 * x) * Math.cos(7 * z) + 0.01 * Math.sin(90 * x + 70 * z), z], 3 * i);
    }
    writeSync(file, row);
  }
  for (let j = 0; j < side; j += 1) {
    const row = Buffer.alloc(26 * side);
    for (let i = 0; i < side; i += 1) {
      const a = j * (side + 1) + i, b = a + side + 1;
      [[a, b, a + 1], [a + 1, b, b + 1]].forEach((face, k) => {
        row.writeUInt8(3, 26 * i + 13 * k);
        face.forEach((v, n) => row.writeInt32LE(v, 26 * i + 13 * k + 1 + 4 * n));
      });
    }
    writeSync(file, row);
  }
  closeSync(file);
  const start = performance.now();
  const {server, url} = await serve("waves.ply");
  servers.push(server);
  check(true, `${2 * side * side} triangles are ready after ${((performance.now() - start) / 1000).toFixed(1)} s`);
  const page = await browser.newPage();
  await page.goto(url);
  await until(page, () => window.lanecast.state.seen && !window.lanecast.state.waits, 60);
  const times = [];
  for (let k = 0; k < 20; k += 1) {
    await sleep(0.3);
    times.push(await page.evaluate(() => new Promise(done => {
      const start = performance.now();
      const before = window.lanecast.state.asked;
      document.getElementById("picture").focus();
      window.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
      const look = () => {
        const {asked, waits, wanted} = window.lanecast.state;
        if (asked > before && !waits && !wanted) done(performance.now() - start);
        else setTimeout(look, 1);
      };
      look();
    })));
  }
  times.sort((a, b) => a - b);
  check(times[times.length - 1] < 150, `from a key to the first picture: median ${times[10].toFixed(0)} ms, at most ${times.at(-1).toFixed(0)} ms`);
  await page.screenshot({path: join(shots, "large.png")});
}
