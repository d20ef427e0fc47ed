// Runs of the WebAssembly module: settings and a problem in, rows out. Runs in a worker.
"use strict";

const NUMBERS = { outputStep: 7, duration: 6, firstStep: 4 };
const POWERS = 6;
const CHANNELS = 6;

function doubles(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float64Array(bytes.buffer);
}

// A history as the runtime takes it: knots, and [piece][channel][power].
function history({ knots, coefficients: { pieces, columns, values } }) {
  const packed = doubles(values);
  const full = new Float64Array(pieces * CHANNELS * POWERS);
  for (let piece = 0; piece < pieces; piece += 1) {
    columns.forEach((column, i) => { full[piece * CHANNELS * POWERS + column] = packed[piece * columns.length + i]; });
  }
  return { knots: doubles(knots), coefficients: full };
}

function decoded(problem) {
  return {
    ...problem,
    motion: history(problem.motion),
    load: history(problem.load),
    jumps: doubles(problem.jumps),
    stops: doubles(problem.stops),
    spans: problem.spans.map(doubles),
  };
}

// The motion with another amplitude, `rate` times as fast, turned in plan by `angle` [rad].
function changedMotion({ knots, coefficients }, { amplitude, rate, angle }) {
  const made = coefficients.slice();
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  for (let base = 0; base < made.length; base += CHANNELS * POWERS) {
    for (let power = 0; power < POWERS; power += 1) {
      const factor = amplitude * rate ** power;
      const [first, second, third] = [0, 1, 2].map((channel) => base + channel * POWERS + power);
      const [x, y] = [coefficients[first] * factor, coefficients[second] * factor];
      made[first] = angle === 0 ? x : c * x - s * y;
      made[second] = angle === 0 ? y : s * x + c * y;
      made[third] = coefficients[third] * factor;
    }
  }
  return { knots: rate === 1 ? knots : knots.map((t) => t / rate), coefficients: made };
}

// The load with another axial load, `rate` times as fast.
function changedLoad({ knots, coefficients }, { load, rate }) {
  const factor = (i) => (Math.floor(i / POWERS) % CHANNELS === 2 ? load : 1) * rate ** (i % POWERS);
  return { knots: rate === 1 ? knots : knots.map((t) => t / rate), coefficients: coefficients.map((c, i) => c * factor(i)) };
}

// settings: { friction, radius: one for each surface; load: factor; amplitude, rate: factors; angle [rad] }.
function inputOf(problem, settings) {
  const { rate } = settings;
  const numbers = problem.numbers.slice();
  for (const index of Object.values(NUMBERS)) numbers[index] /= rate;
  const column = (name) => problem.values.indexOf(name);
  const surfaces = problem.surfaces.map((row, k) => {
    const changed = row.slice();
    changed[column("friction")] = settings.friction[k];
    changed[column("radius")] = settings.radius[k];
    return changed;
  });
  const motion = changedMotion(problem.motion, settings);
  const load = changedLoad(problem.load, settings);
  const scaled = (times) => (rate === 1 ? times : times.map((t) => t / rate));
  const parts = [
    numbers,
    [motion.knots.length - 1, load.knots.length - 1, problem.jumps.length, problem.stops.length, problem.spans[0].length],
    problem.bodies.flat(), surfaces.flat(), problem.top, ...problem.state,
    motion.knots, motion.coefficients, load.knots, load.coefficients,
    scaled(problem.jumps), scaled(problem.stops), scaled(problem.spans[0]), scaled(problem.spans[1]),
  ];
  const input = new Float64Array(parts.reduce((sum, part) => sum + part.length, 0));
  let offset = 0;
  for (const part of parts) {
    input.set(part, offset);
    offset += part.length;
  }
  return input;
}

const STEPS = 500; // between two reports of progress

// One run; `progress` is called with the share of its time that is done. rows: [row][field], as `problem.row` names the fields; extremes: over all steps; start: of r_01 - r_nn [m].
function solve({ exports }, problem, settings, progress) {
  const input = inputOf(problem, settings);
  const place = exports.reserve(input.length);
  if (place === 0) throw new Error("no memory for the motion");
  new Float64Array(exports.memory.buffer, place, input.length).set(input);
  const duration = problem.numbers[NUMBERS.duration] / settings.rate;
  exports.begin(place);
  while (exports.advance(STEPS)) progress(exports.reached() / duration);
  const status = problem.statuses[exports.status()];
  const copy = (at, length) => new Float64Array(exports.memory.buffer, at, length).slice();
  const width = problem.row[""][0];
  return {
    status,
    reached: exports.reached(),
    rows: copy(exports.rows(), exports.row_count() * width),
    extremes: copy(exports.extremes(), problem.extremes[""][0]),
    start: copy(exports.start(), 3),
  };
}
