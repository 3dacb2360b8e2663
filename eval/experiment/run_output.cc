#include "sextant/eval/experiment/run.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

std::string matrix_line(const SE3& T) {
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m = T.matrix().topRows<3>();
  return fmt::format("{}", fmt::join(m.data(), m.data() + m.size(), " "));
}

std::string tum_text(const Trajectory& trajectory, const SequenceInfo& info) {
  std::string text;
  for (const auto& [frame, pose] : trajectory.poses()) {
    if (frame < info.first_frame || frame > info.last_frame) continue;
    const Eigen::Vector3d& t = pose.translation();
    const Eigen::Quaterniond& q = pose.rotation();
    text += fmt::format("{} {} {} {} {} {} {} {}\n", frame / info.rate_hz, t.x(), t.y(), t.z(), q.x(), q.y(),
                        q.z(), q.w());
  }
  return text;
}

Json source_json(const SourceRun& source) {
  Json json;
  json["source"] = source.source;
  json["dataset"] = source.info.dataset;
  json["sequence"] = source.info.sequence;
  json["first_frame"] = source.info.first_frame;
  json["last_frame"] = source.info.last_frame;
  json["rate_hz"] = source.info.rate_hz;
  json["width_px"] = source.info.width;
  json["height_px"] = source.info.height;
  const StereoCamera& camera = source.info.camera;
  json["camera"] = {{"fx_px", camera.left.fx},
                    {"fy_px", camera.left.fy},
                    {"cx_px", camera.left.cx},
                    {"cy_px", camera.left.cy},
                    {"bf_px_m", camera.bf}};
  json["provenance"] = source.info.provenance;
  json["warnings"] = source.info.warnings;
  json["estimated_poses"] = source.motions.estimated.poses().size();
  json["world_origin"] = source.motions.starts_at_truth ? "true pose of the first frame" : "first frame";
  if (!source.noise.is_null()) json["noise"] = source.noise;
  json["inputs"] = inputs_json(source.inputs);
  return json;
}

}  // namespace

OutputFiles run_files(const RunResult& result) {
  OutputFiles files;
  files["records.jsonl"] = write_records(result.records);
  files["run.json"] = json_text(run_provenance(result));
  for (const SourceRun& source : result.sources) {
    const std::string folder = result.sources.size() == 1 ? "" : folder_name(source.info) + "/";
    std::string& kitti = files[folder + "est_camera_kitti.txt"];
    for (const auto& [frame, pose] : source.motions.estimated.poses()) kitti += matrix_line(pose) + '\n';
    files[folder + "est_camera_tum.txt"] = tum_text(source.motions.estimated, source.info);
    const std::string truth = tum_text(source.truth, source.info);
    if (!truth.empty()) files[folder + "gt_camera_tum.txt"] = truth;
    files[folder + "tracks.csv"] = write_tracks(source.tracks);
    for (const auto& [id, motions] : source.motions.objects) {
      std::string& text = files[fmt::format("{}obj_{}_motion.txt", folder, id)];
      for (const auto& [frame, H_world] : motions)
        text += fmt::format("{} {}\n", frame, matrix_line(H_world));
    }
  }
  return files;
}

Json run_provenance(const RunResult& result) {
  Json json = build_provenance();
  json["configuration"] = result.configuration;
  if (!result.fingerprints.empty()) json[fingerprints_key] = fingerprints_json(result.fingerprints);
  json["jobs"] = result.jobs;
  json["wall_time_s"] = result.wall_time_s;
  json["records"] = result.records.size();
  json["sources"] = Json::array();
  for (const SourceRun& source : result.sources) json["sources"].push_back(source_json(source));
  return json;
}

}  // namespace sextant
