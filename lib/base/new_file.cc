#include "sextant/base/new_file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <set>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/interrupt.h"

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

std::filesystem::path temporary_folder() {
  for (const char* variable : {"TMPDIR", "TMP", "TEMP", "TEMPDIR"}) {  // as temp_directory_path()
    if (const char* folder = std::getenv(variable); folder != nullptr && *folder != '\0') return folder;
  }
  return "/tmp";
}

ScratchFolder::ScratchFolder(const std::string& prefix)
    : path_(create_watched_folder([&]() -> std::filesystem::path {
        std::string name = (temporary_folder() / (prefix + "XXXXXX")).string();
        if (::mkdtemp(name.data()) == nullptr)
          fail(
              "{}: cannot create this temporary folder: set TMPDIR to a folder with free space in which you "
              "may create files",
              name);
        return name;
      })) {}

ScratchFolder::~ScratchFolder() { remove_watched_folder(path_); }

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

namespace {

void check_relative(const fs::path& root, const fs::path& relative) {
  const bool leaves = relative.is_absolute() || std::ranges::find(relative, fs::path("..")) != relative.end();
  if (leaves || relative.empty())
    fail("{}: '{}' is not a path inside this folder", root.string(), relative.string());
}

[[noreturn]] void refuse(const fs::path& path) {
  const int reason = errno;
  struct stat info {};
  if (::lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode))
    fail("{}: is a link: output is not written through links; remove the link", path.string());
  if (reason == EEXIST || reason == ENOTDIR) fail("{}: is a file, expected a folder", path.string());
  fail("{}: cannot create: {}", path.string(), std::strerror(reason));
}

/// Opens the folder `relative` below `root` without following links; creates missing folders.
Descriptor open_below(const fs::path& root, const fs::path& relative) {
  constexpr int flags = O_RDONLY | O_DIRECTORY | O_CLOEXEC;
  Descriptor folder(::open(root.c_str(), flags));
  if (!folder) fail("{}: cannot open: {}", root.string(), std::strerror(errno));
  fs::path path = root;
  for (const fs::path& name : relative) {
    if (name.empty() || name == ".") continue;
    path /= name;
    if (::mkdirat(folder.get(), name.c_str(), 0777) != 0 && errno != EEXIST) refuse(path);
    folder = Descriptor(::openat(folder.get(), name.c_str(), flags | O_NOFOLLOW));
    if (!folder) refuse(path);
  }
  return folder;
}

}  // namespace

std::string safe_file_name(std::string_view text) {
  constexpr size_t longest = 200, n_digits = 16;
  std::string name(text);
  std::ranges::replace_if(
      name, [](char c) { return c == '/' || static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, '-');
  if (name.starts_with('.')) name.front() = '_';
  if (name.size() > longest) {
    size_t kept = longest - n_digits - 1;
    while (kept > 0 && (static_cast<unsigned char>(name[kept]) & 0xc0U) == 0x80U)
      --kept;  // do not cut inside a character
    name = name.substr(0, kept) + "-" + sha256(text).substr(0, n_digits);
  }
  return name.empty() ? "_" : name;
}

std::vector<std::string> distinct_names(std::vector<std::string> names) {
  std::set<std::string> taken;
  for (std::string& name : names) {
    const std::string given = name;
    for (int i = 2; !taken.insert(name).second; ++i) name = fmt::format("{}-{}", given, i);
  }
  return names;
}

fs::path make_folder_below(const fs::path& root, const fs::path& relative) {
  check_relative(root, relative);
  open_below(root, relative);
  return root / relative;
}

void move_below(const fs::path& from, const fs::path& root, const fs::path& relative) {
  check_relative(root, relative);
  const Descriptor folder = open_below(root, relative.parent_path());
  if (::renameat(AT_FDCWD, from.c_str(), folder.get(), relative.filename().c_str()) != 0)
    fail("{}: cannot create: {}", (root / relative).string(), std::strerror(errno));
}

void check_private_folder(const fs::path& folder) {
  struct stat info {};
  if (::stat(folder.c_str(), &info) != 0) {
    if (errno == ENOENT || errno == ENOTDIR) return;
    fail("{}: cannot stat: {}", folder.string(), std::strerror(errno));
  }
  if (info.st_uid != ::geteuid())
    fail(
        "{}: this cache belongs to another user, so its content cannot be trusted; choose another "
        "folder (--cache, SEXTANT_CACHE)",
        folder.string());
  if ((info.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    fail(
        "{}: others may write into this cache, so its content cannot be trusted; run `chmod go-w` on it, "
        "or choose another folder (--cache, SEXTANT_CACHE)",
        folder.string());
}

void make_private_folder(const fs::path& folder) {
  std::error_code ignored;
  const fs::path parent = folder.parent_path();
  if (!parent.empty()) fs::create_directories(parent, ignored);
  const int reason = ::mkdir(folder.c_str(), 0700) == 0 ? 0 : errno;
  if (reason != 0 && !fs::is_directory(folder, ignored))
    fail("{}: cannot create the cache: {}; choose another folder with --cache", folder.string(),
         std::strerror(reason));
  check_private_folder(folder);
}

}  // namespace sextant
