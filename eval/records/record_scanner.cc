#include "sextant/eval/records/record_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "sextant/base/error.h"

namespace sextant {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The rest of a line; the first thing that does not fit makes it `bad` for good.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  bool good() const { return good_; }
  bool finished() const { return good_ && text_.empty(); }

  void literal(std::string_view expected) {
    if (!accept(expected)) good_ = false;
  }

  bool accept(std::string_view expected) {
    if (!good_ || !text_.starts_with(expected)) return false;
    text_.remove_prefix(expected.size());
    return true;
  }

  /// Between quotes, without escapes.
  std::string_view text() {
    literal("\"");
    // Escapes, control characters and what is not ASCII are the general parser's business.
    const auto plain = [](char c) { return c >= 0x20 && c < 0x7f && c != '"' && c != '\\'; };
    size_t end = 0;
    while (end < text_.size() && plain(text_[end])) ++end;
    if (!good_ || end == text_.size() || text_[end] != '"') return fail_with(std::string_view());
    const std::string_view found = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return found;
  }

  template <typename T>
  T number() {
    if (!good_) return T{};
    const size_t sign = text_.starts_with('-') ? 1 : 0;
    const auto digit_at = [&](size_t i) { return i < text_.size() && is_digit(text_[i]); };
    if (!digit_at(sign) || (text_[sign] == '0' && digit_at(sign + 1))) return fail_with(T{});
    T value{};
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error != std::errc() || !is_digit(end[-1])) return fail_with(T{});
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) return fail_with(T{});
    }
    text_.remove_prefix(static_cast<size_t>(end - text_.data()));
    return value;
  }

  int count() {
    const int value = number<int>();
    return value >= 0 ? value : fail_with(0);
  }

  /// {"key":1.5,...}, keys rising.
  Record::Numbers numbers() {
    Record::Numbers numbers;
    literal("{");
    if (accept("}")) return numbers;
    do {
      const std::string_view key = text();
      literal(":");
      const auto value = number<double>();
      if (!good_ || (!numbers.empty() && numbers.rbegin()->first >= key))
        return fail_with(std::move(numbers));
      numbers.emplace_hint(numbers.end(), key, value);
    } while (accept(","));
    literal("}");
    return numbers;
  }

  template <typename T>
  T fail_with(T value) {
    good_ = false;
    return value;
  }

 private:
  std::string_view text_;
  bool good_ = true;
};

void scan_status(Scanner& line, Record& r) {
  try {
    r.status = from_name<Status>(line.text(), "status");
  } catch (const Error&) {
    line.fail_with(0);
    return;
  }
  if (line.accept(R"(,"gate":)") != (r.status == Status::gated)) {
    line.fail_with(0);
  } else if (r.status == Status::gated) {
    const std::optional<Gate> gate = find_gate(line.text());
    r.gate = gate ? *gate : line.fail_with(Gate::none);
  }
}

}  // namespace

bool is_body(std::string_view text) {
  constexpr std::string_view prefix = "object:";
  return text == "ego" || (text.starts_with(prefix) && text.size() > prefix.size() &&
                           std::ranges::all_of(text.substr(prefix.size()), is_digit));
}

std::optional<Gate> find_gate(std::string_view name) {
  for (const Gate gate : {Gate::distance, Gate::area, Gate::is_static}) {
    if (to_string(gate) == name) return gate;
  }
  return std::nullopt;
}

std::optional<Record> scan_record(std::string_view text) {
  Scanner line(text);
  Record r;
  line.literal(R"({"schema":1,"dataset":)");
  r.dataset = line.text();
  line.literal(R"(,"sequence":)");
  r.sequence = line.text();
  line.literal(R"(,"estimator":)");
  r.estimator = line.text();
  line.literal(R"(,"noise":)");
  r.noise = line.text();
  line.literal(R"(,"level":)");
  r.level = line.number<double>();
  line.literal(R"(,"seed":)");
  r.seed = line.number<uint64_t>();
  line.literal(R"(,"frame":)");
  r.frame = line.number<int>();
  line.literal(R"(,"body":)");
  r.body = line.text();
  line.literal(R"(,"status":)");
  if (!line.good() || !is_body(r.body)) return std::nullopt;
  scan_status(line, r);
  line.literal(R"(,"n_points":)");
  r.n_points = line.count();
  line.literal(R"(,"n_inliers":)");
  r.n_inliers = line.count();
  if (line.accept(R"(,"flow_truth":)")) {
    r.flow_truth = line.text();
    if (r.flow_truth != "given" && r.flow_truth != "induced") return std::nullopt;
  }
  line.literal(R"(,"errors":)");
  r.errors = line.numbers();
  line.literal(R"(,"values":)");
  r.values = line.numbers();
  line.literal(R"(,"bound":)");
  r.bound = line.numbers();
  line.literal(R"(,"time_ms":)");
  r.time_ms = line.numbers();
  line.literal("}");
  if (!line.finished()) return std::nullopt;
  return r;
}

}  // namespace sextant
