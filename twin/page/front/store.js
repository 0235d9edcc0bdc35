"use strict";
// The numbers behind the page: of a finished run all of them, of a running machine those that have come so far.

function unpack(told) { // typed array with its shape
  const text = atob(told.data), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const Kind = { f4: Float32Array, u4: Uint32Array, i2: Int16Array }[told.kind];
  const array = new Kind(bytes.buffer);
  array.shape = told.shape;
  return array;
}

class Modes { // field(t) = sum of modes times weights
  constructor(told) {
    this.modes = unpack(told.modes); this.weights = unpack(told.weights);
    [this.rank, this.size] = this.modes.shape;
  }
  at(row, into, offset) {
    into.fill(0, offset, offset + this.size);
    for (let r = 0; r < this.rank; r++) {
      const w = this.weights[row * this.rank + r], first = r * this.size;
      for (let i = 0; i < this.size; i++) into[offset + i] += w * this.modes[first + i];
    }
  }
}

class Finished {
  constructor(content) {
    const { tcp, surface } = content;
    this.hours = unpack(content.hours); this.length = this.hours.length;
    this.temperature = unpack(content.temperature); this.outside = unpack(content.outside);
    this.sensors = content.machine.sensors.length;
    if (tcp) {
      this.tcpField = new Modes(tcp.field); this.tcpActual = unpack(tcp.actual);
      this.start = tcp.worst; this.middle = tcp.middle;
    }
    if (surface) {
      this.heat = surface.temperature.map((t) => new Modes(t));
      this.moved = surface.displacement && surface.displacement.map((u) => new Modes(u));
      this.position = unpack(surface.position); this.angle = unpack(surface.angle);
    }
    this.frame = { row: -1 };
  }
  sensor(row, i) { return this.temperature[row * this.sensors + i]; }
  tcp(row) { // m, 3 per pose
    const found = new Float32Array(this.tcpField.size);
    this.tcpField.at(row, found, 0);
    return found;
  }
  actual(row) { return this.tcpActual.subarray(3 * row, 3 * row + 3); }
  surface(row) { // temperature per node, displacement [m], position of the axes
    if (!this.heat) return null;
    if (this.frame.row !== row) {
      const nodes = this.heat.reduce((sum, m) => sum + m.size, 0);
      const temperature = new Float32Array(nodes), displacement = new Float32Array(3 * nodes);
      let at = 0;
      this.heat.forEach((modes, b) => {
        modes.at(row, temperature, at);
        if (this.moved) this.moved[b].at(row, displacement, 3 * at);
        at += modes.size;
      });
      const of = (table) => table.subarray(row * table.shape[1], (row + 1) * table.shape[1]);
      this.frame = { row, temperature, displacement, position: of(this.position), angle: of(this.angle) };
    }
    return this.frame;
  }
}

class Running { // of a machine that runs: rows come with every step of the model
  constructor(content) {
    this.sensors = content.machine.sensors.length;
    this.poses = content.machine.workspace ? content.machine.workspace.poses : 0;
    this.middle = content.middle; this.length = 0; this.hours = []; this.rows = []; this.outside = [];
    this.frame = { row: -1 }; this.start = 0;
  }
  add(row) {
    this.hours.push(row.hours); this.outside.push(row.outside ? 1 : 0);
    this.rows.push({ step: row.step, temperature: row.temperature, tcp: row.tcp && unpack(row.tcp) });
    this.length = this.rows.length;
  }
  drop(count) { this.hours.splice(0, count); this.rows.splice(0, count); this.outside.splice(0, count); this.length = this.rows.length; this.frame.row -= count; }
  clear() { this.drop(this.length); this.frame = { row: -1 }; }
  sensor(row, i) { const v = this.rows[row].temperature[i]; return v === undefined ? null : v; }
  tcp(row) { return this.rows[row].tcp; }
  actual() { return null; }
  async fetch(row) { // the surface of a row, which the server computes when it is asked for
    const answer = await fetch(`frame/${this.rows[row].step}.json`, { credentials: "same-origin" });
    if (!answer.ok) return;
    const told = await answer.json();
    this.frame = { row, temperature: unpack(told.temperature), displacement: unpack(told.displacement),
      position: unpack(told.position) };
  }
  surface(row) { return this.frame.row === row || this.frame.temperature ? this.frame : null; }
}
