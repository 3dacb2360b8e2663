#include "sextant/eval/fuzz/targets.h"

#include <cmath>
#include <sstream>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/options.h"
#include "sextant/base/text.h"
#include "sextant/datasets/channels/network.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/datasets/codec/jpeg.h"
#include "sextant/datasets/codec/kitti_text.h"
#include "sextant/datasets/codec/mots.h"
#include "sextant/datasets/codec/png.h"
#include "sextant/datasets/codec/pose_text.h"
#include "sextant/datasets/codec/vkitti_text.h"
#include "sextant/datasets/dataset.h"
#include "sextant/datasets/vdo_folder.h"
#include "sextant/datasets/vkitti_layout.h"
#include "sextant/estimator/pipeline.h"
#include "sextant/estimator/points/extraction.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/eval/benchmark/suite.h"
#include "sextant/eval/evaluation/dense_files.h"
#include "sextant/eval/evaluation/pose_frames.h"
#include "sextant/eval/experiment/case_results.h"
#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/experiment/plan.h"
#include "sextant/eval/experiment/run.h"
#include "sextant/eval/experiment/sweep.h"
#include "sextant/eval/external/external_case.h"
#include "sextant/eval/external/external_config.h"
#include "sextant/eval/external/external_estimator.h"
#include "sextant/eval/fuzz/input.h"
#include "sextant/eval/gate/history.h"
#include "sextant/eval/gate/policy.h"
#include "sextant/eval/gate/side.h"
#include "sextant/eval/logs/object_logs.h"
#include "sextant/eval/logs/trajectory_bytes.h"
#include "sextant/eval/logs/trajectory_files.h"
#include "sextant/eval/records/case_summary.h"
#include "sextant/eval/records/journal.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/tracks.h"
#include "sextant/eval/report/noise_sweep.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

using Bytes = std::string_view;

/// Checks that accepted data, written and read again, are unchanged.
template <typename Decode, typename Encode>
std::function<void(Bytes)> unchanged(Decode decode, Encode encode) {
  return [=](Bytes bytes) {
    const auto value = decode(bytes, "file");
    SEXTANT_CHECK(decode(encode(value), "written") == value);
  };
}

/// Calls a reader. Returns the Error with which it refuses its input; nullopt if it accepts the input.
std::optional<Error> error_of(const auto& read) {
  try {
    read();
    return std::nullopt;
  } catch (const Error& error) {
    return error;
  }
}

// ---- JSON and our own results

void json(Bytes bytes) {
  const Json value = parse_json(bytes, "json");
  const std::string text = json_text(value);
  SEXTANT_CHECK(json_text(parse_json(text, "written")) == text);
}

void options(Bytes bytes) {
  const Json tree = parse_json(bytes, "options");
  ExtractionOptions extraction;
  read_options(json_object(tree, "extraction", "options"), extraction, "extraction");
  PipelineOptions pipeline;
  read_options(json_object(tree, "pipeline", "options"), pipeline, "pipeline");
  SourceSpec source = SourceSpec::parse("vdo:x");
  source.add_options(json_object(tree, "source", "options"));
}

void noise(Bytes bytes) {
  const Noise noise = Noise::parse(bytes);
  SEXTANT_CHECK(Noise(noise.options()).options() == noise.options());
}

void plan(Bytes bytes) {
  const Plan plan = parse_plan(bytes, "plan", "");
  for (uint64_t i = 0; i < std::min<uint64_t>(plan.n_cases(), 10); ++i) plan.at(i);
  json_text(plan.json());
}

/// Compares the fast parser of a record's line with the general JSON parser.
void record_scanner(Bytes bytes) {
  Record scanned;
  if (scan_record(bytes, scanned))
    SEXTANT_CHECK(scanned == record_from_json(parse_json(bytes, "line"), "line"));
}

void journal(Bytes bytes) {
  const FuzzFolder folder("@@ journal.jsonl\n" + std::string(bytes));
  const Journal::Fits fits = [&](uint64_t, std::string_view content) {
    return !error_of([&] { parse_records(content, "journal"); }) ||
           !error_of([&] { decode_journal_case(content, "journal"); });
  };
  Journal journal(folder.path() / "journal.jsonl", "owner", fits);
  const auto contents = [&] {
    std::string all;
    for (const auto& [number, block] : journal.blocks()) all += journal.content(block);
    return all;
  };
  const std::string before = contents();
  const uint64_t number = journal.blocks().empty() ? 0 : journal.blocks().rbegin()->first;
  if (number == UINT64_MAX) return;
  journal.append(number + 1, 0, "");
  SEXTANT_CHECK(contents() == before);
}

/// Reads a summary and its noise in the form in which a journal stores them.
void journal_case(Bytes bytes) {
  const JournalCase found = decode_journal_case(bytes, "journal");
  SEXTANT_CHECK(ExactNoise::decode(found.noise.bytes(), "written").bytes() == found.noise.bytes());
  decode_case_summary(found.summary, "summary");
}

/// Reads the blocks of a file up to the first bad one.
void summary_file(Bytes bytes) {
  const MemoryFile file(bytes);
  SummaryReader reader(file.path());
  while (const auto block = reader.next()) decode_case_summary(block->bytes, "summary");
  const ExactNoises noises = decode_exact_noises(reader.noise(), "noise");
  for (const auto& [place, noise] : noises) noise.total();
  SEXTANT_CHECK(encode_exact_noises(decode_exact_noises(encode_exact_noises(noises), "written")) ==
                encode_exact_noises(noises));
}

/// Calls every reader of a run folder, even if an earlier reader has refused it.
void run_folder(Bytes bytes) {
  const FuzzFolder folder(bytes);
  static const Policy policy;
  std::optional<Error> first;
  const auto each = [&](const auto& read) {
    const std::optional<Error> error = error_of(read);
    if (!first) first = error;
  };
  each([&] { read_run_json(folder.path()); });
  each([&] { read_side(folder.path()); });
  each([&] { read_history({folder.path(), folder.path()}, policy); });
  each([&] { read_noise_sweeps({folder.path()}); });
  each([&] { baseline_files(folder.path()); });
  if (first) throw *first;
}

void sweep_folder(Bytes bytes) {
  const FuzzFolder folder(bytes);
  merge_sweeps({folder.path() / "a", folder.path() / "b"}, folder.path() / "out");
}

/// Lists and prunes a cache. Files that are not correspondence caches must be skipped, whatever they contain.
void pack_cache(Bytes bytes) {
  const FuzzFolder folder(bytes);
  PackCache(folder.path()).list();
  PackCache(folder.path()).prune(false);
}

void rescore(Bytes bytes) {
  const FuzzFolder folder(bytes);
  RescoreRequest request;
  request.folder = folder.path();
  if (is_sweep(folder.path())) {
    const SweepConfig config = rescored_sweep(request);
    SEXTANT_CHECK(config.shard < config.n_shards);
    json_text(config.plan.json());
  } else {
    resolve_options(rescored_run(request).options);
  }
}

// ---- files of data sets

/// Reads one image with each PNG reader. The image counts as refused if none accepts it, apart from the
/// reader of the header.
void read_png(Bytes png) {
  int taken = 0;
  const auto each = [&](const auto& decode) {
    if (!error_of([&] { decode(png, "png"); })) ++taken;
  };
  each(png_header);
  each(decode_png16);
  each(decode_png_rgb16);
  each(decode_png_rgb);
  each([](Bytes b, const std::string& name) { depth_from_tartanair(decode_png_rgba(b, name)); });
  each(decode_png_gray);
  each(decode_png_ids);
  each([](Bytes b, const std::string& name) { mask_from_mots(decode_png16(b, name), name); });
  if (taken < 2) fail("no PNG");
}

/// Reads a PNG of these pixels: the checksums of a file would keep a fuzzer from reaching the decoder.
void png_pixels(Bytes bytes) { read_png(png_of_pixels(bytes)); }

void flo(Bytes bytes) {
  const Image<Flow> flow = decode_flo(bytes, "flo");
  SEXTANT_CHECK(encode_flo(flow).size() == bytes.size());
}

/// Equal except for the last digits of numbers and the sign of 0.
bool equal_texts(const std::string& a, const std::string& b) {
  std::istringstream words_a(a), words_b(b);
  for (std::string x, y; true;) {
    const bool more_a = static_cast<bool>(words_a >> x), more_b = static_cast<bool>(words_b >> y);
    if (more_a != more_b) return false;
    if (!more_a) return true;
    const double u = std::atof(x.c_str()), v = std::atof(y.c_str());
    if (x != y && !(std::abs(u - v) <= 1e-9 * (1 + std::abs(u)))) return false;
  }
}

/// Checks that accepted data, written, are accepted again and are equal.
template <typename Decode, typename Encode>
std::function<void(Bytes)> both_ways(Decode decode, Encode encode) {
  return [=](Bytes bytes) {
    const std::string written = encode(decode(bytes, "file"));
    std::string again;
    if (const auto error = error_of([&] { again = encode(decode(written, "written")); }))
      throw InternalError(fmt::format("what was written is refused: {}", error->what()));
    SEXTANT_CHECK(equal_texts(again, written));
  };
}

void mots_text(Bytes bytes) {
  for (const MotsIds ids : {MotsIds::tracks, MotsIds::detections}) {
    const MotsText text(bytes, "mots", ids);
    for (const int frame : text.frames()) {
      const auto& row = text.rows(frame).front();
      if (static_cast<int64_t>(row.width) * row.height > 1'000'000)
        continue;  // would take long and test nothing more
      text.mask(frame, row.width, row.height);
    }
  }
}

/// Reads a line "WIDTH HEIGHT" and the run lengths after it.
void mots_rle(Bytes bytes) {
  const size_t line = bytes.find('\n');
  if (line == Bytes::npos) fail("no size");
  const std::vector<std::string> size = split(std::string(bytes.substr(0, line)), ' ');
  if (size.size() != 2 || size[0].size() > 4 || size[1].size() > 4) fail("no size");
  const int width = std::atoi(size[0].c_str()), height = std::atoi(size[1].c_str());
  const std::vector<uint32_t> runs = decode_rle(bytes.substr(line + 1), width, height, "rle");
  SEXTANT_CHECK(decode_rle(encode_rle(runs), width, height, "written") == runs);
}

void source(Bytes bytes) {
  const SourceSpec spec = SourceSpec::parse(std::string(bytes));
  if (spec.adapter == "vkitti1") parse_vkitti1_name(spec.sequence);
  if (spec.adapter == "vkitti2") parse_vkitti2_name(spec.sequence);
}

/// Reads a whole folder of a data set: its truth and, unless frames are rendered, two frames. Its file
/// `source` holds the rest of SOURCE after the path.
void dataset(const std::string& adapter, Bytes bytes) {
  const FuzzFolder folder(bytes);
  const std::string rest = read_file(folder.path() / "source");
  const auto sequence = open_source(SourceSpec::parse(adapter + ":" + folder.path().string() + rest));
  const SequenceInfo& info = sequence->info();
  SEXTANT_CHECK(std::isfinite(info.rate_hz) && info.first_frame <= info.last_frame);
  sequence->truth();
  if (adapter.starts_with("replay-")) return;
  sequence->check_files();
  for (int frame = info.first_frame; frame <= std::min(info.last_frame, info.first_frame + 1); ++frame) {
    sequence->read(frame, info.channels);
    sequence->true_flow(frame);
    sequence->true_depth(frame);
  }
}

// ---- results of other systems

void check_poses(const PoseSeries& poses) {
  const size_t n = poses.size();
  SEXTANT_CHECK(n > 0 && (poses.rotations.empty() || poses.rotations.size() == n));
  SEXTANT_CHECK(poses.stamps_s.empty() || poses.stamps_s.size() == n);
  SEXTANT_CHECK(poses.frames.empty() || poses.frames.size() == n);
  for (size_t i = 0; i < n; ++i)
    SEXTANT_CHECK(poses.positions_m[i].allFinite() &&
                  (poses.rotations.empty() || poses.rotations[i].allFinite()));
  for (const double t : poses.stamps_s) SEXTANT_CHECK(std::isfinite(t));
}

void trajectory(const std::string& format, Bytes bytes, const std::string& topic = "") {
  const TrajectoryFile file = decode_trajectory(bytes, format, topic);
  check_poses(file.poses);
  if (file.truth) check_poses(*file.truth);
  encode_tum(file.poses);
}

void object_log(LogFormat format, Bytes bytes) {
  const FuzzFolder folder(bytes);
  ObjectLogRequest request;
  request.format = format;
  for (const ObjectLog& log : read_object_logs(folder.path(), request)) {
    for (const auto& [key, motion] : log.motions) SEXTANT_CHECK(motion.estimate.matrix().allFinite());
    chained_poses(log);
  }
}

void body_from_camera(Bytes bytes) {
  const BodyFromCamera body = decode_body_from_camera(std::string(bytes), "body");
  SEXTANT_CHECK(body.position_m.allFinite() && (!body.rotation || body.rotation->allFinite()));
}

void external_config(Bytes bytes) {
  const MemoryFile file(bytes);
  json_text(write_options(read_external_config(file.path())));
}

/// Reads output/ as config.json declares; an optional case.json records how the program ended.
void external_results(Bytes bytes) {
  const FuzzFolder folder(bytes);
  const ExternalConfig config = read_external_config(folder.path() / "config.json");
  ResultFolder results;
  results.path = folder.path() / "output";
  results.numbers = {.first = 0, .last = 3, .in_files = 0, .in_results = 0, .rate_hz = 10};
  results.finished = read_case(folder.path()).end == ProcessOutcome::End::exited;
  const ExternalResults read = read_external_results(config.set, results, SequenceTruth{});
  for (const auto& [key, motion] : read.motions) SEXTANT_CHECK(motion.matrix().allFinite());
  const FrameTimes times = read_frame_times(config.times, results);
  for (const auto& [frame, ms] : times.ms) SEXTANT_CHECK(std::isfinite(ms));
  if (!read.problems.empty()) fail("{}", read.problems.front());
}

/// Reads estimate.EXT and truth.EXT, with an optional mask.png.
template <Named Format>
DenseFiles<Format> dense_files(const FuzzFolder& folder, const std::string& extension, Format format) {
  DenseFiles<Format> files{.estimate = folder.path() / ("estimate" + extension),
                           .truth = folder.path() / ("truth" + extension),
                           .estimate_format = format,
                           .truth_format = format,
                           .mask = {},
                           .visible_truth = {}};
  if (fs::exists(folder.path() / "mask.png")) files.mask = folder.path() / "mask.png";
  return files;
}

void dense_flow(Bytes bytes, const std::string& extension, FlowFormat format) {
  const FuzzFolder folder(bytes);
  evaluate_flow(dense_files(folder, extension, format));
}

void dense_depth(Bytes bytes) {
  const FuzzFolder folder(bytes);
  evaluate_depth(dense_files(folder, ".png", DepthFormat::depth256), 0);
}

std::vector<FuzzTarget> make_targets() {
  add_external_estimators();
  std::vector<FuzzTarget> table = {
      {"json", json},
      {"options", options},
      {"noise", noise},
      {"plan", plan},
      {"records", unchanged(parse_records, write_records)},
      {"record_scanner", record_scanner},
      {"journal", journal},
      {"case_summary", unchanged(decode_case_summary, encode_case_summary)},
      {"journal_case", journal_case},
      {"summary_file", summary_file},
      // The checksum at the end is made valid; otherwise no input would pass it.
      {"pack", [](Bytes bytes) { decode_pack(std::string(bytes) + sha256(bytes), "pack"); }},
      {"run_folder", run_folder},
      {"sweep_folder", sweep_folder},
      {"pack_cache", pack_cache},
      {"rescore", rescore},
      {"benchmark_card", [](Bytes bytes) { parse_card(bytes, "card"); }},
      {"benchmark_suite", [](Bytes bytes) { parse_suite(bytes, "suite"); }},
      {"benchmark_file", [](Bytes bytes) { parse_benchmark_file(bytes, "benchmark"); }},
      {"policy", [](Bytes bytes) { read_policy(MemoryFile(bytes).path()); }},
      {"tracks", [](Bytes bytes) { parse_tracks(std::string(bytes), "tracks"); }},
      {"png", read_png},
      {"png_pixels", png_pixels},
      {"flo", flo},
      {"jpeg", [](Bytes bytes) { decode_jpeg_rgb(bytes, "jpeg"); }},
      {"onnx", [](Bytes bytes) { read_onnx_header(bytes, "onnx"); }},
      {"mask_text", unchanged(decode_mask_text, encode_mask_text)},
      {"mots_text", mots_text},
      {"mots_rle", mots_rle},
      {"pose_text", both_ways(decode_pose_text, encode_pose_text)},
      {"object_poses", both_ways(decode_object_poses, encode_object_poses)},
      {"vdo_objects", [](Bytes bytes) { decode_vdo_objects(bytes, "objects"); }},
      {"yaml_camera", both_ways(decode_yaml_camera, encode_yaml_camera)},
      {"kitti_calibration",
       both_ways(decode_kitti_calibration,
                 [](const KittiCalibration& calibration) { return encode_kitti_calibration(calibration); })},
      {"kitti_labels", both_ways(decode_kitti_labels, encode_kitti_labels)},
      {"kitti_oxts", both_ways(decode_kitti_oxts, encode_kitti_oxts)},
      {"vkitti1_extrinsics", both_ways(decode_vkitti1_extrinsics, encode_vkitti1_extrinsics)},
      {"vkitti1_objects", both_ways(decode_vkitti1_objects, encode_vkitti1_objects)},
      {"vkitti1_colors", both_ways(decode_vkitti1_colors, encode_vkitti1_colors)},
      {"vkitti2_extrinsics", both_ways(decode_vkitti2_extrinsics, encode_vkitti2_extrinsics)},
      {"vkitti2_intrinsics", both_ways(decode_vkitti2_intrinsics, encode_vkitti2_intrinsics)},
      {"vkitti2_poses", both_ways(decode_vkitti2_poses, encode_vkitti2_poses)},
      {"vkitti2_boxes", both_ways(decode_vkitti2_boxes, encode_vkitti2_boxes)},
      {"vkitti2_infos", both_ways(decode_vkitti2_infos, encode_vkitti2_infos)},
      {"source", source},
      {"trajectory_auto", [](Bytes bytes) { trajectory("auto", bytes); }},
      {"trajectory_tf", [](Bytes bytes) { trajectory("mcap", bytes, "/tf:map.base"); }},
      {"object_log_dynosam", [](Bytes bytes) { object_log(LogFormat::dynosam, bytes); }},
      {"object_log_vdo", [](Bytes bytes) { object_log(LogFormat::vdo, bytes); }},
      {"body_from_camera", body_from_camera},
      {"direction", [](Bytes bytes) { SEXTANT_CHECK(parse_direction(std::string(bytes)).allFinite()); }},
      {"external_config", external_config},
      {"external_results", external_results},
      {"dense_flow_flo", [](Bytes bytes) { dense_flow(bytes, ".flo", FlowFormat::by_name); }},
      {"dense_flow_png", [](Bytes bytes) { dense_flow(bytes, ".png", FlowFormat::kitti); }},
      {"dense_depth", dense_depth},
  };
  for (const TrajectoryFormat& format : trajectory_formats()) {
    table.push_back(
        {"trajectory_" + format.name, [name = format.name](Bytes bytes) { trajectory(name, bytes); }});
  }
  for (const Adapter& adapter : adapters()) {
    if (adapter.name == "synthetic") continue;  // reads no files
    table.push_back(
        {"dataset_" + adapter.name, [name = adapter.name](Bytes bytes) { dataset(name, bytes); }});
  }
  return table;
}

}  // namespace

std::string refusal(const FuzzTarget& target, std::string_view bytes) {
  const auto words = [](const std::exception& error) {
    SEXTANT_CHECK(*error.what() != '\0');
    return std::string(error.what());
  };
  try {
    target.read(bytes);
    return "";
  } catch (const Error& error) {
    return words(error);
  } catch (const fs::filesystem_error& error) {
    return words(error);
  }
}

std::span<const FuzzTarget> fuzz_targets() {
  static const std::vector<FuzzTarget> table = make_targets();
  return table;
}

}  // namespace sextant
