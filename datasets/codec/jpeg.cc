#include "sextant/datasets/codec/jpeg.h"

#include <array>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

#include "sextant/base/error.h"
#include "sextant/base/interrupt.h"
#include "sextant/base/text.h"
#include "sextant/datasets/codec/image_claim.h"

namespace sextant {
namespace {

constexpr std::string_view start_marker = "\xff\xd8";
constexpr std::string_view end_marker = "\xff\xd9";
constexpr int max_scans = 100;  // encoders write about ten; each costs a pass over all coefficients

static_assert(sizeof(Rgb) == 3, "a row of an image is a row of libjpeg's");

/// Error handler of libjpeg, which reports errors by a jump back to the beginning of the step.
struct ErrorTrap {
  jpeg_error_mgr manager{};  ///< first member: libjpeg passes on its address
  std::jmp_buf step{};
  std::array<char, JMSG_LENGTH_MAX> message{};

  ErrorTrap() {
    jpeg_std_error(&manager);
    manager.error_exit = &jump;
    manager.emit_message = [](j_common_ptr info, int level) {
      if (level < 0) jump(info);  // a warning: damaged parts would be decoded as gray
    };
  }

  [[noreturn]] static void jump(j_common_ptr info) {
    auto* trap = reinterpret_cast<ErrorTrap*>(info->err);
    info->err->format_message(info, trap->message.data());
    std::longjmp(trap->step, 1);
  }

  /// Returns false if libjpeg reports an error. A step must not have objects with destructors, which a jump
  /// would skip.
  template <typename Step>
  bool run(const Step& step_of_libjpeg) {
    if (setjmp(step) != 0) return false;
    step_of_libjpeg();
    return true;
  }
};

struct Decoder {
  ErrorTrap trap;
  jpeg_decompress_struct info{};
  Decoder() { info.err = &trap.manager; }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { jpeg_destroy_decompress(&info); }
};

struct Encoder {
  ErrorTrap trap;
  jpeg_compress_struct info{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  Encoder() { info.err = &trap.manager; }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() {
    jpeg_destroy_compress(&info);
    std::free(bytes);
  }
};

/// Called by libjpeg during each pass: aborts on Ctrl-C, and for a file with more scans than any encoder
/// writes.
void watch(j_common_ptr info) {
  auto* trap = reinterpret_cast<ErrorTrap*>(info->err);
  const bool too_many = reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > max_scans;
  if (!too_many && !is_interrupted()) return;
  if (too_many) std::snprintf(trap->message.data(), trap->message.size(), "more than %d scans", max_scans);
  std::longjmp(trap->step, 1);
}

/// Throws Error if the file is too short for the pixels of its header. A baseline or progressive file has at
/// least one bit for each block of 8x8 pixels.
void check_claim(const jpeg_decompress_struct& info, const std::string& name, size_t file_bytes) {
  const uint64_t width = info.image_width, height = info.image_height;
  const uint64_t coefficient_bytes = info.progressive_mode != 0 ? 2 * uint64_t(info.num_components) : 0;
  check_image_claim("JPEG", name, width, height, (sizeof(Rgb) + coefficient_bytes) * width * height,
                    file_bytes);
  if (info.arith_code == 0 && width * height / (64 * 8) > file_bytes) {
    fail("{}: JPEG file of {} bytes is too short for the {}x{} pixels that its header claims: copy it again",
         name, file_bytes, width, height);
  }
}

/// Throws Error on a truncated file, since the decoder accepts a file that is cut between two scans.
void check_complete(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(start_marker)) fail("{}: not a JPEG file (it does not start with FF D8)", name);
  const size_t last = bytes.find_last_not_of('\0');  // padding at the end is allowed
  if (last == std::string_view::npos || !bytes.substr(0, last + 1).ends_with(end_marker)) {
    fail("{}: JPEG file is truncated (no end marker FF D9): copy it again", name);
  }
}

}  // namespace

Image<Rgb> decode_jpeg_rgb(std::string_view bytes, const std::string& name) {
  check_complete(bytes, name);
  Decoder decoder;
  jpeg_decompress_struct& info = decoder.info;
  jpeg_progress_mgr progress{};
  progress.progress_monitor = &watch;
  const auto damaged = [&] {
    check_interrupt();
    fail("{}: damaged JPEG file ({}): copy it again", name, one_line(decoder.trap.message.data()));
  };
  const bool has_header = decoder.trap.run([&] {
    jpeg_create_decompress(&info);
    info.progress = &progress;
    jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    jpeg_read_header(&info, TRUE);
  });
  if (!has_header) damaged();
  check_claim(info, name, bytes.size());
  const bool has_started = decoder.trap.run([&] {
    info.out_color_space = JCS_RGB;
    jpeg_start_decompress(&info);
  });
  if (!has_started) damaged();
  Image<Rgb> image(static_cast<int>(info.image_width), static_cast<int>(info.image_height));
  const bool is_whole = decoder.trap.run([&] {
    while (info.output_scanline < info.output_height) {
      JSAMPROW row = reinterpret_cast<JSAMPROW>(image.row(static_cast<int>(info.output_scanline)));
      jpeg_read_scanlines(&info, &row, 1);
    }
    jpeg_finish_decompress(&info);
  });
  if (!is_whole) damaged();
  return image;
}

std::string encode_jpeg(const Image<Rgb>& image, int quality) {
  SEXTANT_CHECK(!image.empty() && quality >= 1 && quality <= 100);
  Encoder encoder;
  jpeg_compress_struct& info = encoder.info;
  const bool done = encoder.trap.run([&] {
    jpeg_create_compress(&info);
    jpeg_mem_dest(&info, &encoder.bytes, &encoder.size);
    info.image_width = static_cast<JDIMENSION>(image.width());
    info.image_height = static_cast<JDIMENSION>(image.height());
    info.input_components = 3;
    info.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info);
    jpeg_set_quality(&info, quality, TRUE);
    jpeg_start_compress(&info, TRUE);
    while (info.next_scanline < info.image_height) {
      JSAMPROW row =
          reinterpret_cast<JSAMPROW>(const_cast<Rgb*>(image.row(static_cast<int>(info.next_scanline))));
      jpeg_write_scanlines(&info, &row, 1);
    }
    jpeg_finish_compress(&info);
  });
  SEXTANT_CHECK(done);
  return {reinterpret_cast<const char*>(encoder.bytes), encoder.size};
}

}  // namespace sextant
