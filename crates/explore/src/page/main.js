// Opens the page: decodes the scene, starts WebGL2, and joins the parts.
import { App } from "./app.js";
import { Charts, triangleBuffers } from "./charts.js";
import { runTest, tellTest, testOf } from "./check.js";
import { showMessage, startButtons, startControls } from "./controls.js";
import { Light } from "./light.js";
import { decodedArrays, inflated } from "./numbers.js";
import { PatchCard } from "./patch.js";
import { Patches } from "./patches.js";
import { Plan } from "./plan.js";
import { startStory } from "./story.js";
import { loadedImages, View } from "./view.js";
import { startWalking } from "./walk.js";

const NO_WEBGL = "No room is drawn: this browser has no WebGL2, or it is switched off. Switch on hardware acceleration, "
  + "or open this page in a current browser. The numbers beside still follow the sliders.";

const MOST_PROBLEMS = 5;

// The smallest and the largest unit coordinates of the scene.
function boundsOf({ x, y, z }) {
  const end = (pick, first) => [x, y, z].map((places) => places.reduce((found, place) => pick(found, place), first));
  return [end(Math.min, Infinity), end(Math.max, -Infinity)];
}

// The view of the scene, or null where WebGL2 is missing.
async function webglView(canvas, scene, arrays, charts) {
  const options = { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" };
  const gl = canvas.getContext("webgl2", options);
  if (!gl) return null;
  canvas.addEventListener("webglcontextlost", () => {
    showMessage("The graphics driver stopped: reload the page.");
    for (const id of ["home", "open-plan", "save"]) document.getElementById(id).disabled = true;
  });
  const images = await loadedImages(scene.textures);
  return new View(gl, scene, arrays, charts, triangleBuffers(scene, arrays, charts), images);
}

// Names what is wrong in a link, of many things the first.
function tellProblems(problems) {
  if (problems.length === 0) return;
  const named = problems.slice(0, MOST_PROBLEMS).map((text) => (text.length > 80 ? `${text.slice(0, 80)}…` : text));
  const more = problems.length > MOST_PROBLEMS ? `; and ${problems.length - MOST_PROBLEMS} more` : "";
  showMessage(`In the link: ${named.join("; ")}${more}. The rest of it is shown.`);
}

function startView(app, arrays) {
  const card = new PatchCard(app);
  startWalking(app, (x, y) => card.ask(x, y), (event) => card.hover(event));
  const plan = new Plan(app, boundsOf(arrays));
  new ResizeObserver(() => app.schedule()).observe(app.canvas);
  return plan;
}

async function start() {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const arrays = decodedArrays(scene.arrays, await inflated(document.getElementById("numbers").textContent));
  document.getElementById("title").textContent = scene.title;
  const charts = new Charts(scene, arrays);
  const canvas = document.getElementById("view");
  const app = new App(scene, new Light(scene, arrays), new Patches(scene, arrays, charts), canvas);
  const link = location.hash;
  app.view = await webglView(canvas, scene, arrays, charts);
  if (!app.view) showMessage(NO_WEBGL, false);
  startControls(app);
  const plan = startView(app, arrays);
  startButtons(app, () => plan.open());
  tellProblems(app.readLink(link));
  window.addEventListener("hashchange", ({ newURL }) => tellProblems(app.readLink(new URL(newURL).hash)));
  app.frame();
  app.view?.gl.finish();
  const test = testOf(link);
  startStory(app, link, test);
  if (test) runTest(app, test, link, Math.round(performance.now()));
}

start().catch((error) => {
  showMessage(`The page could not be opened: ${error.message}`, false);
  if (testOf(location.hash)) tellTest({ webgl2: false, states: [], error: error.message });
});
