#pragma once

// Many tests in one table: Holm's correction over all p-values of both errors of all rows.

#include <vector>

#include "sextant/stats/tests.h"

namespace sextant {

/// Row has Et_m and ER_deg, each with optional `p` and `p_corrected`. Rows without p keep none.
template <typename Row>
void correct_p_values(std::vector<Row>& rows) {
  using Part = decltype(Row::Et_m);
  std::vector<double> p;
  std::vector<Part*> owners;
  for (Row& row : rows) {
    for (Part* part : {&row.Et_m, &row.ER_deg}) {
      if (!part->p) continue;
      p.push_back(*part->p);
      owners.push_back(part);
    }
  }
  const std::vector<double> corrected = holm(p);
  for (size_t i = 0; i < owners.size(); ++i) owners[i]->p_corrected = corrected[i];
}

}  // namespace sextant
