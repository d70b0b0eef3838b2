// Where the camera goes: plain functions from a pose to a pose, in f64 as the server has them.
//
// A pose has eye, right, up and forward; halfHeight (of the picture, at distance 1 or of parallel
// rays), isParallel, and depth: how far ahead the point lies that the eye turns about.

const add = (a, b) => a.map((x, k) => x + b[k]);
const scaled = (a, s) => a.map(x => x * s);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const unit = a => scaled(a, 1 / Math.hypot(...a));

/** Turns v about a unit axis (Rodrigues). */
function turned(v, axis, angle) {
  const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
  const along = scaled(axis, dot(axis, v) * (1 - cos));
  return add(add(scaled(v, cos), scaled(cross(axis, v), sin)), along);
}

/** The axis that the eye goes around: upright in an upright picture, else the picture's up. */
function poleOf(pose) {
  if (Math.abs(pose.right[1]) > 1e-6) return pose.up;
  return [0, pose.up[1] < 0 ? -1 : 1, 0];
}

/** Turns the eye about the point ahead by angles to the right and up. */
function orbited(pose, across, upward) {
  const target = add(pose.eye, scaled(pose.forward, pose.depth));
  const pole = poleOf(pose);
  // Not over the pole, where left and right would change places.
  const NEAR_POLE = 0.002;
  const angle = Math.acos(Math.min(1, Math.max(-1, dot(pose.forward, pole))));
  const least = Math.min(NEAR_POLE, angle), most = Math.max(Math.PI - NEAR_POLE, angle);
  const lift = angle - Math.min(most, Math.max(least, angle + upward));
  let [right, up, forward] = [pose.right, pose.up, pose.forward];
  [up, forward] = [up, forward].map(v => turned(v, right, lift));
  [right, up, forward] = [right, up, forward].map(v => unit(turned(v, pole, -across)));
  return {...pose, right, up, forward, eye: add(target, scaled(forward, -pose.depth))};
}

/** Moves the eye across, by shares of the picture's height at the point ahead. */
function panned(pose, across, upward) {
  const height = 2 * pose.halfHeight * (pose.isParallel ? 1 : pose.depth);
  const way = add(scaled(pose.right, -across * height), scaled(pose.up, upward * height));
  return {...pose, eye: add(pose.eye, way)};
}

/** Goes nearer to the point ahead, or sees less of it by parallel rays; factors below 1 do. */
function zoomed(pose, factor) {
  if (pose.isParallel) return {...pose, halfHeight: pose.halfHeight * factor};
  const depth = pose.depth * factor;
  return {...pose, depth, eye: add(pose.eye, scaled(pose.forward, pose.depth - depth))};
}

/** The options of `render` for a pose. */
function optionsOf(pose) {
  const target = add(pose.eye, scaled(pose.forward, pose.depth));
  const pole = poleOf(pose);
  // The pole is shorter to write, and says the same unless the view is along it.
  const up = Math.abs(dot(pose.forward, pole)) < 0.999 && pole !== pose.up ? pole : pose.up;
  const options = {eye: pose.eye.join(), "look-at": target.join(), up: up.join()};
  if (pose.isParallel) options.orthographic = String(2 * pose.halfHeight);
  return options;
}

