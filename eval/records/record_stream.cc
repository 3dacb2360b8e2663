#include "sextant/eval/records/record_stream.h"

#include <cstring>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/eval/records/summary_file.h"

namespace sextant {
namespace {

constexpr size_t block_bytes = size_t{4} << 20U;
static_assert(block_bytes > max_record_bytes);

/// Line after line of one file.
class LineReader {
 public:
  LineReader(std::string name, const RecordVisitor& visit) : name_(std::move(name)), visit_(visit) {}

  /// Visits the whole lines; returns what follows them.
  std::string_view read_lines(std::string_view text) {
    while (!text.empty()) {
      const void* end = std::memchr(text.data(), '\n', text.size());
      const size_t size =
          end == nullptr ? text.size() : static_cast<size_t>(static_cast<const char*>(end) - text.data());
      if (size > max_record_bytes)
        fail("{}: the line has more than {} bytes: expected a record", where(), max_record_bytes);
      if (end == nullptr) break;
      read_line(text.substr(0, size));
      text.remove_prefix(size + 1);
    }
    return text;
  }

  void expect_end(std::string_view rest) const {
    if (rest.empty()) return;
    fail("{}: the line is not finished: the file is truncated; repeat the run that wrote it", where());
  }

 private:
  /// Of the line that was not read yet.
  std::string where() const { return fmt::format("{}:{}", name_, n_lines_ + 1); }

  void read_line(std::string_view line) {
    if (!scan_record(line, record_))
      record_ = record_from_json(parse_json(line, name_, n_lines_ + 1), where());
    ++n_lines_;
    visit_(record_);
  }

  std::string name_;
  const RecordVisitor& visit_;
  int n_lines_ = 0;
  Record record_;
};

}  // namespace

void for_each_record(std::string_view text, const std::string& name, const RecordVisitor& visit) {
  LineReader lines(name, visit);
  lines.expect_end(lines.read_lines(text));
}

void for_each_record(const std::filesystem::path& path, const RecordVisitor& visit) {
  check_keeps_records(path);
  const FileReader file(path, streamed_file);
  LineReader lines(path.string(), visit);
  std::vector<char> block(block_bytes);
  size_t kept = 0;  // the beginning of a line
  for (uint64_t at = 0;;) {
    const size_t n = file.read(block.data() + kept, block.size() - kept, at);
    const std::string_view rest = lines.read_lines({block.data(), kept + n});
    if (n == 0) return lines.expect_end(rest);
    at += n;
    kept = rest.size();
    std::memmove(block.data(), rest.data(), kept);
  }
}

}  // namespace sextant
