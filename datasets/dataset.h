#pragma once

// Where data come from. A SOURCE is "adapter:path[#sequence][@first-last]"; an adapter opens it as one
// Sequence. How to add a data set:
//   1. write datasets/<name>.h and .cc: its options, and open_<name>(SourceSpec), which declares where the
//      files of each channel are and reads camera and truth (folder_sequence.h). A kind of file that is new
//      gets its line in channels/channel_source.cc;
//   2. add one line to the table in registry.cc.
// adapter_test.cc then asks for a miniature of it, a line there, and runs over every file of every channel.

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
  std::string adapter;             ///< "vdo"
  std::string path;                ///< folder, or a scenario's name
  std::string sequence;            ///< after '#', may be empty
  std::optional<int> first, last;  ///< after '@', inclusive frame numbers
  Json options = Json::object();   ///< the adapter's own options (strict)

  /// Throws Error that shows the expected form.
  static SourceSpec parse(const std::string& text);
  /// Adds the options of `tree` that concern this adapter: those under the adapter's name ("kitti.flow"), and
  /// those under no adapter's name, which every source gets.
  void add_options(const Json& tree);
};

struct SequenceInfo {
  std::string dataset;   ///< adapter name, as in records
  std::string sequence;  ///< sequence name, as in records
  StereoCamera camera;
  double rate_hz = 0;
  int width = 0;
  int height = 0;
  int first_frame = 0;  ///< inclusive, after @first-last
  int last_frame = 0;
  Channels channels;                    ///< what read() can give; truth in text alone: none
  Channels exact;                       ///< those of them that are the truth of the data set itself
  std::string depth_kind;               ///< as in channels/channel_source.h ("cm"); empty: not from files
  std::map<int, double> times_s;        ///< time stamps of frames, where the data set has them
  std::vector<std::string> warnings;    ///< for the user, one line each
  std::vector<std::string> provenance;  ///< "flow: precomputed", "depth: disparity png", ...
};

class Sequence {
 public:
  virtual ~Sequence() = default;

  virtual const SequenceInfo& info() const = 0;
  /// Ground truth known without images (poses, object tracks); may be empty.
  virtual const SequenceTruth& truth() const = 0;
  /// Decodes the asked channels of one frame. Safe to call from several threads. The last frame of a
  /// source may lack flow (it has no successor): an empty image then. Throws Error on missing or bad files.
  virtual Frame read(int frame, Channels channels) const = 0;
  /// Dense true flow to the next frame, where the data set has it.
  virtual std::optional<Image<Flow>> true_flow(int /*frame*/) const { return std::nullopt; }
  /// Dense true depth (m), where the data set has it apart from what read() gives.
  virtual std::optional<Image<float>> true_depth(int /*frame*/) const { return std::nullopt; }
  /// Checks that every file a run over all frames needs is there, without decoding; throws on the first that
  /// is not.
  virtual void check_files() const = 0;

  /// All files read so far.
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

/// SourceSpec::parse(); a relative path that is not in the working folder is looked up in the data root.
SourceSpec find_source(const std::string& text, const std::string& data_root);

/// Parses SOURCE and opens it.
std::unique_ptr<Sequence> open_source(const SourceSpec& source);

// ---- which frames of a sequence a source covers: all that are there, without a gap, or @first-last

/// Sets info.first_frame and info.last_frame. Throws Error when `available` is empty, when the asked range
/// exceeds it, or when a frame in between is missing; `where` is the folder or scenario in messages.
void choose_frames(const SourceSpec& source, const std::set<int>& available, const std::string& where,
                   SequenceInfo& info);

/// Throws Error unless `frame` lies in the range.
void check_frame(const SequenceInfo& info, int frame, const std::string& where);

class Sequence;

/// Errors of the camera's true steps across the way and in rotation, where a data set allows to compute them,
/// RMS over the sequence (KITTI: kitti_truth.h). Along the way: SequenceTruth::camera_step_floor_m.
struct TruthFloor {
  std::optional<double> lateral_m;            ///< of the steps across the heading
  std::optional<double> rotation_deg;         ///< of the steps' rotations: not more than that
  std::optional<double> rotation_timing_deg;  ///< the same: not less than that
  std::optional<Eigen::Vector3d> gyro_deg;  ///< mean absolute difference to the turn rates: roll, pitch, yaw

  /// The fields that are known, under their metric keys (metrics/definitions.h).
  std::map<std::string, double> numbers() const;
};

/// A sequence that knows how accurate its truth is.
class KnowsTruthFloor {
 public:
  virtual const TruthFloor& floor() const = 0;

 protected:
  ~KnowsTruthFloor() = default;
};

/// Nothing of sequences that do not know it.
TruthFloor truth_floor(const Sequence& sequence);

}  // namespace sextant
