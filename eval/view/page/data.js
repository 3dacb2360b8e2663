// The data of the page, which page.h describes, and functions that look them up.

const D = JSON.parse(document.getElementById("data").textContent);
const FIRST = D.first + 1, LAST = D.last;  // current frames of pairs
const UNKNOWN = -32768, POSITION_STEPS = 8, FLOW_STEPS = 64, FIELDS = 9;
const PALETTE = ["#56b4e9", "#e69f00", "#f0e442", "#cc79a7", "#009e73", "#d55e00", "#0072b2", "#8c6d31", "#7d4a9e", "#c0143c"];
const STATUS_COLOURS = {
  ok: "#009e73", no_truth: "#56b4e9", gated: "#b9bdc4", lost: "#d55e00", not_detected: "#7d4a9e", diverged: "#c0143c",
  too_few_points: "#e69f00", collinear: "#cc79a7", at_infinity: "#cc79a7", no_parallax: "#cc79a7",
};

const bodies = (() => {
  const seen = new Set(["ego"]);
  for (const run of D.runs)
    for (const frame of Object.values(run.records)) for (const body of Object.keys(frame)) seen.add(body);
  const id = body => body === "ego" ? -1 : Number(body.slice(body.indexOf(":") + 1));
  return [...seen].sort((a, b) => id(a) - id(b));
})();

/// The body that is shown first: the camera, or the first object if no run has records of the camera.
const FIRST_BODY = bodies.find(body =>
  D.runs.some(run => Object.values(run.records).some(frame => frame[body] !== undefined))) ?? "ego";

const colourOf = body => body === "ego" ? PALETTE[0] : PALETTE[1 + (bodies.indexOf(body) - 1) % (PALETTE.length - 1)];
const nameOf = body => body === "ego" ? "camera" : body.replace(":", " ");
const instanceOf = body => body === "ego" ? "0" : body.slice(body.indexOf(":") + 1);
/// Name of a run: its estimator, or the last part of its folder if both runs are of one estimator.
const titleOf = run => D.runs.every(other => other === run || other.estimator !== run.estimator)
  ? run.estimator : run.name.split("/").filter(part => part !== "").pop() ?? run.name;
const recordOf = (run, frame, body) => D.runs[run]?.records[frame]?.[body];
const pairOf = (run, frame, body) => D.runs[run]?.pairs[frame]?.[body];
const metricOf = (map, key) => D.metrics.find(m => m.map === map && m.key === key);

/// Returns the first of the errors `keys` that all runs have; logs may have only motions in the body or world frame.
function commonError(keys) {
  const has = (run, key) => Object.values(run.records).some(frame => Object.values(frame).some(r => r.errors?.[key] !== undefined));
  return keys.find(key => D.runs.every(run => has(run, key))) ?? keys[0];
}
const ET_KEY = commonError(["Et_m", "Et_body_m", "Et_world_m"]), ER_KEY = commonError(["ER_deg", "ER_body_deg", "ER_world_deg"]);
const symbolOf = key => metricOf("errors", key)?.symbol ?? key;

/// Curves of the timelines: the value of a record, the key of its band, and the error of the truth itself (floor).
const CURVES = [
  {id: "Et_m", title: ET_KEY === "Et_m" ? "E_t" : symbolOf(ET_KEY), unit: "m", of: r => r.errors?.[ET_KEY], band: "Et_m", floor: r => r.values?.step_floor_m},
  {id: "ER_deg", title: ER_KEY === "ER_deg" ? "E_R" : symbolOf(ER_KEY), unit: "deg", of: r => r.errors?.[ER_KEY], band: "ER_deg",
   floor: r => r.values?.rotation_floor_deg},
  {id: "Ev_kmh", title: "E_v", unit: "km/h", of: r => r.errors?.Ev_kmh, band: "Ev_kmh"},
  {id: "epe_px", title: "EPE", unit: "px", of: r => r.errors?.epe_refined_px ?? r.errors?.epe_initial_px},
  {id: "inliers", title: "inlier share", unit: "", of: r => r.n_points > 0 ? r.n_inliers / r.n_points : undefined},
];

// What the runs hold: logs have neither points nor covariances.
const anyOf = (map, holds) => D.runs.some(run => Object.values(run[map]).some(frame => Object.values(frame).some(holds)));
const HAS_POINTS = anyOf("records", r => r.n_points > 0), HAS_BANDS = anyOf("pairs", p => Object.keys(p.band).length > 0);
const HAS_FLOORS = anyOf("records", r => CURVES.some(curve => curve.floor?.(r) !== undefined));
const HAS_POSITIONS = anyOf("pairs", p => p.position !== undefined);

function valueOf(curve, run, frame, body) {
  const record = recordOf(run, frame, body);
  return record === undefined ? undefined : curve.of(record);
}

/// Returns the value of run 1 minus that of run 0; undefined unless both have it.
function differenceOf(curve, frame, body) {
  const a = valueOf(curve, 0, frame, body), b = valueOf(curve, 1, frame, body);
  return a === undefined || b === undefined ? undefined : b - a;
}

/// Returns the frames with a value of the curve (of run 0, or the difference of the runs), worst first.
function worstFrames(curve, body, byDifference) {
  const rows = [];
  for (let frame = FIRST; frame <= LAST; ++frame) {
    const value = byDifference ? differenceOf(curve, frame, body) : valueOf(curve, 0, frame, body);
    if (value !== undefined) rows.push({frame, value});
  }
  const badness = row => byDifference ? Math.abs(row.value) : curve.id === "inliers" ? -row.value : row.value;
  return rows.sort((a, b) => badness(b) - badness(a) || a.frame - b.frame);
}

const decoded = new Map();  // points of pairs that were shown recently

/// Returns an Int16Array with FIELDS values for each point; empty if there are no points.
function pointsOf(run, frame, body) {
  const key = `${run} ${frame} ${body}`;
  if (decoded.has(key)) return decoded.get(key);
  const values = new Int16Array(bytesOf(pairOf(run, frame, body)?.points ?? "").buffer);
  if (decoded.size > 400) decoded.clear();
  decoded.set(key, values);
  return values;
}

/// Formats a number with this number of decimals; "" if it is not known.
function shown(value, digits) {
  return value === undefined || value === null ? "" : Number(value).toFixed(digits);
}

// ---- images

const images = new Map();  // frame -> {image, ready, failed}, the last used at the end
const IMAGES_KEPT = 48;

/// Returns the entry of a frame's image; null if the source has no image. `whenReady` is called once, after the first
/// request. The browser decodes in a thread of its own, and keeps the decoded image as long as the entry exists.
function imageOf(frame, whenReady = () => {}) {
  let entry = images.get(frame);
  if (entry) {
    images.delete(frame);
    images.set(frame, entry);
    return entry;
  }
  const source = D.images[frame];
  if (source === undefined) return null;
  entry = {image: new Image(), ready: false, failed: false};
  images.set(frame, entry);
  if (images.size > IMAGES_KEPT) images.delete(images.keys().next().value);
  Object.assign(entry.image, {alt: "", decoding: "sync", draggable: false, src: source});
  entry.image.decode().then(() => { entry.ready = true; }, () => { entry.failed = true; }).then(() => whenReady(frame));
  return entry;
}
