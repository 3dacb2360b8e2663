#include "sextant/eval/check/check_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/machine.h"
#include "sextant/base/progress.h"
#include "sextant/datasets/folder_sequence.h"
#include "sextant/stats/summary.h"

namespace sextant {
namespace {

constexpr size_t sample_step = 16;

/// Content of one channel in one frame.
struct ChannelFrame {
  bool present = false;
  int width = 0;
  int height = 0;
  size_t n_pixels = 0;
  size_t n_valid = 0;
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  std::vector<float> sample;
  std::string error;
};

/// A channel: its name, the unit of its values, and the flag that requests it. The convention checks do not
/// use an `extra` channel, which only some sources have.
struct ChannelKind {
  const char* name;
  const char* unit;
  bool Channels::*flag;
  bool extra = false;
};
constexpr std::array<ChannelKind, 6> channel_kinds = {
    {{"gray", "level", &Channels::gray},
     {"right image", "level", &Channels::rgb_right, true},
     {"depth", "m", &Channels::depth},
     {"flow", "px", &Channels::flow},
     {"backward flow", "px", &Channels::backward_flow, true},
     {"mask", "id", &Channels::mask}}};

/// Returns true if the source has the channel and it is decoded; quick checks leave out extra channels.
bool is_decoded(const Sequence& sequence, const ChannelKind& kind, bool quick) {
  return sequence.info().channels.*kind.flag && !(quick && kind.extra);
}

template <typename T, typename Value>
ChannelFrame measure(const Image<T>& image, const Value& value) {
  ChannelFrame out{!image.empty(), image.width(), image.height(), image.size()};
  for (size_t i = 0; i < image.size(); ++i) {
    const double v = value(image.data()[i]);
    if (!std::isfinite(v)) continue;
    out.min = std::min(out.min, v);
    out.max = std::max(out.max, v);
    if (out.n_valid++ % sample_step == 0) out.sample.push_back(static_cast<float>(v));
  }
  return out;
}

using FrameContent = std::array<ChannelFrame, channel_kinds.size()>;

/// Summarises one channel of a frame.
ChannelFrame look_at(const Frame& data, const ChannelKind& kind) {
  const auto as_it_is = [](auto value) { return static_cast<double>(value); };
  const auto mean_of_colours = [](const Rgb& c) { return (c.r + c.g + c.b) / 3.0; };
  const auto length = [](const Flow& f) { return std::hypot(double{f.u}, double{f.v}); };
  if (kind.flag == &Channels::gray) return measure(data.gray, as_it_is);
  if (kind.flag == &Channels::rgb_right) return measure(data.rgb_right, mean_of_colours);
  if (kind.flag == &Channels::depth) return measure(data.depth_m, as_it_is);
  if (kind.flag == &Channels::mask)
    return measure(data.mask, [](uint16_t id) { return id == 0 ? NAN : static_cast<double>(id); });
  return measure(kind.flag == &Channels::flow ? data.flow : data.backward_flow, length);
}

/// Reads the channels of a frame; the data for the convention checks are stored in `grid`. A channel that
/// cannot be read does not prevent reading the others.
FrameContent read_frame(const Sequence& sequence, int frame, int step, bool sampled, bool quick,
                        GridFrame& grid) {
  Channels all;
  for (const ChannelKind& kind : channel_kinds) all.*kind.flag = is_decoded(sequence, kind, quick);
  FrameContent content;
  Frame data;
  try {
    data = sequence.read(frame, all);
    for (size_t i = 0; i < channel_kinds.size(); ++i) {
      if (all.*channel_kinds[i].flag) content[i] = look_at(data, channel_kinds[i]);
    }
  } catch (const Error&) {
    data = {};
    for (size_t i = 0; i < channel_kinds.size(); ++i) {
      if (!(all.*channel_kinds[i].flag)) continue;
      Channels one;
      one.*channel_kinds[i].flag = true;
      try {
        Frame part = sequence.read(frame, one);
        content[i] = look_at(part, channel_kinds[i]);
        if (one.gray) data.gray = std::move(part.gray);
        if (one.depth) data.depth_m = std::move(part.depth_m);
        if (one.flow) data.flow = std::move(part.flow);
        if (one.mask) data.mask = std::move(part.mask);
      } catch (const Error& error) {
        content[i].error = error.what();
      }
    }
  }
  grid.outlines = mask_outlines(data.mask);
  if (!sampled) return content;
  grid.depth_m = sample_grid(data.depth_m, step);
  grid.flow = sample_grid(data.flow, step);
  grid.mask = sample_grid(data.mask, step);
  if (!data.gray.empty()) grid.gray = std::make_shared<const Image<uint8_t>>(std::move(data.gray));
  return content;
}

/// Returns the frames used by the convention checks, as numbers from 0 to n - 1; see check_source.h.
std::vector<bool> sampled_frames(int n) {
  constexpr int most = 24, run = 4, n_runs = most / run;
  std::vector<bool> sampled(static_cast<size_t>(n), n <= most);
  if (n <= most) return sampled;
  for (int r = 0; r < n_runs; ++r) {
    std::fill_n(sampled.begin() + r * (n - run) / (n_runs - 1), run, true);
  }
  return sampled;
}

void set_fail(SourceCheck& line, const std::string& message) {
  if (line.outcome != CheckOutcome::fail) line.message = message;
  line.outcome = CheckOutcome::fail;
}

/// Returns true if a true object has a 2-D box in a frame of the source, so that a mask should show it.
bool any_true_boxes(const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  for (const auto& [frame, objects] : sequence.truth().objects) {
    if (frame < info.first_frame || frame > info.last_frame) continue;
    if (std::ranges::any_of(objects, [](const ObjectTruth& o) { return o.box.has_value(); })) return true;
  }
  return false;
}

void judge_empty_channel(const Sequence& sequence, const ChannelKind& kind, SourceCheck& line) {
  if (kind.flag != &Channels::mask) {
    set_fail(line, "no valid pixel in any frame");
    return;
  }
  const bool expected = any_true_boxes(sequence);
  line.outcome = expected ? CheckOutcome::suspect : CheckOutcome::note;
  line.message = expected ? "no object in any frame, although the truth has some" : "no object in any frame";
}

/// Disparities in whole pixels lost their fraction, usually in an image of 8 bits.
void judge_rounding(const ConventionData& data, SourceCheck& line) {
  constexpr double tolerance_px = 1e-3, share = 0.99;
  constexpr size_t least_values = 5;
  size_t n = 0, n_whole = 0;
  std::set<double> values;
  for (const GridFrame& frame : data.frames) {
    for (size_t i = 0; i < frame.depth_m.size(); ++i) {
      const double disparity = data.camera.bf / frame.depth_m.data()[i], whole = std::round(disparity);
      if (!std::isfinite(disparity)) continue;
      ++n;
      if (whole < 1 || std::abs(disparity - whole) > tolerance_px) continue;
      ++n_whole;
      values.insert(whole);
    }
  }
  if (values.size() < least_values || static_cast<double>(n_whole) < share * static_cast<double>(n)) return;
  line.outcome = CheckOutcome::suspect;
  line.cause = "disparities are whole pixels: sub-pixel part lost";
  line.message = "were they stored in 8 bits, or rounded? Write disparity * 256 in 16 bits";
}

/// Images that repeat although the flow shows motion are of a frozen camera, or stand for missing frames.
void judge_repeated_images(const ConventionData& data, SourceCheck& line) {
  const std::vector<int> repeated = frames_with_repeated_image(data);
  if (repeated.empty()) return;
  line.outcome = CheckOutcome::fail;
  line.cause = "images are repeated: a frozen camera, or missing frames written as the last image";
  line.message = fmt::format("the images of frames {} equal the ones before, although the flow shows motion",
                             frame_list(repeated));
}

/// Flow of exactly (0, 0) where the background moves is a missing estimate that was not marked as invalid.
void judge_empty_flow(const ConventionData& data, SourceCheck& line) {
  constexpr double suspect_percent = 10;
  const auto share = empty_flow_share(data);
  if (!share || share->percent < suspect_percent) return;
  line.outcome = CheckOutcome::suspect;
  line.cause = "flow is exactly (0, 0) where the background moves: missing estimates written as 0";
  line.message = fmt::format(
      "at {:.0f} % of {} points of the background: mark pixels without an estimate as invalid (1e10 in .flo, "
      "0 in the blue channel of PNG)",
      share->percent, share->n);
}

/// An id without a true object that spans the whole image in most frames is void or background.
void judge_void_id(const ConventionData& data, SourceCheck& line) {
  constexpr double spans = 0.95;
  std::map<int, std::pair<int, double>> wide;  // id -> frames, sum of the shares of pixels
  for (int frame = data.first_frame; frame <= data.last_frame(); ++frame) {
    for (const auto& [id, outline] : data.at(frame).outlines) {
      const bool whole_image =
          outline.box.width() > spans * (data.width - 1) && outline.box.height() > spans * (data.height - 1);
      if (!whole_image || data.truth.find(frame, id) != nullptr) continue;
      ++wide[id].first;
      wide[id].second += outline.n_pixels / (static_cast<double>(data.width) * data.height);
    }
  }
  for (const auto& [id, count] : wide) {
    if (2 * count.first <= *line.n_present) continue;
    const double share = count.second / count.first;
    line.outcome = share > 0.5 ? CheckOutcome::fail : CheckOutcome::suspect;
    line.cause = fmt::format("id {} is void or background, not an object", id);
    line.message = fmt::format(
        "it spans the whole image in {} of {} frames, with {:.0f} % of the pixels: write 0 where there is no "
        "object",
        count.first, *line.n_present, 100 * share);
    return;
  }
}

/// Summarises a channel over `frames`, the decoded frames by number.
SourceCheck judge_channel(const Sequence& sequence, const ChannelKind& kind,
                          const std::map<int, const ChannelFrame*>& frames) {
  const SequenceInfo& info = sequence.info();
  SourceCheck line;
  line.name = kind.name;
  line.unit = kind.unit;
  line.n_present = line.n_expected = 0;
  size_t pixels = 0, valid = 0;
  double min = std::numeric_limits<double>::infinity(), max = -min;
  std::vector<float> sample;
  std::vector<int> empty_frames, uniform_frames;
  for (const auto& [number, content] : frames) {
    const ChannelFrame& frame = *content;
    const bool expected = (kind.flag != &Channels::flow || number < info.last_frame) &&
                          (kind.flag != &Channels::backward_flow || number > info.first_frame);
    *line.n_expected += expected ? 1 : 0;
    if (!frame.error.empty()) set_fail(line, frame.error);
    if (!frame.present) {
      if (expected) set_fail(line, fmt::format("frame {}: missing", number));
      continue;
    }
    if (expected) ++*line.n_present;
    line.size_px = fmt::format("{}x{}", frame.width, frame.height);
    if (frame.width != info.width || frame.height != info.height) {
      set_fail(line, fmt::format("frame {}: is {} px, the source is {}x{} px", number, line.size_px,
                                 info.width, info.height));
    }
    if (expected && frame.n_valid == 0) empty_frames.push_back(number);
    if (kind.flag == &Channels::gray && frame.min == frame.max) uniform_frames.push_back(number);
    pixels += frame.n_pixels;
    valid += frame.n_valid;
    min = std::min(min, frame.min);
    max = std::max(max, frame.max);
    sample.insert(sample.end(), frame.sample.begin(), frame.sample.end());
  }
  if (pixels > 0) line.valid_share = static_cast<double>(valid) / static_cast<double>(pixels);
  if (valid > 0) {
    line.min = min;
    line.max = max;
    line.median = median(std::vector<double>(sample.begin(), sample.end()));
  }
  if (!uniform_frames.empty()) {
    set_fail(line, fmt::format("all pixels have the same value in frames {}: are their images missing?",
                               frame_list(uniform_frames)));
  }
  if (line.outcome != CheckOutcome::pass || pixels == 0) return line;
  if (valid == 0) {
    judge_empty_channel(sequence, kind, line);
  } else if (!empty_frames.empty() && kind.flag != &Channels::mask) {
    line.outcome = CheckOutcome::suspect;
    line.message = fmt::format("frames without a valid pixel: {}", frame_list(empty_frames));
  }
  return line;
}

SourceCheck check_poses(const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  SourceCheck line{.name = "poses", .n_present = 0, .n_expected = info.last_frame - info.first_frame + 1};
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    *line.n_present += sequence.truth().camera.has(frame) ? 1 : 0;
  }
  if (*line.n_present < *line.n_expected) {
    line.outcome = CheckOutcome::note;
    line.message = "frames without a true camera pose are not compared";
  }
  return line;
}

/// Counts the frames between the first and the last true pose of each object in which it has none.
int frames_without_object(const Sequence& sequence) {
  struct Track {
    int first = 0, last = 0, n = 0;
  };
  std::map<int, Track> tracks;
  for (const auto& [frame, objects] : sequence.truth().objects) {
    if (frame < sequence.info().first_frame || frame > sequence.info().last_frame) continue;
    for (const ObjectTruth& object : objects) {
      Track& track = tracks.try_emplace(object.id, Track{frame, frame, 0}).first->second;
      track.last = frame;
      ++track.n;
    }
  }
  int missing = 0;
  for (const auto& [id, track] : tracks) missing += track.last - track.first + 1 - track.n;
  return missing;
}

SourceCheck check_objects(const Sequence& sequence, const std::set<int>& mask_ids) {
  const SequenceInfo& info = sequence.info();
  std::set<int> tracks;
  int interpolated = 0;
  for (const auto& [frame, objects] : sequence.truth().objects) {
    if (frame < info.first_frame || frame > info.last_frame) continue;
    for (const ObjectTruth& object : objects) {
      tracks.insert(object.id);
      interpolated += object.interpolated ? 1 : 0;
    }
  }
  SourceCheck line{.name = "objects", .n_present = static_cast<int>(tracks.size())};
  const auto unseen =
      std::count_if(tracks.begin(), tracks.end(), [&](int id) { return !mask_ids.contains(id); });
  std::string message = fmt::format("{} true tracks", tracks.size());
  if (sequence.info().channels.mask) message += fmt::format(", {} of them in no mask", unseen);
  message += fmt::format("; {} interpolated poses", interpolated);
  if (const int n = frames_without_object(sequence); n > 0) {
    message += fmt::format("; {} {} missing within the tracks, where frame pairs then have no true motion", n,
                           n == 1 ? "pose is" : "poses are");
  }
  if (tracks.empty()) message = "no true object tracks: objects are not compared";
  if (tracks.empty()) line.outcome = CheckOutcome::note;
  if (!tracks.empty() && static_cast<size_t>(unseen) == tracks.size() && !mask_ids.empty()) {
    message += "; do mask ids and track ids agree?";
    line.outcome = CheckOutcome::suspect;
  }
  line.message = message;
  return line;
}

SourceCheck check_all_files(const Sequence& sequence) {
  SourceCheck line{.name = "files", .message = "every file that a run needs is there"};
  if (sequence.info().first_frame == sequence.info().last_frame)
    set_fail(line, "the source has a single frame: a run needs two or more successive frames");
  try {
    sequence.check_files();
  } catch (const Error& error) {
    set_fail(line, error.what());
  }
  return line;
}

SourceCheck note(const std::string& name, const std::string& message) {
  return {.name = name, .outcome = CheckOutcome::note, .message = message};
}

SourceCheck judge_convention(const Diagnosis& diagnosis) {
  const Finding& finding = diagnosis.finding;
  SourceCheck line = note(finding.check, finding.message);
  line.convention = true;
  line.outcome = diagnosis.outcome;
  line.cause = diagnosis.cause;
  if (!finding.checkable()) return line;
  line.value = finding.value;
  line.limit = finding.limit;
  line.n = finding.n;
  line.counted = finding.counted;
  line.unit = finding.unit;
  return line;
}

/// Depth and flow that are both ground truth agree at almost every pixel. Depth of another rendering of the
/// scene is nearly right at most pixels, which the median residual of the static flow does not show.
void judge_exact_flow(const ConventionData& data, SourceCheck& line) {
  constexpr double suspect_percent = 10, fail_percent = 50;
  const std::optional<DeviatingShare> share = deviating_share(data);
  if (!share) return;
  if (share->percent <= suspect_percent) return;
  line.outcome = share->percent > fail_percent ? CheckOutcome::fail : CheckOutcome::suspect;
  line.cause = "depth or flow is of another variation of the scene, or of another camera";
  line.message = fmt::format(
      "both are ground truth, but at {:.1f} % of {} points of the background they differ by more than 0.25 "
      "px",
      share->percent, share->n);
}

/// Adds notes on the accuracy of flow and depth that are not ground truth, if the data set has the truth.
void add_dense_errors(const Sequence& sequence, int jobs, std::vector<SourceCheck>& lines) {
  try {
    const DenseTruthErrors errors = dense_truth_errors(sequence, jobs);
    if (errors.flow) lines.push_back(note("flow vs truth", errors.flow_text()));
    if (errors.disparity) lines.push_back(note("disparity vs truth", errors.disparity_text()));
  } catch (const Error& error) {
    lines.push_back(note("dense truth", error.what()));
    lines.back().outcome = CheckOutcome::fail;
  }
}

/// Adds notes: the accuracy of the ground truth itself, and the adapter's warnings. Warnings of wrong true
/// poses are failures.
void add_notes(const Sequence& sequence, std::vector<SourceCheck>& lines) {
  if (const auto floor = sequence.truth().camera_step_floor_m) {
    lines.push_back(note("truth floor", fmt::format("the true camera steps scatter by {:.4f} m "
                                                    "(RMS): measured accuracies cannot be better than that",
                                                    *floor)));
  }
  const TruthFloor& floor = sequence.info().floor;
  if (floor.lateral_m) {
    lines.push_back(note(
        "lateral floor",
        fmt::format("the true camera steps deviate from the heading by {:.4f} m (RMS)", *floor.lateral_m)));
  }
  if (floor.rotation_timing_deg) {
    std::string text =
        fmt::format("the true rotations have errors of at least {:.4f} deg (RMS), from their timing alone",
                    *floor.rotation_timing_deg);
    if (floor.rotation_deg && floor.gyro_deg) {
      const Eigen::Vector3d& apart = *floor.gyro_deg;
      text += fmt::format(
          "; they differ from the turn rates by {:.4f} deg (RMS), mean absolute yaw {:.4f}, pitch {:.4f}, "
          "roll {:.4f} deg",
          *floor.rotation_deg, apart.z(), apart.y(), apart.x());
    }
    lines.push_back(note("rotation floor", text));
  }
  const std::vector<std::string>& faults = sequence.info().faults;
  for (const std::string& warning : sequence.info().all_warnings()) {
    const bool is_fault = std::ranges::find(faults, warning) != faults.end();
    lines.push_back(note(is_fault ? "truth" : "note", warning));
    if (is_fault) lines.back().outcome = CheckOutcome::fail;
  }
}

}  // namespace

std::vector<SourceCheck> check_source(const Sequence& sequence, const CheckSourceOptions& options) {
  const SequenceInfo& info = sequence.info();
  const int n = info.last_frame - info.first_frame + 1;
  std::vector<SourceCheck> lines = {check_all_files(sequence)};
  ConventionData data = make_convention_data(sequence);
  const std::vector<bool> sampled = sampled_frames(n);
  std::vector<int> looked_at;
  for (int i = 0; i < n; ++i) {
    if (!options.quick || sampled[static_cast<size_t>(i)]) looked_at.push_back(i);
  }
  std::vector<FrameContent> frames(static_cast<size_t>(n));
  Progress progress("frames", static_cast<int>(looked_at.size()), options.quiet);
  parallel_for(static_cast<int>(looked_at.size()), options.jobs, [&](int k) {
    check_interrupt();
    const int i = looked_at[static_cast<size_t>(k)];
    const auto at = static_cast<size_t>(i);
    frames[at] =
        read_frame(sequence, info.first_frame + i, data.step, sampled[at], options.quick, data.frames[at]);
    progress.advance();
  });
  std::set<int> mask_ids;
  for (const GridFrame& frame : data.frames) {
    for (const auto& [id, outline] : frame.outlines) mask_ids.insert(id);
  }
  for (size_t c = 0; c < channel_kinds.size(); ++c) {
    if (!is_decoded(sequence, channel_kinds[c], options.quick)) {
      if (channel_kinds[c].extra) continue;
      lines.push_back(note(channel_kinds[c].name, "the source has no such channel"));
      continue;
    }
    std::map<int, const ChannelFrame*> of_channel;
    for (const int i : looked_at) of_channel[info.first_frame + i] = &frames[static_cast<size_t>(i)][c];
    SourceCheck& line = lines.emplace_back(judge_channel(sequence, channel_kinds[c], of_channel));
    if (line.outcome != CheckOutcome::pass) continue;
    if (channel_kinds[c].flag == &Channels::gray) judge_repeated_images(data, line);
    if (channel_kinds[c].flag == &Channels::depth) judge_rounding(data, line);
    if (channel_kinds[c].flag == &Channels::flow) judge_empty_flow(data, line);
    if (channel_kinds[c].flag == &Channels::mask) judge_void_id(data, line);
  }
  lines.push_back(check_poses(sequence));
  lines.push_back(check_objects(sequence, mask_ids));
  for (const Diagnosis& diagnosis : diagnose(data, options.jobs)) {
    SourceCheck& line = lines.emplace_back(judge_convention(diagnosis));
    const bool is_exact = info.exact.depth && info.exact.flow;
    if (is_exact && line.name == "static flow" && line.outcome == CheckOutcome::pass)
      judge_exact_flow(data, line);
  }
  if (!options.quick) add_dense_errors(sequence, options.jobs, lines);
  add_notes(sequence, lines);
  return lines;
}

}  // namespace sextant
