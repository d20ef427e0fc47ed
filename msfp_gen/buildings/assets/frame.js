// The frame of a building on its bearings in three dimensions by three.js. Lengths in metres, motion relative to the ground.
"use strict";

const MILLI = 1000;
const BACK = { oblique: [-0.6, -1, 0.45], front: [0, -1, 0.03], side: [-1, 0, 0.03], above: [0, -0.02, 1] };
const FLOOR = 0xcfd6dc;
const COLUMN = 0x7d8a96;
const STEEL = 0x59636d;

function material(colour, extra = {}) {
  return new THREE.MeshStandardMaterial({ color: colour, roughness: 0.7, metalness: 0.1, side: THREE.DoubleSide, ...extra });
}

// A box between two corners.
function box([x0, y0, z0], [x1, y1, z1]) {
  const sides = [
    [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]], [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
    [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]], [[x0, y1, z0], [x1, y1, z0], [x1, y1, z1], [x0, y1, z1]],
    [[x0, y0, z0], [x0, y1, z0], [x0, y1, z1], [x0, y0, z1]], [[x1, y0, z0], [x1, y1, z0], [x1, y1, z1], [x1, y0, z1]],
  ];
  const points = sides.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]).flat();
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  geometry.computeVertexNormals();
  return geometry;
}

function disc(radius, height) {
  const profile = [[0, 0], [radius, 0], [radius, height], [0, height]].map(([r, h]) => new THREE.Vector2(r, h));
  return new THREE.LatheGeometry(profile, 32).rotateX(Math.PI / 2);
}

function bar(colour) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(new Float32Array(6), 3));
  return new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colour }));
}

function setBar({ geometry }, ends) {
  ends.forEach((end, k) => geometry.attributes.position.setXYZ(k, ...end));
  geometry.attributes.position.needsUpdate = true;
  geometry.computeBoundingSphere();
}

// Red where a bearing is unloaded, grey at its load at rest, blue at twice that load.
function loadColour(ratio) {
  const [low, rest, high] = [[0xc6, 0x28, 0x28], [0xb9, 0xc2, 0xca], [0x08, 0x30, 0x6b]];
  const share = Math.max(-1, Math.min(1, ratio - 1));
  const end = share < 0 ? low : high;
  const mixed = rest.map((value, k) => Math.round(value + Math.abs(share) * (end[k] - value)));
  return `rgb(${mixed.join(",")})`;
}

// Place of a point that is fixed to a node: displacements and small rotations, `scale` times as large.
function placed(frame, node, point, scale) {
  const [x, y, z] = point.map((value, k) => value - report.nodes[node].position[k]);
  const [u, v, w, a, b, c] = at("node", frame, node);
  const moved = [u + b * z - c * y, v + c * x - a * z, w + a * y - b * x];
  return point.map((value, k) => value + scale * moved[k]);
}

// Adds the view to `parent`. Returns { show, setView, settings }, or null if the browser has no WebGL.
function addFrame(parent) {
  const renderer = addRenderer(parent, "The frame on its bearings", "tables, charts and figures show the run.");
  if (!renderer) return null;
  const { size, places, nodes, plates } = report;
  const [low, high] = report.plan;
  const scene = new THREE.Scene();
  scene.add(new THREE.HemisphereLight(0xffffff, 0xb0b4bc, 2.4));
  const sun = new THREE.DirectionalLight(0xffffff, 1.8);
  sun.position.set(-0.6, -1, 1.3);
  scene.add(sun);
  const settings = { still: true, view: "oblique", scale: report.scale };
  const [thick, tall, wide] = [0.02 * size, report.depth, report.radius];
  const whole = new THREE.Group();
  scene.add(whole);
  const grid = new THREE.GridHelper(1.6 * size, 16, 0x888888, 0x888888).rotateX(Math.PI / 2);
  grid.position.set((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, -tall);
  Object.assign(grid.material, { transparent: true, opacity: 0.3 });
  scene.add(grid);
  const floors = nodes.map(({ position }, node) => {
    const shape = plates
      ? box([low[0], low[1], position[2]], [high[0], high[1], position[2] + thick])
      : box(position.map((value) => value - thick / 2), position.map((value) => value + thick / 2));
    const mesh = new THREE.Mesh(shape, material(FLOOR, { transparent: true, opacity: 0.86 }));
    mesh.matrixAutoUpdate = false;
    whole.add(mesh);
    return { mesh, node };
  });
  const columns = plates ? nodes.slice(1).flatMap((_, k) => places.map(([x, y]) => ({ line: bar(COLUMN), x, y, below: k }))) : [];
  columns.forEach(({ line }) => whole.add(line));
  const bearings = places.map(([x, y, z], index) => {
    const foot = new THREE.Mesh(disc(wide, 0.3 * tall), material(STEEL));
    foot.position.set(x, y, z - tall);
    const slider = new THREE.Mesh(disc(0.45 * wide, 0.4 * tall), material(0xffffff));
    const top = new THREE.Mesh(disc(wide, 0.3 * tall), material(STEEL));
    whole.add(foot, slider, top);
    return { slider, top, index };
  });
  const camera = new THREE.PerspectiveCamera(26, 1, size / 100, size * 100);
  camera.up.set(0, 0, 1);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  const draw = () => renderer.render(scene, camera);
  controls.addEventListener("change", draw);
  const middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, report.height / 2 - tall];
  const setView = () => {
    const away = new THREE.Vector3(...BACK[settings.view]).normalize();
    controls.target.set(...middle);
    camera.position.copy(controls.target).addScaledVector(away, 2.9 * size / Math.min(1.5, Math.max(0.8, camera.aspect)));
    controls.update();
    draw();
  };
  const show = (frame) => {
    const { scale } = settings;
    const [x, y, z] = settings.still ? [0, 0, 0] : [...at("ground", frame)].map((value) => scale * value);
    whole.position.set(x, y, z);
    for (const { mesh, node } of floors) {
      const [, , , a, b, c] = at("node", frame, node);
      const [px, py, pz] = nodes[node].position;
      const [u, v, w] = placed(frame, node, [px, py, pz], scale);
      const [ra, rb, rc] = [scale * a, scale * b, scale * c];
      mesh.matrix.set(
        1, -rc, rb, u - px + rc * py - rb * pz, rc, 1, -ra, v - py - rc * px + ra * pz,
        -rb, ra, 1, w - pz + rb * px - ra * py, 0, 0, 0, 1,
      );
      mesh.matrixWorldNeedsUpdate = true;
    }
    for (const { line, x: cx, y: cy, below } of columns) {
      const ends = [below, below + 1].map((node) => placed(frame, node, [cx, cy, nodes[node].position[2]], scale));
      setBar(line, ends);
    }
    for (const { slider, top, index } of bearings) {
      const [cx, cy, cz] = places[index];
      const [u, v, w] = at("top", frame, index);
      top.position.set(cx + scale * u, cy + scale * v, cz - 0.3 * tall + scale * w);
      slider.position.set(cx + (scale * u) / 2, cy + (scale * v) / 2, cz - 0.7 * tall + (scale * w) / 2);
      slider.material.color.set(loadColour(at("ratio", frame)[index]));
    }
    draw();
  };
  followSize(parent, renderer, camera, setView);
  return { show, setView, settings };
}
