#include "sextant/eval/export/record_columns.h"

#include <map>
#include <set>
#include <unordered_map>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"

namespace sextant {
namespace {

using Names = std::set<Interned>;

/// First pass: collects the fields of a line and the keys of its maps.
class ColumnCollector {
 public:
  template <typename... Rule>
  void field(const char* name, const Interned&, const Rule&...) {
    put(name, ColumnKind::text);
  }
  template <typename... Rule>
  void field(const char* name, const int&, const Rule&...) {
    put(name, ColumnKind::integer);
  }
  void field(const char* name, const uint64_t&) { put(name, ColumnKind::unsigned_integer); }
  template <typename... Rule>
  void field(const char* name, const double&, const Rule&...) {
    put(name, ColumnKind::number);
  }
  void field(const char* name, const Status&) { put(name, ColumnKind::text); }
  void field(const char* name, const Record::Numbers& numbers) {
    Names& names = maps_[map_++];
    if (is_first_) prefixes_.push_back(name);
    for (const auto& [key, number] : numbers) names.insert(key);
  }
  template <typename T, typename... Rest>
  void only_if(bool, const char* name, const T&, const Rest&...) {
    put(name, ColumnKind::text);
  }
  template <typename T, typename... Rest>
  void unless_empty(const char* name, const T&, const Rest&...) {
    put(name, ColumnKind::text);
  }

  void begin(bool is_first) {
    is_first_ = is_first;
    map_ = 0;
  }
  std::vector<RecordColumn> columns() const {
    std::vector<RecordColumn> all = fields_;
    for (size_t map = 0; map < prefixes_.size(); ++map) {
      for (const Interned& name : maps_.at(map)) all.push_back({prefixes_[map] + "_" + name.str()});
    }
    return all;
  }

 private:
  void put(const char* name, ColumnKind kind) {
    if (is_first_) fields_.push_back({name, kind});
  }

  bool is_first_ = true;
  size_t map_ = 0;
  std::vector<RecordColumn> fields_;
  std::vector<std::string> prefixes_;
  std::map<size_t, Names> maps_;
};

/// Second pass: fills the row of a record.
class RowFiller {
 public:
  explicit RowFiller(const std::vector<RecordColumn>& columns) : columns_(columns), row_(columns.size()) {
    for (size_t i = 0; i < columns.size(); ++i) index_.emplace(columns[i].name, i);
  }

  template <typename... Rule>
  void field(const char*, const Interned& text, const Rule&...) {
    put(text);
  }
  template <typename... Rule>
  void field(const char*, const int& count, const Rule&...) {
    put(int64_t{count});
  }
  void field(const char*, const uint64_t& count) { put(count); }
  template <typename... Rule>
  void field(const char*, const double& number, const Rule&...) {
    put(number);
  }
  void field(const char*, const Status& status) { put(Interned(to_string(status))); }
  void field(const char* name, const Record::Numbers& numbers) {
    auto& known = by_key_[name];
    for (const auto& [key, number] : numbers) {
      auto found = known.find(&key.str());
      if (found == known.end()) {
        const auto column = index_.find(std::string(name) + "_" + key.str());
        if (column == index_.end()) throw Changed();
        found = known.emplace(&key.str(), column->second).first;
      }
      row_[found->second] = number;
    }
  }
  template <typename... Rest>
  void only_if(bool is_there, const char*, const Gate& gate, const Rest&...) {
    is_there ? put(Interned(to_string(gate))) : put(std::monostate());
  }
  template <typename... Rest>
  void unless_empty(const char*, const Interned& text, const Rest&...) {
    text.empty() ? put(std::monostate()) : put(text);
  }

  struct Changed {};  ///< thrown for a number that the first pass did not encounter

  std::span<const RecordValue> row(const Record& record) {
    row_.assign(columns_.size(), std::monostate());
    next_ = 0;
    internal::visit_fields(record, *this);
    return row_;
  }

 private:
  void put(RecordValue value) { row_[next_++] = value; }

  const std::vector<RecordColumn>& columns_;
  std::map<std::string, size_t> index_;
  std::map<std::string_view, std::unordered_map<const std::string*, size_t>> by_key_;
  std::vector<RecordValue> row_;
  size_t next_ = 0;
};

constexpr uint64_t rows_between_checks = 1024;

}  // namespace

RecordColumns::RecordColumns(const std::filesystem::path& folder) : file_(folder / "records.jsonl") {
  ColumnCollector collector;
  const Record none;
  collector.begin(true);
  internal::visit_fields(none, collector);
  for_each_record(file_, [&](Record& record) {
    if (n_rows_++ % rows_between_checks == 0) check_interrupt();
    collector.begin(false);
    internal::visit_fields(std::as_const(record), collector);
  });
  columns_ = collector.columns();
}

void RecordColumns::for_each_row(const RowVisitor& visit) const {
  const std::string changed =
      fmt::format("{}: was changed while it was read: wait until the run is done", file_.string());
  RowFiller filler(columns_);
  uint64_t n = 0;
  try {
    for_each_record(file_, [&](Record& record) {
      if (n % rows_between_checks == 0) check_interrupt();
      if (n++ >= n_rows_) throw Error(changed);
      visit(filler.row(record));
    });
  } catch (const RowFiller::Changed&) {
    throw Error(changed);
  }
  if (n != n_rows_) throw Error(changed);
}

}  // namespace sextant
