#include "sextant/base/new_file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

#include "sextant/base/error.h"

namespace sextant {
namespace {

uint64_t random_number() {
  uint64_t number = 0;
  if (::getrandom(&number, sizeof number, 0) != sizeof number)
    fail("cannot get random bytes from the system: {}", std::strerror(errno));
  return number;
}

}  // namespace

bool write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(file, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    bytes.remove_prefix(static_cast<size_t>(n));
  }
  return true;
}

NewFile::NewFile(std::filesystem::path path) : path_(std::move(path)) {
  struct stat info {};
  if (::stat(path_.c_str(), &info) == 0 && !S_ISREG(info.st_mode))
    fail("{}: is a {}: expected the name of a file", path_.string(),
         S_ISDIR(info.st_mode) ? "folder" : "pipe or device");
  for (int attempt = 0; attempt < 10 && !file_; ++attempt) {
    temporary_ = fmt::format("{}.tmp{:016x}", path_.string(), random_number());
    file_ = Descriptor(::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
    if (!file_ && errno != EEXIST) break;
  }
  if (!file_) give_up("create");
}

NewFile::~NewFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void NewFile::append(std::string_view bytes) const {
  if (!write_all(file_.get(), bytes)) give_up("write");
}

void NewFile::commit() {
  if (::fsync(file_.get()) != 0) give_up("write");
  file_.close();
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) give_up("rename");
  temporary_.clear();
}

void NewFile::give_up(const char* what) const {
  fail("{}: cannot {}: {}", path_.string(), what, std::strerror(errno));
}

}  // namespace sextant
