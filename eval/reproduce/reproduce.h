#pragma once

// The paper's experiments again, as far as the data allow. A folder DIR holds
//
//   parts/<name>/      one sweep, run or evaluation each, complete or resumable
//   data.json          which parts could run with this data, and what the others need
//   report/            tables, claims, figures, report.html: a function of the two above alone
//
// A part is run again when its plan, its inputs or the program have changed; else it is left as it is.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/paper/paper_page.h"
#include "sextant/eval/reproduce/parts.h"

namespace sextant {

struct ReproduceConfig {
  std::string data_root;  ///< empty: embedded scenarios only
  std::filesystem::path out;
  PackCache cache{default_cache_folder()};
  std::vector<Part> parts;  ///< reproduction_parts(data_root)
  int jobs = 1;
  bool quiet = false;
};

/// Runs what is not finished. Throws Error on bad data, Interrupted on Ctrl-C: the same call resumes.
void run_parts(const ReproduceConfig& config);

/// The report of what is in config.out. Throws Error where nothing is.
struct ReproductionReport {
  ReportDocument document;
  std::vector<PaperLayout> tables;     ///< as the paper prints them
  std::vector<PrintedFigure> figures;  ///< of paper.html, all in the document
};
ReproductionReport reproduction_report(const ReproduceConfig& config);

// ---- the answer: what holds, what does not and why, what was not measured and what would measure it,
// in at most 120
// words.

std::string answer_paragraph(const std::vector<CheckedClaim>& checked,
                             const std::vector<PaperLayout>& tables);

// ---- by what, on which machine and from which inputs the records of a report were made: from the run.json of its
// parts. Same folders, same lines.

/// Parts lie in `parts/<name>`. What several parts agree in is said once.
std::vector<std::pair<std::string, std::string>> reproduction_provenance(const std::filesystem::path& parts,
                                                                         const Evidence& evidence);

}  // namespace sextant
