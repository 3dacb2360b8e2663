#include "sextant/eval/records/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>
#include <thread>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/json.h"
#include "sextant/base/new_file.h"
#include "sextant/eval/records/case_summary.h"

namespace sextant {
namespace {

struct Header {
  uint64_t number = 0;
  uint64_t n_records = 0;           ///< number of lines of content
  std::optional<uint64_t> n_bytes;  ///< length of content that does not consist of lines
  Json noise;
  std::string sum;
};

std::optional<Header> read_header(std::string_view line) {
  try {
    const Json json = parse_json(line, "journal");
    Header header{json_member<uint64_t>(json, "case", "journal"),
                  json_member<uint64_t>(json, "records", "journal", 0), std::nullopt,
                  json.value("noise", Json()), json_member<std::string>(json, "sha256", "journal")};
    if (json.contains("bytes")) header.n_bytes = json_member<uint64_t>(json, "bytes", "journal");
    return header;
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Returns the next line including its end; nullopt if the file ends before.
std::optional<std::string> whole_line(std::ifstream& file) {
  std::string line;
  if (!std::getline(file, line) || file.eof()) return std::nullopt;
  return line += '\n';
}

/// Returns the content after the header, without the newline that ends a content of bytes; nullopt if the
/// file ends before.
std::optional<std::string> read_content(std::ifstream& file, const Header& header, uint64_t left_bytes) {
  std::string content;
  if (!header.n_bytes) {
    for (uint64_t n = header.n_records; n > 0; --n) {
      const std::optional<std::string> line = whole_line(file);
      if (!line) return std::nullopt;
      content += *line;
    }
    return content;
  }
  if (*header.n_bytes >= left_bytes) return std::nullopt;
  content.resize(*header.n_bytes);
  if (!file.read(content.data(), static_cast<std::streamsize>(content.size())) || file.get() != '\n')
    return std::nullopt;
  return content;
}

}  // namespace

Json case_json(uint64_t number, uint64_t n_records, const Json& noise) {
  Json json = {{"case", number}, {"records", n_records}};
  if (!noise.is_null()) json["noise"] = noise;
  return json;
}

bool is_finished_sweep(const std::filesystem::path& folder) {
  return has_results(folder) && !std::filesystem::exists(folder / "journal.jsonl");
}

Journal::Journal(std::filesystem::path path, Owners owners, const Fits& fits)
    : path_(std::move(path)), owners_(std::move(owners)) {
  // Reading the status of a sweep (sweep_status()) holds the lock briefly: retry for half a second.
  std::string holder;
  for (int tries = 0; tries < 5 && !lock_; ++tries) {
    if (tries > 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    lock_ = FileLock::take(path_, &holder);
  }
  if (!lock_)
    fail("{}: {} is writing this sweep; wait for it, or choose another folder", path_.string(), holder);
  file_ = Descriptor(::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_APPEND | O_NOFOLLOW, 0644));
  if (!file_) fail("{}: cannot open: {}", path_.string(), std::strerror(errno));
  sync_folder(path_.parent_path());
  find_blocks(fits);
}

std::string Journal::sum(const std::string& owner, uint64_t number, const Json& noise,
                         std::string_view content) {
  const std::string note = noise.is_null() ? "" : json_line(noise) + "\n";
  return sha256(fmt::format("{}\n{}\n{}{}", owner, number, note, content));
}

void Journal::find_blocks(const Fits& fits) {
  const uint64_t size = FileReader(path_, recording_file).size();
  std::ifstream file(path_, std::ios::binary);
  uint64_t at = 0;
  while (at < size) {
    const std::optional<std::string> line = whole_line(file);
    const std::optional<Header> header = line ? read_header(*line) : std::nullopt;
    if (!header) break;
    const uint64_t offset = at + line->size();
    const std::optional<std::string> content = read_content(file, *header, size - offset);
    if (!content) break;
    const std::vector<std::string> owners = owners_(header->number);
    const auto owner = std::ranges::find_if(owners, [&](const std::string& name) {
      return header->sum == sum(name, header->number, header->noise, *content);
    });
    if (owner == owners.end()) break;
    if (fits(header->number, *content))
      blocks_[header->number] = {header->n_records, header->noise, offset, content->size(),
                                 static_cast<size_t>(owner - owners.begin())};
    at = offset + content->size() + (header->n_bytes ? 1 : 0);
  }
  end_ = at;
  if (at < size && ::ftruncate(file_.get(), static_cast<off_t>(at)) != 0) {
    fail("{}: cannot cut off its unfinished end: {}", path_.string(), std::strerror(errno));
  }
}

void Journal::append(uint64_t number, uint64_t n_records, std::string_view lines, const Json& noise) {
  append_block(number, case_json(number, n_records, noise), {n_records, noise, 0, lines.size()}, lines);
}

void Journal::append_bytes(uint64_t number, std::string_view bytes) {
  append_block(number, {{"case", number}, {"bytes", bytes.size()}}, {0, {}, 0, bytes.size()}, bytes);
}

void Journal::append_block(uint64_t number, Json entry, const Block& known, std::string_view content) {
  entry["sha256"] = sum(owners_(number).front(), number, known.noise, content);
  const std::string header = json_line(entry) + "\n";
  std::string block = header;
  block += content;
  if (entry.contains("bytes")) block += '\n';
  const std::scoped_lock lock(mutex_);
  const auto give_up = [&] {
    const int reason = errno;
    // the next resume will find the end again
    if (::ftruncate(file_.get(), static_cast<off_t>(end_)) != 0) end_ = 0;
    fail(
        "{}: cannot write: {}; {} cases are safe: free some disk space and run the same "
        "command again",
        path_.string(), std::strerror(reason), blocks_.size());
  };
  if (!write_all(file_.get(), block) || ::fdatasync(file_.get()) != 0) give_up();
  Block& added = blocks_[number] = known;
  added.offset = end_ + header.size();
  end_ += block.size();
}

void Journal::clear() {
  if (::ftruncate(file_.get(), 0) != 0) fail("{}: cannot empty it: {}", path_.string(), std::strerror(errno));
  blocks_.clear();
  end_ = 0;
}

std::string Journal::content(const Block& block) const {
  std::string bytes(block.bytes, '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::pread(file_.get(), bytes.data() + done, bytes.size() - done,
                              static_cast<off_t>(block.offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0)
      fail("{}: cannot read: {}", path_.string(), n < 0 ? std::strerror(errno) : "it was cut off meanwhile");
    done += static_cast<size_t>(n);
  }
  return bytes;
}

}  // namespace sextant
