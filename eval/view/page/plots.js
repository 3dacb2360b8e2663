// Timelines, the ribbon of statuses and the view from above.

/// Draws a line through points {frame, x, y}; a frame without a point interrupts the line.
function plotLine(context, points, colour, width, dash) {
  strokeCurve(context, points.length, i => points[i].x, i => points[i].y, i => points[i - 1]?.frame !== points[i].frame - 1,
              {colour, width, dash});
}

const MARGIN = {left: 52, right: 8};
const frameX = (frame, width) =>
  MARGIN.left + (LAST > FIRST ? (frame - FIRST) / (LAST - FIRST) : 0.5) * (width - MARGIN.left - MARGIN.right);
function frameAt(canvas, clientX) {
  const box = canvas.getBoundingClientRect();
  const share = (clientX - box.left - MARGIN.left) / Math.max(1, box.width - MARGIN.left - MARGIN.right);
  return Math.min(LAST, Math.max(FIRST, Math.round(FIRST + share * (LAST - FIRST))));
}

/// Draws one curve of one body for all runs or, with `difference`, for run 1 minus run 0. Returns false if no frame has
/// a value.
function drawTimeline(canvas, curve, body, difference) {
  const series = [];
  for (let run = 0; run < (difference ? 1 : D.runs.length); ++run) {
    const points = [], band = [];
    for (let frame = FIRST; frame <= LAST; ++frame) {
      const value = difference ? differenceOf(curve, frame, body) : valueOf(curve, run, frame, body);
      if (value !== undefined) points.push({frame, value});
      const limit = pairOf(run, frame, body)?.band[curve.band];
      if (!difference && run === 0 && limit !== undefined && value !== undefined) band.push({frame, value: limit});
    }
    series.push({points, band});
  }
  canvas.hidden = series.every(s => s.points.length === 0);
  if (canvas.hidden) return false;
  const height = 92, context = freshContext(canvas, height), width = canvas.clientWidth;
  const values = series.flatMap(s => s.points.map(p => p.value));
  const sorted = series.flatMap(s => s.band.map(p => p.value)).sort((a, b) => a - b);
  const most = Math.max(...values, Math.min(sorted[Math.floor(sorted.length * 0.95)] ?? 0, 2 * Math.max(...values)), 1e-12);
  const least = difference ? Math.min(...values, 0) : 0;
  const span = (difference ? Math.max(most, 0) - least : most) || 1;
  const y = value => height - 16 - Math.max(-0.02, Math.min(1.02, (value - least) / span)) * (height - 32);
  const ink = styleOf("--ink");
  drawValueAxis(context, {least, span, y, left: MARGIN.left, right: width - MARGIN.right});
  const place = list => list.map(p => ({frame: p.frame, x: frameX(p.frame, width), y: y(p.value)}));
  const band = place(series[0].band);
  context.fillStyle = styleOf("--band");
  const half = (width - MARGIN.left - MARGIN.right) / Math.max(1, LAST - FIRST) / 2 + 0.25;
  for (const p of band) {
    const from = Math.max(MARGIN.left, p.x - half), to = Math.min(width - MARGIN.right, p.x + half);
    context.fillRect(from, p.y, to - from, height - 16 - p.y);
  }
  const floor = place(difference || !curve.floor ? [] : series[0].points
    .map(p => ({frame: p.frame, value: curve.floor(recordOf(0, p.frame, body))})).filter(p => p.value !== undefined));
  plotLine(context, floor, styleOf("--truth"), 1.2, [5, 4]);
  series.forEach((s, run) => plotLine(context, place(s.points), difference ? ink : styleOf(`--run-${run}`), 1.5));
  context.textAlign = "left";
  context.fillStyle = ink;
  context.fillText(`${difference ? "difference of " : ""}${curve.title}${curve.unit ? ` [${curve.unit}]` : ""}`, MARGIN.left + 4, 8);
  drawTimeAxis(context, {from: FIRST, to: LAST, x: frame => frameX(frame, width), y: height - 7, width, least: 1});
  return true;
}

const RIBBON_ROW = 15;

function drawRibbon(canvas, body) {
  const context = freshContext(canvas, bodies.length * RIBBON_ROW + 2), width = canvas.clientWidth;
  const half = (width - MARGIN.left - MARGIN.right) / Math.max(1, LAST - FIRST) / 2 + 0.25;
  context.textBaseline = "middle";
  bodies.forEach((name, row) => {
    const y = row * RIBBON_ROW, lane = (RIBBON_ROW - 3) / D.runs.length;
    context.fillStyle = name === body ? styleOf("--ink") : styleOf("--quiet");
    context.fillText(name === "ego" ? "camera" : name.replace("object:", "obj "), 0, y + RIBBON_ROW / 2);
    D.runs.forEach((_, run) => {
      for (let frame = FIRST; frame <= LAST; ++frame) {
        const record = recordOf(run, frame, name);
        if (!record) continue;
        context.fillStyle = STATUS_COLOURS[record.status] ?? "#888";
        const from = Math.max(MARGIN.left, frameX(frame, width) - half);
        const to = Math.min(width - MARGIN.right, frameX(frame, width) + half);
        context.fillRect(from, y + 1 + run * lane, to - from, lane);
      }
    });
    if (name === body) {
      context.strokeStyle = styleOf("--ink");
      context.strokeRect(MARGIN.left - 1, y + 0.5, width - MARGIN.left - MARGIN.right + 2, RIBBON_ROW - 2);
    }
  });
}

/// Moves the lines that mark the present frame in the ribbon and the timelines, which need not be drawn again.
function moveCursors(frame, width) {
  for (const cursor of document.querySelectorAll(".cursor"))
    cursor.style.transform = `translateX(${frameX(frame, width) - 0.5}px)`;
}

// ---- from above: x to the right, z ahead; ahead is up

const SIDE = {truth: [3, 4], estimate: [1, 2]};

function topBox() {
  const box = {x0: Infinity, x1: -Infinity, z0: Infinity, z1: -Infinity};
  for (const run of D.runs)
    for (const track of Object.values(run.tracks))
      for (const p of track)
        for (const [ix, iz] of Object.values(SIDE)) {
          if (p[ix] === null) continue;
          box.x0 = Math.min(box.x0, p[ix]); box.x1 = Math.max(box.x1, p[ix]);
          box.z0 = Math.min(box.z0, p[iz]); box.z1 = Math.max(box.z1, p[iz]);
        }
  return box;
}
const TOP_BOX = topBox();
const ELLIPSE_SCALE = Math.sqrt(5.991464547107979);  // chi-square, 2 degrees of freedom, 95 %

const TRACK_AT = D.runs.map(run => Object.fromEntries(
  Object.entries(run.tracks).map(([name, points]) => [name, new Map(points.map(p => [p[0], p]))])));
const topView = new MapView([TOP_BOX.x0, TOP_BOX.z0, 0], [TOP_BOX.x1, TOP_BOX.z1, 0]);
let drawnPaths = null;  // a copy of the paths, on which drawTop puts the present frame

/// Draws the paths and keeps a copy of them, onto which drawTop draws the present frame.
function drawPaths(canvas, body) {
  const width = canvas.clientWidth, size = [TOP_BOX.x1 - TOP_BOX.x0, TOP_BOX.z1 - TOP_BOX.z0];
  canvas.hidden = !(size[0] >= 0);
  if (canvas.hidden) return;
  const height = Math.round(Math.min(520, Math.max(180, width * (size[1] + 1) / (size[0] + 1))));
  const context = freshContext(canvas, height);
  topView.fit(width, height);
  const track = (points, [ix, iz], colour, dash, lineWidth) => {
    const place = points.filter(p => p[ix] !== null).map(p => ({frame: p[0], x: topView.x(p[ix], p[iz]), y: topView.y(p[ix], p[iz])}));
    plotLine(context, place, colour, lineWidth, dash);
  };
  D.runs.forEach((run, index) => {
    for (const [name, points] of Object.entries(run.tracks)) {
      if (index === 0) track(points, SIDE.truth, styleOf("--truth"), [4, 3], 1);
      track(points, SIDE.estimate, D.runs.length > 1 ? styleOf(`--run-${index}`) : colourOf(name), [], name === body ? 2.2 : 1.2);
    }
  });
  drawScaleBar(context, topView);
  drawnPaths = document.createElement("canvas");
  Object.assign(drawnPaths, {width: canvas.width, height: canvas.height});
  drawnPaths.getContext("2d").drawImage(canvas, 0, 0);
}

function drawTop(canvas, frame) {
  if (canvas.hidden || !drawnPaths) return;
  const context = canvas.getContext("2d");
  context.save();
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.drawImage(drawnPaths, 0, 0);
  context.restore();
  D.runs.forEach((run, index) => {
    for (const name of Object.keys(run.tracks)) {
      const here = TRACK_AT[index][name].get(frame);
      if (!here) continue;
      const mark = ([ix, iz], colour, filled) => {
        if (here[ix] !== null) drawMark(context, topView.x(here[ix], here[iz]), topView.y(here[ix], here[iz]), colour, filled);
      };
      mark(SIDE.truth, styleOf("--truth"), false);
      mark(SIDE.estimate, D.runs.length > 1 ? styleOf(`--run-${index}`) : colourOf(name), true);
      const covariance = pairOf(index, frame, name)?.position;
      if (covariance && here[1] !== null) ellipse(context, topView.x(here[1], here[2]), topView.y(here[1], here[2]), covariance, topView.scale);
    }
  });
}

function ellipse(context, cx, cy, [xx, xz, zz], scale) {
  const mean = (xx + zz) / 2, spread = Math.hypot((xx - zz) / 2, xz);
  const angle = 0.5 * Math.atan2(2 * xz, xx - zz);
  context.beginPath();
  context.ellipse(cx, cy, Math.max(1, Math.sqrt(mean + spread) * ELLIPSE_SCALE * scale),
                  Math.max(1, Math.sqrt(Math.max(0, mean - spread)) * ELLIPSE_SCALE * scale), -angle, 0, 2 * Math.PI);
  context.strokeStyle = styleOf("--ink");
  context.lineWidth = 1;
  context.stroke();
}
