#include "sextant/eval/logs/trajectory_bytes.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <memory>

#include "sextant/base/interrupt.h"

namespace sextant {
namespace {

constexpr size_t block_bytes = size_t{1} << 18;

/// Output of a decompressor, block by block.
class Output {
 public:
  Output(uint64_t size, const std::string& where) : size_(size), where_(where) {}

  char* block() { return block_.data(); }
  size_t room() const { return block_.size(); }
  void take(size_t n) {
    check_interrupt();
    if (out_.size() + n > size_)
      fail("{}: a decompressed block has more than its {} bytes: the file is damaged", where_, size_);
    out_.append(block_.data(), n);
  }
  std::string finish() {
    if (out_.size() != size_)
      fail("{}: a decompressed block has {} bytes, but its header states {}: the file is damaged", where_,
           out_.size(), size_);
    return std::move(out_);
  }
  [[noreturn]] void damaged(const std::string& reason) const {
    fail("{}: a compressed block is damaged: {}", where_, reason);
  }

 private:
  uint64_t size_;
  const std::string& where_;
  std::vector<char> block_ = std::vector<char>(block_bytes);
  std::string out_;
};

void from_lz4(std::string_view bytes, Output& out) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) out.damaged("no memory for lz4");
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(raw,
                                                                             LZ4F_freeDecompressionContext);
  for (size_t more = 1; more != 0;) {
    size_t n_in = bytes.size(), n_out = out.room();
    more = LZ4F_decompress(raw, out.block(), &n_out, bytes.data(), &n_in, nullptr);
    if (LZ4F_isError(more)) out.damaged(LZ4F_getErrorName(more));
    out.take(n_out);
    bytes.remove_prefix(n_in);
    if (more != 0 && n_in == 0 && n_out == 0) out.damaged("it is cut off");
  }
}

void from_zstd(std::string_view bytes, Output& out) {
  const std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  if (!context) out.damaged("no memory for zstd");
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  for (size_t more = 1; more != 0;) {
    ZSTD_outBuffer to{out.block(), out.room(), 0};
    const size_t before = in.pos;
    more = ZSTD_decompressStream(context.get(), &to, &in);
    if (ZSTD_isError(more)) out.damaged(ZSTD_getErrorName(more));
    out.take(to.pos);
    if (more != 0 && in.pos == before && to.pos == 0) out.damaged("it is cut off");
  }
}

void from_bz2(std::string_view bytes, Output& out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) out.damaged("no memory for bz2");
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> end(&stream, BZ2_bzDecompressEnd);
  stream.next_in = const_cast<char*>(bytes.data());  // not written to
  stream.avail_in = static_cast<unsigned>(bytes.size());
  for (int state = BZ_OK; state != BZ_STREAM_END;) {
    const unsigned left = stream.avail_in;
    stream.next_out = out.block();
    stream.avail_out = static_cast<unsigned>(out.room());
    state = BZ2_bzDecompress(&stream);
    if (state != BZ_OK && state != BZ_STREAM_END) out.damaged(fmt::format("bz2 error {}", state));
    const size_t n = out.room() - stream.avail_out;
    out.take(n);
    if (state == BZ_OK && n == 0 && stream.avail_in == left) out.damaged("it is cut off");
  }
}

}  // namespace

ByteSource::ByteSource(const std::string& path, const FileKind& kind)
    : name_(path), file_(std::in_place, path, kind) {
  size_ = file_->size();
}

std::string_view ByteSource::view(uint64_t at, uint64_t n) {
  if (at > size_ || n > size_ - at)
    fail("{}: ends at byte {} within a record: the file is truncated", name_, size_);
  if (!file_) return memory_.substr(static_cast<size_t>(at), static_cast<size_t>(n));
  if (at < block_at_ || at + n > block_at_ + block_.size()) {
    if (n > largest_block)
      fail("{}: a block has {} bytes at byte {}, expected {} at most", name_, n, at, largest_block);
    block_.resize(static_cast<size_t>(std::min(std::max<uint64_t>(n, block_bytes), size_ - at)));
    block_at_ = at;
    const size_t got = file_->read(block_.data(), block_.size(), at);
    if (got < block_.size())
      fail("{}: ends at byte {}: it became shorter while it was read", name_, at + got);
  }
  return {block_.data() + (at - block_at_), static_cast<size_t>(n)};
}

std::string Decompressor::decompress(std::string_view kind, std::string_view bytes, uint64_t size,
                                     const std::string& where) {
  if (size > largest_block) fail("{}: a block has {} bytes, expected {} at most", where, size, largest_block);
  if (size > left_) {
    fail(
        "{}: the compressed chunks up to here unpack to more than 16 MB and 200 times the file's size: "
        "decompress the recording first if it is not damaged",
        where);
  }
  left_ -= size;
  Output out(size, where);
  if (kind == "lz4") {
    from_lz4(bytes, out);
  } else if (kind == "zstd") {
    from_zstd(bytes, out);
  } else if (kind == "bz2") {
    from_bz2(bytes, out);
  } else {
    fail("{}: unknown compression '{}': expected none, lz4, zstd or bz2; decompress the recording", where,
         kind.substr(0, 20));
  }
  return out.finish();
}

MemoryFile::MemoryFile(std::string_view bytes) : file_(::memfd_create("bytes", MFD_CLOEXEC)) {
  if (!file_) fail("cannot create a file in memory: {}", std::strerror(errno));
  if (!write_all(file_.get(), bytes)) fail("cannot write a file in memory: {}", std::strerror(errno));
}

std::string MemoryFile::path() const { return fmt::format("/proc/self/fd/{}", file_.get()); }

}  // namespace sextant
