"use strict";
// A lumped machine as its network: nodes round, bars square, contacts between them.

class Network {
  constructor(told, canvas, pick) {
    const svg = (name, values) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
      return made;
    };
    const across = told.places.map((p) => p[0]), up = told.places.map((p) => p[1]);
    const span = (values) => Math.max(Math.max(...values) - Math.min(...values), 1e-9);
    const scale = Math.min(640 / span(across), 360 / span(up), 160), middle = (values) => (Math.max(...values) + Math.min(...values)) / 2;
    const at = told.places.map(([x, y]) => [400 + scale * (x - middle(across)), 240 - scale * (y - middle(up))]);
    const host = svg("svg", { id: "network", viewBox: "0 0 800 500", role: "img", "aria-label": "nodes and bars" });
    for (const [a, b, moves] of told.links)
      host.append(svg("line", { x1: at[a][0], y1: at[a][1], x2: at[b][0], y2: at[b][1], class: moves ? "moves" : "" }));
    let nearest = 50; // between two members, at most what makes symbols large enough
    at.forEach((a, k) => at.slice(0, k).forEach((b) => { nearest = Math.min(nearest, Math.hypot(a[0] - b[0], a[1] - b[1])); }));
    const r = Math.max(0.3 * nearest, 4), crowded = told.names.length > 14; // then only what is chosen shows its name
    this.members = told.names.map((name, k) => {
      const [x, y] = at[k];
      const made = told.bars[k] ? svg("rect", { x: x - r, y: y - r, width: 2 * r, height: 2 * r, class: "member" })
        : svg("circle", { cx: x, cy: y, r, class: "member" });
      const text = svg("text", { x, y: y + r + 15, class: crowded ? "crowded" : "" }), hover = svg("title", {});
      text.textContent = hover.textContent = name;
      made.append(hover);
      made.addEventListener("click", () => pick(k));
      host.append(made, text);
      return made;
    });
    canvas.replaceWith(host);
  }
  choose(entry) { this.members.forEach((made, k) => made.classList.toggle("chosen", !!entry && entry.places.includes(k))); }
  reset() {}
}
