"use strict";
// Colours: the maps of the pictures, values as colours, and the bar that tells them.

const HEAT = ["#e6ecf2", "#cfdbe2", "#fbe6a6", "#f8b04f", "#e4602e", "#a81e36", "#5c0f3a"];
const LENGTH = ["#7f93a6", "#cf9f3f", "#dd5a2b", "#a81e36", "#5c0f3a"]; // for lines on white: never pale
const AXES = ["#d55e00", "#009e73", "#0072b2"]; // x, y, z: Okabe-Ito, distinguished by every eye
const MARKED = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#5b4b9a"];
const MUTED = "#c3c8ce", INK = "#22262b";

function colourTable(stops) { // 256 colours, red green blue of 0 .. 1
  const rgb = stops.map((s) => [1, 3, 5].map((k) => parseInt(s.slice(k, k + 2), 16) / 255));
  const table = new Float32Array(256 * 3);
  for (let i = 0; i < 256; i++) {
    const at = (i / 255) * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; c++) table[3 * i + c] = rgb[k][c] + (at - k) * (rgb[k + 1][c] - rgb[k][c]);
  }
  return table;
}
const HEAT_TABLE = colourTable(HEAT), LENGTH_TABLE = colourTable(LENGTH);

function paint(values, low, high, table, into) { // into: 3 numbers per value
  const scale = 255 / Math.max(high - low, 1e-9);
  for (let i = 0; i < values.length; i++) {
    const k = 3 * Math.max(0, Math.min(255, Math.round((values[i] - low) * scale)));
    into[3 * i] = table[k]; into[3 * i + 1] = table[k + 1]; into[3 * i + 2] = table[k + 2];
  }
}

function bar(element, stops, low, high, unit, more) { // more: whether something lies [below, above] the ends
  const digits = high - low < 0.5 ? 2 : high - low < 40 ? 1 : 0;
  element.replaceChildren();
  const strip = document.createElement("div"), ticks = document.createElement("div");
  strip.className = "strip"; ticks.className = "ticks";
  strip.style.background = `linear-gradient(to right, ${stops.join(",")})`;
  const count = element.clientWidth > 420 ? 5 : 3;
  for (let i = 0; i < count; i++) {
    const span = document.createElement("span");
    const value = (low + ((high - low) * i) / (count - 1)).toFixed(digits);
    const sign = i === 0 && more[0] ? "≤ " : i === count - 1 && more[1] ? "≥ " : "";
    span.textContent = sign + value + (i === count - 1 ? " " + unit : "");
    ticks.append(span);
  }
  element.append(strip, ticks);
}

function percentiles(values, weights, shares, least, most) { // values that so large shares of the weight are not above
  const bins = 4096, sums = new Float64Array(bins), width = Math.max(most - least, 1e-9) / bins; // sorting takes ten times as long
  let total = 0, sum = 0;
  for (let i = 0; i < values.length; i++) {
    sums[Math.min(bins - 1, Math.floor((values[i] - least) / width))] += weights[i];
    total += weights[i];
  }
  const found = [];
  for (let b = 0; b < bins; b++) {
    sum += sums[b];
    while (found.length < shares.length && sum >= shares[found.length] * total) found.push(least + (b + 1) * width);
  }
  return found;
}

function round125(x) { // the largest of 1, 2, 5 times a power of ten that is not above x
  if (!(x > 0)) return 1;
  const step = 10 ** Math.floor(Math.log10(x));
  return step * (x >= 5 * step ? 5 : x >= 2 * step ? 2 : 1);
}
