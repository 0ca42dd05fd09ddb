// The story: five cards, each a sentence, the picture of a state, and one thing to do; and what plays by itself.
import { stateOfLink } from "./state.js";
import { radiusBounds } from "./transport.js";

const PACE = 650; // milliseconds that each picture of a sequence stays

const CARDS = [
  { title: "Light that was reflected", link: "mode=global", act: "Bounces off, and on",
    text: "Lamps light walls, and walls light walls: without what was reflected more than once, corners go dark.",
    run: (app) => app.change({ view: app.state.view.kind === "all" ? sum(1) : all(app) }) },
  { title: "One bounce at a time", link: "mode=global&bounce=0", act: "▶ Play the bounces",
    text: "K sends light on by one bounce; E, KE, K²E, … add up to the room, and each is weaker than the last.",
    run: (app) => play(app, bounces(app)) },
  { title: "Whiter walls", link: "mode=global&rho=0.5", act: "▶ Whiten the walls",
    text: "Every bounce counts the reflectance once more, so a little more of it is a lot more light.",
    run: (app) => play(app, range(0.5, 1.3, 9).map((rho) => ({ rho })), 200) },
  { title: "Light through walls", link: "mode=global&bounce=4", act: "▶ Let light through",
    text: "With tau, surfaces let light pass and still reflect it: shadows fade, and every bounce grows.",
    run: (app) => play(app, range(0, 1, 11).map((tau) => ({ tau })), 200) },
  { title: "Why it explodes", link: "mode=shadowless&term=1&scaled=no", act: "▶ Play, unscaled",
    text: "Where one bounce sends on more than it got, the radius is above 1: terms grow until all is white.",
    run: (app) => play(app, explosion(app), 500) }, ];

const sum = (n) => ({ kind: "sum", n });
const all = (app) => ({ kind: "all", n: app.scene.terms });
const range = (from, to, count) => Array.from({ length: count }, (_, k) => from + ((to - from) * k) / (count - 1));

// The sum up to 0, 1, 2, … and all of it.
export function bounces(app) {
  return [...range(0, app.scene.terms, app.scene.terms + 1).map((n) => ({ view: sum(n) })), { view: all(app) }];
}

// The radius grows past 1 with the reflectance; then term after term, none exposed for itself.
function explosion(app) {
  const most = Math.min(3, Math.max(1, 1.8 / radiusBounds(app.scene.radii, 1).lower));
  const terms = range(1, app.scene.terms, app.scene.terms).map((n) => ({ view: { kind: "term", n }, scaled: false }));
  const walls = range(0.6, most, 6).map((rho) => ({ alpha: 1, tau: 1, rho, ...terms[0] }));
  return [...walls, ...terms];
}

// Shows one state after the other, until somebody touches anything.
export function play(app, parts, delay = PACE) {
  stop(app);
  const next = () => {
    app.change(parts[0]);
    parts = parts.slice(1);
    app.playing = parts.length > 0 ? setTimeout(next, delay) : null;
  };
  next();
}

export function stop(app) {
  clearTimeout(app.playing);
  app.playing = null;
}

// Opens the story at a card, 1 … 5, in its state; 0 closes it. Cards of links come in the link's own state.
export function openCard(app, number, link = CARDS[number - 1]?.link) {
  const element = document.getElementById("story");
  stop(app);
  app.story = number;
  document.body.classList.toggle("told", number > 0 && app.scene.story);
  element.hidden = number === 0;
  if (number === 0) return app.change({});
  const { title, text, act } = CARDS[number - 1];
  const button = (card, sign, name) => `<button type="button" data-card="${card}" aria-label="${name}"
    ${card > CARDS.length || (card === 0 && sign === "‹") ? "disabled" : ""}>${sign}</button>`;
  element.innerHTML = `<header><span class="note">${number} of ${CARDS.length}</span><span>
    ${button(number - 1, "‹", "Card before")} ${button(number + 1, "›", "Next card")}
    ${button(0, "✕", "Close the story")}</span></header><h2>${title}</h2><p>${text}</p>
    <p class="buttons"><button type="button" data-card="act" class="act">${act}</button></p>`;
  if (link !== null) app.change(stateOfLink(app.scene, link).state);
}

// Starts the story: its buttons, and the card that a link names, or the first, which moves by itself once.
export function startStory(app, link, isTest) {
  const asked = /(?:^#|&)story=([0-5])(?:&|$)/.exec(link);
  document.getElementById("story").addEventListener("click", ({ target }) => {
    const { card } = target.dataset;
    if (card === "act") CARDS[app.story - 1].run(app);
    else if (card) openCard(app, Number(card));
  });
  for (const type of ["pointerdown", "keydown", "wheel"]) {
    window.addEventListener(type, () => stop(app), { capture: true, passive: true });
  }
  document.getElementById("open-story").addEventListener("click", () => openCard(app, 1));
  document.getElementById("play").addEventListener("click", () => play(app, bounces(app)));
  if (asked) openCard(app, Number(asked[1]), link.replace(/^#/, "").split("&").length > 1 ? null : undefined);
  else if (link.length < 2 && !isTest) openCard(app, 1, null);
  if (link.length < 2 && !matchMedia("(prefers-reduced-motion: reduce)").matches) play(app, bounces(app), PACE / 2);
}
