#pragma once

// Configuration of an external program as an estimator: the file CONFIG of "external:CONFIG.json"
// (docs/external-estimators.md). JSON, read strictly; an example is eval/external/example/rgbd_odometry.json.
// Texts may contain placeholders:
//
//   {input}        folder with the files of the sequence: the layout's root
//   {output}       empty folder for the results
//   {config}       folder of CONFIG
//   {sequence}     name of the sequence in the layout ("0018", "0018/clone"; vdo: that of the source)
//   {first} {last} frame numbers in the files; {n}: number of frames
//   {calibration}  OpenCV YAML with Camera.fx, fy, cx, cy, bf, fps, width and height
//   {settings}     the filled-in copy of the template `settings`
//   {fx} {fy} {cx} {cy} {bf} {rate} {width} {height}     px, px m, Hz
//   {seed}         seed of the case
//
// Braces around anything but lower-case letters are plain text. `command` and `environment` are split into
// words at blanks; '...' and "..." keep blanks together. No shell is involved, so placeholders may contain
// blanks.

#include <map>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/eval/logs/object_logs.h"

namespace sextant {

/// Trajectory of the camera written by the program.
struct ExternalCamera {
  SEXTANT_OPTIONS((std::string, file, "camera.txt", "",
                   "in {output}; a * stands for any text, one file must match"),
                  (std::string, format, "auto", "",
                   "auto, tum, kitti, euroc, vdo, dynosam or vdo_xml (docs/evaluate.md)"),
                  (bool, inverse, false, "", "the file holds T_camera_world instead of T_world_camera"))
  void check() const;
};

/// Format of object motions: a file of motions or of poses per object, or the logs of a system.
enum class ObjectsFormat { none, motions, poses, dynosam, vdo };
constexpr Names<5> names_of(ObjectsFormat) { return {"none", "motions", "poses", "dynosam", "vdo"}; }
/// Frame of motions: H, T_curr_prev, inverse(L) H L (geometry/object_motion.h).
enum class ObjectsFrame { world, camera, body };
constexpr Names<3> names_of(ObjectsFrame) { return {"world", "camera", "body"}; }
/// Object ids of the program: equal to those of the masks, or matched by agreement with true motions.
enum class ObjectsIds { masks, overlap };
constexpr Names<2> names_of(ObjectsIds) { return {"masks", "overlap"}; }

/// Object motions written by the program.
struct ExternalObjects {
  SEXTANT_OPTIONS(
      (ObjectsFormat, format, ObjectsFormat::none, "",
       "none; motions or poses: a file per object; dynosam or vdo: their logs, found by name in {output}"),
      (std::string, files, "obj_*.txt", "",
       "motions and poses: names in {output}, * stands for the id; any trajectory format"),
      (ObjectsFrame, frame, ObjectsFrame::world, "",
       "motions: world (H), camera (T_curr_prev) or body (inverse(L) H L)"),
      (int, id_offset, 0, "", "added to the program's ids to get those of the masks"),
      (ObjectsIds, ids, ObjectsIds::masks, "",
       "masks: the program's ids are those of the masks; overlap: found by agreement with true motions"),
      (LogStage, stage, LogStage::any, "",
       "vdo: initial (obj_mot_*) or refined (obj_mot_*_rf_*) where both exist; any: the one that exists"))
  void check() const;
};

/// Results that are read from one run of the program.
struct ExternalResultSet {
  SEXTANT_OPTIONS((ExternalCamera, camera, {}, "", "its trajectory of the camera"),
                  (ExternalObjects, objects, {}, "", "its motions of objects"))
};

enum class TimeUnit { ms, s };
constexpr Names<2> names_of(TimeUnit) { return {"ms", "s"}; }

/// Durations of the frames, written by the program.
struct ExternalTimes {
  SEXTANT_OPTIONS((std::string, file, {}, "",
                   "in {output}: a line per frame, its time, or frame number and time; empty: none"),
                  (TimeUnit, unit, TimeUnit::ms, "", "of these times"))
};

/// Patterns of file names: * and ? stand for any text and any character of a name, ** for any number of
/// folders.
struct FilePatterns : std::vector<std::string> {
  using std::vector<std::string>::vector;
};
/// Reads a list of texts, with the contract of read_value() in base/json.h.
const char* read_value(const Json& value, FilePatterns& field);

enum class LastFlow { none, zero };
constexpr Names<2> names_of(LastFlow) { return {"none", "zero"}; }
/// Files of a case that are kept: its logs; logs and output; or logs, output and input.
enum class Keep { logs, output, all };
constexpr Names<3> names_of(Keep) { return {"logs", "output", "all"}; }

struct ExternalConfig {
  std::string name;
  std::string command;
  std::string working_directory = "{config}";
  std::string environment;
  double time_limit_s = 600;
  std::string settings;
  std::string layout = "vdo";
  bool write_truth = false;
  bool renumber = false;
  LastFlow last_flow = LastFlow::none;
  int first_frame = -1;
  Keep keep = Keep::output;
  ExternalResultSet set;  ///< used unless `results` is given
  std::map<std::string, ExternalResultSet> results;
  ExternalTimes times;
  FilePatterns depends = {"**"};

  template <typename V>
  void visit(V& v) {
    v("name", name, "", "name in records; empty: that of the file CONFIG");
    v("command", command, "", "program and arguments, with placeholders; relative to working_directory");
    v("working_directory", working_directory, "", "folder in which the program runs");
    v("environment", environment, "", "variables added to this program's: A=1 B='two words'");
    v("time_limit_s", time_limit_s, "s",
      "limit for one sequence; at the limit the program and all processes that it started are killed");
    v("settings", settings, "",
      "template of a settings file, relative to CONFIG; its copy {settings} has the placeholders filled in");
    v("layout", layout, "", "of the input: vdo, kitti, vkitti1 or vkitti2");
    v("write_truth", write_truth, "",
      "true: the input also contains the ground truth, for programs that require it");
    v("renumber", renumber, "", "true: the first frame of the input is 0, whatever the source calls it");
    v("last_flow", last_flow, "", "flow file of the last frame, which has no next one");
    v("first_frame", first_frame, "",
      "the program's number of the first frame in its results; -1 = as in the files");
    v("keep", keep, "", "of each case; output = and logs, all = and input");
    set.visit(v);
    v("results", results, "",
      "several results of one run, by name, instead of camera and objects; records call them NAME.RESULT");
    v("times", times, "", "its own time per frame");
    v("depends", depends, "",
      "files that determine the results, relative to CONFIG: if they change, finished cases are run again; "
      "[\"**\"]: files in the folder of CONFIG and below (program_fingerprint.h)");
  }
  void check() const;
};

/// Key of overrides: if it is present, they are all the options of an earlier run, and CONFIG is not read.
inline constexpr const char* recorded_options = "recorded";

/// Reads CONFIG and applies `overrides` (same keys). Throws Error "PATH: ..." if the file cannot be read, or
/// if an option is unknown or invalid.
ExternalConfig read_external_config(const std::string& path, const Json& overrides = Json::object());

using Placeholders = std::map<std::string, std::string>;

/// Returns dummy values of all placeholders, with which a text can be checked.
const Placeholders& any_placeholders();

/// Replaces every {name} of lower-case letters and _; other braces are plain text. Throws Error on an unknown
/// name.
std::string fill_in(const std::string& text, const Placeholders& values);

/// Returns the words of `text` with placeholders replaced. Throws Error on an unclosed quote or an unknown
/// name.
std::vector<std::string> words_of(const std::string& text, const Placeholders& values);

}  // namespace sextant
