#pragma once

// report.html: the whole document as one page that needs nothing else. Figures (SVG) and pictures (PNG) lie
// inside as data URIs, in which the ids of gnuplot's SVGs cannot clash; a content policy in the page forbids
// any request. Tables sort by a click on a heading; sections with paths have them to walk through
// (explorer_html.h). Prints on A4.

#include <string>

#include "sextant/eval/report/document.h"

namespace sextant {

/// `drawn` holds <name>.svg of every figure (draw()). Throws InternalError where one is missing.
std::string to_html(const ReportDocument& document, const OutputFiles& drawn);

/// & < > " ' as entities: for text and for attributes in quotes.
std::string html_escaped(const std::string& text);

/// JSON that may stand inside <script>: no tag can begin in it.
std::string script_json(const Json& json);

/// A fixed part of the pages, of html/page/: scripts that the page of `sextant view` shares. Throws InternalError where
/// there is none of that name.
std::string_view page_file(std::string_view name);

/// RFC 4648, with padding.
std::string base64(const std::string& bytes);

// ---- all files of a report folder; the layout stands in document.h

struct ReportFolderOptions {
  bool draw_figures = true;  ///< off: tables alone, no report.md and no report.html
  int jobs = 1;              ///< threads that draw; the bytes do not depend on it
  bool quiet = true;         ///< no progress of the drawing
};

OutputFiles report_folder(const ReportDocument& document, const ReportFolderOptions& options);

/// report.html alone, for a folder that has other files.
std::string report_page(const ReportDocument& document, int jobs);

}  // namespace sextant
