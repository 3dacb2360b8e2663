#include "sextant/base/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/machine.h"
#include "sextant/base/new_file.h"

namespace sextant {
namespace {

struct Holder {
  std::string host;
  long pid = 0;
};

/// Returns the process that created a lock file; nullopt if the file is gone or has another content.
std::optional<Holder> read_holder(const fs::path& lock_file) {
  std::ifstream file(lock_file);
  Holder holder;
  if (!(file >> holder.host >> holder.pid)) return std::nullopt;
  return holder;
}

/// Creates `lock_file` with link(), which succeeds for one process only, also on NFS. Returns false if the
/// file already exists, and throws Error if it cannot be created for another reason.
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
  FileLock lock(Descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644)));
  if (!lock.descriptor_ && errno == ELOOP)
    fail("{}: is a link, expected a regular file: remove the link", file.string());
  if (!lock.descriptor_) fail("{}: cannot open: {}", file.string(), std::strerror(errno));
  int result = 0;
  do {
    result = flock(lock.descriptor_.get(), LOCK_EX | LOCK_NB);
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
      *holder = found ? fmt::format("process {} on {} (if it no longer exists, remove {})", found->pid,
                                    found->host, lock_file.string())
                      : fmt::format("another process (see {})", lock_file.string());
    }
    return std::nullopt;
  }
  if (holder != nullptr) *holder = "another process";
  return std::nullopt;
}

FileLock::FileLock(FileLock&& other) noexcept { *this = std::move(other); }

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  descriptor_ = std::move(other.descriptor_);
  lock_file_.swap(other.lock_file_);
  return *this;
}

FileLock::~FileLock() {
  if (!lock_file_.empty()) ::unlink(lock_file_.c_str());
}

namespace {

using Identity = std::pair<dev_t, ino_t>;

std::optional<Identity> identity(int status, const struct stat& info) {
  return status == 0 ? std::optional(Identity(info.st_dev, info.st_ino)) : std::nullopt;
}

/// Creates `folder` and its missing parents, and appends those that were created to `made`, outermost first.
/// Returns false if a parent was removed meanwhile by another process, or is a broken link.
bool make_folders(const fs::path& folder, std::vector<fs::path>& made) {
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) return true;
  if (folder.has_parent_path() && folder != folder.parent_path() && !make_folders(folder.parent_path(), made))
    return false;
  if (::mkdir(folder.c_str(), 0777) == 0) {
    made.push_back(folder);
  } else if (errno == ENOENT) {
    return false;
  } else if (errno != EEXIST) {
    fail("{}: cannot create: {}", folder.string(), std::strerror(errno));
  }
  return true;
}

}  // namespace

struct FolderLock::Held {
  ~Held() {
    for (auto path = made.rbegin(); path != made.rend(); ++path) ::rmdir(path->c_str());
  }

  pid_t owner = ::getpid();  // a forked child inherits this object, but must not use the lock
  std::vector<fs::path> made;
  Descriptor folder;
  std::optional<FileLock> file;
};

FolderLock::FolderLock(const fs::path& folder) {
  static std::mutex mutex;
  static std::map<Identity, std::weak_ptr<Held>> all;
  const std::scoped_lock lock(mutex);

  if (folder.empty()) fail("--out: expected a folder, got ''");
  std::error_code ignored;
  const fs::file_status there = fs::status(folder, ignored);
  if (fs::exists(there) && !fs::is_directory(there))
    fail("{}: is a file, expected a folder for the results", folder.string());
  const fs::path path = fs::absolute(folder).lexically_normal();
  const auto refuse = [&](const std::string& holder, Held& held) {
    // Only the process that holds the lock of a folder removes it: the holder may be about to write its first
    // file into a folder that this process made and that is still empty.
    held.made.clear();
    fail("{}: {} is writing into this folder: wait until it has ended, or choose another folder",
         folder.string(), holder);
  };
  for (int attempt = 0; attempt < 1000; ++attempt) {
    auto held = std::make_shared<Held>();
    if (!make_folders(path, held->made)) continue;
    held->folder = Descriptor(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!held->folder && errno == ENOENT) continue;  // removed since by the process that had made it
    if (!held->folder) fail("{}: cannot open: {}", folder.string(), std::strerror(errno));
    struct stat info {};
    const std::optional<Identity> own = identity(::fstat(held->folder.get(), &info), info);
    if (!own) fail("{}: cannot stat: {}", folder.string(), std::strerror(errno));
    if (const auto shared = all[*own].lock(); shared && shared->owner == ::getpid()) {
      held_ = shared;
      return;
    }
    if (::flock(held->folder.get(), LOCK_EX | LOCK_NB) != 0) {
      if (errno == EWOULDBLOCK) refuse("another process", *held);
      std::string holder;
      held->file = FileLock::take(path / ".lock", &holder);
      if (!held->file) refuse(holder, *held);
    }
    if (identity(::stat(path.c_str(), &info), info) != own) {
      held->made.clear();  // removed, or replaced by a folder of another process
      continue;
    }
    all[*own] = held;
    held_ = std::move(held);
    return;
  }
  fail("{}: cannot create: a folder of the path is a broken link, or another process keeps removing it",
       folder.string());
}

}  // namespace sextant
