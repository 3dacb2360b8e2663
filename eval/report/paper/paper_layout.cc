#include "sextant/eval/report/paper/paper_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

/// Fields of a PaperRow with the values that are required.
using Selector = std::map<std::string, std::string>;

const std::map<std::string, std::string PaperRow::*>& selectable() {
  static const std::map<std::string, std::string PaperRow::*> fields = {
      {"group", &PaperRow::group},         {"body", &PaperRow::body},         {"noise", &PaperRow::noise},
      {"estimator", &PaperRow::estimator}, {"quantity", &PaperRow::quantity}, {"data", &PaperRow::data}};
  return fields;
}

bool selects(const Selector& selector, const PaperRow& row) {
  return std::ranges::all_of(selector, [&](const auto& condition) {
    const auto field = selectable().find(condition.first);
    if (field == selectable().end()) throw InternalError("layout: no field '" + condition.first + "'");
    const std::string& value = row.*(field->second);
    const std::string& wanted = condition.second;
    return wanted.ends_with('*') ? value.starts_with(wanted.substr(0, wanted.size() - 1)) : value == wanted;
  });
}

Selector selector_of(const Json& entry, const std::string& key = "select") {
  return entry.value(key, Json::object()).get<Selector>();
}

/// Joins two selectors; `more` has priority.
Selector joined(Selector selector, const Selector& more) {
  for (const auto& [field, value] : more) selector[field] = value;
  return selector;
}

/// Everything that a cell of one version depends on.
struct CellContext {
  const PublishedTable& table;
  const Json& kinds;      ///< kinds of data, nearest first
  const Json* only_kind;  ///< null: the nearest kind that has the value
  const Json& procedure;
  const Json& column;
  const Json& row;
  std::string system;  ///< estimator of a row below the rule; empty: that of the column

  /// Conditions of column, row and quantity, without those of a procedure or a kind of data.
  Selector conditions(const std::string& quantity) const {
    Selector place = joined(selector_of(column), selector_of(row));
    if (!quantity.empty()) place["quantity"] = quantity;
    return place;
  }
};

struct Found {
  const PaperRow* row = nullptr;
  const Json* kind = nullptr;
};

/// Finds the measured row on the nearest data; among several on the same kind, the one with most pairs. The
/// rows come from the long table with the same number: velocity_table() (tables/drive_tables.cc) makes table
/// V. Kinds, columns and rows of the layout are entries of zhang2020_layout.json.
Found find_measured(const CellContext& context, const std::string& quantity) {
  Selector place = joined(context.conditions(quantity), selector_of(context.procedure));
  const std::string suffix = context.procedure.value("procedure", "");
  if (!suffix.empty() && place.contains("estimator")) place["estimator"] += ", " + suffix;
  if (!context.system.empty()) place["estimator"] = context.system;
  for (const Json& kind : context.kinds) {
    if (context.only_kind != nullptr && &kind != context.only_kind) continue;
    Selector here = place;
    if (context.column.contains("on"))
      here = joined(here, selector_of(context.column.at("on"), kind.value("name", "")));
    Found found;
    for (const PaperRow& row : context.table.rows) {
      if (!row.measured || !is_of_kind(row.dataset, kind) || !selects(here, row)) continue;
      if (found.row == nullptr || row.measured->n_pairs > found.row->measured->n_pairs) found = {&row, &kind};
    }
    if (found.row != nullptr) return found;
  }
  return {};
}

std::optional<double> find_published(const CellContext& context, const std::string& quantity) {
  if (!context.system.empty()) return std::nullopt;
  Selector place = context.conditions(quantity);
  if (context.column.contains("published"))
    place = joined({{"quantity", place.at("quantity")}}, selector_of(context.column, "published"));
  for (const PaperRow& row : context.table.rows) {
    if (row.published && selects(place, row)) return row.published;
  }
  return std::nullopt;
}

/// Returns Wilson's 95 % interval of a proportion `p` of n.
Interval wilson_interval(double p, double n) {
  constexpr double z = 1.959964;
  const double scale = 1 / (1 + z * z / n), centre = scale * (p + z * z / (2 * n));
  const double half = scale * z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {centre - half, centre + half};
}

/// Sets rates and verdict of a count that is a share of `rate_of`.
void judge_rate(const CellContext& context, const std::string& quantity, LayoutValue& value) {
  const Found total = find_measured(context, quantity);
  const std::optional<double> published_total = find_published(context, quantity);
  value.rate_of = quantity;
  const bool has_published = value.published && published_total && *published_total > 0;
  const bool has_measured = value.measured && total.row != nullptr && total.row->measured->value > 0;
  if (has_published) value.published_rate = *value.published / *published_total;
  if (has_measured) value.rate = value.measured->value / total.row->measured->value;
  if (!value.measured || !value.published) {
    value.verdict = verdict_on(value.published, value.measured);
  } else if (!has_published || !has_measured) {
    value.verdict = "not comparable";
    value.reason =
        fmt::format("{} has no detections that are {}", has_published ? "our data" : "the paper", quantity);
  } else {
    const double n = total.row->measured->value;
    Measured rate = value.measured->scaled(1 / n);
    const Interval sampling = wilson_interval(*value.rate, n);
    std::optional<Interval>& range = rate.one_run ? rate.one_run : rate.interval;
    range =
        range ? Interval{std::min(range->low, sampling.low), std::max(range->high, sampling.high)} : sampling;
    value.verdict = verdict_on(value.published_rate, rate);
  }
}

LayoutValue value_of(const CellContext& context, const std::string& quantity, const std::string& name) {
  LayoutValue value{.name = name};
  value.factor = context.row.value("factor", 1.0);
  value.published = find_published(context, quantity);
  const Found found = find_measured(context, quantity);
  if (found.row != nullptr) {
    value.measured = found.row->measured->scaled(value.factor);
    value.estimator = found.row->estimator;
    value.data = found.row->data;
    value.dataset = found.row->dataset;
    value.records = records_of_part(found.row->records);
  }
  const std::string rate_of = context.row.value("rate_of", "");
  const std::string reason = reason_of(context.row, value.dataset);
  if (!rate_of.empty()) {
    judge_rate(context, rate_of, value);
  } else if (found.row != nullptr && value.published && !reason.empty()) {
    value.verdict = "not comparable";
    value.reason = reason;
  } else {
    value.verdict = verdict_on(value.published, value.measured);
  }
  const bool judged = value.verdict == "within" || value.verdict == "outside";
  const std::string words = found.kind == nullptr ? "" : found.kind->value("words", "");
  if (judged && !words.empty()) value.verdict += ", " + words;
  return value;
}

LayoutCell cell_of(const CellContext& context, const std::string& label) {
  const Json quantities = context.row.value("quantities", Json::array({""}));
  LayoutCell values;
  for (size_t i = 0, begin = 0; i < quantities.size(); ++i) {
    const size_t end = quantities.size() > 1 ? label.find('/', begin) : std::string::npos;
    values.push_back(value_of(context, quantities[i], label.substr(begin, end - begin)));
    begin = end == std::string::npos ? end : end + 1;
  }
  return values;
}

/// Returns the value that is smallest as printed; null if two are equal.
template <typename Number>
LayoutValue* least(const std::vector<LayoutValue*>& values, int decimals, const Number& number_of) {
  const auto least = std::ranges::min_element(values, {}, number_of);
  const auto shown = [&](const LayoutValue* value) { return layout_number(number_of(value), decimals); };
  const bool is_alone = std::ranges::count(values, shown(*least), shown) == 1;
  return is_alone ? *least : nullptr;
}

/// Marks the smallest value in every group of columns that the paper compares, if they were measured on the
/// same data.
void mark_best(const Json& columns, LayoutRow& row) {
  std::map<int, std::vector<LayoutValue*>> groups;
  for (size_t j = 0; j < row.cells.size(); ++j)
    if (columns[j].contains("best") && row.cells[j].size() == 1)
      groups[columns[j].at("best").get<int>()].push_back(&row.cells[j].front());
  for (const auto& entry : groups) {
    const std::vector<LayoutValue*>& values = entry.second;
    const LayoutValue& first = *values.front();
    const auto all = [&](auto has) { return values.size() > 1 && std::ranges::all_of(values, has); };
    LayoutValue *published = nullptr, *measured = nullptr;
    if (all([](const LayoutValue* v) { return v->published.has_value(); }))
      published = least(values, row.decimals, [](const LayoutValue* v) { return *v->published; });
    if (all([&](const LayoutValue* v) { return v->measured && v->data == first.data; }))
      measured = least(values, row.decimals, [](const LayoutValue* v) { return v->measured->value; });
    if (published != nullptr) published->best_published = true;
    if (measured != nullptr) measured->best = true;
  }
}

/// Appends a text unless it is empty or the list contains it.
void add_text(const std::string& text, std::vector<std::string>& list) {
  if (!text.empty()) add_distinct(text, list);
}

/// A version of a table under construction.
struct VersionMaker {
  const PublishedTable& table;
  const Json& layout;
  const Json& kinds;
  const Json& procedure;
  const Json* only_kind;

  LayoutRow row_of(const Json& entry, const Json* system) const {
    LayoutRow row;
    row.labels = entry.at("labels").get<std::vector<std::string>>();
    row.decimals = entry.at("decimals").get<int>();
    row.name = row.quantity = fmt::format("{}", fmt::join(row.labels, " "));
    if (system != nullptr) {
      row.is_added = true;
      row.in_terminal = system->value("terminal", false);
      const std::string title = system->value("title", "");
      if (!title.empty()) {
        row.labels =
            row.labels.size() > 1 ? std::vector{title, row.name} : std::vector{row.name + ", " + title};
        row.name += ", " + title;
        row.system = title;
      }
    }
    const Json& columns = layout.at("columns");
    for (size_t j = 0; j < columns.size(); ++j) {
      const bool has = system == nullptr || !system->contains("columns") ||
                       std::ranges::count(system->at("columns"), Json(j)) > 0;
      const std::string estimator = system == nullptr ? "" : system->value("estimator", "");
      const CellContext context{table, kinds, only_kind, procedure, columns[j], entry, estimator};
      row.cells.push_back(has ? cell_of(context, entry.at("labels").back()) : LayoutCell());
    }
    mark_best(columns, row);
    return row;
  }

  LayoutVersion version() const {
    LayoutVersion version{.procedure = procedure.value("title", "")};
    for (const Json& entry : layout.at("rows")) version.rows.push_back(row_of(entry, nullptr));
    for (const LayoutRow& row : version.rows) {
      for (const auto& cell : row.cells)
        version.n_measured += !cell.empty() && cell.front().measured.has_value();
    }
    for (const Json& system : layout.value("added_rows", Json::array())) {
      bool any = false;
      for (const Json& entry : system.contains("rows") ? system.at("rows") : layout.at("rows")) {
        LayoutRow row = row_of(entry, &system);
        const bool measured = std::ranges::any_of(row.cells, [](const auto& cell) {
          return std::ranges::any_of(cell, [](const LayoutValue& v) { return v.measured.has_value(); });
        });
        if (measured) version.rows.push_back(std::move(row));
        any |= measured;
      }
      if (any) add_text(system.value("note", ""), version.notes);
      if (any && procedure.contains("procedure"))  // the paper's rows follow another procedure than ours
        add_text(layout.value("note_on_other_procedures", ""), version.notes);
    }
    return version;
  }
};

/// Adds notes on the data of the cells, if rows of the same quantity show systems on different data, although
/// the paper compares the values of such a row with each other: one note on the rows that are always shown,
/// and one on the other systems.
void note_different_data(const std::vector<std::string>& columns, LayoutVersion& version) {
  std::map<std::string, std::set<std::string>> data_of;           // by quantity, that is, row of the paper
  std::map<std::string, std::vector<std::string>> shown, folded;  // systems by data
  for (const LayoutRow& row : version.rows) {
    for (size_t j = 0; j < row.cells.size(); ++j) {
      if (row.cells[j].empty() || !row.cells[j].front().measured) continue;
      const LayoutValue& value = row.cells[j].front();
      const std::string data = fmt::format("{}, {} pairs", value.data, value.measured->n_pairs);
      const std::string& system = row.is_added ? row.system : columns[j];
      data_of[row.quantity].insert(data);
      add_distinct(replaced(system, ", ", " "), (!row.is_added || row.in_terminal ? shown : folded)[data]);
    }
  }
  if (std::ranges::none_of(data_of, [](const auto& of) { return of.second.size() > 1; })) return;
  const auto note = [](const std::string& begin,
                       const std::map<std::string, std::vector<std::string>>& by_data) {
    std::vector<std::string> parts;
    for (const auto& [data, systems] : by_data)
      parts.push_back(fmt::format("{} on {}", fmt::join(systems, ", "), data));
    return parts.empty() ? "" : fmt::format("{}: {}", begin, fmt::join(parts, "; "));
  };
  add_text(note("Not the same frames", shown), version.notes);
  version.note_on_folded_rows = note("Other systems", folded);
}

/// Describes the data and collects the notes of the cells.
void describe(const Json& kinds, LayoutVersion& version) {
  std::vector<std::string> data, titles, reasons;
  for (const LayoutRow& row : version.rows) {
    for (const auto& cell : row.cells) {
      for (const LayoutValue& value : cell) {
        add_text(value.reason, reasons);
        version.is_incomplete |= !row.is_added && value.published && !value.measured;
        if (row.is_added || !value.measured) continue;
        add_text(value.data, data);
        for (const Json& kind : kinds)
          if (is_of_kind(value.dataset, kind)) add_text(kind.value("title", ""), titles);
      }
    }
  }
  version.data = fmt::format("{}", fmt::join(data.size() > 1 ? titles : data, "; "));
  for (const std::string& reason : reasons) version.notes.push_back("\u2260 " + reason);
}

bool shows_the_same(const LayoutVersion& a, const LayoutVersion& b) {
  if (a.procedure != b.procedure || a.n_measured != b.n_measured) return false;
  for (size_t i = 0; i < std::min(a.rows.size(), b.rows.size()); ++i) {
    for (size_t j = 0; j < a.rows[i].cells.size(); ++j) {
      const auto &x = a.rows[i].cells[j], &y = b.rows[i].cells[j];
      if (x.empty() != y.empty() || (!x.empty() && x.front().data != y.front().data)) return false;
    }
  }
  return true;
}

PaperLayout layout_of(const Json& entry, const Json& kinds, const PublishedTable& table) {
  PaperLayout layout{
      .name = entry.value("name", ""), .number = table.number, .title = entry.value("title", "")};
  layout.missing = measuring_line(paper().table(table.number).fetch);
  for (const Json& line : entry.at("header")) {
    auto& groups = layout.header.emplace_back();
    for (const Json& group : line)
      groups.push_back({group.value("text", ""), group.value("span", size_t(1))});
  }
  for (const Json& column : entry.at("columns")) layout.columns.push_back(column.value("name", ""));
  for (const Json& procedure : entry.at("procedures")) {
    std::vector<const Json*> choices = {nullptr};
    for (const Json& kind : kinds) choices.push_back(&kind);
    for (const Json* kind : choices) {
      LayoutVersion version = VersionMaker{table, entry, kinds, procedure, kind}.version();
      const bool known = std::ranges::any_of(
          layout.versions, [&](const LayoutVersion& other) { return shows_the_same(version, other); });
      if (known || (version.n_measured == 0 && !layout.versions.empty())) continue;
      describe(kinds, version);
      if (entry.value("compares_columns", false)) note_different_data(layout.columns, version);
      layout.versions.push_back(std::move(version));
    }
  }
  // If the nearest procedure was not measured, the next measured one comes first.
  if (layout.versions.front().n_measured == 0 && layout.versions.size() > 1)
    layout.versions.erase(layout.versions.begin());
  return layout;
}

}  // namespace

size_t data_nearness(const std::string& dataset) {
  const Json& kinds = layout_data().at("data");
  const auto nearest =
      std::ranges::find_if(kinds, [&](const Json& kind) { return is_of_kind(dataset, kind); });
  return static_cast<size_t>(nearest - kinds.begin());
}

std::vector<PaperLayout> paper_layouts(std::span<const PublishedTable> tables) {
  const Json& data = layout_data();
  std::vector<PaperLayout> layouts;
  for (const Json& entry : data.at("tables")) {
    const auto table = std::ranges::find(tables, entry.value("number", ""), &PublishedTable::number);
    SEXTANT_CHECK(table != tables.end());
    layouts.push_back(layout_of(entry, data.at("data"), *table));
  }
  return layouts;
}

std::string PaperLayout::sentence(const LayoutVersion& version) const {
  if (version.n_measured == 0) return "Not measured here; the paper's values alone.";
  return fmt::format("Ours: {}; {}.", version.procedure, version.data);
}

std::vector<std::string> PaperLayout::notes_of(const LayoutVersion& version) const {
  std::vector<std::string> notes = version.notes;
  add_text(version.note_on_folded_rows, notes);
  if (version.is_incomplete) notes.push_back("\u2013 run: " + missing);
  return notes;
}

std::string layout_number(double value, int decimals) {
  const bool is_whole = std::abs(value - std::round(value)) < 1e-9;
  return fmt::format("{:.{}f}", value, decimals == 0 && !is_whole ? 1 : decimals);
}

namespace {

/// Returns the numbers of a cell joined by "/"; "" unless every value of the cell has a number.
template <typename Number>
std::string numbers(const LayoutRow& row, const LayoutCell& cell, const Number& number_of) {
  std::string joined;
  for (const LayoutValue& value : cell) {
    const std::optional<double> number = number_of(value);
    if (!number) return "";
    joined += (joined.empty() ? "" : "/") + layout_number(*number, row.decimals);
  }
  return joined;
}

std::string published_number_of(const LayoutRow& row, const LayoutCell& cell) {
  return numbers(row, cell, [](const LayoutValue& v) { return v.published; });
}

std::string number_words(const std::optional<Interval>& interval, int digits) {
  if (!interval) return "none";
  return fmt::format("{:.{}g} to {:.{}g}", interval->low, digits, interval->high, digits);
}

}  // namespace

std::string verdict_sign(const std::string& verdict) {
  if (verdict.starts_with("within")) return "\u2713";
  if (verdict.starts_with("outside")) return "\u2717";
  if (verdict == "not comparable") return "\u2260";
  if (verdict == "undecided") return "?";
  return "";
}

std::string cell_measured(const LayoutRow& row, const LayoutCell& cell) {
  const std::string number = numbers(row, cell, [](const LayoutValue& v) {
    return v.measured ? std::optional(v.measured->value) : std::nullopt;
  });
  if (number.empty()) return published_number_of(row, cell).empty() ? "" : "\u2013";
  return number + verdict_sign(cell.front().verdict);
}

std::string cell_published(const LayoutRow& row, const LayoutCell& cell) {
  const std::string number = published_number_of(row, cell);
  return number.empty() ? "" : "(" + number + ")";
}

std::string cell_details(const LayoutVersion& version, const LayoutCell& cell) {
  std::string text;
  constexpr int digits = 4;
  for (const LayoutValue& v : cell) {
    if (!text.empty()) text += ". ";
    if (cell.size() > 1) text += v.name + ": ";
    if (!v.measured) {
      text += "not measured here";
      continue;
    }
    const Measured& m = *v.measured;
    text += fmt::format("{:.{}g}; 95 % interval {}; single runs {}; {} pair{}, {} seed{}; {}; {}", m.value,
                        digits, number_words(m.interval, digits), number_words(m.one_run, digits), m.n_pairs,
                        m.n_pairs == 1 ? "" : "s", m.n_seeds, m.n_seeds == 1 ? "" : "s",
                        v.estimator.empty() ? version.procedure : v.estimator, v.data);
    if (v.rate && v.published_rate)
      text += fmt::format("; {:.{}g} % of {}, published {:.{}g} %", 100 * *v.rate, 3, v.rate_of,
                          100 * *v.published_rate, 3);
    if (!v.verdict.empty()) text += "; " + v.verdict;
    if (!v.reason.empty()) text += ": " + v.reason;
  }
  return text;
}

}  // namespace sextant
