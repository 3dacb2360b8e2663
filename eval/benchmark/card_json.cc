// card.json and the tables of a card, which are made from the same rows.

#include <algorithm>

#include <cmath>
#include <limits>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/names.h"
#include "sextant/eval/benchmark/card.h"
#include "sextant/metrics/definitions.h"

namespace sextant {
namespace {

constexpr int schema = 2;

std::optional<double> number(const Json& row, const std::string& key, const std::string& where) {
  if (!row.contains(key)) return std::nullopt;
  return json_member<double>(row, key, where);
}

std::optional<Interval> interval(const Json& row, const std::string& low, const std::string& high,
                                 const std::string& where) {
  const auto from = number(row, low, where), to = number(row, high, where);
  return from && to ? std::optional(Interval{*from, *to}) : std::nullopt;
}

std::optional<IntervalEstimate> estimate(const Json& row, const std::string& key, const std::string& where) {
  const auto value = number(row, key, where);
  if (!value) return std::nullopt;
  return IntervalEstimate{*value, interval(row, key + "_low", key + "_high", where)};
}

/// Formats three significant digits, with the interval.
Fields<IntervalEstimate> estimate_columns(const std::string& key, const std::string& title) {
  Fields<IntervalEstimate> fields =
      estimate_fields(Column::number(key, title, 3), key + "_low", key + "_high");
  for (Field<IntervalEstimate>& field : fields) field.column.significant = 3;
  return fields;
}

Fields<CurvePoint> curve_fields() {
  using Row = CurvePoint;
  Fields<Row> fields = {
      {Column::text("estimator").folded(), &Row::estimator},
      {Column::text("track"), &Row::track},
      {Column::text("body"), &Row::body},
      {Column::number("level", 3).with_significant(3).leading_to("records"), &Row::level},
      {Column::text("nominal", "nominal"), [](const Row& row) { return Cell(row.is_nominal ? "yes" : ""); }},
      {Column::count("n_seeds", "seeds").only_in_files(), &Row::n_seeds},
      {Column::count("n_truth").only_in_files(), &Row::n_truth},
      {Column::count("n_estimated").only_in_files(), &Row::n_estimated},
      {Column::number("coverage_percent", "coverage [%]", 1),
       [](const Row& row) { return 100 * row.coverage(); }}};
  for (Field<Row>& field : fields) field.column.names_its_quantity = field.column.key == "estimator";
  const auto add = [&](const char* error, std::optional<IntervalEstimate> Row::*member) {
    fields.add(estimate_columns(error, metric(NumberMap::errors, error).heading()), member);
  };
  add("Et_m", &Row::Et_m);
  add("ER_deg", &Row::ER_deg);
  add("Ev_kmh", &Row::Ev_kmh);
  fields.add(Column::number("best_Et_m", 3).only_in_files(), &Row::best_Et_m);
  fields.add(estimate_columns("efficiency", "efficiency"), &Row::efficiency);
  fields.add(Column::number("anees", "ANEES", 2), &Row::anees);
  fields.add_range(range_columns("anees_expected_low", "anees_expected_high", 2, "expected"),
                   &Row::anees_expected);
  fields.add(Column::text("records").only_in_files(), &Row::records);
  return fields;
}

Fields<Breakdown> breakdown_fields() {
  using Row = Breakdown;
  return {{Column::text("estimator").folded(), &Row::estimator},
          {Column::text("track"), &Row::track},
          {Column::text("body"), &Row::body},
          {Column::number("nominal", "nominal level", 3), [](const Row& row) { return row.at.nominal; }},
          {Column::number("highest", "highest level", 3), [](const Row& row) { return row.at.highest; }},
          {Column::text("breakdown", "breakdown level"), [](const Row& row) { return Cell(row.at.text()); }},
          {Column::text("interval", "95 % interval"),
           [](const Row& row) { return Cell(row.at.interval_text()); }},
          {Column::text("cause"), [](const Row& row) { return Cell(to_string(row.at.cause)); }},
          {Column::number("breakdown_level", 3).only_in_files(), [](const Row& row) { return row.at.level; }},
          {Column::number("breakdown_low", 3).only_in_files(),
           [](const Row& row) { return row.at.interval ? Cell(row.at.interval->low) : Cell(); }},
          {Column::number("breakdown_high", 3).only_in_files(),
           [](const Row& row) { return row.at.interval ? Cell(row.at.interval->high) : Cell(); }}};
}

Fields<Cost> cost_fields() {
  return {{Column::text("estimator"), &Cost::estimator},
          {Column::number("median_ms", "median time of a frame pair [ms]", 2), &Cost::median_ms},
          {Column::number("peak_memory_mb", "peak memory [MB]", 0), &Cost::peak_memory_mb},
          {Column::text("machine"), &Cost::machine}};
}

/// Parses a count, which tables write as a number: 2 as 2.0.
int count(const Json& row, const std::string& key, const std::string& where) {
  const double value = json_member<double>(row, key, where);
  if (value < 0 || value > std::numeric_limits<int>::max() || value != std::floor(value))
    fail("{}: key '{}': expected a whole number of at least 0, got {}", where, key, value);
  return static_cast<int>(value);
}

CurvePoint point_from(const Json& row, const std::string& where) {
  return {.estimator = json_member<std::string>(row, "estimator", where),
          .track = json_member<std::string>(row, "track", where),
          .body = json_member<std::string>(row, "body", where),
          .level = json_member<double>(row, "level", where),
          .is_nominal = json_member<std::string>(row, "nominal", where, std::string()) == "yes",
          .n_seeds = count(row, "n_seeds", where),
          .n_truth = count(row, "n_truth", where),
          .n_estimated = count(row, "n_estimated", where),
          .Et_m = estimate(row, "Et_m", where),
          .ER_deg = estimate(row, "ER_deg", where),
          .Ev_kmh = estimate(row, "Ev_kmh", where),
          .best_Et_m = number(row, "best_Et_m", where),
          .efficiency = estimate(row, "efficiency", where),
          .anees = number(row, "anees", where),
          .anees_expected = interval(row, "anees_expected_low", "anees_expected_high", where),
          .records = json_member<std::string>(row, "records", where)};
}

Breakdown breakdown_from(const Json& row, const std::string& where) {
  return {json_member<std::string>(row, "estimator", where),
          json_member<std::string>(row, "track", where),
          json_member<std::string>(row, "body", where),
          {.nominal = json_member<double>(row, "nominal", where),
           .highest = json_member<double>(row, "highest", where),
           .cause = from_name<BreakdownCause>(json_member<std::string>(row, "cause", where), "cause"),
           .level = json_member<double>(row, "breakdown_level", where),
           .interval = interval(row, "breakdown_low", "breakdown_high", where)}};
}

Json sweep_json(const CardSweep& sweep) {
  return {{"track", sweep.track},
          {"sweep", sweep.name},
          {"cases", sweep.n_cases},
          {"records", sweep.n_records},
          {"records_sha256", sweep.records_sha256}};
}

}  // namespace

Table curve_table(const std::vector<CurvePoint>& rows) {
  return table_of(
      "Errors by level",
      "Mean over the sequences, objects, frame pairs and seeds of a track, with 95 % interval; coverage is "
      "the share of frame pairs for which a motion was estimated. Efficiency: Cramer-Rao bound over RMS "
      "error. A level leads to its records.",
      curve_fields(), rows);
}

Table breakdown_table(const std::vector<Breakdown>& rows) {
  return table_of("Breakdown levels", "", breakdown_fields(), rows);
}

Table cost_table(const std::vector<Cost>& rows) {
  return table_of(
      "Cost",
      "Time of all bodies of a frame pair; of an external program its start and reading of files too.",
      cost_fields(), rows);
}

Json to_json(const Card& card) {
  Json json = {{"sextant_card", schema},
               {"suite", card.suite},
               {"suite_sha256", card.suite_sha256},
               {"quick", card.quick},
               {"estimator", card.estimator},
               {"plan_estimator", card.plan_estimator},
               {"options", card.options},
               {"fingerprint", card.fingerprint},
               {"results", card.results},
               {"program", card.program},
               {"sweeps", Json::array()},
               {"left_out", card.left_out},
               {"breakdowns", rows_to_json(breakdown_table(card.breakdowns))},
               {"curves", rows_to_json(curve_table(card.curves))},
               {"costs", rows_to_json(cost_table(card.costs))}};
  for (const CardSweep& sweep : card.sweeps) json["sweeps"].push_back(sweep_json(sweep));
  return json;
}

Card parse_card(std::string_view text, const std::string& where) {
  const Json json = parse_json(text, where);
  if (json_member<int>(json, "sextant_card", where) != schema)
    fail(
        "{}: the card has another version: expected \"sextant_card\": {}: make it again from its records "
        "with sextant benchmark card",
        where, schema);
  Card card{.suite = json_member<std::string>(json, "suite", where),
            .suite_sha256 = json_member<std::string>(json, "suite_sha256", where),
            .quick = json_member<bool>(json, "quick", where),
            .estimator = json_member<std::string>(json, "estimator", where),
            .plan_estimator = json_member<std::string>(json, "plan_estimator", where),
            .options = json_object(json, "options", where),
            .fingerprint = json_member<std::string>(json, "fingerprint", where, ""),
            .program = json_object(json, "program", where)};
  for (const Json& result : json_list(json, "results", where)) {
    if (!result.is_string()) fail("{}: key 'results': expected texts, got {}", where, json_excerpt(result));
    card.results.push_back(result.get<std::string>());
  }
  for (const Json& sweep : json_list(json, "sweeps", where)) {
    card.sweeps.push_back(
        {json_member<std::string>(sweep, "track", where), json_member<std::string>(sweep, "sweep", where),
         json_member<uint64_t>(sweep, "cases", where), json_member<uint64_t>(sweep, "records", where),
         json_member<std::string>(sweep, "records_sha256", where)});
  }
  const Json left_out = json_object(json, "left_out", where);
  for (const auto& item : left_out.items())
    card.left_out[item.key()] = json_member<std::string>(left_out, item.key(), where);
  for (const Json& row : json_list(json, "breakdowns", where))
    card.breakdowns.push_back(breakdown_from(row, where));
  for (const Json& row : json_list(json, "curves", where)) card.curves.push_back(point_from(row, where));
  for (const Json& row : json_list(json, "costs", where))
    card.costs.push_back({json_member<std::string>(row, "estimator", where), number(row, "median_ms", where),
                          number(row, "peak_memory_mb", where),
                          json_member<std::string>(row, "machine", where)});
  return card;
}

Card stored_card(const fs::path& folder) {
  const fs::path file = folder / "card.json";
  return parse_card(read_file(file, json_file), file.string());
}

}  // namespace sextant
