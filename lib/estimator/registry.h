#pragma once

// Table of all estimators. To add one:
//   1. write lib/estimator/estimators/<name>.{h,cc}: an options struct (base/options.h) and a class derived
//      from Estimator (solvers/estimator.h);
//   2. add one line to the table in registry.cc.
// The parametrised test in registry_test.cc then covers it.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sextant/base/options.h"
#include "sextant/estimator/solvers/estimator.h"

namespace sextant {

struct EstimatorEntry {
  std::string name;
  std::string description;
  std::function<std::unique_ptr<Estimator>(const Json& options)> make;  ///< strict options, {} = defaults
  std::function<std::vector<OptionHelp>()> options;
};

std::span<const EstimatorEntry> estimators();

/// Creates an estimator. Throws Error for an unknown name (with the nearest one) or an unknown option key.
std::unique_ptr<Estimator> make_estimator(const std::string& name, const Json& options = Json::object());

}  // namespace sextant
