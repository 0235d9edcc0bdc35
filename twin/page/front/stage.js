"use strict";
// A canvas with a camera that the pointer turns; drawn when something has changed, not all the time.

class Stage {
  constructor(canvas, vertical) {
    this.canvas = canvas; this.vertical = vertical;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = "srgb-linear"; // colours are shown as they are in the bar
    this.full = Math.min(window.devicePixelRatio || 1, 2); this.ratio = this.full; this.share = 1;
    this.renderer.setPixelRatio(this.full);
    this.scene = new THREE.Scene();
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 100);
    this.camera.up.set(0, 0, 0).setComponent(vertical, 1);
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.72 * Math.PI));
    const sun = new THREE.DirectionalLight(0xffffff, 0.42 * Math.PI);
    sun.position.set(-0.4, 0.7, 1);
    this.camera.add(sun);
    this.scene.add(this.camera);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableZoom = true;
    this.controls.addEventListener("change", () => { if (this.turning) this.pace(); this.ask(); });
    this.controls.addEventListener("start", () => { this.turning = true; this.before = 0; });
    this.controls.addEventListener("end", () => this.still());
    this.centre = new THREE.Vector3(); this.radius = 1;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }
  static supported() {
    try { return !!document.createElement("canvas").getContext("webgl2"); } catch { return false; }
  }
  look(box) { // from the front, to the right and above
    const from = [new THREE.Vector3(0.5, -0.4, 0.8), new THREE.Vector3(0.62, 0.5, 0.85), new THREE.Vector3(0.62, -0.85, 0.5)];
    box.getCenter(this.centre);
    this.radius = Math.max(0.5 * box.getSize(new THREE.Vector3()).length(), 1e-9);
    this.box = box.clone();
    this.camera.position.copy(this.centre).addScaledVector(from[this.vertical].normalize(), 3 * this.radius);
    this.camera.near = -10 * this.radius; this.camera.far = 20 * this.radius; this.camera.zoom = 1;
    this.controls.target.copy(this.centre);
    this.controls.update();
    this.resize();
  }
  resize() {
    const { clientWidth: w, clientHeight: h } = this.canvas.parentElement;
    if (!w || !h || !this.box) return;
    this.renderer.setSize(w, h, false);
    // what the box covers from here, so that it fills the canvas
    this.camera.updateMatrixWorld();
    const corner = new THREE.Vector3();
    let right = 1e-9, up = 1e-9;
    for (let k = 0; k < 8; k++) {
      corner.set(...["x", "y", "z"].map((c, i) => ((k >> i) & 1 ? this.box.max : this.box.min)[c]));
      corner.applyMatrix4(this.camera.matrixWorldInverse);
      right = Math.max(right, Math.abs(corner.x)); up = Math.max(up, Math.abs(corner.y));
    }
    const half = 1.06 * Math.max(up, (right * h) / w);
    Object.assign(this.camera, { left: (-half * w) / h, right: (half * w) / h, top: half, bottom: -half });
    this.camera.updateProjectionMatrix();
    this.ask();
  }
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }
  pace() { // while it turns, fewer pixels where frames take longer than a thirtieth of a second
    const now = performance.now(), took = now - this.before;
    if (this.before && took < 1000) {
      this.mean = 0.7 * (this.mean || took) + 0.3 * took;
      if (this.mean > 32 && this.share > 0.3) { this.share *= 0.8; this.mean = 0; this.sharp(this.share); }
    }
    this.before = now;
  }
  still() { this.turning = false; this.sharp(1); }
  sharp(share) { // of the pixels in each direction
    if (this.ratio === this.full * share) return;
    this.ratio = this.full * share;
    this.renderer.setPixelRatio(this.ratio);
    this.ask();
  }
  draw() { this.renderer.render(this.scene, this.camera); }
  async spin(frames) { // frames per second of a whole turn, as by hand
    const start = this.camera.position.clone().sub(this.centre), axis = this.camera.up.clone();
    this.controls.dispatchEvent({ type: "start" });
    const began = performance.now();
    for (let k = 1; k <= frames; k++) {
      await new Promise((next) => requestAnimationFrame(next));
      this.camera.position.copy(start).applyAxisAngle(axis, (2 * Math.PI * k) / frames).add(this.centre);
      this.controls.update();
    }
    await new Promise((next) => requestAnimationFrame(next));
    this.draw();
    this.renderer.getContext().readPixels(0, 0, 1, 1, 6408, 5121, new Uint8Array(4)); // all is drawn, not only asked for
    const seconds = (performance.now() - began) / 1000;
    this.controls.dispatchEvent({ type: "end" });
    return frames / seconds;
  }
}
