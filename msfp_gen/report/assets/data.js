// The data of the run. Arrays are stored as base64 of little-endian float32; `at` reads one number or vector.
"use strict";

const report = JSON.parse(document.getElementById("report-data").textContent);

function unpack({ shape, data }) {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  return { shape, values: new Float32Array(bytes.buffer) };
}

const frames = Object.fromEntries(Object.entries(report.frames).map(([name, packed]) => [name, unpack(packed)]));
const frameCount = frames.time.shape[0];

// For example, at("centre", 7, 2) is the sphere centre of surface 3 in frame 7, and at("sliding", 7, 2) its sliding.
function at(name, ...indices) {
  const { shape, values } = frames[name];
  let offset = 0;
  let size = values.length;
  indices.forEach((index, depth) => {
    size /= shape[depth];
    offset += index * size;
  });
  return indices.length === shape.length ? values[offset] : values.subarray(offset, offset + size);
}

const column = (read) => Array.from({ length: frameCount }, (_, frame) => read(frame));
const surfaceNumbers = report.surfaces.map((_, index) => index);
const horizontal = [Math.cos(report.azimuth), Math.sin(report.azimuth)];
const radial = ([x, y]) => Math.hypot(x, y);
