// Interactive paths and curves: one Walk for each .explorer of the page (document.h describes the data).

const LINE_COLOURS = {
  light: ["#8a8a8a", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b97f00", "#3f97c9", "#000000"],
  dark: ["#8f959c", "#4aa8e6", "#f08a4b", "#2fc79b", "#e09cc4", "#e9b13f", "#8fd0f5", "#ffffff"],
};
const ERROR_COLOURS = ["#4052c4", "#4675ed", "#39a2fc", "#1bcfd4", "#24eca6", "#61fc6c", "#a4fc3c", "#d1e834",
                       "#f3c63a", "#fe9b2d", "#f36315", "#d93806", "#b11901", "#7a0403"];
const isDark = () => matchMedia("(prefers-color-scheme: dark)").matches;
const lineColour = index => {
  const colours = LINE_COLOURS[isDark() ? "dark" : "light"];
  return colours[index === 0 ? 0 : 1 + (index - 1) % 7];
};
const DASHES = [[9, 3, 2, 3], [2, 3], [14, 3], [9, 3, 2, 3, 2, 3]];
const lineDash = ({colour, dash}) => dash > 0 ? DASHES[(dash - 1) % DASHES.length]
  : colour > 7 ? [[6, 3], [2, 2]][Math.floor((colour - 8) / 7) % 2] : [];
/// The background of a swatch, which repeats the pattern of the line.
const swatchStyle = path => {
  const colour = lineColour(path.colour), parts = lineDash(path);
  if (parts.length === 0) return colour;
  let at = 0;
  const stops = parts.map((length, i) => `${i % 2 ? "transparent" : colour} ${at}px ${at += length}px`);
  return `repeating-linear-gradient(90deg, ${stops.join(", ")})`;
};

function newElement(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties))
    key.startsWith("aria-") || key === "role" ? made.setAttribute(key, value) : made[key] = value;
  made.append(...children);
  return made;
}

const CURVE_HEIGHT = 104, LEFT = 56, RIGHT = 10;

class Walk {
  constructor(box, data) {
    this.box = box;
    this.data = data;
    const floats = text => new Float32Array(bytesOf(text).buffer);
    this.paths = data.paths.map(path => {
      const begins = new Uint8Array(path.n);
      for (const i of path.begins) begins[i] = 1;
      const position = path.position.map(floats), [first, ...others] = path.values.map(list => list === null ? null : floats(list));
      return {...path, begins, time: floats(path.time), position, values: [first, ...[0, 1, 2].map(axis => position[axis] ?? null), ...others],
              frame: path.frame === null ? null : new Int32Array(bytesOf(path.frame).buffer)};
    });
    data.curves.splice(1, 0, "x [m]", "y [m]", "z [m]");
    this.hidden = new Set();
    this.from = this.first = Math.min(...this.paths.map(p => p.time[0]));
    this.to = this.last = Math.max(...this.paths.map(p => p.time[p.n - 1]));
    if (!(this.to > this.from)) this.to = this.last = this.from + 1;
    this.cursor = this.from;
    this.byError = false;
    this.turning = false;
    this.errorEnd = this.endOfErrors();
    this.build();
    new ResizeObserver(() => this.ask(true)).observe(this.box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { styles.clear(); this.ask(true); });
    this.draw(true);
    box.dataset.firstDrawMs = performance.now().toFixed(0);
  }

  shown() { return this.paths.filter(path => !this.hidden.has(path.label)); }
  colour(path) { return lineColour(path.colour); }

  /// The 99 % quantile of the values by which the paths are coloured.
  endOfErrors() {
    const all = this.paths.flatMap(path => path.values[0] ? [...path.values[0]].filter(Number.isFinite) : []).sort((a, b) => a - b);
    return all[Math.floor(0.99 * (all.length - 1))] || 1;
  }

  /// A position as (right, ahead, height). The sign of the third axis is chosen so that the view is not mirrored.
  place(path, i) {
    const [right, up, out] = this.data.axes;
    const sign = (up - right + 3) % 3 === 1 ? 1 : -1;
    return [path.position[right][i], path.position[up][i], sign * path.position[out][i]];
  }

  build() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const path of this.paths) {
      path.place = [0, 1, 2].map(() => new Float32Array(path.position.length ? path.n : 0));
      for (let i = 0; i < path.place[0].length; ++i)
        this.place(path, i).forEach((v, k) => {
          path.place[k][i] = v;
          if (v < low[k]) low[k] = v;
          if (v > high[k]) high[k] = v;
        });
    }
    this.view = new MapView(low[0] <= high[0] ? low : [0, 0, 0], low[0] <= high[0] ? high : [0, 0, 0]);

    const button = (text, title, action, pressed) => {
      const made = newElement("button", {type: "button", title, textContent: text});
      if (pressed !== undefined) made.setAttribute("aria-pressed", String(pressed));
      made.addEventListener("click", () => action(made));
      return made;
    };
    const toggles = key => made => {
      this[key] = !this[key];
      made.setAttribute("aria-pressed", String(this[key]));
      this.ask(true);
    };
    const zoom = factor => () => { this.view.zoomAt(factor); this.ask(); };
    const tools = newElement("div", {className: "tools", role: "toolbar", "aria-label": "path"},
      button("+", "zoom in; or the wheel after a click on the path", zoom(1.5)),
      button("−", "zoom out", zoom(1 / 1.5)),
      button("Whole", "the whole path from above; or a double click", () => { this.view.reset(); this.setTurning(false); this.ask(); }),
      this.turnButton = button("3-D", "dragging turns the path instead of moving it; or drag with Shift", () => this.setTurning(!this.turning), false));
    if (this.paths.some(path => path.values[0] && path.place[0].length))
      tools.append(button("Colour by error", `${this.data.curves[0]}: colours of the paths`, toggles("byError"), false));

    this.mapCanvas = newElement("canvas", {tabIndex: 0, className: "map"});
    this.mapCanvas.setAttribute("aria-label", "paths from above; arrow keys move the cursor");
    this.marks = newElement("canvas", {className: "marks"});
    this.tip = newElement("div", {className: "tip", hidden: true});
    this.series = newElement("div", {className: "series", role: "group", "aria-label": "series"});
    for (const label of new Set(this.paths.map(path => path.label))) {
      const path = this.paths.find(p => p.label === label);
      const swatch = newElement("i");
      const made = newElement("button", {type: "button", title: "switch on and off"}, swatch, label);
      made.setAttribute("aria-pressed", "true");
      made.path = path;
      swatch.classList.toggle("dashed", path.dash > 0);
      made.addEventListener("click", () => {
        this.hidden.has(label) ? this.hidden.delete(label) : this.hidden.add(label);
        made.setAttribute("aria-pressed", String(!this.hidden.has(label)));
        this.ask(true);
      });
      this.series.append(made);
    }
    this.scale = newElement("p", {className: "colours", hidden: true});
    this.readout = newElement("div", {className: "scroll", tabIndex: 0});
    this.table = newElement("table", {});
    this.readout.append(this.table);
    const map = newElement("div", {className: "map-box"}, this.mapCanvas, this.marks, this.tip);
    const curves = newElement("div", {className: "curves"});
    this.curves = this.data.curves.map((title, index) => {
      const canvas = newElement("canvas", {tabIndex: 0}), line = newElement("i", {className: "cursor"});
      canvas.setAttribute("aria-label", `${title} over ${this.data.time_title}`);
      canvas.dataset.curve = index;
      curves.append(newElement("div", {className: "curve"}, canvas, line));
      this.curveEvents(canvas);
      return {title, index, canvas, line, drawn: []};
    });
    const left = newElement("div", {className: "left"}, tools, map, this.scale);
    this.box.append(this.series, newElement("div", {className: "panes"}, left, curves), this.readout);
    if (this.data.note) this.box.append(newElement("p", {className: "note", textContent: this.data.note}));
    this.box.hidden = false;
    if (low[0] > high[0]) map.hidden = tools.hidden = true;
    navigates(this.mapCanvas, this.view, () => this.ask(), () => this.turning);
    this.mapEvents();
  }

  setTurning(on) {
    this.turning = on;
    this.turnButton.setAttribute("aria-pressed", String(on));
    if (on && this.view.rise === 0) this.view.turn(40, 50);
    this.ask();
  }

  mapEvents() {
    this.mapCanvas.addEventListener("pointermove", event => {
      if (event.buttons & 1) { this.tip.hidden = true; return; }
      const box = this.mapCanvas.getBoundingClientRect();
      this.point(event.clientX - box.left, event.clientY - box.top);
    });
    this.mapCanvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    this.box.addEventListener("keydown", event => {
      if (!event.target.matches("canvas")) return;
      const by = {ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity}[event.key];
      if (by === undefined) return;
      event.preventDefault();
      this.step(by * (event.shiftKey ? 10 : 1));
    });
  }

  /// Moves the cursor by a number of poses of the longest path that is shown.
  step(by) {
    const path = this.shown().reduce((a, b) => !a || b.n > a.n ? b : a, null);
    if (!path) return;
    const i = Math.min(path.n - 1, Math.max(0, this.nearestInTime(path, this.cursor) + by));
    this.setCursor(path.time[i]);
  }

  /// The shown pose nearest to a point of the map, within 20 px.
  point(px, py) {
    let best = 400, hit = null;
    for (const path of this.shown()) {
      const [right, ahead, height] = path.place;
      for (let i = 0; i < right.length; ++i) {
        const dx = this.view.x(right[i], ahead[i]) - px, dy = this.view.y(right[i], ahead[i], height[i]) - py;
        const d = dx * dx + dy * dy;
        if (d < best) { best = d; hit = [path, i]; }
      }
    }
    this.tip.hidden = hit === null;
    if (hit === null) return;
    const [path, i] = hit;
    this.setCursor(path.time[i]);
    const error = path.values[0] ? `, ${this.data.curves[0]} ${tickText(path.values[0][i])}` : "";
    this.tip.textContent = `${path.label}: ${this.whenText(path, i)}${error}`;
    const room = this.mapCanvas.clientWidth - this.tip.offsetWidth - 4;
    this.tip.style.transform = `translate(${Math.max(0, Math.min(px + 12, room))}px, ${Math.max(0, py - 30)}px)`;
  }

  whenText(path, i) {
    const frame = path.frame ? path.frame[i] : null;
    return this.data.time_title === "frame" ? `frame ${path.time[i]}`
      : `${path.time[i].toFixed(2)} s${frame === null ? "" : `, frame ${frame}`}`;
  }

  /// Index of the pose nearest in time.
  nearestInTime(path, time) {
    let low = 0, high = path.n - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      path.time[middle] < time ? low = middle + 1 : high = middle;
    }
    return low > 0 && time - path.time[low - 1] < path.time[low] - time ? low - 1 : low;
  }
  /// Index of the pose at a time; -1 if the nearest pose is too far away, as in a gap or outside of the path.
  at(path, time) {
    const i = this.nearestInTime(path, time), step = (this.last - this.first) / 200;
    return Math.abs(path.time[i] - time) <= Math.max(1, step) ? i : -1;
  }

  setCursor(time) {
    if (!Number.isFinite(time)) return;
    this.cursor = Math.min(this.last, Math.max(this.first, time));
    this.ask();
  }

  curveEvents(canvas) {
    const timeAt = clientX => {
      const box = canvas.getBoundingClientRect();
      return this.from + (clientX - box.left - LEFT) / Math.max(1, box.width - LEFT - RIGHT) * (this.to - this.from);
    };
    let from = null;
    canvas.addEventListener("pointerdown", event => {
      from = event.clientX;
      canvas.setPointerCapture(event.pointerId);
      this.setCursor(timeAt(event.clientX));
    });
    canvas.addEventListener("pointermove", event => {
      if (event.buttons & 1 && from !== null && (this.from > this.first || this.to < this.last)) {
        const by = timeAt(from) - timeAt(event.clientX);
        from = event.clientX;
        this.setRange(this.from + by, this.to + by);
      } else {
        this.setCursor(Math.min(this.to, Math.max(this.from, timeAt(event.clientX))));
      }
    });
    canvas.addEventListener("wheel", event => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      const at = timeAt(event.clientX), factor = Math.exp(event.deltaY / 400);
      this.setRange(at + (this.from - at) * factor, at + (this.to - at) * factor);
    }, {passive: false});
    canvas.addEventListener("dblclick", () => this.setRange(this.first, this.last));
  }

  /// The range of time that the curves show.
  setRange(from, to) {
    const length = Math.min(this.last - this.first, Math.max((this.last - this.first) / 1e4, to - from));
    this.from = Math.min(this.last - length, Math.max(this.first, from));
    this.to = this.from + length;
    this.ask(true);
  }

  /// Draws with the next frame of the screen; `still`: the curves too.
  ask(still = false) {
    this.still ||= still;
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      const all = this.still;
      this.still = false;
      this.draw(all);
    });
  }

  draw(still) {
    this.drawMap();
    if (still) {
      for (const curve of this.curves) this.drawCurve(curve);
      for (const button of this.series.children) button.firstChild.style.background = swatchStyle(button.path);
      this.drawScale();
    }
    this.drawCursor();
  }

  mapHeight() {
    const width = this.mapCanvas.clientWidth, [right, ahead] = this.view.size;
    return Math.round(Math.min(640, Math.max(240, width * 1.2), Math.max(240, width * (ahead + 0.1 * right) / (right || 1) + 30)));
  }

  drawMap() {
    if (this.mapCanvas.parentNode.hidden) return;
    const height = this.mapHeight(), context = freshContext(this.mapCanvas, height), view = this.view;
    view.fit(this.mapCanvas.clientWidth, height);
    this.box.dataset.points = 0;
    for (const path of this.shown()) {
      const [right, ahead, up] = path.place;
      const x = i => view.x(right[i], ahead[i]), y = i => view.y(right[i], ahead[i], up[i]);
      const errors = path.values[0];
      if (this.byError && errors) {
        this.strokeByError(context, path, x, y, errors);
        continue;
      }
      const drawn = strokeCurve(context, right.length, x, y, i => path.begins[i] === 1, {
        colour: this.colour(path), width: path.is_reference && path.colour === 0 ? 3 : 1.5,
        dash: path.is_reference && path.colour !== 0 ? [4, 3] : lineDash(path)});
      this.box.dataset.points = Number(this.box.dataset.points) + drawn;
    }
    const reference = this.shown().find(path => path.place[0].length);
    if (reference) {
      const [right, ahead, up] = reference.place, end = right.length - 1;
      context.fillStyle = styleOf("--ink");
      context.textAlign = "left";
      context.textBaseline = "middle";
      for (const [i, text] of [[0, "start"], [end, "end"]]) {
        const x = view.x(right[i], ahead[i]), y = view.y(right[i], ahead[i], up[i]);
        context.fillRect(x - 3, y - 3, 6, 6);
        context.fillText(text, x + 7, y - 7);
      }
    }
    drawScaleBar(context, view);
  }

  /// The segments of one colour in one go.
  strokeByError(context, path, x, y, errors) {
    const groups = ERROR_COLOURS.map(() => []);
    let last = 0;
    for (let i = 1; i < path.n; ++i) {
      if (path.begins[i]) { last = i; continue; }
      if (!Number.isFinite(errors[i])) continue;
      const near = Math.abs(x(i) - x(last)) + Math.abs(y(i) - y(last)) < 1.5 && i + 1 < path.n && !path.begins[i + 1];
      if (near) continue;
      groups[Math.min(ERROR_COLOURS.length - 1, Math.floor(errors[i] / this.errorEnd * ERROR_COLOURS.length))].push(last, i);
      last = i;
    }
    context.lineWidth = 3;
    context.lineCap = "round";
    groups.forEach((segments, k) => {
      context.strokeStyle = ERROR_COLOURS[k];
      context.beginPath();
      for (let s = 0; s < segments.length; s += 2) {
        context.moveTo(x(segments[s]), y(segments[s]));
        context.lineTo(x(segments[s + 1]), y(segments[s + 1]));
      }
      context.stroke();
    });
  }

  drawScale() {
    this.scale.hidden = !this.byError;
    if (!this.byError) return;
    const gradient = newElement("i");
    gradient.style.background = `linear-gradient(90deg, ${ERROR_COLOURS.join(",")})`;
    this.scale.replaceChildren(`${this.data.curves[0]}: 0`, gradient, `${Number(this.errorEnd.toPrecision(3))} and more`);
  }

  x(time, width) { return LEFT + (time - this.from) / (this.to - this.from) * (width - LEFT - RIGHT); }

  drawCurve(curve) {
    const {canvas, index, title} = curve;
    const paths = this.shown().filter(path => path.values[index]);
    canvas.parentNode.hidden = !this.paths.some(path => path.values[index]);
    if (canvas.parentNode.hidden) return;
    const context = freshContext(canvas, CURVE_HEIGHT), width = canvas.clientWidth;
    let least = Infinity, most = -Infinity;
    for (const path of paths)
      for (let i = 0; i < path.n; ++i) {
        const value = path.values[index][i];
        if (path.time[i] < this.from || path.time[i] > this.to || Number.isNaN(value)) continue;
        if (value < least) least = value;
        if (value > most) most = value;
      }
    if (least > 0 && least < most / 2) least = 0;
    if (!(most >= least)) [least, most] = [0, 1];
    const span = most - least || Math.abs(most) * 0.1 || 1;
    if (most === least) least -= span / 2;
    const top = 20, bottom = CURVE_HEIGHT - 17;
    const y = value => bottom - (value - least) / span * (bottom - top), x = time => this.x(time, width);
    drawValueAxis(context, {least, span, y, left: LEFT, right: width - RIGHT});
    drawTimeAxis(context, {from: this.from, to: this.to, x, y: CURVE_HEIGHT - 7, width});
    context.save();
    context.beginPath();
    context.rect(LEFT, 0, width - LEFT - RIGHT, CURVE_HEIGHT);
    context.clip();
    curve.drawn = paths.map(path => ({label: path.label, points: strokeCurve(
      context, path.n, i => x(path.time[i]), i => y(path.values[index][i]), i => path.begins[i] === 1,
      {colour: this.colour(path), width: path.is_reference && path.colour === 0 ? 2.5 : 1.3,
       dash: path.is_reference && path.colour !== 0 ? [4, 3] : lineDash(path)})}));
    context.restore();
    context.fillStyle = styleOf("--ink");
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText(title, LEFT + 4, 8);
    if (index === this.data.curves.length - 1 || this.curves.slice(index + 1).every(c => c.canvas.parentNode.hidden)) {
      context.textAlign = "right";
      context.fillStyle = styleOf("--quiet");
      context.fillText(this.data.time_title, width - RIGHT, 8);
    }
  }

  drawCursor() {
    for (const {canvas, line} of this.curves) {
      line.hidden = this.cursor < this.from || this.cursor > this.to;
      line.style.transform = `translateX(${this.x(this.cursor, canvas.clientWidth) - 0.5}px)`;
    }
    const rows = [];
    const context = this.mapCanvas.parentNode.hidden ? null : freshContext(this.marks, this.mapHeight());
    for (const path of this.shown()) {
      const i = this.at(path, this.cursor);
      if (i < 0) continue;
      const [right, ahead, up] = path.place;
      if (context && right.length)
        drawMark(context, this.view.x(right[i], ahead[i]), this.view.y(right[i], ahead[i], up[i]), this.colour(path), !path.is_reference);
      rows.push([path, i]);
    }
    const shown = value => value === undefined || Number.isNaN(value) ? "" : Math.abs(value) >= 1e5 ? value.toPrecision(6) : value.toFixed(3);
    const cells = [["", this.data.time_title === "frame" ? "frame" : "t [s]", ...(this.data.time_title === "frame" ? [] : ["frame"]),
                    ...this.data.curves], ...rows.map(([path, i]) => [
      path.is_reference && path.colour !== 0 ? `${path.label}, true` : path.label, tickText(path.time[i]),
      ...(this.data.time_title === "frame" ? [] : [path.frame ? String(path.frame[i]) : ""]),
      ...this.data.curves.map((_, k) => shown(path.values[k]?.[i]))])];
    const table = this.table;
    while (table.rows.length > cells.length) table.deleteRow(-1);
    cells.forEach((texts, r) => {
      const row = table.rows[r] ?? table.insertRow();
      texts.forEach((text, c) => {
        const cell = row.cells[c] ?? row.appendChild(document.createElement(r === 0 ? "th" : "td"));
        if (cell.textContent !== text) cell.textContent = text;
        if (c > 0) cell.className = "number";
      });
    });
  }

  /// Moves the path n times, once for each frame of the screen; resolves to the frames a second.
  async measurePanning(n) {
    const frame = () => new Promise(resolve => requestAnimationFrame(resolve));
    await frame();
    const begin = performance.now();
    for (let k = 0; k < n; ++k) {
      this.view.move(k % 2 ? -3 : 3, k % 2 ? 2 : -2);
      this.ask();
      await frame();
    }
    return n / (performance.now() - begin) * 1000;
  }
}

const walks = [...document.querySelectorAll(".explorer")].map(
  box => new Walk(box, JSON.parse(box.querySelector("script").textContent)));
