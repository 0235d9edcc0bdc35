"use strict";
// What is told in words and tables.

const by = (id) => document.getElementById(id);
const um = (metres) => `${metres < 0 ? "−" : "+"}${Math.abs(1e6 * metres).toFixed(1)}`;

function header(content) {
  document.title = `twin: ${content.title}`;
  by("title").textContent = content.title;
  by("subtitle").textContent = [content.subtitle, content.machine.description].filter(Boolean).join(" · ");
  by("facts").textContent = content.facts.join(" · ");
  trusted(content.trust);
  by("missing").replaceChildren(...content.machine.missing.map((text) => element("li", text)));
}

function trusted(trust) {
  const line = `Can I trust it? ${trust.line[0].toUpperCase()}${trust.line.slice(1)}.`;
  if (by("trust").textContent !== line) by("trust").textContent = line;
  by("trust").className = trust.level;
}

function element(name, text, inside = []) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  made.append(...inside);
  return made;
}

function flagged(flags, steps) {
  const list = by("flags").querySelector("ul");
  if (!flags.length) { list.replaceChildren(element("li", "Nothing: every step is inside what was certified.")); return; }
  list.replaceChildren(...flags.map((f) => {
    const when = f.spans ? f.spans.slice(0, 3).map(([a, b]) => `${a.toFixed(2)} to ${b.toFixed(2)} h`).join(", ") : "";
    const more = f.spans && f.spans.length > 3 ? ", and later" : "";
    const count = f.steps ? `${f.steps} of ${steps} steps: ${when}${more} (${f.name})` : f.name;
    return element("li", f.words, [element("small", count)]);
  }));
}

function certified(certificate) {
  by("certificate-words").textContent = `${certificate.passed ? "Passed" : "Not passed"}. Largest errors over ${certificate.words}.`;
  by("certificate-caution").textContent = certificate.caution;
  const [heads, ...rows] = certificate.table;
  if (!heads) return;
  by("certificate").querySelector("table").replaceChildren(
    element("thead", undefined, [element("tr", undefined, heads.map((h) => element("th", h)))]),
    element("tbody", undefined, rows.map((row) => element("tr", undefined, row.map((c) => element("td", c))))),
  );
}

function table(host, rows) {
  host.replaceChildren(element("table", undefined, rows.map(([name, value]) => element("tr", undefined, [element("td", name), element("td", value)]))));
}

function healthy(health) { // the record of `twin live`
  const input = health.input, model = health.model, latency = health.latency;
  const seconds = (s) => (s == null ? "not yet" : s < 1 ? `${(1000 * s).toFixed(0)} ms` : `${s.toFixed(1)} s`);
  const counts = Object.entries(input.blocks).filter(([, n]) => n).map(([k, n]) => `${n} ${k}`).join(", ");
  table(by("health-table"), [
    ["the correction", health.words],
    ["age of the inputs", seconds(input.age_s)],
    ["blocks", counts || "none"],
    ["gaps, clock leaps, values refused", `${input.gaps}, ${input.clock_leaps}, ${Object.values(input.values_refused).reduce((a, b) => a + b, 0)}`],
    ["steps of the model", String(model.steps)],
    ["heat balance is off by", model.balance_error == null ? "not yet known" : `${model.balance_error.toExponential(1)} of the throughput`],
    ["from block to correction: median, 99th percentile", `${seconds(latency.median_s)}, ${seconds(latency.percentile_99_s)}`],
    ["sensors that drift", health.drift.length ? health.drift.join("; ") : "none"],
    ["memory, journal", `${(health.memory_bytes / 1e6).toFixed(0)} MB, ${(health.journal_bytes / 1e6).toFixed(1)} MB`],
  ]);
}

function filed(files) {
  if (!files || !files.length) return;
  const links = files.map((name) => { const a = element("a", name); a.href = name; return a; });
  by("files").replaceChildren("Numbers and pictures beside this page: ", ...links);
}
