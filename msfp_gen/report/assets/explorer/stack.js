// The deformed stack from the side: positions from the tilts of a row, outlines with the radii at hand.
"use strict";

function rotatedBasis([psi, theta], [t1, t2, t3]) {
  const mix = (a, x, b, y) => x.map((v, k) => a * v + b * y[k]);
  const second = mix(Math.cos(psi), t2, Math.sin(psi), t3);
  const between = mix(Math.cos(psi), t3, -Math.sin(psi), t2);
  return [mix(Math.cos(theta), t1, -Math.sin(theta), between), second, mix(Math.sin(theta), t1, Math.cos(theta), between)];
}

// Bottom [m] and axis of every body, the base first and level.
function poses(problem, radius, q) {
  let basis = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  let bottom = [0, 0, 0];
  const found = [{ bottom, axis: basis[2] }];
  const moved = (from, length, axis) => from.map((v, k) => v + length * axis[k]);
  for (let body = 1; body < problem.heights.length; body += 1) {
    const arm = problem.signs[body - 1] * radius[body - 1];
    const joint = moved(moved(bottom, problem.heights[body - 1], basis[2]), arm, basis[2]);
    basis = rotatedBasis([q[3 * (body - 1)], q[3 * (body - 1) + 1]], basis);
    bottom = moved(joint, -arm, basis[2]);
    found.push({ bottom, axis: basis[2] });
  }
  return found;
}

// The outline of a body where the radius of a face differs from that for which it was drawn.
function outlineWith(pieces, radius, nominal) {
  const key = ([r, h]) => `${r},${h}`;
  const shifted = new Map();
  for (const { surface, points } of pieces.filter((piece) => piece.surface)) {
    const [was, is] = [nominal[surface - 1], radius[surface - 1]];
    const apex = points.reduce((a, b) => (a[0] < b[0] ? a : b));
    const bend = Math.sign(points.reduce((a, b) => (a[0] > b[0] ? a : b))[1] - apex[1]) || 1;
    const rise = (r, R) => R - Math.sqrt(Math.max(0, R * R - r * r));
    for (const point of points) shifted.set(key(point), [point[0], point[1] + bend * (rise(point[0], is) - rise(point[0], was))]);
  }
  return pieces.map(({ surface, points }) => ({ surface, points: points.map((point) => shifted.get(key(point)) ?? point) }));
}

function drawStack(parent, problem, numbers, radius, angle, row) {
  parent.replaceChildren();
  const { svg } = drawing(parent, "Bearing from the side, to scale", CHART.width, CHART.height);
  const nominal = problem.surfaces.map((values) => values[problem.values.indexOf("radius")]);
  const cut = problem.planar ? [1, 0] : [Math.cos(angle), Math.sin(angle)];
  const flat = (vector) => [vector[0] * cut[0] + vector[1] * cut[1], vector[2]];
  const bodies = poses(problem, radius, numbers.at.read("q", row));
  const outlines = problem.outlines.map((pieces) => outlineWith(pieces, radius, nominal));
  const reach = Math.max(...outlines.flat(2).flatMap(({ points }) => points.map(([r]) => r)));
  const travel = Math.max(...numbers.u.map((v) => Math.abs(flat(v)[0])));
  const height = problem.heights.reduce((sum, h) => sum + h, 0);
  const inner = [CHART.width - CHART.left - CHART.right, CHART.height - CHART.top - CHART.bottom];
  const wide = [-(reach + travel) * 1000, (reach + travel) * 1000];
  const [x, z] = withEqualScale(wide, [-0.1 * height * 1000, 1.25 * height * 1000], ...inner);
  const { px, py } = axes(svg, CHART, x, z, "along the section [mm]", "height [mm]");
  const scale = (px(1) - px(0)) * 1000;
  outlines.forEach((pieces, body) => {
    const [along, up] = flat(bodies[body].axis);
    const [left, low] = flat(bodies[body].bottom);
    const tilt = (Math.atan2(along, up) * 180) / Math.PI;
    const place = `translate(${px(left * 1000).toFixed(2)} ${py(low * 1000).toFixed(2)}) rotate(${tilt.toFixed(4)})`;
    const group = element(svg, "g", { transform: place });
    const half = pieces.flatMap(({ points }) => points);
    const path = (points) => points.map(([r, h]) => `${(r * scale).toFixed(2)},${(-h * scale).toFixed(2)}`).join(" ");
    const mirrored = half.map(([r, h]) => [-r, h]).reverse();
    element(group, "polygon", { class: `body tone${body % 2}`, points: path([...half, ...mirrored]) });
    for (const { surface, points } of pieces.filter((piece) => piece.surface)) {
      const face = [...points, ...points.map(([r, h]) => [-r, h])].sort((a, b) => a[0] - b[0]);
      element(group, "polyline", { class: "face", points: path(face), style: `stroke: ${problem.colours[surface - 1]}` });
    }
  });
}
