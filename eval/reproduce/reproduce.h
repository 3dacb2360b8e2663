#pragma once

// Repeats the paper's experiments as far as the data allow. The folder DIR of a reproduction contains
//
//   parts/<name>/      one experiment (sweep, run or evaluation) each, complete or resumable
//   data.json          which experiments could run with this data, and which data the others need
//   report/            tables, claims, figures and report.html, made only from the two above
//
// An experiment is run again if its plan, its inputs or the program have changed.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/records/output.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/paper/paper_layout.h"
#include "sextant/eval/report/tables/paper_table.h"

namespace sextant {

// ---- Experiments (parts.cc), each in a folder below DIR/parts that is complete or can be resumed. How to
// add one: a plan in eval/plans/reproduce/ and one line in the table of parts.cc.

/// One experiment. What is run follows from its fields:
///   `beside` given          errors of published systems, measured once and stored in results/systems
///   role recorded           recorded trajectories of other systems against the truth
///   role recorded_objects   recorded object logs of other systems against the truth
///   role timing             run times: one thread, decoded sources, no correspondence cache
///   role showcase           a run with paths, and the picture of its last frame pair
///   otherwise               a sweep from correspondence caches
struct Part {
  std::string name;
  PartRole role = PartRole::sets;
  std::string title;
  std::string needs;     ///< folder below the data root that it needs; empty: the data come with the program
  std::string fetch;     ///< command that obtains these data
  std::string plan;      ///< JSON; empty for recorded and stored experiments
  std::string beside{};  ///< earlier experiment whose records have the truth of the same frames

  bool is_stored() const { return !beside.empty(); }
};

/// Returns the experiments in the order in which they run: first those on the embedded scenarios, and each
/// stored experiment after the one that it needs (`beside`). The text files of Virtual KITTI are read from
/// ROOT/vkitti_1.3.1_text or, if this folder does not exist, from ROOT/vkitti_1.3.1.
std::vector<Part> reproduction_parts(const std::string& data_root);

/// Explains why an experiment cannot run with this data; empty if it can.
std::string what_is_missing(const Part& part, const std::string& data_root);

// ---- Published systems, measured once with the external protocol (docs/external-estimators.md) and stored.
// results/systems/PART/records.jsonl contains their errors, and run.json the program and the machine that
// measured them. These files come with the program.
//
// The stored records have no truth values, because the truth of real data may not be redistributed. The true
// values are taken from the records of the experiment that was measured here on the same frames.

/// Returns records.jsonl and run.json of a stored experiment. Records of frames and bodies that `beside` does
/// not have are left out. Throws Error if the experiment does not exist, or if `beside` has no records.jsonl.
OutputFiles stored_files(const std::string& part, const std::filesystem::path& beside);

// ---- Recorded camera trajectories of other systems on KITTI tracking (recorded_systems.cc), converted to
// records: the paper's pose change error against the truth for each frame pair.
//
//   ROOT/kitti_tracking                                     truth (text is enough)
//   ROOT/kitti_tracking_peers/orbslam3_camera/0003.txt      KITTI format
//   ROOT/kitti_tracking_peers/vdo_slam_frontend/0000.xml    VDO-SLAM's log
//
//   errors.Et_m, ER_deg        against the raw truth
//   errors.Et_corrected_m      against the truth with velocity-corrected step lengths
//   errors.Et_scaled_m         raw truth, the estimate scaled to the truth's size (Umeyama, scale only)
//   values.step_gt_m, step_floor_m, and other floors of the truth

/// A system with recorded camera trajectories.
struct RecordedSystem {
  const char* name;
  /// Below ROOT/kitti_tracking_peers; also the prefix of its trajectories in the results
  const char* folder;
  const char* extension;
  const char* format;  ///< format name for read_trajectory()
};
std::span<const RecordedSystem> recorded_systems();

/// Returns the paper's sequences whose truth is publicly available as text: "0000" to "0006", "0018", "0020".
const std::vector<std::string>& recorded_sequences();

/// Returns the files that evaluate_recorded() would read, as path -> SHA-256. Throws Error if there is no
/// trajectory.
Json recorded_inputs(const std::string& data_root);
/// Returns records.jsonl, run.json, and for each system and sequence
/// <system>_<sequence>_{reference,estimate}.tum.
OutputFiles evaluate_recorded(const std::string& data_root);

// ---- Recorded object motions: DynOSAM's logs of a sequence of KITTI tracking, in ROOT/dynosam_kitti_0000.
// The truth comes from the data set; the errors are computed as by `sextant evaluate objects`.

/// Returns the files that evaluate_recorded_objects() would read, as path -> SHA-256.
Json recorded_object_inputs(const std::string& data_root);
/// Returns records.jsonl and run.json. The estimators are called "DynOSAM front end" and "DynOSAM back end".
OutputFiles evaluate_recorded_objects(const std::string& data_root);

// ---- The reproduction

/// Configuration of a reproduction.
struct ReproduceConfig {
  std::string data_root;  ///< empty: embedded scenarios only
  std::filesystem::path out;
  PackCache cache{default_cache_folder()};
  std::vector<Part> parts;  ///< reproduction_parts(data_root)
  int jobs = 1;
  bool quiet = false;
};

/// Writes data.json, removes earlier results of experiments whose data are missing now, and runs the
/// experiments that are unfinished or outdated. Throws Error on bad data and Interrupted on Ctrl-C, after
/// which the same call resumes.
void run_parts(const ReproduceConfig& config);

/// The report of a reproduction.
struct ReproductionReport {
  ReportDocument document;
  std::vector<PaperLayout> tables;     ///< tables in the layout of the paper
  std::vector<PrintedFigure> figures;  ///< figures of paper.html; all are in the document
};
/// Makes the report of the finished experiments in config.out. Throws Error if none is finished, or if
/// data.json is missing or damaged.
ReproductionReport reproduction_report(const ReproduceConfig& config);

// ---- The answer in at most 120 words: which claims hold, which do not and why, what was not measured, and
// which command would measure it.

std::string answer_paragraph(const std::vector<CheckedClaim>& checked,
                             const std::vector<PaperLayout>& tables);

// ---- Figures of the reproduction (figures.cc), as sections of its document. An experiment
// that was not measured has no section.

/// A section, and the place in the paper that it belongs to.
struct PlacedSection {
  PaperPlace place = PaperPlace::ours;
  ReportSection section;
};

/// Makes the sections with figures. `parts` is DIR/parts. Records come from `evidence`; paths and pictures
/// from the files of the experiments:
///   recorded/<system>_<sequence>_{estimate,reference}.tum    fig. 6
///   <showcase>/{overlay.png,tracks.csv}                      fig. 1
std::vector<PlacedSection> figure_sections(const std::filesystem::path& parts, const Evidence& evidence,
                                           int jobs);

// ---- Answer: the measured values of one table of the paper as a picture, with a line for every published
// value on the common axis measured / published.
//
//   at 1        the published value
//   broad bar   range of 95 % of our single runs;  thin bar: 95 % interval of our mean;  point: the mean
//   filled      our procedure;  open: the procedure of the published code, if the table has it
//   word        verdict of the table on that row
//
// If a value was measured on several kinds of data, the last one in the table is drawn, which is nearest to
// the paper's; with several noises, the first. Values of 0 cannot be drawn on the logarithmic axis, which
// ends at 0.02 and 50 at most: an arrow stands for a value beyond it. The first 26 lines are drawn; the
// caption states how many there are.

/// Returns nullopt if there is no line: no published value above 0 was measured by one of the two procedures.
std::optional<Figure> answer_figure(const std::string& name, const PublishedTable& table);

/// Formats "the published value lies within our single runs in 12 of 40 comparisons; 2 not comparable; 3 not
/// measured here" from the verdicts on published values.
std::string answer_text(const std::vector<std::string>& verdicts);

}  // namespace sextant
