#include "sextant/eval/records/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <thread>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"

namespace sextant {
namespace {

struct Header {
  uint64_t number = 0;
  uint64_t n_records = 0;
  Json noise;
  std::string sum;
};

std::optional<Header> read_header(std::string_view line) {
  try {
    const Json json = parse_json(line, "journal");
    return Header{json_member<uint64_t>(json, "case", "journal"),
                  json_member<uint64_t>(json, "records", "journal"), json.value("noise", Json()),
                  json_member<std::string>(json, "sha256", "journal")};
  } catch (const Error&) {
    return std::nullopt;
  }
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

Json case_json(uint64_t number, uint64_t n_records, const Json& noise) {
  Json json = {{"case", number}, {"records", n_records}};
  if (!noise.is_null()) json["noise"] = noise;
  return json;
}

bool is_finished_sweep(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "records.jsonl") && !std::filesystem::exists(folder / "journal.jsonl");
}

Journal::Journal(std::filesystem::path path, std::string owner, const Fits& fits)
    : path_(std::move(path)), owner_(std::move(owner)) {
  // A look at the state of a sweep (sweep_status.h) holds the lock for a moment: try again for half a second.
  std::string holder;
  for (int tries = 0; tries < 5 && !lock_; ++tries) {
    if (tries > 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    lock_ = FileLock::take(path_, &holder);
  }
  if (!lock_)
    fail("{}: {} is writing this sweep; wait for it, or choose another folder", path_.string(), holder);
  file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_APPEND | O_NOFOLLOW, 0644);
  if (file_ < 0) fail("{}: cannot open: {}", path_.string(), std::strerror(errno));
  sync_folder(path_.parent_path());
  find_blocks(fits);
}

Journal::~Journal() { ::close(file_); }

std::string Journal::sum(uint64_t number, const Json& noise, std::string_view lines) const {
  const std::string note = noise.is_null() ? "" : json_line(noise) + "\n";
  return sha256(fmt::format("{}\n{}\n{}{}", owner_, number, note, lines));
}

void Journal::find_blocks(const Fits& fits) {
  const std::string text = read_file(path_, records_file);
  size_t at = 0;
  while (at < text.size()) {
    const size_t header_end = end_of_lines(text, at, 1);
    if (header_end == std::string::npos) break;
    const std::optional<Header> header = read_header(std::string_view(text).substr(at, header_end - at));
    if (!header) break;
    const size_t end = end_of_lines(text, header_end, header->n_records);
    if (end == std::string::npos) break;
    const std::string_view lines = std::string_view(text).substr(header_end, end - header_end);
    if (header->sum != sum(header->number, header->noise, lines)) break;
    if (fits(header->number, lines))
      blocks_[header->number] = {header->n_records, header->noise, header_end, lines.size()};
    at = end;
  }
  end_ = at;
  if (at < text.size() && ::ftruncate(file_, static_cast<off_t>(at)) != 0) {
    fail("{}: cannot cut off its unfinished end: {}", path_.string(), std::strerror(errno));
  }
}

void Journal::append(uint64_t number, uint64_t n_records, std::string_view lines, const Json& noise) {
  Json entry = case_json(number, n_records, noise);
  entry["sha256"] = sum(number, noise, lines);
  const std::string header = json_line(entry) + "\n";
  std::string block = header;
  block += lines;
  const std::scoped_lock lock(mutex_);
  const auto give_up = [&] {
    const int reason = errno;
    if (::ftruncate(file_, static_cast<off_t>(end_)) != 0) end_ = 0;  // found again on resuming
    fail("{}: cannot write: {}; {} cases are safe: make room and give the same command again", path_.string(),
         std::strerror(reason), blocks_.size());
  };
  size_t done = 0;
  while (done < block.size()) {
    const ssize_t n = ::write(file_, block.data() + done, block.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) give_up();
    done += static_cast<size_t>(n);
  }
  if (::fdatasync(file_) != 0) give_up();
  blocks_[number] = {n_records, noise, end_ + header.size(), lines.size()};
  end_ += block.size();
}

std::string Journal::ordered_lines() const {
  const std::string text = read_file(path_, records_file);
  std::string lines;
  lines.reserve(text.size());
  for (const auto& [number, block] : blocks_) lines.append(text, block.offset, block.bytes);
  return lines;
}

}  // namespace sextant
