// Plays with a page as a person would: node play.mjs PAGE BROWSER PLAYWRIGHT-CORE. Ends with an error at the first thing
// that is not as it should be.
import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";

const [file, executablePath, packageFolder] = process.argv.slice(2);
const { chromium } = await import(pathToFileURL(`${packageFolder}/index.mjs`));
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const address = pathToFileURL(file).href;
const faults = [];

async function opened(options = {}, link = "", prepare = () => {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.on("pageerror", (error) => faults.push(error.stack));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || faults.push(request.url()));
  await prepare(page);
  await page.goto(address + link);
  await page.waitForFunction(() => document.querySelector("#verdict")?.textContent);
  return page;
}

const linkOf = (page) => page.evaluate(() => decodeURIComponent(location.hash));
const valueOf = async (page, key) => new URLSearchParams((await linkOf(page)).slice(1)).get(key);
const verdictOf = (page) => page.locator("#verdict").innerText();
const settle = (page) => page.waitForTimeout(400);

// What a busy machine may take its time for: a link follows the picture.
async function comesTo(read, expected) {
  for (let tries = 0; tries < 50 && (await read()) !== expected; tries += 1) {
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
  assert.equal(await read(), expected);
}

// The picture as a person sees it, and whether two of them differ.
const pictureOf = (page) => page.locator("#view").screenshot();

async function dragsSliders(page) {
  const before = await pictureOf(page);
  const tau = await page.locator("#tau").boundingBox();
  await page.mouse.move(tau.x + 3, tau.y + tau.height / 2);
  await page.mouse.down();
  await page.mouse.move(tau.x + tau.width - 3, tau.y + tau.height / 2, { steps: 8 });
  await page.mouse.up();
  await settle(page);
  await comesTo(async () => await valueOf(page, "tau") ?? await valueOf(page, "mode"), "shadowless");
  assert.match(await verdictOf(page), /No picture/i);
  assert(!before.equals(await pictureOf(page)));
  await page.locator("#bounce").fill("2");
  await settle(page);
  await comesTo(() => valueOf(page, "bounce"), "2");
  await page.locator("[name=kind][value=term]").check();
  await settle(page);
  await comesTo(() => valueOf(page, "term"), "2");
  await page.locator("[name=kind][value=sum]").check();
  await page.locator("[name=mode][value=one-bounce]").check();
  await settle(page);
  await comesTo(() => valueOf(page, "mode"), "one-bounce");
  assert.match(await verdictOf(page), /ends/i);
  await page.locator("[name=mode][value=global]").check();
}

async function dimsLamps(page) {
  await page.locator("#lamps-off").click();
  await settle(page);
  await comesTo(() => valueOf(page, "lamp"), "0");
  await page.locator("#lamps-reset").click();
  await settle(page);
  await comesTo(() => valueOf(page, "lamp"), null);
}

async function asksForPatches(page) {
  const box = await page.locator("#view").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + 0.8 * box.height);
  await page.locator("#card").waitFor({ state: "visible" });
  const card = await page.locator("#card").innerText();
  assert.match(card, /rho/i);
  const before = await pictureOf(page);
  await page.locator("#card [value=light]").check();
  await settle(page);
  assert.match(await page.locator("#card").innerText(), /\d\s%/);
  assert(!before.equals(await pictureOf(page)));
  await page.keyboard.press("Escape");
  assert(await page.locator("#card").isHidden());
}

async function walks(page) {
  await page.locator("#view").focus();
  await page.keyboard.down("w");
  await page.waitForTimeout(500);
  await page.keyboard.up("w");
  await settle(page);
  const place = await valueOf(page, "at");
  assert.match(place, /^[-\d.]+,[-\d.]+,[-\d.]+$/);
  const box = await page.locator("#view").boundingBox();
  await page.mouse.move(box.x + 300, box.y + 250);
  await page.mouse.down();
  await page.mouse.move(box.x + 380, box.y + 250, { steps: 4 });
  await page.mouse.up();
  await settle(page);
  assert.notEqual(await valueOf(page, "look"), null);
  await page.locator("#open-plan").click();
  await page.locator("#plan-view").click({ position: { x: 60, y: 60 } });
  await settle(page);
  assert(await page.locator("#plan").isHidden());
  assert.notEqual(await valueOf(page, "at"), place);
  await page.locator("#home").click();
  await settle(page);
  await comesTo(() => valueOf(page, "at"), null);
}

// The copied link leads to the same state, and a state in a link is that of the controls.
async function copiesLinks(page) {
  await page.locator("#alpha").fill("0.5");
  await page.locator("#copy").click();
  await settle(page);
  assert.match(await page.locator("#status").innerText(), /link/i);
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#save").click()]);
  assert.match(download.suggestedFilename(), /\.png$/);
  const other = await opened({}, await page.evaluate(() => location.hash));
  assert.equal(await other.locator("#alpha").inputValue(), "0.5");
  assert.equal(await verdictOf(other), await verdictOf(page));
  await other.context().close();
}

async function usesTheKeyboardAlone() {
  const page = await opened({ reducedMotion: "reduce" });
  const reached = new Set();
  for (let k = 0; k < 40; k++) {
    await page.keyboard.press("Tab");
    const [id, outline] = await page.evaluate(() => {
      const element = document.activeElement;
      const style = getComputedStyle(element);
      return [element.id || element.name || element.getAttribute("role"), style.outlineStyle !== "none" || style.boxShadow !== "none"];
    });
    if (id === "alpha" && !reached.has(id)) {
      assert(outline, "the focus is not seen");
      await page.keyboard.press("ArrowLeft");
    }
    reached.add(id);
  }
  for (const id of ["view", "alpha", "tau", "bounce", "stops", "home", "open-plan", "save", "copy"]) assert(reached.has(id), id);
  await settle(page);
  await comesTo(() => valueOf(page, "alpha"), "0.99");
  await page.context().close();
}

async function readsBrokenLinks() {
  const page = await opened({}, "#mode=foo&alpha=7&tau=x&bounce=99&lamp=1,2&at=1,2&zzz=1&stops=1&__proto__=1&%ZZ=1");
  const message = await page.locator("[role=alert]").first().innerText();
  assert.match(message, /alpha/);
  assert.equal(await page.locator("#stops").inputValue(), "1");
  await page.context().close();
}

async function isReadableWithoutWebgl() {
  const page = await opened({}, "", (bare) => bare.addInitScript(() => {
    const own = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind === "webgl2" ? null : own.call(this, kind, ...rest);
    };
  }));
  assert.match(await page.locator("body").innerText(), /WebGL ?2/);
  await page.locator("#tau").fill("0.9");
  await settle(page);
  await comesTo(() => valueOf(page, "tau"), "0.9");
  await page.context().close();
}

async function fitsSmallWindows() {
  for (const [width, height] of [[360, 640], [200, 200]]) {
    const page = await opened({ viewport: { width, height }, hasTouch: true });
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    assert(wide <= width, `${wide} wide in ${width}`);
    const box = await page.locator("#view").boundingBox();
    assert(box.width > 0.5 * width && box.height > 40);
    await page.touchscreen.tap(box.x + box.width / 2, box.y + 0.8 * box.height);
    await page.locator("#card").waitFor({ state: "visible" });
    await page.context().close();
  }
}

const page = await opened();
for (const act of [dragsSliders, dimsLamps, asksForPatches, walks, copiesLinks]) await act(page);
for (const act of [usesTheKeyboardAlone, readsBrokenLinks, isReadableWithoutWebgl, fitsSmallWindows]) await act();
await browser.close();
assert.deepEqual(faults, []);
