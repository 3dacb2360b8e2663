#include "sextant/eval/check/check_report.h"

#include <algorithm>

#include "sextant/base/error.h"
#include "sextant/eval/report/document.h"
#include "sextant/eval/report/table.h"

namespace sextant {

namespace {

constexpr size_t page_width = 116;

std::string outcome(const SourceCheck& c) { return std::string(to_string(c.outcome)); }

std::string present(const SourceCheck& c) {
  std::string text = c.n_present ? std::to_string(*c.n_present) : "";
  if (c.n_expected) text += fmt::format("/{}", *c.n_expected);
  return text;
}

/// Puts the cause first, and then the numbers behind it.
std::string remark(const SourceCheck& c) {
  if (c.cause.empty()) return c.message;
  return c.cause + (c.message.empty() ? "" : " (" + c.message + ")");
}

/// Returns the value for the page; speeds and counts are no deviations.
Cell value_cell(const SourceCheck& c) {
  const bool is_deviation = c.unit != "km/h" && c.unit != "steps";
  return c.value && is_deviation && *c.value > largest_shown ? Cell(value_text(*c.value)) : Cell(c.value);
}

Json to_json(const SourceCheck& c) {
  Json json{{"check", c.name}, {"outcome", outcome(c)}};
  const auto put = [&](const char* key, const auto& value) {
    if (value) json[key] = *value;
  };
  put("value", c.value);
  put("limit", c.limit);
  if (!c.unit.empty() && (c.value || c.min)) json["unit"] = c.unit;
  put("n", c.n);
  if (!c.counted.empty()) json["counted"] = c.counted;
  put("present", c.n_present);
  put("expected", c.n_expected);
  if (!c.size_px.empty()) json["size_px"] = c.size_px;
  if (c.valid_share) json["valid_percent"] = *c.valid_share * 100;
  put("min", c.min);
  put("median", c.median);
  put("max", c.max);
  json["cause"] = c.cause;
  json["message"] = c.message;
  return json;
}

}  // namespace

std::string check_page(const std::string& source, const SequenceInfo& info,
                       const std::vector<SourceCheck>& checks) {
  Table content{fmt::format("{}: frames {}-{}, {}x{} px, {} Hz", source, info.first_frame, info.last_frame,
                            info.width, info.height, info.rate_hz),
                "",
                {Column::text("outcome", ""),
                 Column::text("check", "content"),
                 {"present", "present"},
                 {"size_px", "size [px]"},
                 Column::number("valid_percent", "valid [%]", 1),
                 Column::number("min", 2),
                 Column::number("median", 2),
                 Column::number("max", 2),
                 Column::text("unit")}};
  Table conventions{"",
                    "",
                    {Column::text("outcome", ""),
                     Column::text("check", "convention"),
                     {"value", "value"},
                     {"limit", "limit"},
                     Column::text("unit"),
                     Column::count("n"),
                     Column::text("counted", "of")}};
  for (const SourceCheck& c : checks) {
    Table& table = c.convention ? conventions : content;
    const std::string label = fmt::format("{:<7} {}: ", outcome(c), c.name);
    if (!remark(c).empty())
      table.notes.push_back(wrapped(label + remark(c), page_width, std::string(label.size(), ' ')));
    if (c.convention) {
      table.add_row(
          {outcome(c), c.name, value_cell(c), c.limit, c.unit, c.n ? Cell(*c.n) : Cell(), c.counted});
    } else if (c.outcome != CheckOutcome::note || c.n_present) {
      table.add_row({outcome(c), c.name, present(c), c.size_px,
                     c.valid_share ? Cell(*c.valid_share * 100) : Cell(), c.min, c.median, c.max,
                     c.min ? c.unit : ""});
    }
  }
  return to_text(content) + "\n" + to_text(conventions);
}

Json check_json(const std::string& source, const std::vector<SourceCheck>& checks) {
  const auto n_with = [&](CheckOutcome wanted) {
    return std::ranges::count(checks, wanted, &SourceCheck::outcome);
  };
  Json json{{"source", source},
            {"failed", n_with(CheckOutcome::fail)},
            {"suspect", n_with(CheckOutcome::suspect)},
            {"checks", Json::array()}};
  for (const SourceCheck& c : checks) json["checks"].push_back(to_json(c));
  return json;
}

std::vector<std::string> failures(const std::string& source, const std::vector<SourceCheck>& checks) {
  struct Group {
    CheckOutcome outcome;
    std::string cause, names;
  };
  std::vector<Group> groups;
  const auto add = [&](const SourceCheck& check) {
    const std::string& cause = check.cause.empty() ? check.message : check.cause;
    const auto known = std::ranges::find(groups, cause, &Group::cause);
    if (known == groups.end()) {
      groups.push_back({check.outcome, cause, check.name});
    } else if (known->outcome == check.outcome) {
      known->names += ", " + check.name;
    }
  };
  for (const SourceCheck& check : checks) {
    if (check.outcome == CheckOutcome::fail) add(check);
  }
  constexpr int fewest = 5;  // a cause can agree with fewer samples by chance
  for (const SourceCheck& check : checks) {
    const bool has_cause = !check.cause.empty() && check.cause != no_known_cause;
    if (check.outcome == CheckOutcome::suspect && has_cause && check.n.value_or(fewest) >= fewest) add(check);
  }
  std::vector<std::string> lines;
  for (const Group& group : groups)
    lines.push_back(fmt::format("{}: {} ({}: {}); `sextant data check {}` shows the numbers", source,
                                group.cause, group.outcome == CheckOutcome::fail ? "failed" : "suspect",
                                group.names, shell_word(source)));
  return lines;
}

std::vector<std::string> failures_of(const SourceSpec& source, int jobs) {
  try {
    const auto checks = check_source(*open_source(source), {.jobs = jobs, .quiet = true, .quick = true});
    return failures(source.text, checks);
  } catch (const Error&) {
    return {};
  }
}

void refuse_failed(const std::string& source, const std::vector<SourceCheck>& checks) {
  const auto first = std::ranges::find(checks, CheckOutcome::fail, &SourceCheck::outcome);
  if (first == checks.end()) return;
  fail("{}: {} of {} checks failed; the first, {}: {}", source,
       std::ranges::count(checks, CheckOutcome::fail, &SourceCheck::outcome), checks.size(), first->name,
       remark(*first));
}

}  // namespace sextant
