#pragma once

// A report as data, and its writers: report.md here, report.html and all files of a report folder in
// html/html.h. The same document gives the same bytes.
//
//   DIR/report.html, report.md
//   DIR/details.html                              if sections are details; report.md has all sections
//   DIR/tables/<name>.md .tex .csv .json
//   DIR/figures/<name>.svg .pdf .png .gp .csv     drawn by gnuplot
//   DIR/pictures/<name>.png                       overlays on images
//
// Names are used for files and for anchors of the page: letters, digits, '.', '-', '_', unique in the
// document.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/table.h"

namespace sextant {

// ---- Interactive paths, and curves along them, for report.html: pan, zoom, rotate, one cursor in the path
// and all curves, series switched on and off. The script is html/page/explorer.js; a reader without
// JavaScript sees the figures of the same section.

/// Approximate largest number of poses of all paths on one page. Callers thin longer paths, and state it in
/// Explorer::note.
inline constexpr size_t explored_poses = 60'000;

/// One path with the quantities along it. Lists are as long as `time`.
struct ExploredPath {
  std::string label;          ///< paths with the same label are switched on and off together
  bool is_reference = false;  ///< drawn grey if `colour` is 0, otherwise dashed
  int colour = 0;             ///< 0: grey; k: the k-th line colour
  int dash = 0;               ///< 0: a solid line; k: the k-th pattern of dashes and dots; not of references
  std::vector<double> time;   ///< ascending
  std::vector<int> frame;
  std::vector<Eigen::Vector3d> position_m;  ///< may be empty; NaN: unknown
  std::vector<bool> begins;                 ///< true if a line begins at this pose
  /// One list for each of Explorer::curves, with NaN for unknown values; an empty list if none is known.
  std::vector<std::vector<double>> values;
};

struct Explorer {
  std::string name;        ///< anchor of the page
  std::string time_title;  ///< "time [s]"
  /// Indices of the axes to the right, upwards and towards the reader; the last one may be the negative axis.
  std::array<int, 3> axes = {0, 2, 1};
  std::vector<std::string>
      curves;          ///< titles with units; the first one also colours the paths; the page appends x, y, z
  std::string note{};  ///< shown below the paths
  std::vector<ExploredPath> paths;  ///< drawn in this order
};

/// One line of the summary.
struct VerdictLine {
  std::string subject;   ///< the judged statement or table
  std::string verdict;   ///< in words: "reproduced", "outside", "not measured here"
  std::string evidence;  ///< one line
  std::string link;      ///< "#<name>" of a section or table, a path in the report folder, or empty
  std::string group{};   ///< heading of the group of lines that this one belongs to; empty: none
};

/// Appearance of a verdict. It follows from the words, so that a table and the summary cannot differ.
enum class Tone { agrees, differs, open };
/// "reproduced", "within", "passed", "ok", "improved": agrees. "not reproduced", "outside", "failed",
/// "regressed", "invalid": differs. All others: open.
Tone tone_of(const std::string& verdict);
/// Counts texts in order of first appearance: "12 reproduced, 3 not reproduced, 1 undecided".
std::string count_words(const std::vector<std::string>& words);
std::string count_verdicts(const std::vector<VerdictLine>& verdicts);
/// Joins several verdicts. Returns their common word if all are equal, otherwise "partly"; "not measured
/// here" if there are none.
std::string joint_verdict(const std::vector<std::string>& verdicts);

/// A table with the name of its files.
struct NamedTable {
  std::string name;
  Table table;
  /// Keys of columns. On pages a new table begins at each change of their values (for_each_part()); if the
  /// columns are marked `fold`, each table states the values once. Files contain the whole table.
  std::vector<std::string> split_by{};
  /// Keys of the most important columns, which fit a terminal and a page; the others are shown on request.
  /// Empty: all columns are shown.
  std::vector<std::string> first{};
  bool only_on_request = false;  ///< too long for a terminal: shown there on request only
};

/// Name of the anchor of the part with index `i`, if split_by is not empty.
std::string part_anchor(const std::string& table, size_t i);

/// A picture that is not drawn by gnuplot.
struct Picture {
  std::string name;
  std::string caption;
  std::string alt;     ///< description for readers who cannot see it
  std::string png;     ///< PNG file; JPEG as well on self-contained pages
  std::string link{};  ///< address that the picture links to
  bool small = false;  ///< placed beside other pictures
  std::string jpeg{};  ///< smaller JPEG for the page; empty: the page embeds `png`
};

/// Markup made by the program; all text in it is escaped.
struct Fragment {
  std::string html, markdown;
  std::string style, script;  ///< style and script of the page
};

/// A section of the report.
struct ReportSection {
  std::string name;
  std::string heading;
  std::vector<std::string> paragraphs;
  std::vector<NamedTable> tables;
  std::vector<Figure> figures;
  std::vector<Picture> pictures;
  std::vector<std::string> commands{};  ///< shell commands, one line each; below the paragraphs
  std::vector<Explorer> explorers{};    ///< above pictures and figures; in report.html only
  bool is_detail = false;               ///< placed on details.html instead of report.html
};

/// A whole report.
struct ReportDocument {
  std::string title;
  std::string abstract;                 ///< one paragraph
  std::vector<std::string> warnings{};  ///< about the data; commands print them, and the abstract has them
  Fragment lead{};                      ///< between the abstract and the summary
  std::vector<VerdictLine> verdicts;
  std::vector<ReportSection> sections;
  std::string details_abstract{};  ///< one paragraph for details.html
  std::vector<std::pair<std::string, std::string>> provenance;
  std::string citation;  ///< BibTeX; see citation()
};

/// BibTeX of the reproduced paper and of this program.
std::string citation();

std::string to_markdown(const ReportDocument& document);

/// Returns all figures: those of the summary, then those of the sections.
std::vector<Figure> figures_of(const ReportDocument& document);

/// Formats a text as one word of a shell command; it is quoted if necessary.
std::string shell_word(const std::string& text);

/// Throws InternalError if two parts have the same name, or if a name cannot be a file name.
void check_names(const ReportDocument& document);

}  // namespace sextant
