#pragma once

// What `evaluate ego` found as a document (eval/report/document.h): its tables, the warnings, and the
// distribution of errors: cumulative per system (runs pooled), and as boxes per run.

#include <vector>

#include "sextant/eval/evaluation/ego_json.h"
#include "sextant/eval/report/document.h"

namespace sextant {

ReportDocument ego_document(const std::vector<EgoResult>& runs, const EgoReference& reference,
                            const EgoOptions& options);

}  // namespace sextant
