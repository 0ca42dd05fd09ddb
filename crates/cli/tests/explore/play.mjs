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
  for (let k = 0; k < 60; k++) {
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
  for (const id of ["view", "alpha", "tau", "bounce", "rho", "stops", "play", "theme", "home", "open-plan", "save", "copy"]) assert(reached.has(id), id);
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

// Terms in the equation and bars are buttons; bars that are dragged over are a sum.
async function touchesTheEquation(page) {
  await page.locator("#equation [data-n='2']").click();
  await comesTo(() => valueOf(page, "term"), "2");
  assert.match(await page.locator("#part").innerText(), /^K²E alone, × \d/);
  const colourOf = (selector) => page.locator(selector).first().evaluate((e) => getComputedStyle(e).getPropertyValue("--term"));
  const colours = await Promise.all(["#equation [data-n='2']", "#bars g.in", "#picture"].map(colourOf));
  assert.equal(new Set(colours).size, 1, colours.join());
  await page.locator("#equation [data-n='2']").click();
  await comesTo(() => valueOf(page, "term"), null);
  await page.locator("#bars").scrollIntoViewIfNeeded();
  const bars = await page.locator("#bars g.in").evaluateAll((all) => all.map((e) => e.getBoundingClientRect().x + 5));
  const { y } = await page.locator("#bars svg").boundingBox();
  await page.mouse.move(bars[1], y + 60);
  await page.mouse.down();
  await page.mouse.move(bars[3], y + 60, { steps: 6 });
  await page.mouse.up();
  await comesTo(() => valueOf(page, "terms"), "1-3");
  await page.locator("[name=mode][value=one-bounce]").check();
  await settle(page);
  assert.match(await page.locator("#equation .zero").first().innerText(), /= 0/);
  await page.goto(`${address}#mode=global`);
  await comesTo(() => page.locator("[name=mode]:checked").inputValue(), "global");
  await settle(page);
}

const radiusOf = async (page) => Number(/radius ([\d.]+)/.exec(await verdictOf(page))[1]);

// Half of the reflectance is half of the radius, proved; another material moves it too, estimated.
async function changesReflectance(page) {
  const before = await radiusOf(page);
  await page.locator("#rho").fill("0.5");
  await comesTo(() => valueOf(page, "rho"), "0.5");
  assert(Math.abs((await radiusOf(page)) / before - 0.5) < 0.01);
  await page.locator("#rho").fill("1");
  const box = await page.locator("#view").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + 0.8 * box.height);
  await page.locator("#rho-own").fill("0");
  await settle(page);
  assert.match(await verdictOf(page), /estimated/);
  assert((await radiusOf(page)) < before);
  assert.match(await linkOf(page), /rho-[^=]+=0/);
  await page.locator("#rho-own").fill("1");
  await page.keyboard.press("Escape");
}

async function tellsTheStory() {
  const page = await opened();
  assert.match(await page.locator("#story").innerText(), /1 of 5/);
  await page.locator("[data-card='2']").click();
  await settle(page);
  await comesTo(() => valueOf(page, "story"), "2");
  await page.locator("[data-card='0']").click();
  assert(await page.locator("#story").isHidden());
  await page.context().close();
  const last = await opened({}, "#story=5");
  await last.locator(".act").click();
  await comesTo(async () => await valueOf(last, "term"), "8");
  assert.match(await verdictOf(last), /Diverges/);
  await last.context().close();
}

// Dark and light as the browser asks for, and the other by the button.
async function hasThemes() {
  for (const colorScheme of ["light", "dark"]) {
    const page = await opened({ colorScheme }, "#mode=global");
    const sumOf = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/\d+/g).reduce((a, x) => a + +x, 0));
    assert.equal((await sumOf()) > 380, colorScheme === "light");
    await page.locator("#theme").click();
    assert.equal((await sumOf()) > 380, colorScheme === "dark");
    await page.context().close();
  }
}

async function fitsSmallWindows() {
  for (const [width, height] of [[390, 844], [640, 360], [360, 640], [200, 200]]) {
    const page = await opened({ viewport: { width, height }, hasTouch: true }, "#story=3");
    const wide = await page.evaluate(() => [document.documentElement, ...document.querySelectorAll("body *")]
      .filter((e) => !e.closest("svg, .unseen, dialog")).reduce((most, e) => Math.max(most, e.getBoundingClientRect().right), 0));
    assert(wide <= width + 0.5, `${wide} wide in ${width}`);
    const box = await page.locator("#view").boundingBox();
    assert(box.width > 0.5 * width && box.height > (height > 300 ? 0.33 * height : 40), `${box.width} by ${box.height}`);
    if (height === 360) assert(box.height >= 0.5 * height);
    await page.touchscreen.tap(box.x + box.width / 2, box.y + 0.6 * box.height);
    await page.locator("#card").waitFor({ state: "visible" });
    const card = await page.locator("#card").boundingBox();
    assert(card.x >= box.x + box.width || card.y >= box.y + box.height || height === 200, "the card covers the picture");
    await page.context().close();
  }
}

const page = await opened({}, "#mode=global");
for (const act of [dragsSliders, dimsLamps, touchesTheEquation, changesReflectance, asksForPatches, walks, copiesLinks]) {
  await act(page);
}
for (const act of [usesTheKeyboardAlone, readsBrokenLinks, isReadableWithoutWebgl, tellsTheStory, hasThemes, fitsSmallWindows]) {
  await act();
}
await browser.close();
assert.deepEqual(faults, []);
