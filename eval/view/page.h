#pragma once

// An interactive page of one run, or of two runs of the same source: the image with masks, points and flow,
// the paths from above, the errors over time, the worst frames. It is one self-contained HTML file; if its
// images make it larger than one_file_bytes, they are written to frames/ beside it.
//
// Data of the page, read by page/data.js, as JSON inside it:
//   {"schema":1, "source", "dataset", "sequence", "width", "height", "first", "last", "rate_hz",
//    "images": {"12": "data:image/jpeg;base64,.."} or {"12": "frames/000012.jpg"},
//    "outlines": {"12": {"3": [[x,y,x,y,..], ..]}},         // of masks, px
//    "boxes": {"12": {"3": [u,v, ..]}},   // true boxes: 8 projected corners, or left, top, right, bottom; px
//    "metrics": [{"map","key","symbol","unit","digits","definition"}],
//    "runs": [{"name", "estimator", "noise", "level", "seed", "version", "notes",
//              "records": {"12": {"ego": {..}}}, "pairs": {"12": {"ego": {"n", "points", "band",
//              "position"}}}, "tracks": {"ego": [[frame, x, z, x_true, z_true], ..]},
//              "axes": {"12": {"object:3": [u,v, ..]}}}]}  // estimated: origin and ends of x, y, z; px
// `points` are 9 little-endian int16 a point, base64: u, v in 1/8 px; measured, predicted and refined flow in
// 1/64 px; 1 = inlier. -32768: not known.

#include <span>

#include "sextant/eval/records/output.h"
#include "sextant/eval/view/viewed_run.h"

namespace sextant {

inline constexpr size_t one_file_bytes = 50'000'000;

struct PageOptions {
  int jpeg_quality = 85;
  int jobs = 1;
  bool quiet = false;
  size_t one_file_bytes = sextant::one_file_bytes;
};

/// Makes index.html, and frames/ if the page is too large. A second run must have the same frames; otherwise
/// throws Error that names both.
OutputFiles view_page(std::span<const ViewedRun> runs, const PageOptions& options);

/// Writes the page to the file `out` (FILE.html) or into the folder `out`; returns the file to open. Throws
/// Error if `out` is FILE.html and view_page() has put the images into files of their own, which need a
/// folder.
std::string write_view(const std::filesystem::path& out, const OutputFiles& files);

/// Request for a page of one run, or of two runs of the same source.
struct ViewRequest {
  /// Folders of `sextant run`, `sweep`, `merge` or `evaluate objects`
  std::vector<std::filesystem::path> folders;
  CaseChoice choice;
  /// SOURCE to which folders of logs belong; empty: that of a run in `folders`, or none
  std::string images;
  std::string data_root;
  std::string out;  ///< FILE.html, or a folder
  PageOptions page;
};
struct View {
  std::vector<ViewedRun> runs;
  std::string page;  ///< file to open
};
/// Calls view_run() or view_records(), view_page() and write_view(); locks a folder `out`.
View make_view(const ViewRequest& request);

}  // namespace sextant
