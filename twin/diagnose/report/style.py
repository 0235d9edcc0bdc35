"""The look of the page of a diagnosis: light, dark and on paper."""

STYLE = """
:root { --ink: #22262b; --page: #ffffff; --soft: #f4f5f7; --grid: #e6e8eb; --muted: #6a7078;
  --blue: #0072b2; --orange: #d55e00; --good: #2f7d4f; color-scheme: light dark; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #e4e6e9; --page: #16191d; --soft: #20242a; --grid: #32373e; --muted: #a0a6ae;
    --blue: #56b4e9; --orange: #f0803c; --good: #6cc08f; }
  img { filter: invert(0.9) hue-rotate(180deg); } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page); max-width: 1100px;
  margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; }
h3 { font-size: 1rem; margin: 1.5rem 0 .4rem; }
.verdict { background: var(--soft); border-left: 6px solid var(--orange); padding: .8rem 1.2rem; margin: 1rem 0; }
.verdict.nothing { border-color: var(--good); }
.verdict.sensor, .verdict.signal { border-color: var(--blue); }
.verdict p { margin: .3rem 0; }
.label { text-transform: uppercase; letter-spacing: .06em; font-size: .8rem; color: var(--muted); }
.sentence { font-size: 1.2rem; line-height: 1.4; overflow-wrap: anywhere; }
nav { margin: 1rem 0; } nav a { color: var(--blue); margin-right: 1rem; }
figure { margin: .6rem 0 1.2rem; break-inside: avoid; }
figcaption { color: var(--muted); }
img { max-width: 100%; height: auto; }
.place { display: flex; flex-wrap: wrap; gap: 1rem 2rem; align-items: center; }
.place figure { flex: 1 1 26rem; min-width: 0; margin: 0; }
summary { cursor: pointer; color: var(--blue); margin: .4rem 0; }
body > details > summary { border-bottom: 1px solid var(--grid); }
summary h2 { display: inline-block; margin: .3rem 0; color: var(--ink); }
summary span { display: block; color: var(--ink); margin: 0 0 .3rem 1rem; }
.wide { flex: 1 1 22rem; overflow-x: auto; }
table { border-collapse: collapse; margin: .6rem 0 1.2rem; font-size: .88rem; }
th, td { text-align: left; padding: .25rem .7rem .25rem 0; border-bottom: 1px solid var(--grid); vertical-align: top;
  overflow-wrap: break-word; max-width: 24rem; }
th { color: var(--muted); font-weight: 600; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
@media print { body { max-width: none; margin: 0; font-size: 10pt; } nav { display: none; } tr { break-inside: avoid; }
  h2, h3 { break-after: avoid; } .wide { overflow: visible; } .verdict { print-color-adjust: exact; }
  details::details-content { content-visibility: visible; display: block; } }
"""
