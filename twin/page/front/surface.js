"use strict";
// The machine's surface: coloured by temperature, deformed, axes where they stand.

class Surface {
  constructor(machine, store) {
    const told = machine.surface;
    this.told = told; this.store = store;
    this.points = unpack(told.points); this.triangles = unpack(told.triangles);
    this.turns = told.turns.map((turn) => ({ ...turn, nodes: unpack(turn.nodes) }));
    const n = this.points.length / 3;
    this.body = new Uint16Array(n);
    for (let b = 0; b < told.bodies.length; b++) this.body.fill(b, told.first[b], told.first[b + 1]);
    this.area = this.areas(n);
    this.geometry = new THREE.BufferGeometry();
    this.place = new THREE.BufferAttribute(new Float32Array(3 * n), 3).setUsage(THREE.DynamicDrawUsage);
    this.colour = new THREE.BufferAttribute(new Float32Array(3 * n), 3).setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute("position", this.place);
    this.geometry.setAttribute("color", this.colour);
    this.geometry.setIndex(new THREE.BufferAttribute(this.triangles, 1));
    const material = new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    const mesh = new THREE.Mesh(this.geometry, material);
    const lines = new THREE.BufferGeometry();
    lines.setAttribute("position", this.place);
    lines.setIndex(new THREE.BufferAttribute(unpack(told.edges), 1));
    const creases = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ color: 0x33383f, transparent: true, opacity: 0.55 }));
    mesh.frustumCulled = creases.frustumCulled = false;
    this.stage = new Stage(document.getElementById("surface-canvas"), machine.vertical);
    this.stage.scene.add(mesh, creases);
    this.rangeOf = new Map();
  }
  areas(n) { // m^2 of every node: a third of its triangles'
    const found = new Float32Array(n), p = this.points, t = this.triangles;
    for (let i = 0; i < t.length; i += 3) {
      const [a, b, c] = [3 * t[i], 3 * t[i + 1], 3 * t[i + 2]];
      const u = [0, 1, 2].map((k) => p[b + k] - p[a + k]), v = [0, 1, 2].map((k) => p[c + k] - p[a + k]);
      const area = Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 6;
      found[t[i]] += area; found[t[i + 1]] += area; found[t[i + 2]] += area;
    }
    return found;
  }
  largest(rows) { // displacement [m]
    let most = 0;
    for (const row of rows) {
      const frame = this.store.surface(row);
      if (frame) for (const u of frame.displacement) most = Math.max(most, Math.abs(u));
    }
    return most;
  }
  size() {
    const box = new THREE.Box3().setFromArray(this.points);
    return box.getSize(new THREE.Vector3()).length();
  }
  range(rows, kind) { // low and high of the colours, and what lies beyond: cached, for a slider asks often
    const key = `${kind} ${rows.join()}`;
    if (!this.store.heat) return this.computed(rows, kind); // of a running machine, rows move on
    if (!this.rangeOf.has(key)) this.rangeOf.set(key, this.computed(rows, kind));
    return this.rangeOf.get(key);
  }
  computed(rows, kind) {
    let least = Infinity, most = -Infinity, hottest = 0, low = Infinity, high = -Infinity;
    const n = this.area.length, all = new Float32Array(n * rows.length), weights = new Float32Array(n * rows.length);
    rows.forEach((row, j) => {
      const { temperature } = this.store.surface(row);
      all.set(temperature, j * n); weights.set(this.area, j * n);
      for (let i = 0; i < n; i++) {
        if (temperature[i] > most) { most = temperature[i]; hottest = i; }
        least = Math.min(least, temperature[i]);
      }
    });
    [low, high] = percentiles(all, weights, [0.02, 0.98], least, most);
    const clipped = kind === "typical" && most - least > 1.3 * (high - low);
    if (!clipped) { low = least; high = most; }
    if (high - low < 0.1) { const middle = (low + high) / 2; low = middle - 0.05; high = middle + 0.05; } // K
    return { low, high, least, most, clipped, body: this.told.bodies[this.body[hottest]] };
  }
  show(row, factor, range) {
    const frame = this.store.surface(row);
    if (!frame || !frame.temperature) return;
    this.placed(frame, factor);
    paint(frame.temperature, range.low, range.high, HEAT_TABLE, this.colour.array);
    this.place.needsUpdate = this.colour.needsUpdate = true;
    if (!this.stage.box) this.reset();
    this.stage.ask();
  }
  placed(frame, factor) {
    const { shifts } = this.told, shift = this.told.bodies.map((_, b) => [0, 1, 2].map((k) =>
      (shifts[b] || []).reduce((sum, axis, a) => sum + axis[k] * (frame.position[a] || 0), 0)));
    const place = this.place.array;
    for (let i = 0; i < this.body.length; i++) {
      for (let k = 0; k < 3; k++) place[3 * i + k] = this.points[3 * i + k] + factor * (frame.displacement[3 * i + k] || 0);
    }
    this.turned(frame.angle || []);
    for (let i = 0; i < this.body.length; i++) for (let k = 0; k < 3; k++) place[3 * i + k] += shift[this.body[i]][k];
  }
  turned(angles) { // about rotary axes, the outermost first, displacements with their parts
    const place = this.place.array, at = new THREE.Vector3(), axis = new THREE.Vector3(), point = new THREE.Vector3();
    for (let a = this.turns.length - 1; a >= 0; a--) {
      if (!angles[a]) continue;
      axis.fromArray(this.turns[a].direction); point.fromArray(this.turns[a].point);
      for (const i of this.turns[a].nodes) at.fromArray(place, 3 * i).sub(point).applyAxisAngle(axis, angles[a]).add(point).toArray(place, 3 * i);
    }
  }
  reset() { this.stage.look(new THREE.Box3().setFromArray(this.place.array)); }
  picture(canvas, row, factor, range) { // a still one, drawn by the same camera
    this.show(row, factor, range);
    this.stage.draw();
    const source = this.stage.canvas;
    canvas.width = 440; canvas.height = Math.round((440 * source.height) / source.width);
    canvas.getContext("2d").drawImage(source, 0, 0, canvas.width, canvas.height);
  }
  words(range) {
    const span = (a, b) => `${a.toFixed(1)} to ${b.toFixed(1)} °C`;
    if (!range.clipped) return `Colours span all temperatures of the surface, ${span(range.least, range.most)}.`;
    return `Colours span ${span(range.low, range.high)}, where 96 % of the surface is. What is beyond has the colour of the ` +
      `end: the coldest is ${range.least.toFixed(1)} °C, the hottest ${range.most.toFixed(1)} °C, on ${range.body}.`;
  }
}
