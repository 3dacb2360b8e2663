#pragma once

// Data sources. A SOURCE is "adapter:path[#sequence][@first-last]"; an adapter opens it as a Sequence. To add
// a data set:
//
//   1. write datasets/<name>.h and .cc: its options, and open_<name>(SourceSpec), which declares the files
//      of each channel and reads camera and truth (folder_sequence.h). A new kind of file gets a line in
//      channels/channel_source.cc;
//   2. add one line to the table in registry.cc.
//
// adapter_test.cc then requires a miniature of the data set, which a layout of the same name (layout.h) or a
// branch of its make_miniature() writes, and tests every file of every channel.

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "sextant/base/files.h"
#include "sextant/base/options.h"
#include "sextant/geometry/camera.h"
#include "sextant/measurement/frame.h"
#include "sextant/truth/truth.h"

namespace sextant {

/// A parsed SOURCE.
struct SourceSpec {
  std::string text;                ///< as given
  std::string adapter;             ///< such as "vdo"
  std::string path;                ///< folder, or the name of a scenario
  std::string sequence;            ///< text after '#'; may be empty
  std::optional<int> first, last;  ///< frame numbers after '@', inclusive
  Json options = Json::object();   ///< options of the adapter (strict)

  /// Parses a SOURCE. Throws Error that shows the expected form if the text does not have it.
  static SourceSpec parse(const std::string& text);
  /// Adds the options of `tree` that concern this adapter: those below the adapter's name ("kitti.flow"), and
  /// those that are not below any adapter's name, which apply to every source.
  void add_options(const Json& tree);
  /// Returns the name of the group of these options in messages, "source.kitti", which is also their key.
  std::string option_group() const { return "source." + adapter; }
};

/// Returns the options of a source. Throws Error like read_options().
template <internal::OptionStruct Options>
Options options_of(const SourceSpec& source) {
  Options options;
  read_options(source.options, options, source.option_group());
  return options;
}

/// Errors of the ground truth's own camera steps, RMS over the sequence, lateral and in rotation, if a data
/// set allows to compute them (KITTI: kitti_oxts.h). The longitudinal error is
/// SequenceTruth::camera_step_floor_m.
struct TruthFloor {
  std::optional<double> lateral_m;            ///< error of the steps perpendicular to the heading
  std::optional<double> rotation_deg;         ///< error of the rotations, upper bound
  std::optional<double> rotation_timing_deg;  ///< error of the rotations, lower bound
  /// rotation of a step minus turn rate times duration, mean absolute value: roll, pitch, yaw
  std::optional<Eigen::Vector3d> gyro_deg;

  /// Returns the known fields, except gyro_deg, under their metric keys (metrics/definitions.h).
  std::map<std::string, double> numbers() const;
};

struct SequenceInfo {
  std::string dataset;   ///< name of the adapter, as in records
  std::string sequence;  ///< name of the sequence, as in records
  StereoCamera camera;
  double rate_hz = 0;
  int width = 0;
  int height = 0;
  int first_frame = 0;  ///< first and last frame, inclusive, with @first-last applied
  int last_frame = 0;
  Channels channels;  ///< channels that read() can return; none for text-only truth
  Channels exact;     ///< channels of read() that are ground truth (of files: depth and flow only)
  /// choice in channels/channel_source.h by which depth is read or computed ("cm", "sgbm"); empty: rendered,
  /// or no depth
  std::string depth_kind;
  std::map<int, double> times_s;        ///< time stamps of frames, if the data set has them
  std::vector<std::string> warnings;    ///< messages for the user, one line each
  std::vector<std::string> missing;     ///< warnings of absent images and channels, one line each
  std::vector<std::string> provenance;  ///< "flow: precomputed", "depth: disparity png", ...
  TruthFloor floor;                     ///< accuracy of the true camera poses; empty if unknown
  std::vector<std::string> faults;      ///< the warnings that say that the true camera poses are wrong

  std::vector<std::string> all_warnings() const {
    std::vector<std::string> all = warnings;
    all.insert(all.end(), missing.begin(), missing.end());
    return all;
  }
};

class Sequence {
 public:
  virtual ~Sequence() = default;

  virtual const SequenceInfo& info() const = 0;
  /// Returns the ground truth that is available without images (poses, object tracks); may be empty.
  virtual const SequenceTruth& truth() const = 0;
  /// Decodes the requested channels of one frame; channels that the source does not have are empty. Safe to
  /// call from several threads. Flow may be empty in the last frame of a source, which has no successor, and
  /// backward flow in the first. Throws Error on a frame outside the source, and on missing or damaged files.
  virtual Frame read(int frame, Channels channels) const = 0;
  /// Returns the dense true flow to the next frame, if the data set has it.
  virtual std::optional<Image<Flow>> true_flow(int /*frame*/) const { return std::nullopt; }
  /// Returns the dense true depth (m), if the data set has it in files; read() may return the same depth.
  /// Rendered sequences return nullopt, because their depth of read() is exact.
  virtual std::optional<Image<float>> true_depth(int /*frame*/) const { return std::nullopt; }
  /// Checks that every file needed for a run over all frames exists, without decoding; throws Error on the
  /// first missing file.
  virtual void check_files() const = 0;

  /// Log of all files read so far.
  InputLog& inputs() const { return inputs_; }

 private:
  mutable InputLog inputs_;
};

struct Adapter {
  std::string name;
  std::string description;  ///< one line for `sextant data list`
  std::string example;      ///< an example SOURCE
  std::function<std::unique_ptr<Sequence>(const SourceSpec&)> open;
  std::function<std::vector<OptionHelp>()> options;
};

std::span<const Adapter> adapters();

/// Parses a SOURCE like SourceSpec::parse(); a relative path that does not exist in the working folder is
/// looked up in the data root.
SourceSpec find_source(const std::string& text, const std::string& data_root);

/// Opens a parsed SOURCE. Throws Error with the nearest name if there is no such adapter, and the errors of
/// Adapter::open.
std::unique_ptr<Sequence> open_source(const SourceSpec& source);

// Frame range of a source: all available frames, which must be consecutive, or @first-last.

/// Sets info.first_frame and info.last_frame. Throws Error if `available` is empty, if the requested range
/// exceeds it, or if a frame in between is missing; `where` is the folder or scenario in messages.
void choose_frames(const SourceSpec& source, const std::set<int>& available, const std::string& where,
                   SequenceInfo& info);

/// Throws Error unless `frame` lies in info.first_frame..info.last_frame; `where` as above.
void check_frame(const SequenceInfo& info, int frame, const std::string& where);

}  // namespace sextant
