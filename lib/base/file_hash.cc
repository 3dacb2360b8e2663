#include "sextant/base/file_hash.h"

#include <openssl/evp.h>

#include <array>
#include <memory>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/files.h"

namespace sextant {

std::string file_sha256(const std::filesystem::path& path) {
  constexpr size_t piece_bytes = size_t{1} << 20U;
  const FileReader file(path, streamed_file);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  SEXTANT_CHECK(context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1);
  std::vector<char> piece(piece_bytes);
  uint64_t at = 0;
  for (size_t n = file.read(piece.data(), piece.size(), at); n > 0; n = file.read(piece.data(), piece.size(), at)) {
    SEXTANT_CHECK(EVP_DigestUpdate(context.get(), piece.data(), n) == 1);
    at += n;
  }
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  SEXTANT_CHECK(EVP_DigestFinal_ex(context.get(), digest.data(), &size) == 1);
  std::string text;
  for (unsigned int i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

}  // namespace sextant
