"use strict";
// Drawing on canvases: what the pages of `sextant view` and of reports have in common.

/// Colours of the style sheet; looked up again when the scheme changes.
const styles = new Map();
function styleOf(name) {
  if (!styles.has(name)) styles.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return styles.get(name);
}

const CANVAS_FONT = "11px system-ui, \"DejaVu Sans\", sans-serif";

/// Sizes a canvas to its place on the page; returns its context, in CSS pixels, cleared.
function freshContext(canvas, height) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
  canvas.style.height = `${height}px`;
  canvas.width = Math.max(1, Math.round(width * ratio));
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = CANVAS_FONT;
  return context;
}

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);  // Uint8Array.from takes ten times as long
  return bytes;
}

/// Round steps for an axis of about n steps up to `most`.
function axisStep(most, n) {
  const rough = most / n, decade = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map(d => d * decade).find(step => step >= rough) ?? decade * 10;
}

const tickText = value => String(Number(value.toPrecision(6)));

/// Lines and numbers of a vertical axis from `least` over `span`, between the margins.
function drawValueAxis(context, {least, span, y, left, right}) {
  context.textBaseline = "middle";
  context.textAlign = "right";
  const step = axisStep(span, 3);
  for (let k = Math.ceil(least / step - 1e-9); k * step <= least + span * 1.001; ++k) {
    context.fillStyle = styleOf("--line");
    context.fillRect(left, y(k * step), right - left, 1);
    context.fillStyle = styleOf("--quiet");
    context.fillText(tickText(k * step), left - 5, y(k * step));
  }
}

/// Numbers of a horizontal axis from `from` to `to`, at the height y. `least`: the smallest step.
function drawTimeAxis(context, {from, to, x, y, width, least = 0}) {
  context.textBaseline = "middle";
  context.textAlign = "center";
  context.fillStyle = styleOf("--quiet");
  const step = Math.max(least, axisStep(to - from || 1, Math.max(2, width / 90)));
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + step * 1e-9; ++k)
    context.fillText(tickText(k * step), x(k * step), y);
}

/// A line through n points, interrupted before those where begins(i) is true and where x or y is NaN. Points less than
/// half a pixel from the last one drawn are passed over. A point between two interruptions is drawn as a dot. Returns
/// how many points the line stands for.
function strokeCurve(context, n, x, y, begins, {colour, width, dash = []}) {
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = width;
  context.lineJoin = "round";
  context.setLineDash(dash);
  context.beginPath();
  let lastX = NaN, lastY = NaN, length = 0, count = 0;
  const dots = [];
  const end = () => {
    if (length === 1) dots.push([lastX, lastY]);
    length = 0;
  };
  for (let i = 0; i < n; ++i) {
    const px = x(i), py = y(i);
    if (Number.isNaN(px) || Number.isNaN(py)) { end(); continue; }
    ++count;
    if (length === 0 || begins(i)) {
      end();
      context.moveTo(px, py);
    } else if (Math.abs(px - lastX) + Math.abs(py - lastY) < 0.5 && i + 1 < n && !begins(i + 1)) {
      continue;
    } else {
      context.lineTo(px, py);
    }
    lastX = px;
    lastY = py;
    ++length;
  }
  end();
  context.stroke();
  context.setLineDash([]);
  for (const [px, py] of dots) context.fillRect(px - 1.5, py - 1.5, 3, 3);
  return count;
}

function drawMark(context, x, y, colour, filled = true) {
  context.beginPath();
  context.arc(x, y, 4, 0, 2 * Math.PI);
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 1.5;
  filled ? context.fill() : context.stroke();
}

/// Projection of points of the world (right, ahead, height; m) to a canvas. It begins as the view from above that shows
/// the whole of a box of the world, and can be moved, zoomed and turned.
class MapView {
  constructor(low, high) {
    this.centre = [0, 1, 2].map(k => (low[k] + high[k]) / 2);
    this.size = [0, 1, 2].map(k => high[k] - low[k]);
    this.reset();
  }
  reset() { Object.assign(this, {zoom: 1, dx: 0, dy: 0, azimuth: 0, elevation: Math.PI / 2}); this.turned(); }
  turned() {
    this.cos = Math.cos(this.azimuth); this.sin = Math.sin(this.azimuth);
    this.tilt = Math.sin(this.elevation); this.rise = Math.cos(this.elevation);
    if (this.elevation === Math.PI / 2) this.rise = 0;
  }
  /// Sets the scale for a canvas of this size.
  fit(width, height, margin = 15) {
    this.width = width;
    this.height = height;
    const least = 1e-6 + 0.02 * Math.max(this.size[0], this.size[1]);
    this.whole = Math.min((width - 2 * margin) / Math.max(this.size[0], least), (height - 2 * margin) / Math.max(this.size[1], least));
  }
  get scale() { return this.whole * this.zoom; }
  x(right, ahead) {
    return this.width / 2 + this.dx + ((right - this.centre[0]) * this.cos - (ahead - this.centre[1]) * this.sin) * this.scale;
  }
  y(right, ahead, height = this.centre[2]) {
    const along = (right - this.centre[0]) * this.sin + (ahead - this.centre[1]) * this.cos;
    return this.height / 2 + this.dy - (along * this.tilt + (height - this.centre[2]) * this.rise) * this.scale;
  }
  move(dx, dy) { this.dx += dx; this.dy += dy; }
  turn(dx, dy) {
    this.azimuth += dx * 0.01;
    this.elevation = Math.min(Math.PI / 2, Math.max(0, this.elevation - dy * 0.01));
    this.turned();
  }
  /// Zooms so that the point of the world below (px, py) stays there.
  zoomAt(factor, px = this.width / 2, py = this.height / 2) {
    const zoom = Math.min(1e5, Math.max(0.2, this.zoom * factor)), k = zoom / this.zoom;
    this.dx = (px - this.width / 2) * (1 - k) + this.dx * k;
    this.dy = (py - this.height / 2) * (1 - k) + this.dy * k;
    this.zoom = zoom;
  }
}

/// A bar of a round length in the lower left corner.
function drawScaleBar(context, view) {
  const metres = axisStep(view.width / view.scale, 4), length = metres * view.scale;
  context.fillStyle = styleOf("--ink");
  context.textAlign = "left";
  context.textBaseline = "alphabetic";
  context.fillRect(10, view.height - 12, length, 2);
  context.fillText(metres < 1000 ? `${Number(metres.toPrecision(3))} m` : `${Number((metres / 1000).toPrecision(3))} km`,
                   12, view.height - 18);
}

/// Lets the mouse change a view. Dragging moves it or, if turns() is true or with the shift key, turns it (never if `turns`
/// is null). A double click shows the whole again. The wheel zooms if the canvas has the focus, or with Ctrl; otherwise the
/// page scrolls.
function navigates(canvas, view, changed, turns = null) {
  let from = null;
  canvas.addEventListener("wheel", event => {
    if (!event.ctrlKey && document.activeElement !== canvas) return;
    event.preventDefault();
    const box = canvas.getBoundingClientRect();
    view.zoomAt(Math.exp(-event.deltaY / 400), event.clientX - box.left, event.clientY - box.top);
    changed();
  }, {passive: false});
  canvas.addEventListener("pointerdown", event => {
    from = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", event => {
    if (!(event.buttons & 1) || from === null) return;
    const dx = event.clientX - from[0], dy = event.clientY - from[1];
    from = [event.clientX, event.clientY];
    turns && (event.shiftKey || turns()) ? view.turn(dx, dy) : view.move(dx, dy);
    changed();
  });
  canvas.addEventListener("dblclick", () => { view.reset(); changed(); });
}
