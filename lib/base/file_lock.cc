#include "sextant/base/file_lock.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/machine.h"

namespace sextant {
namespace {

struct Holder {
  std::string host;
  long pid = 0;
};

/// Nothing while it is being written.
std::optional<Holder> read_holder(const fs::path& lock_file) {
  std::ifstream file(lock_file);
  Holder holder;
  if (!(file >> holder.host >> holder.pid)) return std::nullopt;
  return holder;
}

/// Makes `lock_file`, which link() does for one process only, on NFS too. False when it is there.
bool make_lock_file(const fs::path& lock_file) {
  const fs::path own = fmt::format("{}.{}.{}", lock_file.string(), host_name(), ::getpid());
  write_file(own, fmt::format("{} {}\n", host_name(), ::getpid()));
  const bool made = ::link(own.c_str(), lock_file.c_str()) == 0;
  const int reason = errno;
  ::unlink(own.c_str());
  if (!made && reason != EEXIST) fail("{}: cannot lock: {}", lock_file.string(), std::strerror(reason));
  return made;
}

}  // namespace

std::optional<FileLock> FileLock::take(const fs::path& file, std::string* holder, Flock flock) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (descriptor < 0 && errno == ELOOP)
    fail("{}: is a link: what is locked may lie in no other folder; remove it", file.string());
  if (descriptor < 0) fail("{}: cannot open: {}", file.string(), std::strerror(errno));
  FileLock lock(descriptor, {});
  int result = 0;
  do {
    result = flock(descriptor, LOCK_EX | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  if (result == 0) return lock;
  if (errno == EWOULDBLOCK) {
    if (holder != nullptr) *holder = "another process";
    return std::nullopt;
  }
  if (errno != ENOLCK && errno != ENOSYS && errno != EOPNOTSUPP)
    fail("{}: cannot lock: {}", file.string(), std::strerror(errno));

  const fs::path lock_file = file.string() + ".lock";
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (make_lock_file(lock_file)) {
      lock.lock_file_ = lock_file;
      return lock;
    }
    const std::optional<Holder> found = read_holder(lock_file);
    if (found && found->host == host_name() && ::kill(static_cast<pid_t>(found->pid), 0) != 0 &&
        errno == ESRCH) {
      ::unlink(lock_file.c_str());
      continue;
    }
    if (holder != nullptr) {
      *holder = found ? fmt::format("process {} on {} (if it is no more: remove {})", found->pid, found->host,
                                    lock_file.string())
                      : fmt::format("another process (see {})", lock_file.string());
    }
    return std::nullopt;
  }
  if (holder != nullptr) *holder = "another process";
  return std::nullopt;
}

FileLock::FileLock(FileLock&& other) noexcept { *this = std::move(other); }

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  lock_file_.swap(other.lock_file_);
  return *this;
}

FileLock::~FileLock() {
  if (!lock_file_.empty()) ::unlink(lock_file_.c_str());
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace sextant
