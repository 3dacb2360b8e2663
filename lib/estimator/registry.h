#pragma once

// Table of all estimators. To add one:
//   1. write lib/estimator/estimators/<name>.{h,cc}: an options struct (base/options.h) and a class derived
//      from Estimator (solvers/estimator.h);
//   2. add its header and one line of the table to registry.cc.
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

/// Creates an estimator. Throws Error for an unknown name (the message suggests the nearest one), and for an
/// option that is unknown, has another type or is out of range.
std::unique_ptr<Estimator> make_estimator(const std::string& name, const Json& options = Json::object());

}  // namespace sextant
