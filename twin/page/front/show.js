"use strict";
// The machine as described: its surfaces in grey, red where nothing exchanges heat, blue where something is chosen.

const GREY = [0.74, 0.76, 0.79], PALE = [0.86, 0.87, 0.89], BARE = [0.8, 0.23, 0.18], CHOSEN = [0, 0.447, 0.698], SENSOR = [0.9, 0.624, 0];

const UPRIGHT = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const plus = (a, b) => a.map((x, k) => x + b[k]), times = (rows, v) => rows.map((r) => r[0] * v[0] + r[1] * v[1] + r[2] * v[2]);
function rotation([x, y, z], angle) { // about a unit vector (Rodrigues)
  const c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
  return [[c + k * x * x, k * x * y - s * z, k * x * z + s * y], [k * y * x + s * z, c + k * y * y, k * y * z - s * x],
    [k * z * x - s * y, k * z * y + s * x, c + k * z * z]];
}

class Described {
  constructor(content) {
    const told = content.surface;
    this.told = told; this.entries = content.entries;
    this.points = unpack(told.points); this.body = unpack(told.body); this.triangles = unpack(told.triangles);
    this.of = unpack(told.of); this.bare = unpack(told.bare); this.edges = unpack(told.edges);
    this.stage = new Stage(document.getElementById("machine-canvas"), content.vertical);
    this.places = told.bodies.map(() => ({ turn: UPRIGHT, shift: [0, 0, 0] }));
    this.chosen = new Set(); this.marked = null;
    this.size = new THREE.Box3().setFromArray(this.points).getSize(new THREE.Vector3()).length();
    const grey = new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    const seen = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.4, depthTest: false, depthWrite: false, side: THREE.DoubleSide });
    seen.color.setRGB(...CHOSEN);
    const ink = new THREE.LineBasicMaterial({ color: 0x33383f, transparent: true, opacity: 0.45 });
    this.bodies = told.bodies.map((_, b) => this.made(b, grey, seen, ink));
    this.sensors();
    this.paint();
    this.reset();
  }
  made(b, grey, seen, ink) { // a body of its own, so that an axis moves it as a whole
    const rows = [];
    for (let t = 0; t < this.of.length; t++) if (this.body[this.triangles[3 * t]] === b) rows.push(t);
    const place = new Float32Array(9 * rows.length), lines = [];
    rows.forEach((t, i) => { for (let c = 0; c < 3; c++) place.set(this.at(this.triangles[3 * t + c]), 9 * i + 3 * c); });
    for (let e = 0; e < this.edges.length; e += 2)
      if (this.body[this.edges[e]] === b) lines.push(...this.at(this.edges[e]), ...this.at(this.edges[e + 1]));
    const geometry = this.geometry(place), through = new THREE.BufferGeometry();
    const colour = new THREE.BufferAttribute(new Float32Array(place.length), 3).setUsage(THREE.DynamicDrawUsage);
    geometry.setAttribute("color", colour);
    const mesh = new THREE.Mesh(geometry, grey), behind = new THREE.Mesh(through, seen);
    const creases = new THREE.LineSegments(this.geometry(Float32Array.from(lines)), ink);
    behind.renderOrder = 2; behind.visible = false;
    for (const made of [mesh, behind, creases]) { made.frustumCulled = made.matrixAutoUpdate = false; this.stage.scene.add(made); }
    return { rows, place, colour, behind, all: [mesh, behind, creases] };
  }
  at(point) { return this.points.subarray(3 * point, 3 * point + 3); }
  geometry(place) {
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(place, 3));
    return made;
  }
  sensors() { // an octahedron at each point of the list
    const corners = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], place = [];
    for (const x of [0, 1]) for (const y of [2, 3]) for (const z of [4, 5]) for (const c of [x, y, z]) place.push(...corners[c]);
    const geometry = this.geometry(Float32Array.from(place));
    const usual = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide });
    const chosen = new THREE.MeshBasicMaterial({ depthTest: false, side: THREE.DoubleSide });
    usual.color.setRGB(...SENSOR); chosen.color.setRGB(...CHOSEN);
    this.points3 = this.entries.filter((e) => e.point).map((entry) => {
      const mesh = new THREE.Mesh(geometry, usual);
      mesh.frustumCulled = false;
      this.stage.scene.add(mesh);
      return { entry, mesh, usual, chosen };
    });
    this.placed();
  }
  placed() {
    this.bodies.forEach((body, b) => body.all.forEach((made) => {
      const { turn: [r, s, t], shift: [x, y, z] } = this.places[b];
      made.matrix.set(...r, x, ...s, y, ...t, z, 0, 0, 0, 1);
      made.matrixWorldNeedsUpdate = true;
    }));
    for (const { entry, mesh, usual, chosen } of this.points3) {
      const marked = this.marked === entry, { turn, shift } = this.places[entry.point.body];
      mesh.position.set(...plus(times(turn, entry.point.at), shift));
      mesh.scale.setScalar((marked ? 0.013 : 0.006) * this.size);
      mesh.material = marked ? chosen : usual; mesh.renderOrder = marked ? 3 : 1;
    }
    this.stage.ask();
  }
  move(axes, positions) { // m, rad; rotary axes come last, the inner before the outer
    this.places = this.told.bodies.map((_, b) => axes.reduce(({ turn, shift }, a, i) => {
      if (!a.turns) return { turn, shift: shift.map((x, k) => x + a.moves[b][k] * positions[i]) };
      if (!a.turns[b]) return { turn, shift };
      const about = rotation(a.direction, positions[i]), lever = plus(a.point, times(about, a.point).map((x) => -x));
      const [x, y, z] = [0, 1, 2].map((k) => times(turn, about.map((row) => row[k])));
      return { turn: [0, 1, 2].map((k) => [x[k], y[k], z[k]]), shift: plus(times(turn, lever), shift) };
    }, { turn: UPRIGHT, shift: [0, 0, 0] }));
    this.placed();
  }
  choose(entry) { // or nothing
    this.chosen = new Set(entry ? entry.places : []); this.marked = entry && entry.point ? entry : null;
    this.paint(); this.placed();
  }
  paint() {
    const ground = this.chosen.size || this.marked ? PALE : GREY;
    for (const { rows, place, colour, behind } of this.bodies) {
      const through = [];
      rows.forEach((t, i) => {
        const mine = this.chosen.has(this.of[t]), bare = this.bare[t];
        if (mine) through.push(...place.subarray(9 * i, 9 * i + 9));
        for (let k = 0; k < 9; k++) colour.array[9 * i + k] = mine ? CHOSEN[k % 3] : ground[k % 3] + bare * (BARE[k % 3] - ground[k % 3]);
      });
      colour.needsUpdate = true;
      behind.visible = through.length > 0;
      if (behind.visible) behind.geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(through), 3));
    }
    this.stage.ask();
  }
  under(x, y) { // what is at a point of the canvas, in pixels: a sensor's entry, else the number of a surface, or null
    const { clientWidth: w, clientHeight: h } = this.stage.canvas, camera = this.stage.camera;
    const start = new THREE.Vector3((2 * x) / w - 1, 1 - (2 * y) / h, -1).unproject(camera);
    const along = new THREE.Vector3((2 * x) / w - 1, 1 - (2 * y) / h, 1).unproject(camera).sub(start).normalize();
    const hit = this.hit(start.toArray(), along.toArray());
    let nearest = hit.surface, least = 9; // px
    for (const { entry, mesh } of this.points3) {
      const seen = mesh.position.clone().project(camera), depth = mesh.position.clone().sub(start).dot(along);
      const apart = Math.hypot(((seen.x + 1) * w) / 2 - x, ((1 - seen.y) * h) / 2 - y);
      if (apart < least && depth < hit.depth + 0.02 * this.size) { least = apart; nearest = entry; }
    }
    return nearest;
  }
  hit(start, along) { // the first surface on a ray (Moller, Trumbore 1997)
    let depth = Infinity, surface = null;
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    const [whence, whither] = [start, along];
    this.bodies.forEach(({ rows, place }, b) => {
      const { turn, shift } = this.places[b], back = [0, 1, 2].map((k) => turn.map((row) => row[k]));
      const from = times(back, minus(whence, shift)), along = times(back, whither);
      rows.forEach((t, i) => {
        const corner = [0, 3, 6].map((c) => place.subarray(9 * i + c, 9 * i + c + 3));
        const u = minus(corner[1], corner[0]), v = minus(corner[2], corner[0]), p = cross(along, v), det = dot(u, p);
        if (Math.abs(det) < 1e-16) return;
        const lever = minus(from, corner[0]), q = cross(lever, u), s = dot(lever, p) / det, r = dot(along, q) / det;
        if (s < 0 || r < 0 || s + r > 1) return;
        const far = dot(v, q) / det;
        if (far < depth) { depth = far; surface = this.of[t]; }
      });
    });
    return { depth, surface };
  }
  reset() { this.stage.look(new THREE.Box3().setFromArray(this.points)); }
}
