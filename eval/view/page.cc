#include "sextant/eval/view/page.h"

#include <bit>
#include <cmath>
#include <cstring>

#include <opencv2/core/mat.hpp>
#include <opencv2/imgproc.hpp>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/machine.h"
#include "sextant/base/names.h"
#include "sextant/base/progress.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/eval/report/html/html.h"
#include "sextant/metrics/definitions.h"

namespace sextant {

std::span<const EmbeddedFile> view_page_files();

namespace {

static_assert(std::endian::native == std::endian::little, "points are written as they lie in memory");

constexpr double position_steps_per_px = 8;
constexpr double flow_steps_per_px = 64;
constexpr int16_t not_known = -32768;

int16_t quantised(double value, double steps) {
  const double q = std::round(value * steps);
  return std::isfinite(q) && std::abs(q) < 32767 ? static_cast<int16_t>(q) : not_known;
}

std::string packed(const DrawnPoints& drawn) {
  std::vector<int16_t> values;
  values.reserve(drawn.points.size() * 9);
  for (const DrawnPoints::Point& p : drawn.points) {
    values.push_back(quantised(p.u, position_steps_per_px));
    values.push_back(quantised(p.v, position_steps_per_px));
    for (const double flow : {p.flow_u, p.flow_v, p.predicted_u, p.predicted_v, p.refined_u, p.refined_v})
      values.push_back(quantised(flow, flow_steps_per_px));
    values.push_back(p.inlier ? 1 : 0);
  }
  if (values.empty()) return "";
  std::string bytes(values.size() * sizeof(int16_t), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return base64(bytes);
}

/// Outlines of every instance in a mask, simplified to about one pixel.
Json outlines(const Image<uint16_t>& mask) {
  std::map<int, cv::Rect> boxes;
  for (const auto [x, y] : pixels(mask)) {
    const int id = mask(x, y);
    if (id == 0) continue;
    const auto [box, is_new] = boxes.try_emplace(id, x, y, 1, 1);
    if (!is_new) box->second |= cv::Rect(x, y, 1, 1);
  }
  Json json = Json::object();
  for (const auto& [id, box] : boxes) {
    cv::Mat region(box.size(), CV_8UC1);
    for (const auto [x, y] : PixelRange(box.width, box.height))
      region.at<uint8_t>(y, x) = mask(box.x + x, box.y + y) == id ? 255 : 0;
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(region, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_TC89_L1, box.tl());
    Json& of_instance = *append_member(json, std::to_string(id), Json::array());
    for (const std::vector<cv::Point>& contour : contours) {
      if (contour.size() < 3) continue;
      Json line = Json::array();
      for (const cv::Point& p : contour) {
        line.push_back(p.x);
        line.push_back(p.y);
      }
      of_instance.push_back(std::move(line));
    }
  }
  return json;
}

/// Rounds to visible differences, to keep the page small.
Json rounded(double value, double steps) {
  return std::isfinite(value) ? Json(std::round(value * steps) / steps) : Json();
}

Json tracks_json(const std::vector<BodyTrack>& tracks) {
  constexpr double steps_per_m = 1e4;
  Json json = Json::object();
  for (const BodyTrack& track : tracks) {
    Json points = Json::array();
    for (const TrackPoint& point : track.points) {
      Json entry = {point.frame};
      for (const auto* p : {&point.estimate_m, &point.truth_m}) {
        entry.push_back(*p ? rounded((*p)->x(), steps_per_m) : Json());
        entry.push_back(*p ? rounded((*p)->z(), steps_per_m) : Json());
      }
      points.push_back(std::move(entry));
    }
    append_member(json, track.body, std::move(points));
  }
  return json;
}

Json pairs_json(const ViewedRun& run) {
  Json json = Json::object();
  for (const auto& [frame, bodies] : run.pairs) {
    Json& of_frame = *append_member(json, std::to_string(frame), Json::object());
    for (const auto& [name, body] : bodies) {
      Json entry = {{"n", body.drawn.n_all}, {"points", packed(body.drawn)}, {"band", Json::object()}};
      const auto set = [&](const char* key, double value) {
        if (std::isfinite(value)) entry["band"][key] = value;
      };
      set("Et_m", body.band.Et_m);
      set("ER_deg", body.band.ER_deg);
      set("Ev_kmh", body.band.Ev_kmh);
      if (body.position) entry["position"] = {body.position->xx, body.position->xz, body.position->zz};
      append_member(of_frame, name, std::move(entry));
    }
  }
  return json;
}

/// Records as in records.jsonl, without the fields that all records of the run share.
Json records_json(const ViewedRun& run) {
  std::map<int, std::map<std::string, Json>> by_frame;
  for (const Record& record : run.records) {
    Json entry = to_json(record);
    for (const char* key :
         {"schema", "dataset", "sequence", "estimator", "noise", "level", "seed", "frame", "body"})
      entry.erase(key);
    by_frame[record.frame][record.body.str()] = std::move(entry);
  }
  Json json = Json::object();
  for (auto& [frame, bodies] : by_frame) {
    Json& of_frame = *append_member(json, std::to_string(frame), Json::object());
    for (auto& [body, entry] : bodies) append_member(of_frame, body, std::move(entry));
  }
  return json;
}

/// Projects the corners of the true boxes, (+-w/2, 0 or -h, +-l/2), x fastest. An object of unknown size or
/// with a corner behind the camera has its 2-D box.
Json boxes_json(const Sequence& sequence) {
  constexpr double least_depth_m = 0.1, steps_per_px = 10;
  const auto& camera = sequence.info().camera.left;
  Json json = Json::object();
  if (sequence.info().width == 0) return json;
  for (const auto& [frame, objects] : sequence.truth().objects) {
    if (frame < sequence.info().first_frame || frame > sequence.info().last_frame) continue;
    Json& of_frame = *append_member(json, std::to_string(frame), Json::object());
    for (const ObjectTruth& object : objects) {
      Json corners = Json::array();
      for (int k = 0; object.size_m && k < 8; ++k) {
        const Eigen::Vector3d& size = *object.size_m;
        const Eigen::Vector3d p =
            object.T_camera_object * Eigen::Vector3d((k & 1 ? 0.5 : -0.5) * size.x(), k & 2 ? -size.y() : 0,
                                                     (k & 4 ? 0.5 : -0.5) * size.z());
        if (p.z() < least_depth_m) break;
        const Eigen::Vector2d u = camera.project(p);
        corners.push_back(rounded(u.x(), steps_per_px));
        corners.push_back(rounded(u.y(), steps_per_px));
      }
      if (corners.size() < 16) {
        if (!object.box) continue;
        corners = {object.box->left, object.box->top, object.box->right, object.box->bottom};
      }
      append_member(of_frame, std::to_string(object.id), std::move(corners));
    }
  }
  return json;
}

/// Projects the origins of estimated objects and the ends of their axes, which are axis_length_m long.
Json axes_json(const ViewedRun& run) {
  constexpr double least_depth_m = 0.5, axis_length_m = 1.5, steps_per_px = 10;
  const SequenceInfo& info = run.sequence->info();
  Json json = Json::object();
  for (int frame = info.first_frame; info.width > 0 && frame <= info.last_frame; ++frame) {
    Json of_frame = Json::object();
    for (const auto& [body, T_camera_object] : estimated_poses(run.tracks, frame)) {
      Json points = Json::array();
      for (const Eigen::Vector3d& p :
           {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(axis_length_m, 0, 0),
            Eigen::Vector3d(0, axis_length_m, 0), Eigen::Vector3d(0, 0, axis_length_m)}) {
        const Eigen::Vector3d in_camera = T_camera_object * p;
        if (in_camera.z() < least_depth_m) break;
        const Eigen::Vector2d u = info.camera.left.project(in_camera);
        points.push_back(rounded(u.x(), steps_per_px));
        points.push_back(rounded(u.y(), steps_per_px));
      }
      if (points.size() == 8) append_member(of_frame, body, std::move(points));
    }
    if (!of_frame.empty()) append_member(json, std::to_string(frame), std::move(of_frame));
  }
  return json;
}

Json run_json(const ViewedRun& run) {
  return {{"name", run.folder},       {"estimator", run.estimator},
          {"noise", run.noise},       {"level", run.level},
          {"seed", run.seed},         {"version", run.version},
          {"notes", run.notes},       {"records", records_json(run)},
          {"pairs", pairs_json(run)}, {"tracks", tracks_json(run.tracks)},
          {"axes", axes_json(run)}};
}

Json metrics_json() {
  Json json = Json::array();
  for (const MetricDefinition& m : metric_definitions()) {
    json.push_back({{"map", to_string(m.map)},
                    {"key", m.name},
                    {"symbol", m.symbol},
                    {"unit", m.unit},
                    {"digits", m.digits},
                    {"definition", m.definition}});
  }
  return json;
}

struct FramePicture {
  std::string jpeg;  ///< empty if the source has no image
  Json outlines = Json::object();
};

std::vector<FramePicture> pictures(const Sequence& sequence, const PageOptions& options) {
  const SequenceInfo& info = sequence.info();
  Channels channels;
  channels.rgb = info.channels.rgb;
  channels.mask = info.channels.mask;
  std::vector<FramePicture> made(static_cast<size_t>(info.last_frame - info.first_frame + 1));
  if (!channels.rgb && !channels.mask) return made;
  Progress progress(info.sequence + " images", static_cast<int>(made.size()), options.quiet);
  parallel_for(static_cast<int>(made.size()), options.jobs, [&](int i) {
    const Frame frame = sequence.read(info.first_frame + i, channels);
    FramePicture& picture = made[static_cast<size_t>(i)];
    if (!frame.rgb.empty()) picture.jpeg = encode_jpeg(frame.rgb, options.jpeg_quality);
    if (!frame.mask.empty()) picture.outlines = outlines(frame.mask);
    progress.advance();
  });
  return made;
}

std::string_view part(std::string_view name) { return find_entry(view_page_files(), name, "file").text; }

/// Inserts `data` into the page. The marks are searched in the page only, because texts of the data may look
/// like one.
std::string assembled(const Json& data) {
  std::string scripts(page_file("canvas.js"));
  for (const char* name : {"data.js", "picture.js", "plots.js", "app.js"}) scripts += part(name);
  const std::pair<std::string_view, std::string> parts[] = {
      {"@STYLE@", std::string(part("page.css"))}, {"@DATA@", script_json(data)}, {"@SCRIPT@", scripts}};
  std::string_view rest = part("page.html");
  std::string page;
  for (const auto& [mark, text] : parts) {
    const size_t at = rest.find(mark);
    SEXTANT_CHECK(at != std::string_view::npos);
    page.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + mark.size());
  }
  return page.append(rest);
}

void check_same_frames(std::span<const ViewedRun> runs) {
  const SequenceInfo& a = runs.front().sequence->info();
  for (const ViewedRun& run : runs) {
    const SequenceInfo& b = run.sequence->info();
    if (a.dataset == b.dataset && a.sequence == b.sequence && a.first_frame == b.first_frame &&
        a.last_frame == b.last_frame && a.width == b.width && a.height == b.height)
      continue;
    fail(
        "{} is of {} {} frames {}-{} ({}x{} px), {} of {} {} frames {}-{} ({}x{} px): two runs in one page "
        "must have the same frames and image size",
        runs.front().folder, a.dataset, a.sequence, a.first_frame, a.last_frame, a.width, a.height,
        run.folder, b.dataset, b.sequence, b.first_frame, b.last_frame, b.width, b.height);
  }
}

}  // namespace

OutputFiles view_page(std::span<const ViewedRun> runs, const PageOptions& options) {
  SEXTANT_CHECK(!runs.empty());
  check_same_frames(runs);
  const SequenceInfo& info = runs.front().sequence->info();
  Json data = {{"schema", 1},
               {"source", runs.front().source},
               {"dataset", info.dataset},
               {"sequence", info.sequence},
               {"width", info.width},
               {"height", info.height},
               {"first", info.first_frame},
               {"last", info.last_frame},
               {"rate_hz", info.rate_hz},
               {"images", Json::object()},
               {"outlines", Json::object()},
               {"boxes", boxes_json(*runs.front().sequence)},
               {"metrics", metrics_json()},
               {"runs", Json::array()}};
  for (const ViewedRun& run : runs) data["runs"].push_back(run_json(run));

  std::vector<FramePicture> made = pictures(*runs.front().sequence, options);
  size_t image_bytes = 0;
  for (size_t i = 0; i < made.size(); ++i) {
    data["outlines"][std::to_string(info.first_frame + static_cast<int>(i))] = std::move(made[i].outlines);
    image_bytes += (made[i].jpeg.size() + 2) / 3 * 4;
  }
  const bool inside = assembled(data).size() + image_bytes <= options.one_file_bytes;
  OutputFiles files;
  for (size_t i = 0; i < made.size(); ++i) {
    if (made[i].jpeg.empty()) continue;
    const int frame = info.first_frame + static_cast<int>(i);
    const std::string name = fmt::format("frames/{:06}.jpg", frame);
    data["images"][std::to_string(frame)] = inside ? "data:image/jpeg;base64," + base64(made[i].jpeg) : name;
    if (!inside) files[name] = std::move(made[i].jpeg);
  }
  files["index.html"] = assembled(data);
  return files;
}

std::string write_view(const std::filesystem::path& out, const OutputFiles& files) {
  if (out.extension() != ".html") {
    write_output_folder(out, files);
    return (out / "index.html").string();
  }
  if (files.size() > 1)
    fail("{}: with its images the page is larger than {} MB: give a folder to --out, or a lower --quality",
         out.string(), one_file_bytes / 1'000'000);
  write_file(out, files.at("index.html"));
  return out.string();
}

View make_view(const ViewRequest& request) {
  const auto lock = lock_folder(request.out.ends_with(".html") ? "" : request.out);
  View view;
  std::map<fs::path, ViewedRun> of_folder;
  const ViewedRun* source = nullptr;
  for (const bool logs : {false, true}) {  // logs without a source of their own are of the run beside them
    for (const fs::path& folder : request.folders) {
      if (is_of_logs(folder) != logs || of_folder.contains(folder)) continue;
      const bool borrows = logs && source != nullptr && request.images.empty();
      ViewedRun run = borrows ? view_records(folder, request.choice, source->source, source->sequence)
                              : view_folder(folder, request.choice, request.images, request.data_root,
                                            request.page.jobs, request.page.quiet);
      const auto it = of_folder.emplace(folder, std::move(run)).first;
      if (!logs) source = &it->second;
    }
  }
  for (const fs::path& folder : request.folders) view.runs.push_back(of_folder.at(folder));
  view.page = write_view(request.out, view_page(view.runs, request.page));
  return view;
}

}  // namespace sextant
