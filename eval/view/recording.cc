#include "sextant/eval/view/recording.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/json.h"
#include "sextant/base/progress.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/eval/logs/mcap_writer.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

constexpr const char* world = "world";

/// Schemas of the messages written here: properties as a list "name:type", where a type is a JSON schema type
/// or the name of another schema of this table.
struct SchemaText {
  std::string_view name, properties;
};
constexpr SchemaText schemas[] = {
    {"time", "sec:integer nsec:integer"},
    {"vector", "x:number y:number z:number"},
    {"quaternion", "x:number y:number z:number w:number"},
    {"colour", "r:number g:number b:number a:number"},
    {"pose", "position:vector orientation:quaternion"},
    {"cube", "pose:pose size:vector color:colour"},
    {"entity",
     "timestamp:time frame_id:string id:string lifetime:time frame_locked:boolean metadata:[] arrows:[] "
     "cubes:[cube] spheres:[] cylinders:[] lines:[] triangles:[] texts:[] models:[]"},
    {"foxglove.PoseInFrame", "timestamp:time frame_id:string pose:pose"},
    {"foxglove.PosesInFrame", "timestamp:time frame_id:string poses:[pose]"},
    {"foxglove.FrameTransform",
     "timestamp:time parent_frame_id:string child_frame_id:string translation:vector rotation:quaternion"},
    {"foxglove.SceneUpdate", "deletions:[] entities:[entity]"},
    {"foxglove.CompressedImage", "timestamp:time frame_id:string data:base64 format:string"},
    {"foxglove.CameraCalibration",
     "timestamp:time frame_id:string width:integer height:integer distortion_model:string D:[number] "
     "K:[number] R:[number] P:[number]"},
};

Json schema(std::string_view name);

Json type_schema(std::string_view type) {
  if (type.starts_with('[')) {
    const std::string_view item = type.substr(1, type.size() - 2);
    return {{"type", "array"}, {"items", item.empty() ? Json{{"type", "object"}} : type_schema(item)}};
  }
  if (type == "base64") return {{"type", "string"}, {"contentEncoding", "base64"}};
  for (const char* simple : {"integer", "number", "string", "boolean"})
    if (type == simple) return {{"type", simple}};
  return schema(type);
}

Json schema(std::string_view name) {
  for (const SchemaText& entry : schemas) {
    if (entry.name != name) continue;
    Json properties = Json::object();
    std::string_view rest = entry.properties;
    while (!rest.empty()) {
      const std::string_view word = rest.substr(0, rest.find(' '));
      rest.remove_prefix(std::min(rest.size(), word.size() + 1));
      const size_t colon = word.find(':');
      properties[std::string(word.substr(0, colon))] = type_schema(word.substr(colon + 1));
    }
    return {{"title", std::string(name)}, {"type", "object"}, {"properties", std::move(properties)}};
  }
  SEXTANT_CHECK(false);
  return {};
}

constexpr uint64_t second_ns = 1'000'000'000;

Json time_json(uint64_t ns) { return {{"sec", ns / second_ns}, {"nsec", ns % second_ns}}; }
Json vector_json(const Eigen::Vector3d& p) { return {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}}; }
Json rotation_json(const Eigen::Quaterniond& q) {
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}
Json pose_json(const SE3& T) {
  return {{"position", vector_json(T.translation())}, {"orientation", rotation_json(T.rotation())}};
}

/// Estimate or truth of a body.
struct Side {
  const char* name;
  std::optional<SE3> (TrackPoint::*pose)() const;
  Json colour;
};

const std::vector<Side>& sides() {
  static const std::vector<Side> both = {
      {"estimate", &TrackPoint::estimate, {{"r", 0.90}, {"g", 0.45}, {"b", 0.10}, {"a", 0.5}}},
      {"truth", &TrackPoint::truth, {{"r", 0.25}, {"g", 0.60}, {"b", 0.90}, {"a", 0.4}}},
  };
  return both;
}

class Recording {
 public:
  Recording(const ViewedRun& run, const std::filesystem::path& out)
      : run_(run), info_(run.sequence->info()), writer_(out, "sextant " + run.version) {}

  uint64_t time_ns(int frame) const {
    return static_cast<uint64_t>(std::llround(frame * (static_cast<double>(second_ns) / info_.rate_hz)));
  }

  void add(const std::string& topic, const std::string& type, uint64_t ns, const Json& message) {
    auto channel = channels_.find(topic);
    if (channel == channels_.end())
      channel = channels_.emplace(topic, writer_.add_channel(topic, type, schema(type).dump())).first;
    writer_.add(channel->second, ns, message.dump());
    ++n_messages_;
  }

  void add_transform(uint64_t ns, const char* parent, const std::string& child, const SE3& T_parent_child) {
    add("/tf", "foxglove.FrameTransform", ns,
        {{"timestamp", time_json(ns)},
         {"parent_frame_id", parent},
         {"child_frame_id", child},
         {"translation", vector_json(T_parent_child.translation())},
         {"rotation", rotation_json(T_parent_child.rotation())}});
  }

  /// The frame `map` has x ahead, y to the left and z up.
  void add_map() {
    Eigen::Matrix3d R_map_world;
    R_map_world << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    add_transform(time_ns(info_.first_frame), "map", world,
                  SE3(Eigen::Quaterniond(R_map_world), Eigen::Vector3d::Zero()));
  }

  void add_paths() {
    for (const BodyTrack& track : run_.tracks) {
      for (const Side& side : sides()) {
        Json poses = Json::array();
        for (const TrackPoint& point : track.points) {
          if (const auto T = (point.*side.pose)()) poses.push_back(pose_json(*T));
        }
        const uint64_t ns = time_ns(info_.first_frame);
        if (!poses.empty())
          add(fmt::format("{}/{}_path", topic_of(track.body), side.name), "foxglove.PosesInFrame", ns,
              {{"timestamp", time_json(ns)}, {"frame_id", world}, {"poses", std::move(poses)}});
      }
    }
  }

  void add_frame(int frame) {
    const uint64_t ns = time_ns(frame);
    for (const Side& side : sides()) {
      Json entities = Json::array();
      for (const BodyTrack& track : run_.tracks) {
        const TrackPoint* point = track.find(frame);
        const std::optional<SE3> T = point == nullptr ? std::nullopt : (point->*side.pose)();
        if (!T) continue;
        add(fmt::format("{}/{}", topic_of(track.body), side.name), "foxglove.PoseInFrame", ns,
            {{"timestamp", time_json(ns)}, {"frame_id", world}, {"pose", pose_json(*T)}});
        if (track.body == "ego") {
          add_transform(ns, world, side.name == std::string_view("estimate") ? "camera" : "camera_truth", *T);
        } else if (const auto size_m = box_size_m(track.body, frame)) {
          entities.push_back(box(ns, track.body, *T, *size_m, side.colour));
        }
      }
      if (!entities.empty())
        add(fmt::format("/boxes/{}", side.name), "foxglove.SceneUpdate", ns,
            {{"deletions", Json::array()}, {"entities", std::move(entities)}});
    }
  }

  void add_image(int frame, int jpeg_quality) {
    if (!info_.channels.rgb) return;
    const uint64_t ns = time_ns(frame);
    const Frame pictured = run_.sequence->read(frame, Channels{.rgb = true});
    add("/image", "foxglove.CompressedImage", ns,
        {{"timestamp", time_json(ns)},
         {"frame_id", "camera"},
         {"data", base64(encode_jpeg(pictured.rgb, jpeg_quality))},
         {"format", "jpeg"}});
    const auto& c = info_.camera.left;
    add("/calibration", "foxglove.CameraCalibration", ns,
        {{"timestamp", time_json(ns)},
         {"frame_id", "camera"},
         {"width", info_.width},
         {"height", info_.height},
         {"distortion_model", ""},
         {"D", Json::array()},
         {"K", {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1}},
         {"R", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
         {"P", {c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0}}});
  }

  uint64_t finish() {
    writer_.finish();
    return n_messages_;
  }

 private:
  static std::string topic_of(const std::string& body) {
    return body == "ego" ? "/camera" : "/object/" + body.substr(body.find(':') + 1);
  }

  std::optional<Eigen::Vector3d> box_size_m(const std::string& body, int frame) const {
    const ObjectTruth* object = run_.sequence->truth().find(frame, body_order(body));
    return object == nullptr ? std::nullopt : object->size_m;
  }

  /// The origin of an object is the middle of its box's bottom face, with y down.
  Json box(uint64_t ns, const std::string& body, const SE3& T_world_object, const Eigen::Vector3d& size_m,
           const Json& colour) const {
    const SE3 T_object_centre(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, -size_m.y() / 2, 0));
    const Json cube = {{"pose", pose_json(T_world_object * T_object_centre)},
                       {"size", vector_json(size_m)},
                       {"color", colour}};
    Json entity = {
        {"timestamp", time_json(ns)},        {"frame_id", world},     {"id", body},
        {"lifetime", time_json(time_ns(1))}, {"frame_locked", false}, {"cubes", Json::array({cube})}};
    for (const char* none :
         {"metadata", "arrows", "spheres", "cylinders", "lines", "triangles", "texts", "models"})
      entity[none] = Json::array();
    return entity;
  }

  const ViewedRun& run_;
  const SequenceInfo& info_;
  McapWriter writer_;
  std::map<std::string, uint16_t> channels_;
  uint64_t n_messages_ = 0;
};

}  // namespace

uint64_t write_recording(const ViewedRun& run, const std::filesystem::path& out,
                         const RecordingOptions& options) {
  const SequenceInfo& info = run.sequence->info();
  Recording recording(run, out);
  recording.add_map();
  recording.add_paths();
  Progress progress("frames", info.last_frame - info.first_frame + 1, options.quiet);
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    check_interrupt();
    recording.add_frame(frame);
    if (options.images) recording.add_image(frame, options.jpeg_quality);
    progress.advance();
  }
  return recording.finish();
}

}  // namespace sextant
