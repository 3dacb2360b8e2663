for (const table of document.querySelectorAll("table")) {
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
// A table of more than 20 rows gets a selection for each text column with 2 to 20 different values, apart from the columns
// that are shown on request only; only the rows with the selected values are shown.
for (const table of document.querySelectorAll("table")) {
  const rows = [...table.tBodies[0].rows];
  if (rows.length <= 20) continue;
  const choices = [];
  for (const heading of table.querySelectorAll("th:not(.number, .second)")) {
    const column = heading.cellIndex;
    const values = new Set(rows.map(row => row.cells[column].textContent));
    if (values.size < 2 || values.size > 20) continue;
    const label = document.createElement("label");
    const select = document.createElement("select");
    for (const value of ["all", ...values]) select.add(new Option(value));
    select.addEventListener("change", () => rows.forEach(row => {
      row.hidden = choices.some(([at, choice]) => choice.selectedIndex > 0 && row.cells[at].textContent !== choice.value);
    }));
    label.append(heading.textContent + " ", select);
    table.parentElement.before(label);
    choices.push([column, select]);
  }
}
for (const [event, open] of [["beforeprint", true], ["afterprint", false]]) {
  addEventListener(event, () => document.querySelectorAll("details").forEach(part => { part.open = open; }));
}
