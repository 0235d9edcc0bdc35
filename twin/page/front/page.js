"use strict";
// The page: one time for all pictures, controls, and what they change.

class Page {
  constructor(content) {
    this.content = content; this.machine = content.machine;
    this.live = content.mode === "live";
    this.store = this.live ? new Running(content) : new Finished(content);
    this.row = 0; this.surfaceFactor = null; this.workspaceFactor = null; this.pose = this.store.middle || 0;
    header(content); certified(this.machine.certificate); flagged(content.flags, this.store.length - 1);
    if (!this.live) filed(content.files);
    const webgl = Stage.supported();
    this.surface = this.machine.surface && webgl ? new Surface(this.machine, this.store) : null;
    this.workspace = this.machine.workspace && this.machine.workspace.poses > 1 && webgl ? new Workspace(this.machine) : null;
    this.sections(webgl);
    this.charts();
    this.controls();
    if (!this.live) { this.curves(); this.scales(); this.go(this.store.start === undefined ? this.store.length - 1 : this.store.start); this.correction(content.correction); this.later(); }
  }
  sections(webgl) {
    const hide = (id, hidden) => { by(id).hidden = hidden; };
    hide("surface", !this.machine.surface); hide("four", !this.surface || this.live);
    hide("workspace", !this.machine.workspace || this.machine.workspace.poses < 2);
    hide("tcp", !this.machine.workspace); hide("along", !this.machine.workspace || !this.axesOf().length);
    hide("correction", !this.content.correction && !this.live); hide("health", !this.live);
    if (!webgl) for (const id of ["surface", "workspace"]) by(`${id}-canvas`).replaceWith(element("p", "This browser draws no WebGL, so no surface; curves and tables need none."));
    by("surface-scale-label").hidden = !this.machine.surface || !this.machine.surface.deforms;
  }
  axesOf() { return this.machine.workspace.axes.map((name, k) => ({ name, k, nodes: this.machine.workspace.grid[k] })).filter((a) => a.nodes.length > 1); }
  charts() {
    const pick = (row) => this.go(row), since = this.live ? "hours" : "time in h";
    this.temperatures = new Chart(by("temperatures"), since, "°C", pick);
    this.time = new Chart(by("tcp"), since, "µm", pick);
    this.alongChart = new Chart(by("along"), "mm", "µm", null);
    this.corrections = new Chart(by("correction"), "mm", "µm", null);
  }
  controls() {
    const on = (id, event, f) => by(id).addEventListener(event, f);
    by("time").max = Math.max(this.store.length - 1, 0);
    on("time", "input", () => { this.follow = +by("time").value === this.store.length - 1; this.go(+by("time").value); });
    on("play", "click", () => this.play());
    for (const id of ["surface-range", "surface-span"]) on(id, "change", () => { this.drawSurface(); this.fields(); });
    on("surface-scale", "input", () => this.drawSurface());
    on("surface-scale", "change", () => this.fields());
    on("surface-reset", "click", () => this.surface && this.surface.reset());
    on("workspace-shift", "change", () => { this.workspaceFactor = null; this.scales(); this.drawWorkspace(); });
    on("workspace-scale", "input", () => this.drawWorkspace());
    if (!this.machine.workspace) return;
    const select = by("along-axis");
    select.replaceChildren(...this.axesOf().map((a) => element("option", a.name)));
    on("along-axis", "change", () => this.along());
    this.poses();
  }
  poses() { // a choice per axis, and where the axes are
    const { grid } = this.machine.workspace, host = by("pose");
    this.where = element("select");
    this.where.append(element("option", "at a pose"), ...(this.live ? [] : [element("option", "where the axes are")]));
    this.at = this.axesOf().map((axis) => {
      const select = element("select", undefined, axis.nodes.map((p) => element("option", `${(1000 * p).toFixed(0)} mm`)));
      select.selectedIndex = this.indices(this.pose)[axis.k];
      host.append(element("label", `${axis.name} `, [select]));
      select.addEventListener("change", () => {
        const chosen = grid.map((g, k) => { const j = this.axesOf().findIndex((a) => a.k === k); return j < 0 ? 0 : this.at[j].selectedIndex; });
        this.pose = chosen.reduce((i, at, k) => i * grid[k].length + at, 0);
        this.tcpCurves(); this.along();
      });
      return select;
    });
    this.where.addEventListener("change", () => this.tcpCurves());
    if (!this.live) host.prepend(element("label", undefined, [this.where]));
  }
  indices(pose) {
    const { grid } = this.machine.workspace, found = [];
    for (let k = grid.length - 1; k >= 0; k--) { found[k] = pose % grid[k].length; pose = Math.floor(pose / grid[k].length); }
    return found;
  }
  play() {
    if (this.playing) { clearInterval(this.playing); this.playing = null; by("play").textContent = "▶"; return; }
    const step = Math.max(1, Math.round(this.store.length / 200));
    by("play").textContent = "■";
    this.playing = setInterval(() => this.go(this.row + step < this.store.length ? this.row + step : 0), 60);
  }
  go(row) {
    if (!this.store.length) return;
    this.row = Math.max(0, Math.min(row, this.store.length - 1));
    by("time").value = this.row;
    const hours = this.store.hours[this.row];
    by("now").textContent = this.live ? `${this.ago(hours)}` : `after ${hours < 1.5 ? `${(60 * hours).toFixed(0)} min` : `${hours.toFixed(2)} h`}`;
    if (this.live && this.surface) { this.wanted = this.row; this.fetching(); } else this.drawSurface();
    this.drawWorkspace(); this.along();
    this.temperatures.at(hours); this.time.at(hours);
  }
  ago(hours) { return new Date(3600e3 * hours + this.content.epoch * 1e3).toLocaleTimeString(); }
  async fetching() { // one request at a time, the last one asked for next
    if (this.busy) return;
    this.busy = true;
    while (this.wanted !== null) {
      const row = this.wanted;
      this.wanted = null;
      await this.store.fetch(row).catch(() => null);
      if (this.surfaceFactor === null) this.scales();
      this.drawSurface();
    }
    this.busy = false;
  }
  sampled(count) { // rows evenly over the run
    const last = this.store.length - 1;
    return [...new Set(Array.from({ length: count }, (_, k) => Math.round((k * last) / (count - 1))))];
  }
  scales() { // round factors that show what there is
    const frames = this.live ? [this.row] : this.sampled(24);
    if (this.surface && this.store.surface(frames[0])) {
      const most = this.surface.largest(frames);
      this.surfaceFactor = most > 0 ? round125((0.04 * this.surface.size()) / most) : 1;
    }
    if (this.workspace && this.store.length) {
      const rows = this.live ? [this.row] : this.sampled(60);
      this.high = Math.max(0.01, ...rows.map((row) => { const tcp = this.store.tcp(row); return Math.max(...this.workspace.lengths(tcp, this.off(tcp))); }));
      if (this.workspaceFactor === null) this.workspaceFactor = this.workspace.factor(1e-6 * this.high);
    }
  }
  off(tcp) { return by("workspace-shift").checked ? this.workspace.common(tcp) : [0, 0, 0]; }
  slid(id, base) { // a slider of 0 .. 100: none, a tenth, the factor itself in the middle, ten times
    const at = +by(id).value;
    if (at === 0) return 0;
    const wanted = base * 10 ** ((at - 50) / 50), step = 10 ** (Math.floor(Math.log10(wanted)) - 1);
    return Math.round(wanted / step) * step;
  }
  drawSurface() {
    if (!this.surface || !this.store.surface(this.row)) return;
    const factor = this.factor(), range = this.range();
    by("surface-factor").textContent = factor ? `×${Math.round(factor).toLocaleString("en")}` : "not at all";
    bar(by("surface-bar"), HEAT, range.low, range.high, "°C", [range.clipped && range.least < range.low - 0.05, range.clipped && range.most > range.high + 0.05]);
    by("surface-words").textContent = this.surface.words(range);
    this.surface.show(this.row, factor, range);
  }
  factor() { return this.machine.surface.deforms && this.surfaceFactor ? this.slid("surface-scale", this.surfaceFactor) : 0; }
  range() { return this.surface.range(by("surface-span").value === "now" || this.live ? [this.row] : this.sampled(24), by("surface-range").value); }
  drawWorkspace() {
    if (!this.workspace || !this.store.length) return;
    const tcp = this.store.tcp(this.row), off = this.off(tcp), common = this.workspace.common(tcp), alone = by("workspace-shift").checked;
    const factor = this.slid("workspace-scale", this.workspaceFactor);
    by("workspace-factor").textContent = factor ? `×${Math.round(factor).toLocaleString("en")}` : "not at all";
    const most = Math.max(...this.workspace.lengths(tcp, off)), high = this.live ? Math.max(most, 0.01) : this.high;
    bar(by("workspace-bar"), LENGTH, 0, high, "µm", [false, false]);
    const shift = `X ${um(common[0])}, Y ${um(common[1])}, Z ${um(common[2])} µm`;
    by("workspace-words").textContent = alone
      ? `Common to all poses and not drawn: a shift of ${shift}. Beside it up to ${most.toFixed(1)} µm. Dashed: as it stands.`
      : `The whole TCP error, up to ${most.toFixed(1)} µm; of it a shift common to all poses of ${shift}. Dashed: as it stands.`;
    this.workspace.show(tcp, off, factor, high);
  }
  curves() {
    const spans = this.outside();
    this.temperatures.spans = this.time.spans = spans;
    this.temperatures.draw(this.store.hours, sensorSeries(this.machine, this.store, this.content.measured));
    this.tcpCurves();
  }
  outside() {
    const found = [], { hours, outside } = this.store;
    for (let k = 1; k < this.store.length; k++) if (outside[k]) {
      if (found.length && found[found.length - 1][1] === hours[k - 1]) found[found.length - 1][1] = hours[k];
      else found.push([hours[k - 1], hours[k]]);
    }
    return found;
  }
  tcpCurves() {
    if (!this.machine.workspace || !this.store.length) return;
    const actual = this.where.selectedIndex === 1, low = [0, 0, 0], high = [0, 0, 0], curves = [[], [], []];
    for (let row = 0; row < this.store.length; row++) {
      const tcp = this.store.tcp(row), own = actual ? this.store.actual(row) : tcp.subarray(3 * this.pose, 3 * this.pose + 3);
      for (let k = 0; k < 3; k++) curves[k].push(1e6 * own[k]);
      for (let i = 0; i < tcp.length; i++) { low[i % 3] = Math.min(low[i % 3], tcp[i]); high[i % 3] = Math.max(high[i % 3], tcp[i]); }
    }
    for (const select of this.at) select.disabled = actual;
    const measured = actual && this.content.measured ? this.content.measured.tcp : []; // where the axes were
    this.time.draw(this.store.hours, [
      ...["X", "Y", "Z"].map((name, k) => ({ name, colour: AXES[k], values: curves[k] })),
      ...measured.map((readings, k) => ({ name: `${"XYZ"[k]} measured`, colour: AXES[k], dots: true, quiet: true, values: dotted(readings, this.store.length).map((v) => (v === null ? v : 1e6 * v)) })),
    ]);
    const range = (k) => `${"XYZ"[k]} ${um(low[k])} to ${um(high[k])}`;
    const dots = measured.length ? " Dots: measured." : "";
    const grey = this.outside().length ? " Grey: outside what was certified." : "";
    by("tcp-words").textContent = `Over all poses and times: ${[0, 1, 2].map(range).join(", ")} µm; tool side minus work side.${dots}${grey}`;
  }
  line(axis) { // poses along an axis through the chosen one
    const { grid } = this.machine.workspace, at = this.indices(this.pose);
    return axis.nodes.map((_, j) => at.reduce((i, own, k) => i * grid[k].length + (k === axis.k ? j : own), 0));
  }
  along() {
    if (!this.machine.workspace || !this.store.length || by("along").hidden) return;
    const axis = this.axesOf()[by("along-axis").selectedIndex], poses = this.line(axis), tcp = this.store.tcp(this.row);
    this.alongChart.xLabel = `${axis.name} in mm`;
    this.alongChart.draw(axis.nodes.map((p) => 1000 * p), ["X", "Y", "Z"].map((name, k) => ({ name, colour: AXES[k], points: true, values: poses.map((i) => 1e6 * tcp[3 * i + k]) })));
    const at = this.indices(this.pose), others = this.axesOf().filter((a) => a.k !== axis.k).map((a) => `${a.name} ${(1000 * a.nodes[at[a.k]]).toFixed(0)} mm`);
    by("along-words").textContent = others.length ? `at ${others.join(", ")} and the chosen time` : "at the chosen time";
  }
  correction(told) {
    if (!told) return;
    by("correction-words").textContent = told.words;
    if (!told.offsets) { this.corrections.host.hidden = true; return; }
    const offsets = unpack(told.offsets), axis = this.axesOf()[0], poses = axis ? this.line(axis) : [], n = told.axes.length;
    if (!axis) return;
    this.corrections.xLabel = `${axis.name} in mm`;
    this.corrections.draw(axis.nodes.map((p) => 1000 * p), told.axes.map((name, k) => ({ name: `offset of ${name}`, colour: AXES[k % 3], points: true, values: poses.map((i) => 1e6 * offsets[n * i + k]) })));
    table(by("correction-table"), told.axes.map((name, k) => [`largest offset of ${name}`, `${told.largest_um[k].toFixed(1)} µm`]));
  }
  later() { window.requestIdleCallback ? requestIdleCallback(() => this.fields(), { timeout: 1500 }) : setTimeout(() => this.fields(), 200); }
  fields() { // the same camera and colours at four times over the run
    if (!this.surface || this.live) return;
    const last = this.store.length - 1, rows = [1 / 12, 1 / 3, 1 / 2, 1].map((share) => Math.round(share * last));
    const range = this.surface.range(this.sampled(24), by("surface-range").value), factor = this.factor();
    by("fields").replaceChildren(...rows.map((row) => {
      const canvas = element("canvas"), { temperature } = this.store.surface(row);
      const low = temperature.reduce((a, b) => Math.min(a, b)), high = temperature.reduce((a, b) => Math.max(a, b));
      this.surface.picture(canvas, row, factor, range);
      return element("figure", undefined, [canvas, element("figcaption", `after ${this.store.hours[row].toFixed(2)} h: ${low.toFixed(1)} to ${high.toFixed(1)} °C`)]);
    }));
    this.drawSurface();
  }
}
