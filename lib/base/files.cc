#include "sextant/base/files.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/sha.h>
#include <sys/stat.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/new_file.h"

namespace sextant {
namespace {

std::string size_text(uint64_t bytes, int digits) {
  const bool large = bytes >= 50'000'000;
  return fmt::format("{:.{}f} {}", static_cast<double>(bytes) / (large ? 1e9 : 1e6), digits,
                     large ? "GB" : "MB");
}

std::string hexadecimal(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

struct LastOpened {
  std::mutex mutex;
  std::string path;
};

LastOpened& last_opened() {
  static LastOpened last;
  return last;
}

}  // namespace

std::string last_opened_file() {
  const std::scoped_lock lock(last_opened().mutex);
  return last_opened().path;
}

FileReader::FileReader(const std::filesystem::path& path, const FileKind& kind) : path_(path.string()) {
  // O_NONBLOCK: opening a pipe would otherwise block until it has a writer.
  file_ = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file_) fail("{}: cannot open: {}", path_, std::strerror(errno));
  struct stat info {};
  std::string problem;
  if (::fstat(file_.get(), &info) != 0) {
    problem = fmt::format("cannot stat: {}", std::strerror(errno));
  } else if (S_ISDIR(info.st_mode)) {
    problem = "is a folder, expected a file";
  } else if (!S_ISREG(info.st_mode)) {
    problem = "is a pipe or device, expected a file: save its content to a file first";
  } else if (size_ = static_cast<uint64_t>(info.st_size); size_ > kind.max_bytes) {
    problem = fmt::format("has {}, expected at most {} for {}", size_text(size_, 1),
                          size_text(kind.max_bytes, 2), kind.name);
  }
  if (problem.empty()) {
    const std::scoped_lock lock(last_opened().mutex);
    last_opened().path = path_;
    return;
  }
  fail("{}: {}", path_, problem);
}

size_t FileReader::read(char* to, size_t n, uint64_t at) const {
  check_interrupt();
  size_t done = 0;
  while (done < n) {
    const ssize_t got = ::pread(file_.get(), to + done, n - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("{}: cannot read: {}", path_, std::strerror(errno));
    if (got == 0) break;
    done += static_cast<size_t>(got);
  }
  return done;
}

std::string read_file(const std::filesystem::path& path, const FileKind& kind) {
  const FileReader file(path, kind);
  std::string bytes(static_cast<size_t>(file.size()), '\0');
  bytes.resize(file.read(bytes.data(), bytes.size(), 0));
  return bytes;
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  NewFile file(path);
  file.append(bytes);
  file.commit();
}

StreamedFile::StreamedFile(std::filesystem::path path)
    : path_(std::move(path)),
      file_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644)) {
  if (!file_) fail("{}: cannot create: {}", path_.string(), std::strerror(errno));
}

void StreamedFile::append(std::string_view bytes) {
  buffer_ += bytes;
  if (buffer_.size() >= size_t{1} << 20U) flush();
}

void StreamedFile::flush() {
  if (!write_all(file_.get(), buffer_)) fail("{}: cannot write: {}", path_.string(), std::strerror(errno));
  buffer_.clear();
}

void StreamedFile::close() {
  flush();
  if (::fsync(file_.get()) != 0) fail("{}: cannot write: {}", path_.string(), std::strerror(errno));
  file_.close();
}

void sync_folder(const std::filesystem::path& folder) {
  const Descriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // EINVAL: some network file systems do not support fsync() of folders.
  if (!file || (::fsync(file.get()) != 0 && errno != EINVAL))
    fail("{}: cannot write: {}", folder.string(), std::strerror(errno));
}

std::string sha256(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  ::SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  return hexadecimal(digest);
}

std::string InputLog::read(const std::filesystem::path& path) {
  std::string bytes = read_file(path);
  Entry entry{bytes.size(), sha256(bytes)};
  const std::scoped_lock lock(mutex_);
  entries_[path.string()] = std::move(entry);
  return bytes;
}

std::map<std::string, InputLog::Entry> InputLog::entries() const {
  const std::scoped_lock lock(mutex_);
  return entries_;
}

std::string file_sha256(const std::filesystem::path& path) {
  constexpr size_t piece_bytes = size_t{1} << 20U;
  const FileReader file(path, streamed_file);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  SEXTANT_CHECK(context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1);
  std::vector<char> piece(piece_bytes);
  uint64_t at = 0;
  for (size_t n = file.read(piece.data(), piece.size(), at); n > 0;
       n = file.read(piece.data(), piece.size(), at)) {
    SEXTANT_CHECK(EVP_DigestUpdate(context.get(), piece.data(), n) == 1);
    at += n;
  }
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  SEXTANT_CHECK(EVP_DigestFinal_ex(context.get(), digest.data(), &size) == 1);
  return hexadecimal(std::span(digest).first(size));
}

}  // namespace sextant
