#pragma once

// Repeats the paper's experiments as far as the data allow. The folder DIR of a reproduction contains
//
//   parts/<name>/      one experiment (sweep, run or evaluation) each, complete or resumable
//   data.json          which experiments could run with this data, and which data the others need
//   report/            tables, claims, figures and report.html, made only from the two above
//
// An experiment is run again if its plan, its inputs or the program have changed.

#include <filesystem>
#include <string>
#include <vector>

#include "sextant/eval/experiment/pack.h"
#include "sextant/eval/report/claims/claim.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/evidence.h"
#include "sextant/eval/report/paper/paper_page.h"
#include "sextant/eval/reproduce/parts.h"

namespace sextant {

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

}  // namespace sextant
