#include "sextant/eval/experiment/check_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/parallel_for.h"
#include "sextant/base/progress.h"
#include "sextant/eval/experiment/diagnosis.h"
#include "sextant/eval/experiment/interrupt.h"

namespace sextant {
namespace {

constexpr size_t sample_step = 16;

/// What one frame's channel holds.
struct ChannelFrame {
  bool present = false;
  int width = 0;
  int height = 0;
  size_t n_pixels = 0;
  size_t n_valid = 0;
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  std::vector<float> sample;
  std::set<int> ids;  ///< masks only
  std::string error;
};

/// A channel: how to ask for it and how to read a pixel of it (NaN = invalid).
struct ChannelKind {
  const char* name;
  const char* unit;
  bool Channels::*flag;
};
constexpr std::array<ChannelKind, 4> channel_kinds = {{{"gray", "level", &Channels::gray},
                                                       {"depth", "m", &Channels::depth},
                                                       {"flow", "px", &Channels::flow},
                                                       {"mask", "id", &Channels::mask}}};

template <typename T, typename Value>
void measure(const Image<T>& image, Value value, ChannelFrame& out) {
  out.present = !image.empty();
  out.width = image.width();
  out.height = image.height();
  out.n_pixels = image.size();
  for (size_t i = 0; i < image.size(); ++i) {
    const double v = value(image.data()[i]);
    if (!std::isfinite(v)) continue;
    out.min = std::min(out.min, v);
    out.max = std::max(out.max, v);
    if (out.n_valid++ % sample_step == 0) out.sample.push_back(static_cast<float>(v));
  }
}

/// What one frame's channel holds; its samples go to `grid`.
ChannelFrame read_channel(const Sequence& sequence, int frame, const ChannelKind& kind, int step,
                          GridFrame& grid) {
  ChannelFrame out;
  try {
    Channels channels;
    channels.*kind.flag = true;
    const Frame data = sequence.read(frame, channels);
    if (channels.gray)
      measure(
          data.gray, [](uint8_t g) { return static_cast<double>(g); }, out);
    if (channels.depth)
      measure(
          data.depth_m, [](float d) { return static_cast<double>(d); }, out);
    if (channels.flow)
      measure(
          data.flow, [](const Flow& f) { return std::hypot(double{f.u}, double{f.v}); }, out);
    if (channels.mask) {
      measure(
          data.mask, [](uint16_t id) { return id == 0 ? NAN : static_cast<double>(id); }, out);
      grid.mask = sample_grid(data.mask, step);
      grid.extents = mask_outlines(data.mask);
      for (const auto& [id, extent] : grid.extents) out.ids.insert(id);
    }
    if (channels.depth) grid.depth_m = sample_grid(data.depth_m, step);
    if (channels.flow) grid.flow = sample_grid(data.flow, step);
  } catch (const Error& error) {
    out.error = error.what();
  }
  return out;
}

double median_of(const std::vector<float>& values) { return median({values.begin(), values.end()}); }

void set_fail(SourceCheck& line, const std::string& message) {
  if (line.outcome != CheckOutcome::fail) line.message = message;
  line.outcome = CheckOutcome::fail;
}

SourceCheck judge_channel(const ChannelKind& kind, const SequenceInfo& info,
                          const std::vector<ChannelFrame>& frames) {
  SourceCheck line;
  line.name = kind.name;
  line.unit = kind.unit;
  const bool successor_needed = std::string_view(kind.name) == "flow";
  const auto n = static_cast<int>(frames.size());
  line.n_expected = successor_needed ? n - 1 : n;
  line.n_present = 0;
  size_t pixels = 0, valid = 0;
  double min = std::numeric_limits<double>::infinity(), max = -min;
  std::vector<float> sample;
  for (int i = 0; i < n; ++i) {
    const ChannelFrame& frame = frames[static_cast<size_t>(i)];
    if (!frame.error.empty()) set_fail(line, frame.error);
    if (!frame.present) {
      if (i < *line.n_expected) set_fail(line, fmt::format("frame {}: has none", info.first_frame + i));
      continue;
    }
    if (i < *line.n_expected) ++*line.n_present;
    line.size_px = fmt::format("{}x{}", frame.width, frame.height);
    if (frame.width != info.width || frame.height != info.height) {
      set_fail(line, fmt::format("frame {}: is {} px, the source is {}x{} px", info.first_frame + i,
                                 line.size_px, info.width, info.height));
    }
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
    line.median = median_of(sample);
  }
  if (line.outcome == CheckOutcome::pass && pixels > 0 && valid == 0) {
    line.outcome = CheckOutcome::suspect;
    line.message = "no valid pixel in any frame";
  }
  return line;
}

SourceCheck check_poses(const Sequence& sequence) {
  const SequenceInfo& info = sequence.info();
  SourceCheck line;
  line.name = "poses";
  line.n_expected = info.last_frame - info.first_frame + 1;
  line.n_present = 0;
  for (int frame = info.first_frame; frame <= info.last_frame; ++frame) {
    *line.n_present += sequence.truth().camera.has(frame) ? 1 : 0;
  }
  if (*line.n_present < *line.n_expected) {
    line.outcome = CheckOutcome::note;
    line.message = "frames without a true camera pose are not compared";
  }
  return line;
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
  SourceCheck line;
  line.name = "objects";
  line.n_present = static_cast<int>(tracks.size());
  const auto unseen =
      std::count_if(tracks.begin(), tracks.end(), [&](int id) { return !mask_ids.contains(id); });
  std::string message = fmt::format("{} true tracks", tracks.size());
  if (sequence.info().channels.mask) message += fmt::format(", {} of them in no mask", unseen);
  message += fmt::format("; {} interpolated poses", interpolated);
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
  SourceCheck line;
  line.name = "files";
  line.message = "every file that a run needs is there";
  try {
    sequence.check_files();
  } catch (const Error& error) {
    line.outcome = CheckOutcome::fail;
    line.message = error.what();
  }
  return line;
}

SourceCheck note(const std::string& name, const std::string& message) {
  SourceCheck line;
  line.name = name;
  line.outcome = CheckOutcome::note;
  line.message = message;
  return line;
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

/// What to know beside the checks: the truth's own accuracy, and what the adapter warns of.
void add_notes(const Sequence& sequence, std::vector<SourceCheck>& lines) {
  if (const auto floor = sequence.truth().camera_step_floor_m) {
    lines.push_back(note("truth floor", fmt::format("the true camera steps scatter by {:.4f} m (RMS): no "
                                                    "estimator can be measured to be better",
                                                    *floor)));
  }
  for (const std::string& warning : sequence.info().warnings) lines.push_back(note("note", warning));
}

}  // namespace

std::vector<SourceCheck> check_source(const Sequence& sequence, int jobs, bool quiet) {
  const SequenceInfo& info = sequence.info();
  const int n = info.last_frame - info.first_frame + 1;
  std::vector<SourceCheck> lines = {check_all_files(sequence)};
  ConventionData data = make_convention_data(sequence);
  std::set<int> mask_ids;
  Progress progress("frames", n * static_cast<int>(channel_kinds.size()), quiet);
  for (const ChannelKind& kind : channel_kinds) {
    if (!(info.channels.*kind.flag)) {
      lines.push_back(note(kind.name, "the source has no such channel"));
      continue;
    }
    std::vector<ChannelFrame> frames(static_cast<size_t>(n));
    parallel_for(n, jobs, [&](int i) {
      check_interrupt();
      const auto at = static_cast<size_t>(i);
      frames[at] = read_channel(sequence, info.first_frame + i, kind, data.step, data.frames[at]);
      progress.advance();
    });
    for (const ChannelFrame& frame : frames) mask_ids.insert(frame.ids.begin(), frame.ids.end());
    lines.push_back(judge_channel(kind, info, frames));
  }
  lines.push_back(check_poses(sequence));
  lines.push_back(check_objects(sequence, mask_ids));
  for (const Diagnosis& diagnosis : diagnose(data, jobs)) lines.push_back(judge_convention(diagnosis));
  add_notes(sequence, lines);
  return lines;
}

}  // namespace sextant
