// Numbers of a run: displacement, force, the last closed cycle, sliding regimes. The definitions are those of the package:
// results/loops.py and results/sliding.py.
"use strict";

const REVERSAL = 0.02;
const CLOSURE = 0.05;
const NEAR_PEAK = 0.999;
const MOBILISED = 0.9;
const INSTANT_SHARE = 0.1;
const TRANSVERSE = 0.02;

// Reads the fields of rows by name: read("normal", row) is an array of as many numbers as the field has.
function reader(problem, { rows, start }) {
  const width = problem.row[""][0];
  const read = (name, row) => {
    const [offset, size] = problem.row[name];
    return rows.subarray(row * width + offset, row * width + offset + size);
  };
  const count = rows.length / width;
  const displacement = (row) => {
    const [base, top] = [read("base", row), read("top", row)];
    return [0, 1, 2].map((k) => base[k] - top[k] - start[k]);
  };
  return { read, count, displacement };
}

function turningPoints(u, threshold) {
  const turning = [0];
  let candidate = 0;
  let direction = 0;
  for (let row = 1; row < u.length; row += 1) {
    const step = u[row] - u[candidate];
    if (direction === 0) {
      if (Math.abs(u[row] - u[0]) >= threshold) [candidate, direction] = [row, Math.sign(u[row] - u[0])];
    } else if (step * direction >= 0) candidate = row;
    else if (Math.abs(step) >= threshold) {
      turning.push(candidate);
      [candidate, direction] = [row, -direction];
    }
  }
  return direction ? [...turning, candidate] : turning;
}

// Rows of the last closed cycle: start, reversal, end; null if there is none.
function lastCycle(u) {
  const range = u.reduce((a, b) => Math.max(a, b)) - u.reduce((a, b) => Math.min(a, b));
  const turning = turningPoints(u, REVERSAL * range);
  let found = null;
  for (let first = 0; first + 2 < turning.length;) {
    const [start, middle, end] = turning.slice(first, first + 3);
    const span = Math.abs(u[middle] - u[start]);
    const closed = Math.abs(u[end] - u[start]) <= CLOSURE * span && u[start] * u[middle] < 0;
    if (closed) found = [start, middle, end];
    first += closed ? 2 : 1;
  }
  return found;
}

// Effective stiffness [N/m], energy dissipated [J] and damping [-] of a cycle.
function effectiveProperties(u, force, [start, middle, end]) {
  const [most, least] = u[start] > u[middle] ? [start, middle] : [middle, start];
  const span = u[most] - u[least];
  const stiffness = (force[most] - force[least]) / span;
  let energy = 0;
  for (let row = start; row <= end; row += 1) {
    const next = row === end ? start : row + 1;
    energy += ((force[row] + force[next]) * (u[next] - u[row])) / 2;
  }
  return { stiffness, energy, damping: stiffness > 0 ? (2 * energy) / (Math.PI * stiffness * span ** 2) : null };
}

function slidingSurfaces({ read }, row) {
  const [state, slip] = [read("f", row), read("slip", row)];
  const speeds = Array.from({ length: state.length / 2 }, (_, k) => Math.hypot(slip[2 * k], slip[2 * k + 1]));
  const total = speeds.reduce((sum, speed) => sum + speed, 0);
  return speeds.map((speed, k) => total > 0 && speed / total >= INSTANT_SHARE
    && Math.hypot(state[2 * k], state[2 * k + 1]) >= MOBILISED
    && state[2 * k] * slip[2 * k] + state[2 * k + 1] * slip[2 * k + 1] > 0);
}

// Everything that the page shows of a run.
function numbersOf(problem, found, angle) {
  const at = reader(problem, found);
  const u = [];
  for (let row = 0; row < at.count; row += 1) u.push(at.displacement(row));
  const axis = problem.planar ? [1, 0] : [Math.cos(angle), Math.sin(angle)];
  const along = (vector) => vector[0] * axis[0] + vector[1] * axis[1];
  const path = u.map(along);
  const force = u.map((_, row) => along(at.read("top_force", row)));
  const cycle = path.length > 2 && !problem.record ? lastCycle(path) : null;
  const distance = u.map((v) => Math.hypot(v[0], v[1]));
  const most = distance.reduce((a, b) => Math.max(a, b), 0);
  const peak = distance.findIndex((d) => d >= NEAR_PEAK * most); // the first of the cycles that reach it
  const extreme = (name) => {
    const [offset, size] = problem.extremes[name];
    return [...found.extremes.subarray(offset, offset + size)];
  };
  return {
    at, u, path, force, peak,
    straight: !problem.record && u.every((v) => Math.abs(v[1] * axis[0] - v[0] * axis[1]) <= TRANSVERSE * most),
    peakDisplacement: extreme("displacement"),
    peakForce: extreme("top_force"),
    sliding: extreme("sliding"),
    gap: extreme("gap"),
    leastNormal: extreme("least_normal"),
    cycle: cycle ? effectiveProperties(path, force, cycle) : null,
  };
}

// Sets of sliding surfaces in the order in which they occur up to the largest displacement, with where each begins [m].
function regimes(problem, { at, u, peak }) {
  const found = [];
  for (let row = 0; row <= peak; row += 1) {
    const set = slidingSurfaces(at, row).flatMap((slides, k) => (slides ? [k + 1] : [])).join(", ");
    if (set && set !== found.at(-1)?.set) found.push({ set, from: Math.hypot(u[row][0], u[row][1]), rows: 1 });
    else if (set) found.at(-1).rows += 1;
  }
  const least = Math.max(2, peak / 100); // sets of a row or two are passages from one to the next
  return found.filter(({ rows }) => rows >= least).filter(({ set }, i, all) => set !== all[i - 1]?.set);
}
