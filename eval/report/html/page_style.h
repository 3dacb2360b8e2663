#pragma once

// The fixed parts of report.html.

namespace sextant {

inline constexpr const char* page_style = R"css(:root {
  --ink: #1c1c1c; --quiet: #595959; --line: #d6d6d6; --link: #0058a3;
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0 auto; padding: 1.5rem; max-width: 84rem; background: #fff; color: var(--ink);
  font: 1rem/1.5 system-ui, "DejaVu Sans", "Liberation Sans", Arial, sans-serif;
}
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .6rem; }
h2 { font-size: 1.4rem; margin: 2.6rem 0 .7rem; padding-bottom: .2rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1.08rem; margin: 1.8rem 0 .3rem; }
p { margin: .4rem 0 .8rem; max-width: 48rem; overflow-wrap: anywhere; }
a { color: var(--link); }
.abstract { font-size: 1.05rem; }
nav ul { list-style: none; margin: .8rem 0 0; padding: 0; display: flex; flex-wrap: wrap; gap: .3rem 1.2rem; }
.counts { font-weight: 600; }
.verdicts { list-style: none; margin: 0; padding: 0; }
.verdicts li {
  display: grid; grid-template-columns: 10.5rem minmax(20rem, 3fr) 2fr; gap: .2rem 1rem; align-items: baseline;
  padding: .4rem 0; border-top: 1px solid var(--line);
}
.verdicts .evidence { color: var(--quiet); }
.verdict {
  display: inline-block; justify-self: start; padding: 0 .5em; border-radius: .3em; white-space: nowrap;
  border: 1px solid; font-size: .92em; -webkit-print-color-adjust: exact; print-color-adjust: exact;
}
.agrees { color: #00533a; background: #e0f3ec; border-color: #8fc9b5; }
.differs { color: #8f2c00; background: #fdebe2; border-color: #e6b39a; }
.open { color: #4a4a4a; background: #f1f1f1; border-color: #c9c9c9; }
.caption, .note, figcaption { color: var(--quiet); font-size: .9rem; }
.note { margin: .3rem 0; }
.scroll { overflow-x: auto; margin: .6rem 0; }
table { border-collapse: collapse; font-size: .86rem; line-height: 1.35; width: max-content; }
td, th { max-width: 24rem; overflow-wrap: break-word; }
.folded { font-weight: 600; font-size: .92rem; margin: 1.1rem 0 -.2rem; max-width: none; }
th, td { padding: .28rem .6rem; text-align: left; vertical-align: baseline; }
th { border-top: 2px solid var(--ink); border-bottom: 1px solid var(--ink); vertical-align: bottom; }
td { border-bottom: 1px solid #ececec; }
tbody tr:last-child td { border-bottom: 2px solid var(--ink); }
tbody tr:hover { background: #f6f8fa; }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.crowded table { font-size: .78rem; }
.crowded th, .crowded td { padding: .25rem .45rem; }
th button { all: unset; cursor: pointer; }
th button:focus-visible, .scroll:focus-visible, pre:focus-visible { outline: 2px solid var(--link); }
th[aria-sort=ascending] button::after { content: " ▲"; font-size: .7em; }
th[aria-sort=descending] button::after { content: " ▼"; font-size: .7em; }
.figures { display: flex; flex-wrap: wrap; gap: 1.2rem 2rem; align-items: flex-start; }
figure { margin: .8rem 0; width: 100%; }
figure img { display: block; width: 100%; height: auto; }
figcaption { margin-top: .3rem; max-width: 48rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1.2rem; font-size: .92rem; }
dt { color: var(--quiet); }
dd { margin: 0; overflow-wrap: anywhere; }
pre { overflow-x: auto; padding: .8rem; background: #f6f6f6; border: 1px solid var(--line); font-size: .82rem; }
@media (max-width: 46rem) {
  body { padding: 1rem; }
  h1 { font-size: 1.5rem; }
  .verdicts li { grid-template-columns: 1fr; }
  dl { grid-template-columns: 1fr; }
  dd { margin-bottom: .5rem; }
  th, td { padding: .28rem .5rem; }
}
@page { size: A4; margin: 16mm 14mm; }
@page wide { size: A4 landscape; margin: 12mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 9.5pt; }
  nav { display: none; }
  h1 { font-size: 17pt; }
  h2 { font-size: 13pt; margin-top: 1.4rem; }
  h2, h3, .caption { break-after: avoid; }
  a { color: inherit; text-decoration: none; }
  .verdicts li, figure, tr, pre, dt, dd { break-inside: avoid; }
  .verdicts li { grid-template-columns: 3.4cm 9.5cm 1fr; }
  .scroll { overflow: visible; }
  table { font-size: 7.5pt; width: auto; max-width: 100%; }
  .folded { break-after: avoid; }
  thead { display: table-header-group; }
  th, td { padding: .12rem .35rem; }
  .wide { page: wide; }
  .crowded table { font-size: 6pt; }
  .crowded th, .crowded td { padding: .1rem .2rem; }
  .figures { display: block; }
  .figures figure { display: inline-block; vertical-align: top; width: 8.8cm; margin: .3cm .2cm .3cm 0; }
  pre { white-space: pre-wrap; }
}
)css";

/// Headings become buttons that sort their table's rows: numbers by their exact value, rows without one last.
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
)js";

}  // namespace sextant
