#include "sextant/eval/report/consistency_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

namespace sextant {
namespace {

struct Mean {
  double sum = 0;
  int n = 0;
  std::string text() const { return n == 0 ? "-" : fmt::format("{:.2f}", sum / n); }
};

}  // namespace

std::string consistency_text(const std::vector<Record>& records) {
  constexpr std::array<const char*, 4> keys = {"split_nees", "split_nees_sides", "split_nees_cells", "nees"};
  std::map<std::string, std::array<Mean, 4>> of_body;
  for (const Record& record : records) {
    for (size_t k = 0; k < keys.size(); ++k) {
      const auto value = record.values.find(keys[k]);
      if (value == record.values.end()) continue;
      Mean& mean = of_body[fmt::format("{} {} {}", record.dataset, record.sequence, record.body)][k];
      mean.sum += value->second;
      ++mean.n;
    }
  }
  if (std::ranges::none_of(of_body, [](const auto& body) { return body.second[0].n > 0; })) return "";
  std::string text =
      "Mean NEES, 6 where covariances are right: of halves of a body (left, right; odd, even cells),\n"
      "of the truth\n";
  for (const auto& [body, means] : of_body) {
    text += fmt::format("  {:<28} {:>8} ({}; {}) {:>8}  {} pairs\n", body, means[0].text(), means[1].text(),
                        means[2].text(), means[3].text(), std::max(means[0].n, means[3].n));
  }
  return text;
}

}  // namespace sextant
