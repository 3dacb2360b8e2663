#include "sextant/eval/experiment/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/options.h"

namespace sextant {
namespace {

std::string header_line(uint64_t number, uint64_t n_records, std::string_view lines) {
  return Json{{"case", number}, {"records", n_records}, {"sha256", sha256(lines)}}.dump() + "\n";
}

/// The end of the n-th line from `from`; npos when there are fewer.
size_t end_of_lines(std::string_view text, size_t from, uint64_t n) {
  for (; n > 0; --n) {
    const size_t end = text.find('\n', from);
    if (end == std::string_view::npos) return end;
    from = end + 1;
  }
  return from;
}

}  // namespace

Journal::Journal(std::filesystem::path path) : path_(std::move(path)) {
  file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_APPEND, 0644);
  if (file_ < 0) fail("{}: cannot open: {}", path_.string(), std::strerror(errno));
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
    ::close(file_);
    fail("{}: another sweep is writing here; wait for it, or choose another folder", path_.string());
  }
  find_blocks();
}

Journal::~Journal() { ::close(file_); }

void Journal::find_blocks() {
  const std::string text = read_file(path_);
  size_t at = 0;
  while (at < text.size()) {
    const size_t header_end = end_of_lines(text, at, 1);
    if (header_end == std::string::npos) break;
    const Json header = Json::parse(text.substr(at, header_end - at), nullptr, /*allow_exceptions=*/false);
    const bool is_header = header.is_object() && header.contains("case") &&
                           header["case"].is_number_unsigned() && header.contains("records") &&
                           header["records"].is_number_unsigned() && header.contains("sha256");
    if (!is_header) break;
    const uint64_t n_records = header["records"];
    const size_t end = end_of_lines(text, header_end, n_records);
    if (end == std::string::npos) break;
    if (header["sha256"] != sha256(std::string_view(text).substr(header_end, end - header_end))) break;
    blocks_[header["case"]] = {n_records, header_end, end - header_end};
    at = end;
  }
  end_ = at;
  if (at < text.size() && ::ftruncate(file_, static_cast<off_t>(at)) != 0) {
    fail("{}: cannot cut off its unfinished end: {}", path_.string(), std::strerror(errno));
  }
}

void Journal::append(uint64_t number, uint64_t n_records, std::string_view lines) {
  const std::string header = header_line(number, n_records, lines);
  std::string block = header;
  block += lines;
  const std::scoped_lock lock(mutex_);
  size_t done = 0;
  while (done < block.size()) {
    const ssize_t n = ::write(file_, block.data() + done, block.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int reason = errno;
      if (::ftruncate(file_, static_cast<off_t>(end_)) != 0) end_ = 0;  // found again on resuming
      fail("{}: cannot write: {}; {} cases are safe: make room and give the same command again",
           path_.string(), std::strerror(reason), blocks_.size());
    }
    done += static_cast<size_t>(n);
  }
  blocks_[number] = {n_records, end_ + header.size(), lines.size()};
  end_ += block.size();
}

std::string Journal::ordered_lines() const {
  const std::string text = read_file(path_);
  std::string lines;
  lines.reserve(text.size());
  for (const auto& [number, block] : blocks_) lines.append(text, block.offset, block.bytes);
  return lines;
}

}  // namespace sextant
