#pragma once

// report.html: the document as one self-contained page. Figures (SVG) and pictures (PNG) are embedded as data
// URIs, so that the ids in gnuplot's SVGs cannot clash; a content policy in the page forbids any request.
// Tables are sorted by clicking on a heading; sections with paths are interactive. The page prints on A4.

#include <string>

#include "sextant/eval/report/document.h"

namespace sextant {

/// Returns a page from its document type to the opening tag of the body: the title, the style, and a content
/// policy that forbids any request, and without `has_scripts` any script.
std::string page_head(const std::string& title, const std::string& style, bool has_scripts);

/// Replaces & < > " ' by entities, for text and for quoted attributes.
std::string html_escaped(const std::string& text);

/// Formats JSON for use inside <script>: it cannot contain a tag.
std::string script_json(const Json& json);

/// Returns a fixed file of the pages, from html/page/, such as the scripts that the page of `sextant view`
/// shares. Throws InternalError if there is none of that name.
std::string_view page_file(std::string_view name);

/// Encodes bytes as base64 (RFC 4648), with padding.
std::string base64(const std::string& bytes);

/// Makes the element of an Explorer (explorer_html.cc): its data, which page/explorer.js draws. Lists are
/// base64 of 32-bit little-endian numbers: float32 for drawn values, int32 for frames. The JSON inside the
/// element:
///
///   {"time_title", "axes": [right, up, out], "curves": [title], "note",
///    "paths": [{"label", "is_reference", "colour", "dash", "n", "time", "frame" (null: time is the frame),
///               "position": [x, y, z] or [], "values": [list or null of each curve], "begins": [index]}]}
std::string explorer_html(const Explorer& explorer);

// ---- All files of a report folder; document.h describes the layout.

struct ReportFolderOptions {
  bool draw_figures = true;  ///< false: tables and pictures only, without report.md and report.html
  int jobs = 1;              ///< threads that draw; the files do not depend on it
  bool quiet = true;         ///< false: print the progress of the drawing
};

/// Makes all files of the folder and gives each to `write` as soon as it is complete, so that not all of them
/// are in memory. Figures of `document` with equal names get distinct names.
void make_report_folder(ReportDocument& document, const ReportFolderOptions& options,
                        const FileWriter& write);
/// Returns all files of the folder.
OutputFiles report_folder(ReportDocument document, const ReportFolderOptions& options);

/// Returns the content of report.html alone, for a folder that also contains files that are not part of the
/// report.
std::string report_page(ReportDocument document, int jobs);

}  // namespace sextant
