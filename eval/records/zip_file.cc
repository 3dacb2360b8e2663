#include "sextant/eval/records/zip_file.h"

#include <minizip/zip.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "sextant/base/error.h"

namespace sextant {
namespace {

/// minizip's function to open a file, applied to the descriptor to which `opaque` points.
voidpf open_descriptor(voidpf opaque, const void* /*name*/, int /*mode*/) {
  const int copy = ::dup(*static_cast<const int*>(opaque));
  std::FILE* file = copy < 0 ? nullptr : ::fdopen(copy, "w+b");
  if (file == nullptr && copy >= 0) ::close(copy);
  return file;
}

}  // namespace

ZipFile::ZipFile(const std::filesystem::path& path, int level) : path_(path), file_(path), level_(level) {
  zlib_filefunc64_def functions{};
  fill_fopen64_filefunc(&functions);
  functions.zopen64_file = open_descriptor;
  int descriptor = file_.descriptor();
  functions.opaque = &descriptor;  // read once, when the file is opened
  zip_ = zipOpen2_64(path.c_str(), APPEND_STATUS_CREATE, nullptr, &functions);
  if (zip_ == nullptr) fail("{}: cannot write", path.string());
}

ZipFile::~ZipFile() {
  if (zip_ != nullptr) zipClose(zip_, nullptr);
}

void ZipFile::expect(bool good, const std::string& what) const {
  if (!good) fail("{}: cannot write{}", path_.string(), what);
}

void ZipFile::begin(const std::string& name, uint64_t n_bytes) {
  name_ = " " + name;
  zip_fileinfo info{};
  info.tmz_date = {0, 0, 0, 1, 0, 1980};  // constant, for reproducible bytes
  const int is_large = n_bytes >= std::numeric_limits<uint32_t>::max() ? 1 : 0;
  expect(zipOpenNewFileInZip64(zip_, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr,
                               level_ > 0 ? Z_DEFLATED : 0, level_, is_large) == ZIP_OK,
         name_);
}

void ZipFile::append(std::string_view bytes) {
  constexpr size_t most = size_t{1} << 30U;
  for (; !bytes.empty(); bytes.remove_prefix(std::min(most, bytes.size()))) {
    const auto n = static_cast<unsigned>(std::min(most, bytes.size()));
    expect(zipWriteInFileInZip(zip_, bytes.data(), n) == ZIP_OK, name_);
  }
}

void ZipFile::end() { expect(zipCloseFileInZip(zip_) == ZIP_OK, name_); }

void ZipFile::add(const std::string& name, std::string_view bytes) {
  begin(name, bytes.size());
  append(bytes);
  end();
}

void ZipFile::finish() {
  const bool good = zipClose(zip_, nullptr) == ZIP_OK;
  zip_ = nullptr;
  expect(good, "");
  file_.commit();
}

std::string npy_header(std::string_view type, std::string_view shape) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", type, shape);
  constexpr size_t preamble = 10, block = 64;
  header.append(block - (preamble + header.size() + 1) % block, ' ').push_back('\n');
  std::string out("\x93NUMPY\x01\x00", 8);
  out.push_back(static_cast<char>(header.size() & 0xff));
  out.push_back(static_cast<char>(header.size() >> 8));
  return out + header;
}

}  // namespace sextant
