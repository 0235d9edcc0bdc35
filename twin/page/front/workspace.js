"use strict";
// The grid of poses as it stands and displaced, with or without what all poses have in common.

class Workspace {
  constructor(machine) {
    const told = machine.workspace;
    this.axes = told.axes; this.grid = told.grid; this.places = unpack(told.places); this.count = told.poses;
    this.pairs = this.lines(false);
    this.stage = new Stage(document.getElementById("workspace-canvas"), machine.vertical);
    const still = new THREE.BufferGeometry();
    still.setAttribute("position", new THREE.BufferAttribute(this.along(this.lines(true), this.places), 3));
    const dashed = new THREE.LineSegments(still, new THREE.LineDashedMaterial({ color: 0x6a7078, dashSize: 0.02 * this.size(), gapSize: 0.014 * this.size() }));
    dashed.computeLineDistances();
    const moved = new THREE.Mesh(this.ribbon(), new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide }));
    moved.frustumCulled = dashed.frustumCulled = false;
    this.stage.scene.add(dashed, moved);
  }
  size() {
    const box = new THREE.Box3().setFromArray(this.places);
    return Math.max(box.getSize(new THREE.Vector3()).length(), 1e-9);
  }
  lines(onEdges) { // pairs of neighbouring poses on the faces, or the edges, of the grid: inner lines would hide them
    const shape = this.grid.map((g) => g.length), pairs = [];
    const stride = shape.map((_, k) => shape.slice(k + 1).reduce((a, b) => a * b, 1));
    for (let i = 0; i < this.count; i++) {
      const at = shape.map((n, k) => Math.floor(i / stride[k]) % n);
      shape.forEach((n, k) => {
        if (at[k] + 1 >= n) return;
        const others = shape.map((m, j) => j !== k && (at[j] === 0 || at[j] === m - 1)).filter(Boolean).length;
        if (others >= shape.length - 1 - (onEdges ? 0 : 1)) pairs.push([i, i + stride[k]]);
      });
    }
    return pairs;
  }
  along(pairs, places) {
    const found = new Float32Array(6 * pairs.length);
    pairs.forEach(([a, b], j) => { found.set(places.subarray(3 * a, 3 * a + 3), 6 * j); found.set(places.subarray(3 * b, 3 * b + 3), 6 * j + 3); });
    return found;
  }
  ribbon() { // a line of WebGL is one pixel wide: each is drawn as two crossed strips
    const n = this.pairs.length, index = new Uint32Array(12 * n);
    this.strips = new THREE.BufferAttribute(new Float32Array(24 * n), 3); this.tints = new THREE.BufferAttribute(new Float32Array(24 * n), 3);
    for (let j = 0; j < n; j++) for (let s = 0; s < 2; s++) { const f = 8 * j + 4 * s; index.set([f, f + 1, f + 2, f + 1, f + 3, f + 2], 12 * j + 6 * s); }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.strips); geometry.setAttribute("color", this.tints);
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    return geometry;
  }
  common(tcp) { // m, mean over the poses
    const mean = [0, 0, 0];
    for (let i = 0; i < this.count; i++) for (let k = 0; k < 3; k++) mean[k] += tcp[3 * i + k] / this.count;
    return mean;
  }
  lengths(tcp, off) { // um, without `off` [m]
    return Float32Array.from({ length: this.count }, (_, i) => 1e6 * Math.hypot(...[0, 1, 2].map((k) => tcp[3 * i + k] - off[k])));
  }
  factor(most) { return most > 0 ? round125((0.12 * this.size()) / most) : 1; }
  show(tcp, off, factor, high) {
    const moved = Float32Array.from(this.places, (p, i) => p + factor * (tcp[i] - off[i % 3]));
    const lengths = this.lengths(tcp, off), tint = new Float32Array(3 * this.count), width = 0.0032 * this.size();
    paint(lengths, 0, high, LENGTH_TABLE, tint);
    const ends = [new THREE.Vector3(), new THREE.Vector3()], along = new THREE.Vector3(), side = new THREE.Vector3(), other = new THREE.Vector3();
    this.pairs.forEach((pair, j) => {
      pair.forEach((i, e) => ends[e].fromArray(moved, 3 * i));
      along.subVectors(ends[1], ends[0]).normalize();
      side.set(...(Math.abs(along.z) < 0.9 ? [0, 0, 1] : [1, 0, 0])).cross(along).normalize();
      other.crossVectors(along, side);
      [side, other].forEach((direction, s) => {
        for (let c = 0; c < 4; c++) {
          const e = c >> 1, at = 3 * (8 * j + 4 * s + c), sign = (c & 1 ? 1 : -1) * width;
          this.strips.array[at] = ends[e].x + sign * direction.x; this.strips.array[at + 1] = ends[e].y + sign * direction.y; this.strips.array[at + 2] = ends[e].z + sign * direction.z;
          this.tints.array.set(tint.subarray(3 * pair[e], 3 * pair[e] + 3), at);
        }
      });
    });
    this.strips.needsUpdate = this.tints.needsUpdate = true;
    if (!this.stage.box) {
      const box = new THREE.Box3().setFromArray(this.places), pad = 0.14 * this.size();
      this.stage.look(box.expandByScalar(pad));
    }
    this.stage.ask();
  }
}
