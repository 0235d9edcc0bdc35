"use strict";
// Curves: uPlot with labels that are measured before they get their room, and a legend of its own that wraps.

class Chart {
  constructor(section, xLabel, yLabel, pick) {
    this.host = section.querySelector(".chart"); this.legend = section.querySelector(".legend");
    this.xLabel = xLabel; this.yLabel = yLabel; this.pick = pick; this.now = null; this.spans = [];
    new ResizeObserver(() => { if (this.plot && this.width() !== this.plot.width) this.plot.setSize({ width: this.width(), height: this.height() }); }).observe(this.host);
  }
  width() { return Math.max(Math.floor(this.host.clientWidth), 200); }
  height() { return this.width() < 420 ? 230 : 270; }
  room(plot, values) { // CSS pixels for the widest number
    if (!values) return 50;
    return 18 + Math.ceil(Math.max(...values.map((v) => String(v).length)) * 7.4);
  }
  draw(x, series) { // series: {name, colour, values, width, dash, quiet}
    const options = {
      width: this.width(), height: this.height(), legend: { show: false }, padding: [12, 14, 0, 4],
      scales: { x: { time: false } }, cursor: { y: false },
      axes: [
        { label: this.xLabel, labelSize: 22, size: 34, stroke: INK, grid: { stroke: "#e6e8eb" }, ticks: { stroke: "#c3c8ce" }, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif" },
        { label: this.yLabel, labelSize: 20, size: (u, values) => this.room(u, values), stroke: INK, grid: { stroke: "#e6e8eb" }, ticks: { stroke: "#c3c8ce" }, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif" },
      ],
      series: [{}, ...series.map((s) => ({ label: s.name, stroke: s.colour, width: s.width || 2, dash: s.dash, points: { show: s.points || s.dots || false, size: s.dots ? 4 : 7, fill: s.colour }, ...(s.dots ? { paths: () => null } : {}) }))],
      hooks: { drawClear: [(u) => this.shade(u)], draw: [(u) => this.mark(u)] },
    };
    const data = [x, ...series.map((s) => s.values)];
    const key = JSON.stringify(series.map((s) => [s.name, s.colour, s.dash]));
    if (this.plot && this.key === key) { this.plot.setData(data); } else {
      if (this.plot) this.plot.destroy();
      this.plot = new uPlot(options, data, this.host);
      this.key = key;
      if (this.pick) this.plot.over.addEventListener("click", () => { if (this.plot.cursor.idx != null) this.pick(this.plot.cursor.idx); });
    }
    this.named(series);
  }
  named(series) {
    this.legend.replaceChildren(...series.filter((s) => !s.quiet).map((s) => {
      const span = document.createElement("span"), line = document.createElement("i");
      line.style.borderTopColor = s.colour;
      if (s.dash) line.className = "dashed";
      span.append(line, s.name);
      return span;
    }));
  }
  shade(u) { // steps outside what was certified
    u.ctx.save(); u.ctx.fillStyle = "rgba(138,144,153,0.16)";
    for (const [a, b] of this.spans) {
      const left = u.valToPos(a, "x", true), right = u.valToPos(b, "x", true);
      u.ctx.fillRect(left, u.bbox.top, Math.max(right - left, 1), u.bbox.height);
    }
    u.ctx.restore();
  }
  mark(u) { // the time that the other pictures show
    if (this.now === null) return;
    const x = u.valToPos(this.now, "x", true);
    if (!(x >= u.bbox.left && x <= u.bbox.left + u.bbox.width)) return;
    u.ctx.save(); u.ctx.strokeStyle = INK; u.ctx.lineWidth = 1.2 * devicePixelRatio; u.ctx.setLineDash([4, 3]);
    u.ctx.beginPath(); u.ctx.moveTo(x, u.bbox.top); u.ctx.lineTo(x, u.bbox.top + u.bbox.height); u.ctx.stroke(); u.ctx.restore();
  }
  at(now) { this.now = now; if (this.plot) this.plot.redraw(false, false); }
}

function column(store, value) { return Array.from({ length: store.length }, (_, row) => value(row)); }

function dotted(readings, length) { // [row, value] on the common axis, nothing between
  const values = new Array(length).fill(null);
  for (const [row, value] of readings) values[row] = value;
  return values;
}

function sensorSeries(machine, store, measured) { // those that change most in colour and named, the others grey, air dashed
  const all = machine.sensors.map((s, i) => {
    const values = column(store, (row) => store.sensor(row, i)), first = values.find((v) => v != null);
    const change = values.reduce((most, v) => (v != null && Math.abs(v - first) > Math.abs(most) ? v - first : most), 0);
    return { ...s, values, change };
  });
  const loud = all.filter((s) => !s.air).sort((a, b) => Math.abs(b.change) - Math.abs(a.change)).slice(0, MARKED.length);
  const rest = all.filter((s) => !s.air && !loud.includes(s));
  const named = (s) => `${s.name} (${s.change >= 0 ? "+" : "−"}${Math.abs(s.change).toFixed(1)} K)`;
  return [
    ...rest.map((s, k) => ({ name: k ? s.name : `${rest.length} more`, colour: MUTED, width: 1, values: s.values, quiet: k > 0 })),
    ...loud.map((s, k) => ({ name: named(s), colour: MARKED[k], values: s.values })),
    ...loud.flatMap((s, k) => (measured && measured.sensors[s.name] ? [{ name: `${s.name} measured`, colour: MARKED[k], dots: true, quiet: true, values: dotted(measured.sensors[s.name], store.length) }] : [])),
    ...all.filter((s) => s.air).map((s) => ({ name: `${s.name}, air`, colour: INK, width: 1.2, dash: [5, 4], values: s.values })),
  ];
}
