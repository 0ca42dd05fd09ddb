// The camera: its directions from yaw and pitch, matrices, and walking. Vectors are arrays of three numbers.

export const add = (a, b, factor = 1) => a.map((x, i) => x + factor * b[i]);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const normalised = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));
const radians = (degrees) => (degrees * Math.PI) / 180;

// A vector turned about a unit axis.
function turned(vector, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(vector.map((x) => c * x), cross(axis, vector), s), axis, (1 - c) * dot(axis, vector));
}

// The directions of the camera: pitch turns about the file camera's right, then yaw about what is up in the scene.
export function basisOf(scene, state) {
  const turn = (vector) =>
    turned(turned(vector, scene.camera.right, radians(state.pitch)), scene.up, -radians(state.yaw));
  return { forward: turn(scene.camera.forward), right: turn(scene.camera.right), up: turn(scene.camera.up) };
}

// How far before the eye drawing begins: near enough for what the file's camera has before it, as long as the eye is
// not far from there.
function nearPlane(scene, state) {
  const { position, nearest } = scene.camera;
  const away = Math.hypot(...state.position.map((x, axis) => x - position[axis]));
  return Math.min(0.002, Math.max(0.3 * (nearest ?? 1), 0.05 * away, 1e-9));
}

// The camera of a state: where it is, its directions, tangents of half its angles, and its matrix (column-major).
export function perspective(scene, state, aspect) {
  const basis = basisOf(scene, state);
  const tangent = Math.tan(radians(state.fov) / 2);
  const far = Math.hypot(...state.position) + 2;
  const near = nearPlane(scene, state);
  const { forward: f, right: r, up: u } = basis;
  const eye = state.position;
  const rows = [[...r, -dot(r, eye)], [...u, -dot(u, eye)], [...f, -dot(f, eye)]];
  const [sx, sy] = [1 / (tangent * aspect), 1 / tangent];
  const [depth, offset] = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
  const matrix = [0, 1, 2, 3].flatMap((i) =>
    [sx * rows[0][i], sy * rows[1][i], depth * rows[2][i] + (i === 3 ? offset : 0), rows[2][i]]);
  return { ...basis, eye, tangents: [tangent * aspect, tangent], matrix };
}

// The horizontal directions of the plan, and their names: its up is the axis of the file nearest to where the file's
// camera looks.
export function planAxes(scene) {
  const level = (vector) => add(vector, scene.up, -dot(vector, scene.up));
  const ahead = level(scene.camera.forward);
  const nearest = dot(ahead, ahead) > 1e-6 ? ahead : level(scene.camera.up);
  const along = nearest.reduce((most, x, i) => (Math.abs(x) > Math.abs(nearest[most]) ? i : most), 0);
  const up = [0, 1, 2].map((i) => (i === along ? Math.sign(nearest[i]) : 0));
  const right = cross(up, scene.up);
  const nameOf = (axis) => axis.map((x, i) => (Math.abs(x) > 0.5 ? (x < 0 ? "−" : "") + "xyz"[i] : "")).join("");
  return { up, right, names: [nameOf(right), nameOf(up)] };
}

// A view from above on all that lies below the given height: parallel rays, `half` unit lengths from middle to edge.
export function planCamera(scene, height, centre, half, aspect) {
  const { up, right } = planAxes(scene);
  const down = scene.up.map((x) => -x);
  const [sx, sy, depth] = aspect > 1 ? [1 / (half * aspect), 1 / half, 4] : [1 / half, aspect / half, 4];
  const rows = [
    [...right.map((x) => sx * x), -sx * centre[0]], [...up.map((x) => sy * x), -sy * centre[1]],
    [...down.map((x) => (2 / depth) * x), (2 / depth) * height - 1], [0, 0, 0, 1], ];
  const matrix = [0, 1, 2, 3].flatMap((i) => rows.map((row) => row[i]));
  return { forward: down, right, up, eye: [0, 0, 0], tangents: [0, 0], matrix, culled: true, scales: [sx, sy] };
}

// The state's camera moved by steps to the right, up and ahead; ahead keeps the height.
export function walked(scene, state, [right, up, ahead]) {
  const basis = basisOf(scene, state);
  const level = (vector) => add(vector, scene.up, -dot(vector, scene.up));
  const flat = level(Math.abs(dot(basis.forward, scene.up)) < 0.99 ? basis.forward : basis.up);
  let position = add(state.position, normalised(flat), ahead);
  position = add(position, normalised(level(basis.right)), right);
  position = add(position, scene.up, up);
  return { position: position.map((x) => Math.min(20, Math.max(-20, x))) };
}

// The state's camera turned by degrees. It never looks further up or down than 89 degrees, unless the file's does.
export function looked(scene, state, yaw, pitch) {
  const elevation = (Math.asin(Math.min(1, Math.max(-1, dot(scene.camera.forward, scene.up)))) * 180) / Math.PI;
  const [least, most] = [Math.min(0, -89 - elevation), Math.max(0, 89 - elevation)];
  const wrapped = ((((state.yaw + yaw + 180) % 360) + 360) % 360) - 180;
  return { yaw: wrapped, pitch: Math.min(most, Math.max(least, state.pitch + pitch)) };
}
