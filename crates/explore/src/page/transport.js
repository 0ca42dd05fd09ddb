// The equation L = E + K L in numbers: what every stored layer of light weighs in a picture at (alpha, tau), whether
// the series converges there, and the power of its terms. Pure functions of the manifest and the state.

export const MODES = {
  global: { alpha: 1, tau: 0, meaning: "Global: shadows and interreflection, as in a real room." },
  shadowless: { alpha: 1, tau: 1, meaning: "Shadowless: light interreflects, but nothing casts a shadow." },
  "one-bounce": { alpha: 0, tau: 0, meaning: "One-bounce: shadows, but light is reflected only once." },
  local: { alpha: 0, tau: 1, meaning: "Local: no shadows, one reflection, as OpenGL shades." }, };

// The mode at (alpha, tau), or null between the modes.
export function modeOf(alpha, tau) {
  return Object.keys(MODES).find((name) => MODES[name].alpha === alpha && MODES[name].tau === tau) ?? null;
}

// Lagrange's weights of the nodes for interpolation at tau.
export function lagrangeWeights(taus, tau) {
  if (taus.includes(tau)) return taus.map((node) => (node === tau ? 1 : 0));
  const terms = taus.map((node) => {
    const product = taus.reduce((p, other) => (other === node ? p : p * (node - other)), 1);
    return 1 / (product * (tau - node));
  });
  const sum = terms.reduce((a, b) => a + b, 0);
  return terms.map((term) => term / sum);
}

// exp of the weighted mean of logarithms; null where one of the values is not positive.
function geometricMean(weights, values) {
  if (!values.every((value) => value > 0)) return null;
  return Math.exp(values.reduce((sum, value, q) => sum + weights[q] * Math.log(value), 0));
}

// An array [l][n][c] of what `make` says.
function overLayers(scene, make) {
  return scene.lamps.map((lamp, l) =>
    Array.from({ length: scene.terms + 1 }, (_, n) => [0, 1, 2].map((c) => make(l, n, c))));
}

// For every lamp, term and channel: its size at tau, and the weight of each node's layer at gain and coefficient 1.
export function interpolation(scene, tau) {
  const weights = lagrangeWeights(scene.taus, tau);
  const sizesOf = (l, n, c) => scene.taus.map((_, q) => scene.powers[q][l][n][c]);
  const sizes = overLayers(scene, (l, n, c) => {
    const nodes = sizesOf(l, n, c);
    const linear = nodes.reduce((sum, size, q) => sum + weights[q] * size, 0);
    return geometricMean(weights, nodes) ?? Math.max(0, linear);
  });
  const factors = overLayers(scene, (l, n, c) => {
    const nodes = sizesOf(l, n, c);
    if (!nodes.every((size) => size > 0)) return weights;
    return weights.map((weight, q) => weight * (sizes[l][n][c] / nodes[q]));
  });
  return { tau, weights, sizes, factors };
}

// The power of term n with the lamps at their gains, per channel, in W, where reflectances changed.
export function powerOfTerm(sizes, gains, alpha, n, { scale, powers }) {
  const bounces = scale.map((s) => (n === 0 ? 1 : alpha ** (n - 1) * s ** n));
  const ofLamp = (l, c) => gains[l][c] * sizes[l][n][c] * (n > 0 && powers ? powers[n][l][c] : 1);
  return bounces.map((b, c) => b * gains.reduce((sum, _, l) => sum + ofLamp(l, c), 0));
}

// A straight line in (ln tau, ln radius) through two points, at tau.
function chord(tau0, radius0, tau1, radius1, tau) {
  const slope = Math.log(radius1 / radius0) / Math.log(tau1 / tau0);
  return radius0 * Math.exp(slope * Math.log(tau / tau0));
}

// Proved bounds on the spectral radius of K at alpha = 1: it increases with tau and is log-convex in log tau.
export function radiusBounds(radii, tau) {
  const exact = radii.find((radius) => radius.tau === tau);
  if (exact) return { lower: exact.lower, upper: exact.upper };
  const after = radii.findIndex((radius) => radius.tau > tau);
  const [a, b, before, beyond] = [radii[after - 1], radii[after], radii[after - 2], radii[after + 1]];
  const upper = a.tau > 0 && a.upper > 0 ? chord(a.tau, a.upper, b.tau, b.upper, tau) : b.upper;
  const lower = [a.lower];
  if (before && before.tau > 0 && a.lower > 0) lower.push(chord(before.tau, before.upper, a.tau, a.lower, tau));
  if (beyond && b.lower > 0) lower.push(chord(beyond.tau, beyond.upper, b.tau, b.lower, tau));
  return { lower: Math.max(...lower), upper };
}

// Whether the series converges where K is `radius` times as large, with bounds, proved where that factor is exact.
export function verdictAt(radii, alpha, tau, { radius, isExact }) {
  const bounds = radiusBounds(radii, tau);
  const [lower, upper] = [alpha * radius * bounds.lower, alpha * radius * bounds.upper];
  const kind = alpha === 0 ? "ends" : upper < 1 ? "converges" : lower >= 1 ? "diverges" : "undecided";
  return { kind, lower, upper, isExact };
}

// The series of x from the first term that is not kept: sum of alpha^(n-1) x^(n-N) over n > N.
function geometricRest(scene, alpha, x) {
  const sum = (alpha ** scene.terms * x) / (1 - alpha * x);
  return Number.isFinite(sum) ? sum : 0;
}

// The rest of the series after term N, of one lamp and channel: T_N = c v + d with v the dominant eigenvector of K,
// whose eigenvalue is lambda; d shrinks by mu. Returned are the multiples of T_N and of v.
function restOfSeries(scene, weights, alpha, l, c) {
  const mu = scene.rest.reduce((sum, lamps, q) => sum + weights[q] * lamps[l].mu[c], 0);
  const own = geometricMean(weights, scene.rest.map((lamps) => lamps[l].dominant[c])) ?? 0;
  const lambda = geometricMean(weights, scene.lambda.map((node) => node[c])) ?? 0;
  const ofLast = geometricRest(scene, alpha, mu);
  return [ofLast, own * (geometricRest(scene, alpha, lambda) - ofLast)];
}

// Whether term n is part of the picture asked for.
function isIncluded(view, n) {
  if (view.kind === "term") return n === view.n;
  return view.kind === "all" || (n <= view.n && n >= (view.from ?? 0));
}

// a_n as [n][l][c] for some terms; `alphas` [c] are alpha times the factor on reflectance. Of all without its rest.
function coefficientsOfPicture(scene, alphas, view) {
  return Array.from({ length: scene.terms + 1 }, (_, n) => {
    const a = alphas.map((alpha) => (!isIncluded(view, n) ? 0 : n === 0 ? 1 : alpha ** (n - 1)));
    return scene.lamps.map(() => [...a]);
  });
}

// Adds the rest of the series to the coefficients of the last term; returns the coefficients of v, per channel.
function addRest(scene, weights, alphas, gains, coefficients) {
  const dominant = [0, 0, 0];
  gains.forEach((gain, l) => gain.forEach((g, c) => {
    const [ofLast, ofDominant] = restOfSeries(scene, weights, alphas[c], l, c);
    coefficients[scene.terms][l][c] += ofLast;
    dominant[c] += g * ofDominant;
  }));
  return dominant;
}

export const total = (power) => power[0] + power[1] + power[2];

// The last term alone, as powerful as the first: what is drawn where all of a series was asked for that has no sum.
function coefficientsOfGrowth(scene, powers, alphas) {
  const last = total(powers[scene.terms]);
  const a = alphas.map((alpha) => (last > 0 ? (total(powers[1]) / last) * alpha ** (scene.terms - 1) : 0));
  return powers.map((_, n) => scene.lamps.map(() => (n === scene.terms ? [...a] : [0, 0, 0])));
}

// Whole stops that make terms without E about as bright as all terms together.
function stopsOfTerms(powers, included, { view, scaled }) {
  if (!scaled || included[0] || view.kind === "all" || view.kind === "sum") return 0;
  const shown = powers.reduce((sum, power, n) => sum + (included[n] ? total(power) : 0), 0);
  const reflected = powers.slice(1).reduce((sum, power) => sum + total(power), 0);
  return shown > 0 ? Math.max(-20, Math.min(20, Math.round(Math.log2(reflected / shown)))) : 0;
}

// All that a state means: coefficients [n][l][c] of the terms, those of the dominant eigenvector (with the gains),
// which terms are in the picture, powers, and the verdict; `blend` is of tau, `change` of reflectance.
export function mixture(scene, blend, state, gains, change) {
  const { alpha, tau, view } = state;
  const alphas = change.scale.map((s) => alpha * s);
  const verdict = verdictAt(scene.radii, alpha, tau, change);
  const powers = Array.from({ length: scene.terms + 1 }, (_, n) => powerOfTerm(blend.sizes, gains, alpha, n, change));
  const hasPicture = view.kind !== "all" || verdict.kind === "ends" || verdict.kind === "converges";
  const coefficients = hasPicture
    ? coefficientsOfPicture(scene, alphas, view)
    : coefficientsOfGrowth(scene, powers, alphas);
  const isWhole = hasPicture && view.kind === "all";
  const dominant = isWhole ? addRest(scene, blend.weights, alphas, gains, coefficients) : [0, 0, 0];
  const included = powers.map((_, n) => (hasPicture ? isIncluded(view, n) : n === scene.terms));
  const stops = stopsOfTerms(powers, included, state);
  const { radius } = change;
  return { verdict, powers, hasPicture, isWhole, coefficients, dominant, included, alphas, stops, radius };
}

// The coefficients of the light that travels to what is shown: F turns it into the light that arrives.
export function travellingCoefficients({ coefficients: a, dominant, alphas, isWhole }) {
  const scaled = (rows, factors) => rows.map((row) => row.map((value, c) => value * factors[c]));
  const coefficients = isWhole
    ? a.map((rows, n) => (n === 0 ? rows : scaled(rows, alphas)))
    : a.map((rows, n) => a[n + 1] ?? scaled(rows, [0, 0, 0]));
  return { coefficients, dominant: dominant.map((x, c) => alphas[c] * x) };
}
