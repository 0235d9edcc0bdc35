"use strict";
// The page of a description: the list, the facts of what is chosen, and the sliders of the axes.

class Page {
  constructor(content) {
    this.content = content; this.live = false;
    document.title = `twin: ${content.title}`;
    by("title").textContent = content.title; by("subtitle").textContent = content.subtitle;
    by("facts").textContent = content.facts.join(" · ");
    if (content.problems.length) { by("trust").className = "no"; by("trust").textContent = content.problems.join(" "); }
    by("missing").replaceChildren(...[...content.uncovered, ...content.notes].map((text) => element("li", text)));
    this.machine = this.drawn();
    this.legend();
    this.listed();
    this.sliders();
    by("filter").addEventListener("input", () => this.find(by("filter").value.trim().toLowerCase()));
    by("reset").addEventListener("click", () => this.machine && this.machine.reset());
    by("clear").addEventListener("click", () => this.choose(null));
  }
  drawn() {
    const { network, surface } = this.content, canvas = by("machine-canvas");
    by("reset").hidden = !surface;
    if (network) by("drawn").textContent = "The machine as a network of nodes and bars";
    if (network) return new Network(network, canvas, (k) => this.choose(this.member(network.names[k])));
    if (!surface || !Stage.supported()) {
      canvas.replaceWith(element("p", "This browser draws no WebGL, so no machine; the list needs none."));
      return null;
    }
    const machine = new Described(this.content);
    let down = null; // where the pointer went down: a click that moved is a turn
    canvas.addEventListener("pointerdown", (e) => { down = [e.clientX, e.clientY]; });
    canvas.addEventListener("click", (e) => {
      if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) > 4) return;
      const found = machine.under(e.offsetX, e.offsetY);
      this.choose(typeof found === "number" ? this.surface(surface.names[found]) : found);
    });
    return machine;
  }
  surface(name) { return this.content.entries.find((e) => e.group === "Surfaces" && e.name === name); }
  member(name) { return this.content.entries.find((e) => ["Nodes", "Bars"].includes(e.group) && e.name === name); }
  legend() {
    if (this.content.network) { by("legend").textContent = "Round: a node. Square: a bar. Dotted: a moving contact."; return; }
    const key = (kind, text) => { const mark = element("b"); mark.className = kind; return [mark, text]; };
    by("legend").replaceChildren(...key("bare", "no film and no contact: adiabatic"), ...key("chosen", "chosen, seen through the rest"),
      ...key("sensor", "sensor, tool centre point"));
  }
  listed() {
    this.buttons = new Map(); this.groups = [];
    for (const name of new Set(this.content.entries.map((e) => e.group))) {
      const own = this.content.entries.filter((e) => e.group === name);
      const group = element("details", undefined, [element("summary", `${name} (${own.length})`)]);
      for (const entry of own) {
        const button = element("button", entry.name);
        button.type = "button"; button.setAttribute("aria-pressed", "false");
        button.addEventListener("click", () => this.choose(entry));
        this.buttons.set(entry, button); group.append(button);
      }
      this.groups.push({ group, own });
    }
    by("groups").replaceChildren(...this.groups.map((g) => g.group));
    if (this.groups.length) this.groups[0].group.open = true;
  }
  find(text) {
    for (const { group, own } of this.groups) {
      let left = 0;
      for (const entry of own) {
        const shown = `${entry.name} ${entry.path}`.toLowerCase().includes(text);
        this.buttons.get(entry).hidden = !shown; left += shown;
      }
      group.hidden = !left;
      if (text) group.open = left > 0;
    }
  }
  choose(entry) { // or nothing
    for (const [one, button] of this.buttons) button.setAttribute("aria-pressed", String(one === entry));
    if (this.machine) this.machine.choose(entry || null);
    by("chosen-name").textContent = entry ? `${entry.group}: ${entry.name}` : "Click a name, or the machine";
    const facts = entry ? entry.facts : [];
    by("chosen").querySelector("table").replaceChildren(element("tbody", undefined,
      facts.map(([what, told]) => element("tr", undefined, [element("th", what), element("td", told)]))));
    if (!entry) return;
    const button = this.buttons.get(entry), list = by("groups");
    button.closest("details").open = true;
    const apart = button.getBoundingClientRect().top - list.getBoundingClientRect().top;
    if (apart < 0 || apart > list.clientHeight - 30) list.scrollTop += apart - 60;
  }
  sliders() {
    const { axes } = this.content, positions = axes.map(() => 0);
    by("axes").replaceChildren(...(this.machine ? axes : []).map((axis, k) => {
      const told = (v) => (axis.turns ? `${((180 / Math.PI) * v).toFixed(0)}°` : `${(1000 * v).toFixed(0)} mm`);
      const slider = element("input"), shown = element("output", told(0));
      const [low, high] = axis.stroke;
      Object.assign(slider, { type: "range", id: `axis-${axis.name}`, min: low, max: high, step: (high - low) / 200, value: 0 });
      slider.addEventListener("input", () => {
        positions[k] = +slider.value;
        shown.textContent = told(positions[k]);
        this.machine.move(axes, positions);
      });
      const label = element("label", `${axis.name} `, [slider, shown]);
      label.className = "grow";
      return label;
    }));
  }
}
