// The image with masks, points and flow of one pair.

const picture = {
  canvas: document.getElementById("picture"),
  zoom: 1, x: 0, y: 0,      // px of the image at the left upper corner
  last: null,               // frame of the image that is shown
  direction: 1,             // of travel: where to decode ahead
};

/// Residual 0 .. 2 px as colours that a colour-blind reader can order (cividis-like, light at the top).
const RESIDUAL_MAX = 2;
const RESIDUAL_COLOURS = ["#2b5ba8", "#4d7bb0", "#7a9bb0", "#a8b5a0", "#d4c878", "#f2d24b", "#f7b52b", "#f28f1d"];
const OUTLIER = "#ff3860";

function residualBin(px) {
  return Math.min(RESIDUAL_COLOURS.length - 1, Math.floor(px / RESIDUAL_MAX * RESIDUAL_COLOURS.length));
}

/// Screen pixels of one image pixel.
const pictureScale = () => picture.canvas.width / D.width * picture.zoom;
const screenX = u => (u + 0.5 - picture.x) * pictureScale();
const screenY = v => (v + 0.5 - picture.y) * pictureScale();

const IMAGES_AHEAD = 8;

function resizePicture() {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(1, Math.round(picture.canvas.clientWidth * ratio));
  const height = Math.round(width * D.height / D.width);
  if (picture.canvas.width !== width || picture.canvas.height !== height) {
    picture.canvas.width = width;
    picture.canvas.height = height;
  }
}

const HAS_PICTURE = D.width > 0;  // false for logs without a source

function drawPicture(state) {
  if (!HAS_PICTURE) return;
  resizePicture();
  const context = picture.canvas.getContext("2d");
  const imageFrame = state.layers.current ? state.frame : state.frame - 1;
  const entry = imageOf(imageFrame, frame => { if (frame === shownImage(state)) requestDraw(); });
  if (picture.last !== null && picture.last !== imageFrame) picture.direction = Math.sign(imageFrame - picture.last);
  for (let ahead = 1; ahead <= IMAGES_AHEAD; ++ahead) imageOf(imageFrame + picture.direction * ahead);
  context.clearRect(0, 0, picture.canvas.width, picture.canvas.height);
  if (entry?.ready) showImage(entry.image, imageFrame);
  if (!entry || entry.failed) {
    context.fillStyle = "#9a9a9a";
    context.font = `${Math.round(picture.canvas.width / 50)}px sans-serif`;
    context.fillText(entry ? "image not found beside this page: frames/" : "the source has no images", 20, 40);
  }
  if (state.layers.masks) drawOutlines(context, imageFrame);
  if (state.layers.boxes) drawBoxes(context, imageFrame);
  for (const body of bodies) drawBody(context, state, body);
  if (state.layers.axes) drawAxes(context, imageFrame);
  if (state.layers.labels) drawLabels(context, state, imageFrame);
}

/// Shows an image under the canvas, where it stays until the next one is ready.
function showImage(image, frame) {
  const box = document.getElementById("image");
  if (box.firstChild !== image) box.replaceChildren(image);
  const css = picture.canvas.clientWidth / D.width * picture.zoom;  // CSS pixels of one image pixel
  const transform = `translate(${-picture.x * css}px, ${-picture.y * css}px) scale(${picture.zoom})`;
  if (box.style.transform !== transform) box.style.transform = transform;
  box.style.imageRendering = pictureScale() < 3 ? "auto" : "pixelated";
  picture.last = frame;
}

const shownImage = state => state.layers.current ? state.frame : state.frame - 1;

function drawOutlines(context, imageFrame) {
  const lineWidth = Math.max(1.2, picture.canvas.width / 900);
  for (const [id, contours] of Object.entries(D.outlines[imageFrame] ?? {})) {
    const body = `object:${id}`;
    context.strokeStyle = bodies.includes(body) ? colourOf(body) : "#9a9a9a";
    context.lineWidth = lineWidth;
    context.beginPath();
    for (const contour of contours) {
      for (let i = 0; i < contour.length; i += 2)
        context[i === 0 ? "moveTo" : "lineTo"](screenX(contour[i]), screenY(contour[i + 1]));
      context.closePath();
    }
    context.stroke();
  }
}

/// Corners k and k ^ 1, k ^ 2, k ^ 4 of a box share an edge.
const BOX_EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap(k => [1, 2, 4].filter(bit => !(k & bit)).map(bit => [k, k | bit]));

function drawBoxes(context, imageFrame) {
  context.save();
  context.lineWidth = Math.max(1.2, picture.canvas.width / 1100);
  for (const [id, p] of Object.entries(D.boxes[imageFrame] ?? {})) {
    const body = `object:${id}`;
    context.strokeStyle = bodies.includes(body) ? colourOf(body) : "#9a9a9a";
    context.setLineDash([4, 3]);
    context.beginPath();
    if (p.length === 4) context.rect(screenX(p[0]), screenY(p[1]), (p[2] - p[0]) * pictureScale(), (p[3] - p[1]) * pictureScale());
    else for (const [a, b] of BOX_EDGES) {
      context.moveTo(screenX(p[2 * a]), screenY(p[2 * a + 1]));
      context.lineTo(screenX(p[2 * b]), screenY(p[2 * b + 1]));
    }
    context.stroke();
  }
  context.restore();
}

const AXIS_COLOURS = ["#ff4b4b", "#3ddc63", "#4b8dff"];  // x, y, z

/// Draws the axes of the estimated objects; those of the second run are dashed.
function drawAxes(context, imageFrame) {
  context.save();
  context.lineWidth = Math.max(2, picture.canvas.width / 500);
  D.runs.forEach((run, index) => {
    context.setLineDash(index === 0 ? [] : [5, 3]);
    for (const p of Object.values(run.axes[imageFrame] ?? {})) {
      AXIS_COLOURS.forEach((colour, axis) => {
        context.strokeStyle = colour;
        context.beginPath();
        context.moveTo(screenX(p[0]), screenY(p[1]));
        context.lineTo(screenX(p[2 * axis + 2]), screenY(p[2 * axis + 3]));
        context.stroke();
      });
    }
  });
  context.restore();
}

/// Draws the points of a body in one path per colour, which makes scrubbing fast.
function drawBody(context, state, body) {
  const points = pointsOf(state.pointsOf, state.frame, body);
  if (points.length === 0) return;
  const size = Math.max(1.4, picture.canvas.width / 800 * Math.min(2.2, Math.sqrt(picture.zoom)));
  const batches = RESIDUAL_COLOURS.map(() => []);
  const outliers = [], unestimated = [];
  for (let i = 0; i < points.length; i += FIELDS) {
    if (points[i + 4] === UNKNOWN) unestimated.push(i);
    else if (points[i + 8] === 0) outliers.push(i);
    else batches[residualBin(Math.hypot(points[i + 2] - points[i + 4], points[i + 3] - points[i + 5]) / FLOW_STEPS)].push(i);
  }
  const startX = i => points[i] / POSITION_STEPS, startY = i => points[i + 1] / POSITION_STEPS;
  const atX = i => screenX(startX(i) + (state.layers.current ? points[i + 2] / FLOW_STEPS : 0));
  const atY = i => screenY(startY(i) + (state.layers.current ? points[i + 3] / FLOW_STEPS : 0));
  const dots = (list, colour) => {
    context.fillStyle = colour;
    context.beginPath();
    for (const i of list) context.rect(atX(i) - size, atY(i) - size, 2 * size, 2 * size);
    context.fill();
  };
  const vectors = (list, colour, field) => {
    const sign = state.layers.current ? -1 : 1;
    context.strokeStyle = colour;
    context.lineWidth = Math.max(1, size * 0.55);
    context.beginPath();
    for (const i of list) {
      if (points[i + field] === UNKNOWN) continue;
      context.moveTo(atX(i), atY(i));
      context.lineTo(atX(i) + sign * state.flowLength * points[i + field] / FLOW_STEPS * pictureScale(),
                     atY(i) + sign * state.flowLength * points[i + field + 1] / FLOW_STEPS * pictureScale());
    }
    context.stroke();
  };
  const crosses = list => {
    context.strokeStyle = OUTLIER;
    context.lineWidth = Math.max(1, size * 0.6);
    context.beginPath();
    for (const i of list) {
      const x = atX(i), y = atY(i), s = size * 1.3;
      context.moveTo(x - s, y - s); context.lineTo(x + s, y + s);
      context.moveTo(x - s, y + s); context.lineTo(x + s, y - s);
    }
    context.stroke();
  };
  if (state.layers.flow) {
    batches.forEach((list, bin) => vectors(list, RESIDUAL_COLOURS[bin], 2));
    if (state.layers.outliers) vectors(outliers, OUTLIER, 2);
  }
  if (state.layers.refined) vectors(batches.flat(), "#ffffff", 6);
  if (state.layers.points) {
    batches.forEach((list, bin) => dots(list, RESIDUAL_COLOURS[bin]));
    dots(unestimated, "#9a9a9a");
  }
  if (state.layers.outliers) crosses(outliers);
}

function speedText(state, body) {
  const texts = [];
  D.runs.forEach((_, run) => {
    const values = recordOf(run, state.frame, body)?.values;
    if (values?.v_kmh !== undefined) texts.push(shown(values.v_kmh, 1));
  });
  if (texts.length === 0) return "";
  const truth = recordOf(0, state.frame, body)?.values?.v_gt_kmh;
  return `  ${texts.join(" | ")} km/h${truth === undefined ? "" : ` (true ${shown(truth, 1)})`}`;
}

function drawLabels(context, state, imageFrame) {
  const height = Math.max(11, Math.min(22, picture.canvas.width / 75));
  context.font = `${Math.round(height)}px system-ui, "DejaVu Sans", sans-serif`;
  context.textBaseline = "middle";
  const placed = [];
  const boxes = Object.entries(D.boxes[imageFrame] ?? {}).map(([id, corners]) => [id, [corners]]);
  for (const [id, contours] of Object.entries({...Object.fromEntries(boxes), ...D.outlines[imageFrame]})) {
    const body = `object:${id}`;
    const record = recordOf(0, state.frame, body);
    if (!record || record.status === "gated" && body !== state.body) continue;
    let x = Infinity, y = Infinity;
    for (const contour of contours)
      for (let i = 0; i < contour.length; i += 2) { x = Math.min(x, contour[i]); y = Math.min(y, contour[i + 1]); }
    if (!isFinite(x)) continue;
    const text = id + (record.status === "ok" || record.status === "no_truth" ? speedText(state, body) : ` ${record.status}`);
    const width = context.measureText(text).width + height * 0.8;
    const left = Math.max(0, Math.min(picture.canvas.width - width, screenX(x)));
    let top = Math.max(0, screenY(y) - height * 1.6);
    const isTaken = label => left < label.left + label.width && label.left < left + width && Math.abs(label.top - top) < height * 1.4;
    while (top >= height * 1.5 && placed.some(isTaken)) top -= height * 1.5;  // above the others
    placed.push({left, top, width});
    context.fillStyle = "rgba(20, 20, 20, .8)";
    context.fillRect(left, top, width, height * 1.4);
    context.strokeStyle = colourOf(body);
    context.lineWidth = body === state.body ? 3 : 1.5;
    context.strokeRect(left, top, width, height * 1.4);
    context.fillStyle = "#fff";
    context.fillText(text, left + height * 0.4, top + height * 0.72);
  }
}

function zoomPicture(factor, clientX, clientY) {
  const box = picture.canvas.getBoundingClientRect();
  const fx = (clientX - box.left) / box.width, fy = (clientY - box.top) / box.height;
  const zoom = Math.min(20, Math.max(1, picture.zoom * factor));
  const u = picture.x + fx * D.width / picture.zoom, v = picture.y + fy * D.height / picture.zoom;
  picture.zoom = zoom;
  movePicture(u - fx * D.width / zoom, v - fy * D.height / zoom);
}

function movePicture(x, y) {
  picture.x = Math.min(Math.max(0, x), D.width * (1 - 1 / picture.zoom));
  picture.y = Math.min(Math.max(0, y), D.height * (1 - 1 / picture.zoom));
}
