// State, events, and what is drawn when.

const element = id => document.getElementById(id);
const LAYERS = [["current", "current image", "b"], ["masks", "masks", "m"], ["points", "points", "p"],
                ["outliers", "outliers", "o"], ["flow", "flow", "f"], ["refined", "refined flow", "r"],
                ["labels", "labels", "l"], ["boxes", "true boxes", "t"], ["axes", "estimated axes", "a"]];
const state = {
  frame: FIRST, body: FIRST_BODY, playing: false, flowLength: 0.25, pointsOf: 0, worstBy: CURVES[0], byDifference: false,
  layers: {current: false, masks: true, points: true, outliers: true, flow: true, refined: false, labels: true,
           boxes: Object.keys(D.outlines).every(frame => Object.keys(D.outlines[frame]).length === 0), axes: true},
};

let drawAsked = false;
function requestDraw() {
  if (drawAsked) return;
  drawAsked = true;
  requestAnimationFrame(() => { drawAsked = false; draw(); });
}

/// Draws everything that changes with the frame.
function draw() {
  drawPicture(state);
  moveCursors(state.frame, plotWidth);
  drawTop(element("top"), state.frame);
  showNumbers();
  element("slider").value = state.frame;
  if (document.activeElement !== element("frame")) element("frame").value = state.frame;
  element("pair").textContent = `${state.frame - 1} → ${state.frame}`;
  document.body.dataset.frame = state.frame;
  document.body.dataset.body = state.body;
}

let plotWidth = 0;  // of the ribbon and the timelines, CSS pixels

/// Draws everything that changes only with the body and the size of the window.
function drawStill() {
  plotWidth = element("ribbon").clientWidth;
  element("body-name").textContent = nameOf(state.body);
  drawRibbon(element("ribbon"), state.body);
  for (const canvas of element("timelines").querySelectorAll("canvas"))
    drawTimeline(canvas, CURVES[canvas.dataset.curve], state.body, canvas.dataset.difference === "1");
  drawPaths(element("top"), state.body);
  showWorst();
  for (const button of element("bodies").children)
    button.setAttribute("aria-pressed", String(button.dataset.body === state.body));
  requestDraw();
}

/// Writes frame and body into the address. Called with a delay while the user scrubs, since browsers allow only a few
/// changes per second.
let addressTimer = 0;
function showAddress() {
  const hash = `#frame=${state.frame}&body=${encodeURIComponent(state.body).replace("%3A", ":")}`;
  if (location.hash !== hash) history.replaceState(null, "", hash);
}

function goTo(frame, body = state.body) {
  const target = Math.min(LAST, Math.max(FIRST, Math.round(Number(frame))));
  if (!Number.isFinite(target)) return;
  const bodyChanged = body !== state.body && bodies.includes(body);
  state.frame = target;
  if (bodyChanged) state.body = body;
  clearTimeout(addressTimer);
  addressTimer = setTimeout(showAddress, 150);
  bodyChanged ? drawStill() : requestDraw();
}

function followAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  goTo(wanted.get("frame") ?? state.frame, wanted.get("body") ?? state.body);
}

let playedAt = 0;
function play(on) {
  state.playing = on;
  element("play").textContent = on ? "Pause" : "Play";
  element("play").setAttribute("aria-pressed", String(on));
  if (on) { playedAt = 0; requestAnimationFrame(tick); }
}
function tick(now) {
  if (!state.playing) return;
  if (now - playedAt >= 1000 / Math.max(1, D.rate_hz || 10)) {
    playedAt = now;
    if (state.frame >= LAST) { play(false); return; }
    goTo(state.frame + 1);
  }
  requestAnimationFrame(tick);
}

// ---- lists and tables

/// Fills a table with rows {key, cells: [{text, kind, title, colour}]}; cells that are equal already are not written.
function fillTable(table, rows) {
  while (table.rows.length > rows.length) table.deleteRow(-1);
  rows.forEach(({key, cells}, index) => {
    const row = table.rows[index] ?? table.insertRow();
    if (row.dataset.key !== key) key === undefined ? delete row.dataset.key : row.dataset.key = key;
    while (row.cells.length > cells.length) row.deleteCell(-1);
    cells.forEach(({text = "", kind = "", title = "", colour = ""}, column) => {
      const cell = row.cells[column] ?? row.insertCell();
      if (cell.className !== kind) cell.className = kind;
      if (cell.title !== title) cell.title = title;
      if (cell.textContent !== text) cell.textContent = text;
      if (cell.style.color !== colour) cell.style.color = colour;
    });
  });
}

function showNumbers() {
  const records = D.runs.map((_, run) => recordOf(run, state.frame, state.body));
  const rows = [];
  const add = (key, what, title, values) => rows.push(
    {key, cells: [{text: what, kind: "what", title}, ...values.map(v => ({text: v.text, kind: "number", title: v.exact}))]});
  if (D.runs.length > 1)
    rows.push({cells: [{}, ...D.runs.map((run, i) => ({text: titleOf(run), kind: "number head", title: run.name, colour: `var(--run-${i})`}))]});
  add(undefined, "status", "", records.map(r => ({text: r ? r.gate ? `${r.status} (${r.gate})` : r.status : "no record"})));
  if (HAS_POINTS) add(undefined, "inliers / points", "", records.map(r => ({text: r ? `${r.n_inliers} / ${r.n_points}` : ""})));
  for (const map of ["errors", "values", "bound"]) {
    const keys = [...new Set(records.flatMap(r => Object.keys(r?.[map] ?? {})))];
    for (const key of keys) {
      const metric = metricOf(map, key);
      const name = `${map === "bound" ? "bound of " : ""}${metric?.symbol ?? key}${metric && metric.unit && metric.unit !== "1" ? ` [${metric.unit}]` : ""}`;
      add(`${map}.${key}`, name, `${map}.${key}${metric ? `: ${metric.definition}` : ""}`,
          records.map(r => r?.[map]?.[key]).map(v => ({text: shown(v, metric?.digits ?? 4), exact: v === undefined ? "" : String(v)})));
    }
  }
  fillTable(element("numbers"), rows);
}

function showWorst() {
  const list = element("worst");
  list.replaceChildren();
  for (const {frame, value} of worstFrames(state.worstBy, state.body, state.byDifference).slice(0, 10)) {
    const item = document.createElement("li"), button = document.createElement("button");
    button.type = "button";
    button.dataset.frame = frame;
    button.textContent = `${frame}: ${Number(value.toPrecision(4))} ${state.worstBy.unit}`;
    button.addEventListener("click", () => goTo(frame));
    item.append(button);
    list.append(item);
  }
}

function nextWorst() {
  const frames = worstFrames(state.worstBy, state.body, state.byDifference).slice(0, 10).map(row => row.frame);
  if (frames.length > 0) goTo(frames[(frames.indexOf(state.frame) + 1) % frames.length]);
}

// ---- building the page

function buildHeader() {
  document.title = `${D.runs.map(titleOf).join(" and ")} on ${D.source}`;
  element("title").textContent = document.title;
  const facts = D.runs.map((run, index) => {
    const noise = run.noise === "none" || run.noise === "" ? "" : `, noise ${run.noise}, level ${run.level}, seed ${run.seed}`;
    return {colour: `var(--run-${index})`, text: `${run.name}: ${run.estimator}${noise}${run.version ? `, sextant ${run.version}` : ""}`};
  });
  for (const fact of facts) {
    const line = document.createElement("span"), swatch = document.createElement("i");
    swatch.className = "swatch";
    swatch.style.background = fact.colour;
    if (D.runs.length > 1) line.append(swatch);
    line.append(`${fact.text}  `);
    element("facts").append(line);
  }
  for (const run of D.runs)
    for (const note of run.notes) {
      const line = document.createElement("p");
      line.textContent = `${run.name}: ${note}`;
      element("notes").append(line);
    }
}

function buildLayers() {
  for (const id of ["picture-box", "layers", "legend"]) element(id).hidden = !HAS_PICTURE;
  for (const [name, text, key] of LAYERS) {
    const label = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.id = `layer-${name}`;
    box.checked = state.layers[name];
    box.addEventListener("change", () => { state.layers[name] = box.checked; requestDraw(); });
    label.title = `key ${key}`;
    label.append(box, ` ${text}`);
    element("layers").append(label);
  }
  const label = document.createElement("label"), length = document.createElement("input");
  Object.assign(length, {type: "range", id: "flow-length", min: 0, max: 2, step: 0.05, value: state.flowLength});
  length.addEventListener("input", () => { state.flowLength = Number(length.value); requestDraw(); });
  label.append("length of flow ", length);
  element("layers").append(label);
  if (D.runs.length > 1) {
    const select = document.createElement("select");
    select.id = "points-of";
    D.runs.forEach((run, index) => select.append(new Option(run.name, index)));
    select.addEventListener("change", () => { state.pointsOf = Number(select.value); requestDraw(); });
    const whose = document.createElement("label");
    whose.append("points of ", select);
    element("layers").append(whose);
  }
  const gradient = document.createElement("i");
  gradient.style.background = `linear-gradient(90deg, ${RESIDUAL_COLOURS.join(",")})`;
  if (D.runs.some(run => Object.keys(run.pairs).length > 0))
  element("legend").append("residual of the measured flow: 0 px", gradient, `${RESIDUAL_MAX} px and more; outliers are crosses; `,
                           "of many points an even choice is drawn");
}

function buildBodies() {
  bodies.forEach((body, index) => {
    const button = document.createElement("button"), dot = document.createElement("i");
    button.type = "button";
    button.dataset.body = body;
    if (index < 9) button.title = `key ${index + 1}`;
    dot.style.background = colourOf(body);
    button.append(dot, nameOf(body));
    button.addEventListener("click", () => goTo(state.frame, body));
    element("bodies").append(button);
  });
  const seen = new Set();
  for (const run of D.runs)
    for (const frame of Object.values(run.records)) for (const record of Object.values(frame)) seen.add(record.status);
  for (const status of seen) {
    const entry = document.createElement("b"), swatch = document.createElement("i");
    swatch.style.background = STATUS_COLOURS[status] ?? "#888";
    entry.append(swatch, status.replaceAll("_", " "));
    element("statuses").append(entry);
  }
}

function buildTimelines() {
  const add = (curve, difference) => {
    const canvas = document.createElement("canvas");
    canvas.dataset.curve = CURVES.indexOf(curve);
    canvas.dataset.difference = difference ? "1" : "0";
    canvas.id = `timeline-${curve.id}${difference ? "-difference" : ""}`;
    canvas.setAttribute("aria-label", `${difference ? "difference of " : ""}${curve.title} over time`);
    element("timelines").append(canvas);
    scrubs(canvas, (frame, _) => goTo(frame));
    const ofRun = D.runs.length > 1 && !difference ? ` of ${titleOf(D.runs[0])}` : "";  // worstFrames() takes the first run
    const option = new Option(`${difference ? "difference of " : ""}${curve.title}${ofRun}`, canvas.id);
    option.dataset.curve = CURVES.indexOf(curve);
    option.dataset.difference = difference ? "1" : "";
    element("worst-by").append(option);
  };
  for (const curve of CURVES) {
    add(curve, false);
    if (D.runs.length > 1 && curve.id !== "inliers") add(curve, true);
  }
  element("worst-by").addEventListener("change", event => {
    const option = event.target.selectedOptions[0];
    state.worstBy = CURVES[option.dataset.curve];
    state.byDifference = option.dataset.difference === "1";
    showWorst();
  });
  scrubs(element("ribbon"), (frame, event) => {
    const row = Math.floor((event.clientY - element("ribbon").getBoundingClientRect().top) / RIBBON_ROW);
    goTo(frame, bodies[Math.min(bodies.length - 1, Math.max(0, row))]);
  });
}

/// A click seeks, dragging scrubs.
function scrubs(canvas, seek) {
  canvas.addEventListener("pointerdown", event => {
    play(false);
    canvas.setPointerCapture(event.pointerId);
    seek(frameAt(canvas, event.clientX), event);
  });
  canvas.addEventListener("pointermove", event => {
    if (event.buttons & 1) seek(frameAt(canvas, event.clientX), event);
  });
}

function buildTop() {
  const canvas = element("top");
  navigates(canvas, topView, () => { drawPaths(canvas, state.body); requestDraw(); });
}

function buildPicture() {
  const canvas = picture.canvas;
  let from = null;
  canvas.addEventListener("wheel", event => {
    if (!event.ctrlKey && picture.zoom === 1 && event.deltaY > 0) return;  // the page scrolls
    event.preventDefault();
    zoomPicture(Math.exp(-event.deltaY / 400), event.clientX, event.clientY);
    requestDraw();
  }, {passive: false});
  canvas.addEventListener("pointerdown", event => {
    from = {x: event.clientX, y: event.clientY, left: picture.x, top: picture.y};
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", event => {
    if (!(event.buttons & 1) || from === null) return;
    const px = D.width / picture.zoom / canvas.clientWidth;
    movePicture(from.left - (event.clientX - from.x) * px, from.top - (event.clientY - from.y) * px);
    requestDraw();
  });
  canvas.addEventListener("dblclick", () => { picture.zoom = 1; movePicture(0, 0); requestDraw(); });
}

function toggleLayer(name) {
  element(`layer-${name}`).click();
}

function changeFlowLength(by) {
  const length = element("flow-length");
  length.value = Number(length.value) + by;
  length.dispatchEvent(new Event("input"));
}

const KEYS = {
  ArrowLeft: event => goTo(state.frame - (event.shiftKey ? 10 : 1)),
  ArrowRight: event => goTo(state.frame + (event.shiftKey ? 10 : 1)),
  Home: () => goTo(FIRST),
  End: () => goTo(LAST),
  " ": () => play(!state.playing),
  w: nextWorst,
  "+": () => changeFlowLength(0.1),
  "-": () => changeFlowLength(-0.1),
  0: () => { picture.zoom = 1; movePicture(0, 0); requestDraw(); },
  "?": () => element("help").open ? element("help").close() : element("help").showModal(),
};
for (const [name, , key] of LAYERS) KEYS[key] = () => toggleLayer(name);

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const target = event.target, types = target.matches?.("input[type=number], select");
  if (types || element("help").open && event.key !== "?") return;
  if (target.matches?.("button, input[type=checkbox]") && event.key === " ") return;  // presses it
  const action = KEYS[event.key] ?? (/^[1-9]$/.test(event.key) ? () => goTo(state.frame, bodies[Number(event.key) - 1] ?? state.body) : null);
  if (!action) return;
  event.preventDefault();
  action(event);
}

function start() {
  buildHeader();
  buildLayers();
  buildBodies();
  buildTimelines();
  buildPicture();
  buildTop();
  Object.assign(element("slider"), {min: FIRST, max: LAST, step: 1});
  Object.assign(element("frame"), {min: FIRST, max: LAST, step: 1});
  element("slider").addEventListener("input", event => { play(false); goTo(event.target.value); });
  element("frame").addEventListener("change", event => goTo(event.target.value));
  element("play").addEventListener("click", () => play(!state.playing));
  element("back").addEventListener("click", () => goTo(state.frame - 1));
  element("forth").addEventListener("click", () => goTo(state.frame + 1));
  element("timelines-note").textContent = [
    ...(HAS_BANDS ? ["band: 95 % of errors by the estimate's own covariance"] : []),
    ...(HAS_FLOORS ? ["dashed: the truth's own floor"] : [])].join("; ");
  element("top-note").textContent = HAS_POSITIONS
    ? "lines and discs: estimate; grey dashes and circles: truth; ellipses: 95 % by the accumulated covariance" : "";
  element("help-button").addEventListener("click", () => element("help").showModal());
  document.addEventListener("keydown", onKey);
  window.addEventListener("hashchange", followAddress);
  new ResizeObserver(() => drawStill()).observe(element("left"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { styles.clear(); drawStill(); });
  followAddress();
  drawStill();
}
start();
