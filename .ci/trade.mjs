// The walk of `.ci/trade`: lanecast and a folder for pages and screenshots are its arguments.
import {execFileSync} from "node:child_process";
import {mkdirSync, mkdtempSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {basename, join, resolve} from "node:path";
import {pathToFileURL} from "node:url";

const {chromium} = await import(process.env.PLAYWRIGHT);
const lanecast = resolve(process.argv[2]), folder = resolve(process.argv[3]);
mkdirSync(folder, {recursive: true});
const scenes = process.env.SCENES.split(/\s+/).filter(name => name);
let wrong = 0;

function check(is, what) {
  console.log(`${is ? "ok   " : "WRONG"} ${what}`);
  if (!is) wrong += 1;
}

const profile = mkdtempSync(join(tmpdir(), "lanecast-profile-"));
const browser = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.BROWSER_PATH,
  headless: true,
  offline: true,
  viewport: {width: 1280, height: 900},
  permissions: ["clipboard-read", "clipboard-write"],
  args: ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync"],
});
try {
  for (const scene of scenes) await read(scene);
} catch (error) {
  check(false, error.stack);
} finally {
  await browser.close();
  rmSync(profile, {recursive: true, force: true});
}
console.log(`${wrong} wrong; pages and screenshots are in ${folder}`);
process.exit(wrong ? 1 : 0);

/** Makes the page of a scene, and reads it. */
async function read(scene) {
  const name = basename(scene).replace(/\.[^.]*$/, "");
  const file = join(folder, `${name}.html`);
  const start = performance.now();
  execFileSync(lanecast, ["tradeoff", scene, "--size", process.env.SIZE, "--reps", "1", "--converged", "64",
    "--html", file], {stdio: ["ignore", "ignore", "inherit"]});
  console.log(`     ${scene}: its page is made in ${((performance.now() - start) / 1000).toFixed(1)} s`);
  const page = await browser.newPage();
  const errors = [], asked = [];
  page.on("pageerror", error => errors.push(String(error)));
  page.on("console", message => errors.push(message.text()));
  page.on("request", request => { if (!/^(file|data):/.test(request.url())) asked.push(request.url()); });
  await page.goto(pathToFileURL(file).href);
  await page.waitForFunction(() => [...document.querySelectorAll(".pair img")].every(image => image.naturalWidth));
  await page.screenshot({path: join(folder, `${name}.png`), fullPage: true});

  const cut = await page.evaluate(() => [...document.querySelectorAll(".figure")]
    .filter(figure => figure.scrollWidth > figure.clientWidth).length);
  check(cut === 0, `${name}: ${cut} figures are wider than the page`);
  const named = await page.locator("svg text.name").count();
  const front = await page.locator("tr.front").count();
  check(named > 0 && named <= front, `${name}: ${named} of ${front} ways on the front are named in the plot`);

  // The sliders, by the keyboard, as they are reached without a mouse.
  const pair = page.locator(".pair");
  const shown = async () => (await pair.screenshot()).toString("base64");
  const before = await shown();
  await page.locator(".cut").fill("10");
  const moved = await shown();
  check(moved !== before, `${name}: the border moves`);
  const box = await page.locator(".cut").boundingBox();
  await page.mouse.move(box.x + 0.1 * box.width, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.9 * box.width, box.y + box.height / 2, {steps: 5});
  await page.mouse.up();
  check(await shown() !== moved, `${name}: the border is dragged`);
  await page.locator(".cut").fill("50");
  check(await shown() === before, `${name}: the border moves back`);
  await page.locator(".gain").fill("3");
  check(await shown() !== before, `${name}: the difference shows`);
  await page.screenshot({path: join(folder, `${name}.difference.png`)});
  await page.locator(".gain").fill("0");

  // Each row shows its picture, and copies its command.
  const rows = await page.locator("tr[data-way]").count();
  let copied = 0, rendered = 0;
  for (let k = 0; k < rows; k += 1) {
    const row = page.locator("tr[data-way]").nth(k);
    await row.locator("button").click();
    const command = await row.locator("button").getAttribute("data-command");
    const held = await page.evaluate(() => navigator.clipboard.readText());
    if (held === command) copied += 1;
    else check(false, `${name}: ${command} is copied as ${held}`);
    // Those that took long are left out.
    if (Number(await row.locator("td").nth(2).textContent()) > 2) continue;
    rendered += 1;
    execFileSync("sh", ["-c", `"$0" ${command.slice("lanecast ".length)} -o "$1" 2>"$1.txt"`, lanecast, join(folder, `${name}.made.png`)],
      {stdio: ["ignore", "ignore", "inherit"]});
    rmSync(join(folder, `${name}.made.png.txt`));
  }
  check(rows > 4 && copied === rows, `${name}: ${copied} of ${rows} commands are copied, and ${rendered} of them render`);
  const [left] = await page.locator("select").all();
  await page.locator("tr[data-way] td").nth(0).click();
  check(await left.inputValue() === await page.locator("tr[data-way]").nth(0).getAttribute("data-way"),
    `${name}: a click on a row shows its picture`);
  check(errors.length === 0, `${name}: the console is quiet ${errors.join("; ")}`);
  check(asked.length === 0, `${name}: nothing is asked of a network ${asked.join(" ")}`);
  // A phone's width.
  await page.setViewportSize({width: 390, height: 844});
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= 390, `${name}: a narrow page needs no scrolling to the side: ${wide} of 390 pixels`);
  await page.screenshot({path: join(folder, `${name}.narrow.png`), fullPage: true});
  await page.close();
}
