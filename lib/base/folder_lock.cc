#include "sextant/base/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "sextant/base/descriptor.h"
#include "sextant/base/error.h"
#include "sextant/base/file_lock.h"
#include "sextant/base/files.h"

namespace sextant {
namespace {

using Identity = std::pair<dev_t, ino_t>;

std::optional<Identity> identity(int status, const struct stat& info) {
  return status == 0 ? std::optional(Identity(info.st_dev, info.st_ino)) : std::nullopt;
}

/// Makes the folders on the way to `folder` that are not there; those made are appended to `made`, outermost first.
void make_folders(const fs::path& folder, std::vector<fs::path>& made) {
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) return;
  if (folder.has_parent_path() && folder != folder.parent_path()) make_folders(folder.parent_path(), made);
  if (::mkdir(folder.c_str(), 0777) == 0) {
    made.push_back(folder);
  } else if (errno != EEXIST) {
    fail("{}: cannot create: {}", folder.string(), std::strerror(errno));
  }
}

}  // namespace

struct FolderLock::Held {
  ~Held() {
    for (auto folder = made.rbegin(); folder != made.rend(); ++folder) ::rmdir(folder->c_str());
  }

  pid_t owner = ::getpid();  // a child process inherits this, but not the lock
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
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored))
    fail("{}: is a file, expected a folder for the results", folder.string());
  const fs::path path = fs::absolute(folder).lexically_normal();
  const auto refuse = [&](const std::string& holder) {
    fail("{}: {} is writing into this folder: wait until it has ended, or choose another folder", folder.string(), holder);
  };
  for (int attempt = 0; attempt < 10; ++attempt) {
    auto held = std::make_shared<Held>();
    make_folders(path, held->made);
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
      if (errno == EWOULDBLOCK) refuse("another process");
      std::string holder;
      held->file = FileLock::take(path / ".lock", &holder);
      if (!held->file) refuse(holder);
    }
    if (identity(::stat(path.c_str(), &info), info) != own) continue;
    all[*own] = held;
    held_ = std::move(held);
    return;
  }
  refuse("another process");
}

}  // namespace sextant
