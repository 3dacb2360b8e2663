#pragma once

// What a reproduction says of one table of the paper, as a picture: a line for every published value, all on one
// axis, measured / published.
//
//   at 1        the published value
//   broad bar   where 95 % of our single runs lie;  thin bar: 95 % interval of our mean;  point: the mean
//   filled      our procedure;  open: that of the published code (", release"), where the table has it
//   word        the verdict of the table on that row
//
// Of several kinds of data for one value the last in the table, the nearest to the paper's, is drawn; of several
// noises the first. Values of 0 have no place on the axis.

#include <optional>

#include "sextant/eval/report/figure.h"
#include "sextant/eval/report/table.h"

namespace sextant {

/// None where no published value was measured. `table` is one of paper_tables().
std::optional<Figure> answer_figure(const std::string& name, const Table& table);

/// "12 of 40 published values lie in the range of our single runs; 3 rows not measured here".
std::string answer_text(const Table& table);

}  // namespace sextant
