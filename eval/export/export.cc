#include "sextant/eval/export/export.h"

#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/new_file.h"
#include "sextant/base/progress.h"
#include "sextant/base/text.h"
#include "sextant/eval/records/provenance.h"
#include "sextant/eval/records/record.h"
#include "sextant/eval/records/record_stream.h"
#include "sextant/eval/records/zip_file.h"

namespace sextant {
namespace {

/// A field that a line of records.jsonl has besides its four maps.
struct FixedField {
  const char* name;
  ColumnKind kind;
  RecordValue (*value)(const Record&);
};

RecordValue count(int n) { return int64_t{n}; }

constexpr FixedField fixed_fields[] = {
    {"dataset", ColumnKind::text, [](const Record& r) -> RecordValue { return r.dataset; }},
    {"sequence", ColumnKind::text, [](const Record& r) -> RecordValue { return r.sequence; }},
    {"estimator", ColumnKind::text, [](const Record& r) -> RecordValue { return r.estimator; }},
    {"noise", ColumnKind::text, [](const Record& r) -> RecordValue { return r.noise; }},
    {"level", ColumnKind::number, [](const Record& r) -> RecordValue { return r.level; }},
    {"seed", ColumnKind::unsigned_integer, [](const Record& r) -> RecordValue { return r.seed; }},
    {"frame", ColumnKind::integer, [](const Record& r) { return count(r.frame); }},
    {"body", ColumnKind::text, [](const Record& r) -> RecordValue { return r.body; }},
    {"status", ColumnKind::text,
     [](const Record& r) -> RecordValue { return Interned(to_string(r.status)); }},
    {"gate", ColumnKind::text,
     [](const Record& r) {
       return r.status == Status::gated ? RecordValue(Interned(to_string(r.gate))) : std::monostate();
     }},
    {"n_points", ColumnKind::integer, [](const Record& r) { return count(r.n_points); }},
    {"n_inliers", ColumnKind::integer, [](const Record& r) { return count(r.n_inliers); }},
    {"flow_truth", ColumnKind::text,
     [](const Record& r) { return r.flow_truth.empty() ? std::monostate() : RecordValue(r.flow_truth); }},
};

constexpr NumberMap number_maps[] = {NumberMap::errors, NumberMap::values, NumberMap::bound,
                                     NumberMap::time_ms};

constexpr uint64_t rows_between_checks = 1024;

}  // namespace

RecordColumns::RecordColumns(const std::filesystem::path& folder) : file_(folder / "records.jsonl") {
  for_each_record(file_, [&](const Record& record) {
    if (n_rows_++ % rows_between_checks == 0) check_interrupt();
    for (const NumberMap map : number_maps) {
      for (const auto& [key, number] : record.numbers(map)) names_[static_cast<size_t>(map)].insert(key);
    }
  });
  for (const FixedField& field : fixed_fields) columns_.push_back({field.name, field.kind});
  for (const NumberMap map : number_maps) {
    for (const Interned& name : names_[static_cast<size_t>(map)])
      columns_.push_back({fmt::format("{}_{}", to_string(map), name), ColumnKind::number});
  }
}

void RecordColumns::for_each_row(const RowVisitor& visit) const {
  const std::string changed =
      fmt::format("{}: was changed while it was read: wait until the run is done", file_.string());
  std::vector<RecordValue> row;
  uint64_t n = 0;
  for_each_record(file_, [&](const Record& record) {
    if (n % rows_between_checks == 0) check_interrupt();
    if (n++ >= n_rows_) throw Error(changed);
    row.clear();
    for (const FixedField& field : fixed_fields) row.push_back(field.value(record));
    for (const NumberMap map : number_maps) {
      // The numbers of a record are ordered by name, as the columns are.
      auto number = record.numbers(map).begin();
      const auto end = record.numbers(map).end();
      for (const Interned& name : names_[static_cast<size_t>(map)]) {
        const bool is_there = number != end && number->first == name;
        row.push_back(is_there ? RecordValue((number++)->second) : std::monostate());
      }
      if (number != end) throw Error(changed);  // by a number that the first pass did not encounter
    }
    visit(row);
  });
  if (n != n_rows_) throw Error(changed);
}

const char* numpy_type(ColumnKind kind) {
  constexpr const char* types[] = {"<i4", "<i8", "<u8", "<f8"};  // indexed by ColumnKind
  return types[static_cast<size_t>(kind)];
}

namespace {

/// Function that visits the rows of a file.
using Rows = std::function<void(const RowVisitor&)>;

constexpr size_t buffer_bytes = size_t{1} << 16U;

/// Columns next to each other in one temporary file, each at its own offset.
class ColumnStore {
 public:
  ColumnStore(const std::filesystem::path& beside, size_t n_columns, uint64_t column_bytes)
      : path_(beside.string()),
        file_(beside),
        column_bytes_(column_bytes),
        buffers_(n_columns),
        written_(n_columns) {}

  template <typename T>
  void append(size_t column, T value) {
    std::string& buffer = buffers_[column];
    buffer.append(reinterpret_cast<const char*>(&value), sizeof value);
    if (buffer.size() >= buffer_bytes) flush(column);
  }

  /// Passes the bytes of a column to `take`, piece by piece.
  template <typename Take>
  void read(size_t column, const Take& take) {
    flush(column);
    std::string piece(buffer_bytes, '\0');
    for (uint64_t at = 0; at < written_[column];) {
      const size_t most = std::min<uint64_t>(piece.size(), written_[column] - at);
      const ssize_t n = ::pread(file_.descriptor(), piece.data(), most, place(column, at));
      if (n <= 0) refuse();
      take(std::string_view(piece).substr(0, static_cast<size_t>(n)));
      at += static_cast<uint64_t>(n);
    }
  }

 private:
  off_t place(size_t column, uint64_t at) const { return static_cast<off_t>(column * column_bytes_ + at); }
  [[noreturn]] void refuse() const { fail("{}: {}", path_, std::strerror(errno)); }
  void flush(size_t column) {
    std::string_view rest = buffers_[column];
    while (!rest.empty()) {
      const ssize_t n =
          ::pwrite(file_.descriptor(), rest.data(), rest.size(), place(column, written_[column]));
      if (n < 0) refuse();
      written_[column] += static_cast<uint64_t>(n);
      rest.remove_prefix(static_cast<size_t>(n));
    }
    buffers_[column].clear();
  }

  std::string path_;
  NewFile file_;
  uint64_t column_bytes_;
  std::vector<std::string> buffers_;
  std::vector<uint64_t> written_;
};

/// Converts UTF-8 to numpy's text format, four bytes per character. Records contain valid UTF-8 only.
std::u32string characters_of(const std::string& utf8) {
  std::u32string out;
  for (size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    const size_t n = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    char32_t c = n == 1 ? lead : lead & (0xffU >> (n + 1));
    for (size_t k = 1; k < n && i + k < utf8.size(); ++k)
      c = c << 6U | (static_cast<unsigned char>(utf8[i + k]) & 0x3fU);
    out.push_back(c);
    i += n;
  }
  return out;
}

/// Adds an array of texts, each padded to the longest.
void add_texts(ZipFile& npz, const std::string& name, const DistinctTexts& texts) {
  std::vector<std::u32string> rows;
  size_t longest = 1;
  for (const Interned& text : texts.all) {
    rows.push_back(characters_of(text));
    longest = std::max(longest, rows.back().size());
  }
  constexpr uint64_t most_bytes = uint64_t{1} << 30U;
  const uint64_t n_bytes = uint64_t{rows.size()} * longest * sizeof(char32_t);
  if (n_bytes > most_bytes)
    fail("{}: {} texts of up to {} characters are too many for an array: use csv or sqlite", name,
         rows.size(), longest);
  const std::string header = npy_header(fmt::format("<U{}", longest), fmt::format("({},)", rows.size()));
  npz.begin(name + ".npy", header.size() + n_bytes);
  npz.append(header);
  for (std::u32string& row : rows) {
    row.resize(longest, U'\0');
    npz.append({reinterpret_cast<const char*>(row.data()), longest * sizeof(char32_t)});
  }
  npz.end();
}

/// Returns the name of a column in the zip file: characters with a meaning in file systems become %XX.
std::string member_name(const std::string& column) {
  std::string out;
  for (const char c : column) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

void write_npz(const RecordColumns& records, const Rows& rows, const std::filesystem::path& file) {
  const std::vector<RecordColumn>& columns = records.columns();
  ColumnStore store(file, columns.size(), records.n_rows() * sizeof(double));
  std::vector<DistinctTexts> texts(columns.size());
  rows([&](std::span<const RecordValue> row) {
    for (size_t i = 0; i < row.size(); ++i)
      put_numpy(row[i], columns[i].kind, texts[i], [&](auto number) { store.append(i, number); });
  });
  constexpr int fastest = 1;
  ZipFile npz(file, fastest);
  for (size_t i = 0; i < columns.size(); ++i) {
    const std::string name = member_name(columns[i].name);
    const std::string header =
        npy_header(numpy_type(columns[i].kind), fmt::format("({},)", records.n_rows()));
    npz.begin(name + ".npy", header.size() + records.n_rows() * sizeof(double));
    npz.append(header);
    store.read(i, [&](std::string_view bytes) { npz.append(bytes); });
    npz.end();
    if (columns[i].kind == ColumnKind::text) add_texts(npz, name + "_names", texts[i]);
  }
  npz.finish();
}

void append_field(std::string& line, const RecordValue& value) {
  const auto append = [&](const auto& given) {
    using Value = std::decay_t<decltype(given)>;
    if constexpr (std::is_same_v<Value, Interned>) line += spreadsheet_field(given.str());
    if constexpr (std::is_arithmetic_v<Value>) fmt::format_to(std::back_inserter(line), "{}", given);
  };
  std::visit(append, value);
}

void write_csv(const RecordColumns& records, const Rows& rows, const fs::path& file) {
  constexpr size_t csv_buffer_bytes = size_t{1} << 20U;
  NewFile csv(file);
  std::string line, buffer;
  for (const RecordColumn& column : records.columns())
    line.append(line.empty() ? 0 : 1, ',').append(spreadsheet_field(column.name));
  buffer = line + "\n";
  rows([&](std::span<const RecordValue> row) {
    line.clear();
    for (size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line += ',';
      append_field(line, row[i]);
    }
    line += '\n';
    buffer += line;
    if (buffer.size() < csv_buffer_bytes) return;
    csv.append(buffer);
    buffer.clear();
  });
  csv.append(buffer);
  csv.commit();
}

struct Close {
  void operator()(sqlite3* db) const { sqlite3_close(db); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// Returns an SQL identifier, in which quotes are escaped.
std::string quoted(const std::string& name) {
  std::string out(1, '"');
  for (const char c : name) out.append(c == '"' ? 2 : 1, c);
  return out + '"';
}

class Database {
 public:
  explicit Database(const std::filesystem::path& file) : file_(file.string()) {
    sqlite3* db = nullptr;
    const int code = sqlite3_open_v2(file_.c_str(), &db, SQLITE_OPEN_READWRITE, nullptr);
    db_.reset(db);
    expect(code);
  }

  void execute(const std::string& sql) {
    expect(sqlite3_exec(db_.get(), sql.c_str(), nullptr, nullptr, nullptr));
  }
  std::unique_ptr<sqlite3_stmt, Close> prepare(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    expect(sqlite3_prepare_v2(db_.get(), sql.c_str(), -1, &statement, nullptr));
    return std::unique_ptr<sqlite3_stmt, Close>(statement);
  }
  void expect(int code) const {
    if (code != SQLITE_OK && code != SQLITE_DONE)
      fail("{}: {}", file_, one_line(db_ ? sqlite3_errmsg(db_.get()) : sqlite3_errstr(code)));
  }
  void close() { expect(sqlite3_close(db_.release())); }

 private:
  std::string file_;
  std::unique_ptr<sqlite3, Close> db_;
};

const char* sql_type(ColumnKind kind) {
  constexpr const char* types[] = {"TEXT", "INTEGER", "", "REAL"};  // unsigned: no affinity, see bind()
  return types[static_cast<size_t>(kind)];
}

int bind(sqlite3_stmt* statement, int at, const RecordValue& value) {
  if (const auto* text = std::get_if<Interned>(&value)) {
    return sqlite3_bind_text64(statement, at, text->str().data(), text->str().size(), SQLITE_STATIC,
                               SQLITE_UTF8);
  }
  if (const auto* count = std::get_if<int64_t>(&value)) return sqlite3_bind_int64(statement, at, *count);
  if (const auto* number = std::get_if<double>(&value)) return sqlite3_bind_double(statement, at, *number);
  if (const auto* large = std::get_if<uint64_t>(&value)) {
    if (*large <= static_cast<uint64_t>(std::numeric_limits<int64_t>::max()))
      return sqlite3_bind_int64(statement, at, static_cast<int64_t>(*large));
    const std::string digits =
        // larger than SQLite's integers: stored as text, since it would be rounded otherwise
        std::to_string(*large);
    return sqlite3_bind_text(statement, at, digits.c_str(), -1, SQLITE_TRANSIENT);
  }
  return sqlite3_bind_null(statement, at);
}

void write_sqlite(const RecordColumns& records, const Rows& rows, const std::filesystem::path& file) {
  std::string columns, places;
  for (const RecordColumn& column : records.columns()) {
    if (column.name.find('\0') != std::string::npos)
      fail("{}: the name of a number in the records contains a zero byte, which SQLite forbids: use csv",
           file.string());
    columns +=
        fmt::format("{}{} {}", columns.empty() ? "" : ", ", quoted(column.name), sql_type(column.kind));
    places += places.empty() ? "?" : ", ?";
  }
  NewFile whole(file);
  Database db(whole.temporary());
  // The file is renamed when it is complete, so no rollback is needed.
  db.execute("PRAGMA journal_mode = OFF");
  db.execute(fmt::format("CREATE TABLE records ({})", columns));
  db.execute("BEGIN");
  auto insert = db.prepare(fmt::format("INSERT INTO records VALUES ({})", places));
  rows([&](std::span<const RecordValue> row) {
    for (size_t i = 0; i < row.size(); ++i) db.expect(bind(insert.get(), static_cast<int>(i) + 1, row[i]));
    db.expect(sqlite3_step(insert.get()));
    db.expect(sqlite3_reset(insert.get()));
  });
  db.execute("COMMIT");
  insert.reset();
  db.close();
  whole.commit();
}

}  // namespace

ExportOutcome export_records(const fs::path& folder, ExportFormat format, const fs::path& out, bool quiet) {
  std::error_code ignored;
  if (fs::is_directory(out, ignored)) fail("{}: is a folder: expected the name of a file", out.string());
  const fs::path parent = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (!fs::is_directory(parent, ignored)) fail("{}: there is no folder {}", out.string(), parent.string());
  const RecordColumns records(folder);
  if (fs::exists(folder / "run.json", ignored)) {
    const std::string missing = missing_records(read_run_json(folder), records.n_rows(), folder);
    if (!missing.empty()) fail("{}", missing);
  }
  constexpr int step = 1000;
  Progress progress("thousand records", static_cast<int>(records.n_rows() / step), quiet);
  const Rows rows = [&](const RowVisitor& visit) {
    uint64_t n = 0;
    records.for_each_row([&](std::span<const RecordValue> row) {
      visit(row);
      if (++n % step == 0) progress.advance();
    });
  };
  constexpr decltype(&write_csv) writers[] = {write_csv, write_npz, write_sqlite};  // indexed by ExportFormat
  writers[static_cast<size_t>(format)](records, rows, out);
  sync_folder(out.has_parent_path() ? out.parent_path() : fs::path("."));
  return {records.n_rows(), records.columns().size()};
}

}  // namespace sextant
