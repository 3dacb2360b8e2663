#include <sqlite3.h>

#include "sextant/base/error.h"
#include "sextant/base/new_file.h"
#include "sextant/base/text.h"
#include "sextant/eval/export/record_columns.h"

namespace sextant {
namespace {

struct Close {
  void operator()(sqlite3* db) const { sqlite3_close(db); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

/// An SQL identifier: no text ends it but its own quote.
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

const char* type_of(ColumnKind kind) {
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
        std::to_string(*large);  // beyond SQLite's integers: a text, or it would be rounded
    return sqlite3_bind_text(statement, at, digits.c_str(), -1, SQLITE_TRANSIENT);
  }
  return sqlite3_bind_null(statement, at);
}

}  // namespace

void write_sqlite(const RecordColumns& records, const Rows& rows, const std::filesystem::path& file) {
  std::string columns, places;
  for (const RecordColumn& column : records.columns()) {
    if (column.name.find('\0') != std::string::npos)
      fail("{}: the records name a number with a zero byte, which SQLite cannot: use csv", file.string());
    columns += fmt::format("{}{} {}", columns.empty() ? "" : ", ", quoted(column.name), type_of(column.kind));
    places += places.empty() ? "?" : ", ?";
  }
  NewFile whole(file);
  Database db(whole.temporary());
  // The file gets its name when it is whole, so there is nothing to roll back.
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

}  // namespace sextant
