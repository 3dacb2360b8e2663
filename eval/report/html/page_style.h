#pragma once

// The fixed parts of report.html.

namespace sextant {

inline constexpr const char* page_style = R"css(:root {
  color-scheme: light dark;
  --paper: #fff; --ink: #1c1c1c; --quiet: #595959; --line: #d6d6d6; --link: #0058a3; --row: #ececec; --hover: #f6f8fa;
  --plate: #f6f6f6;
  --agrees: #00533a; --agrees-plate: #e0f3ec; --agrees-line: #8fc9b5;
  --differs: #8f2c00; --differs-plate: #fdebe2; --differs-line: #e6b39a;
  --open: #4a4a4a; --open-plate: #f1f1f1; --open-line: #c9c9c9;
}
@media screen and (prefers-color-scheme: dark) {
  :root {
    --paper: #16181b; --ink: #e6e6e6; --quiet: #a4a8ad; --line: #3a3f45; --link: #7db8f0; --row: #2b2f34; --hover: #20242a;
    --plate: #1f2226;
    --agrees: #8be0c0; --agrees-plate: #10382b; --agrees-line: #2c6b55;
    --differs: #ffb694; --differs-plate: #47210f; --differs-line: #80462c;
    --open: #c4c8cc; --open-plate: #2a2e33; --open-line: #4a5057;
  }
  img.drawn { filter: invert(1) hue-rotate(180deg); }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0 auto; padding: 1.5rem; max-width: 104rem; background: var(--paper); color: var(--ink);
  font: 1rem/1.5 system-ui, "DejaVu Sans", "Liberation Sans", Arial, sans-serif;
  display: grid; grid-template: "nav header" auto "nav main" 1fr / 14rem minmax(0, 1fr); column-gap: 2.2rem;
}
header { grid-area: header; }
main { grid-area: main; }
section, figure { scroll-margin-top: 1rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .6rem; }
h2 { font-size: 1.4rem; margin: 2.6rem 0 .7rem; padding-bottom: .2rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1.08rem; margin: 1.8rem 0 .3rem; }
p { margin: .4rem 0 .8rem; max-width: 48rem; overflow-wrap: anywhere; }
a { color: var(--link); }
.abstract { font-size: 1.05rem; }
nav {
  grid-area: nav; position: sticky; top: 0; align-self: start; max-height: 100vh; overflow-y: auto; padding: .4rem 0;
  font-size: .86rem; line-height: 1.35;
}
nav ul { list-style: none; margin: 0; padding: 0 .8rem 0 0; border-right: 1px solid var(--line); }
nav li { margin: 0 0 .5rem; }
nav a { text-decoration: none; }
nav a:hover { text-decoration: underline; }
.counts { font-weight: 600; }
.verdicts { list-style: none; margin: 0; padding: 0; }
.verdicts li { border-top: 1px solid var(--line); }
.line {
  display: grid; grid-template-columns: 1rem 11rem minmax(18rem, 3fr) 2fr; gap: .2rem .8rem; align-items: baseline;
  padding: .4rem 0;
}
.line::before { content: ""; }
summary.line { cursor: pointer; }
summary.line::-webkit-details-marker { display: none; }
summary.line::before { content: "▸"; color: var(--quiet); }
details[open] > summary.line::before { content: "▾"; }
details > .scroll, details > .folded { margin-left: 1.8rem; }
.evidence { color: var(--quiet); }
.answers { columns: 25rem; column-gap: 1.6rem; }
.answer { border-top: 2px solid var(--line); padding-top: .4rem; margin-bottom: 1.2rem; break-inside: avoid; }
.answer p { margin: 0; display: flex; flex-wrap: wrap; gap: .1rem .7rem; align-items: baseline; max-width: none; }
.answer .subject { font-weight: 600; }
.answer .evidence { font-size: .9rem; flex-basis: 100%; }
.answer figure { margin: .3rem 0; }
.answer figcaption { display: none; }
.verdict {
  display: inline-block; justify-self: start; padding: 0 .5em; border-radius: .3em; white-space: nowrap;
  border: 1px solid; font-size: .92em; -webkit-print-color-adjust: exact; print-color-adjust: exact;
}
.agrees { color: var(--agrees); background: var(--agrees-plate); border-color: var(--agrees-line); }
.differs { color: var(--differs); background: var(--differs-plate); border-color: var(--differs-line); }
.open { color: var(--open); background: var(--open-plate); border-color: var(--open-line); }
.caption, .note, figcaption { color: var(--quiet); font-size: .9rem; }
.note { margin: .3rem 0; }
.scroll { overflow-x: auto; margin: .6rem 0; }
table { border-collapse: collapse; font-size: .86rem; line-height: 1.35; width: max-content; }
td, th { max-width: 24rem; overflow-wrap: break-word; }
.folded { font-weight: 600; font-size: .92rem; margin: 1.1rem 0 -.2rem; max-width: none; }
th, td { padding: .28rem .6rem; text-align: left; vertical-align: baseline; }
th { border-top: 2px solid var(--ink); border-bottom: 1px solid var(--ink); vertical-align: bottom; }
td { border-bottom: 1px solid var(--row); }
tbody tr:last-child td { border-bottom: 2px solid var(--ink); }
tbody tr:hover { background: var(--hover); }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.crowded table { font-size: .78rem; }
.crowded th, .crowded td { padding: .25rem .45rem; }
th button { all: unset; cursor: pointer; }
th button:focus-visible, .scroll:focus-visible, pre:focus-visible, summary:focus-visible { outline: 2px solid var(--link); }
th[aria-sort=ascending] button::after { content: " ▲"; font-size: .7em; }
th[aria-sort=descending] button::after { content: " ▼"; font-size: .7em; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 17rem), 1fr)); gap: .2rem 1rem; }
.pictures figure { margin: .4rem 0; }
.figures { display: flex; flex-wrap: wrap; gap: 1.2rem 2rem; align-items: flex-start; }
figure { margin: .8rem 0; width: 100%; }
figure img { display: block; width: 100%; height: auto; }
.broad { overflow-x: auto; }
.broad img { min-width: 40rem; }
.answer .broad img { min-width: 28rem; }
figcaption { margin-top: .3rem; max-width: 48rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1.2rem; font-size: .92rem; }
dt { color: var(--quiet); }
dd { margin: 0; overflow-wrap: anywhere; }
pre { overflow-x: auto; padding: .8rem; background: var(--plate); border: 1px solid var(--line); font-size: .82rem; }
@media (max-width: 64rem) {
  body { display: block; }
  nav {
    position: sticky; z-index: 1; margin: 0 0 1rem; padding: .5rem 0; background: var(--paper); overflow-x: auto;
    border-bottom: 1px solid var(--line);
  }
  nav ul { display: flex; gap: 1.2rem; border: 0; padding: 0; width: max-content; }
  nav li { margin: 0; white-space: nowrap; }
  section, figure { scroll-margin-top: 3.5rem; }
}
@media (max-width: 46rem) {
  body { padding: 1rem; }
  h1 { font-size: 1.5rem; }
  .line { grid-template-columns: 1rem 1fr; }
  .line > .subject, .line > .evidence { grid-column: 2; }
  details > .scroll, details > .folded { margin-left: 0; }
  dl { grid-template-columns: 1fr; }
  dd { margin-bottom: .5rem; }
  th, td { padding: .28rem .5rem; }
}
@page { size: A4; margin: 16mm 14mm; }
@page wide { size: A4 landscape; margin: 12mm; }
@media print {
  :root { color-scheme: light; }
  body { display: block; max-width: none; padding: 0; font-size: 9.5pt; }
  nav { display: none; }
  h1 { font-size: 17pt; }
  h2 { font-size: 13pt; margin-top: 1.4rem; }
  h2, h3, .caption { break-after: avoid; }
  a { color: inherit; text-decoration: none; }
  .line, figure, .answer, tr, pre, dt, dd { break-inside: avoid; }
  .line { grid-template-columns: .4cm 3.2cm 9.2cm 1fr; }
  .answers { columns: 2; }
  .pictures { grid-template-columns: repeat(3, 1fr); }
  .scroll { overflow: visible; }
  table { font-size: 7.5pt; width: auto; max-width: 100%; }
  .folded { break-after: avoid; }
  thead { display: table-header-group; }
  th, td { padding: .12rem .35rem; }
  .wide { page: wide; }
  .crowded table { font-size: 6pt; }
  .crowded th, .crowded td { padding: .1rem .2rem; }
  .broad img { min-width: 0; }
  .figures { display: block; }
  .figures figure { display: inline-block; vertical-align: top; width: 8.8cm; margin: .3cm .2cm .3cm 0; }
  pre { white-space: pre-wrap; }
}
)css";

/// Headings become buttons that sort their table's rows: numbers by their exact value, rows without one last. What is
/// folded is printed.
inline constexpr const char* sort_script = R"js(for (const table of document.querySelectorAll("table")) {
  const headings = [...table.tHead.rows[0].cells];
  const body = table.tBodies[0];
  const compare = (a, b, sign) => {
    const [x, y] = [a, b].map(cell => cell.dataset.value);
    if (x !== undefined && y !== undefined) return sign * (x - y);
    if (x !== undefined || y !== undefined) return x !== undefined ? -1 : 1;
    return sign * a.textContent.localeCompare(b.textContent, "en", {numeric: true});
  };
  headings.forEach((heading, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.title = "sort";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const sign = heading.ariaSort === "ascending" ? -1 : 1;
      headings.forEach(other => other.removeAttribute("aria-sort"));
      heading.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
      body.append(...[...body.rows].sort((a, b) => compare(a.cells[column], b.cells[column], sign)));
    });
  });
}
for (const [event, open] of [["beforeprint", true], ["afterprint", false]]) {
  addEventListener(event, () => document.querySelectorAll("details").forEach(part => { part.open = open; }));
}
)js";

}  // namespace sextant
