// Applies noise to one frame in C++ only. The test of the Python package compares its own result with this
// one bit for bit.
//
//   noise_reference NOISE SEED DATASET SEQUENCE FRAME FX FY CX CY BF WIDTH HEIGHT IN OUT
//
// IN and OUT contain, one after the other and row by row: depth (float), flow and backward flow (2 floats per
// pixel), mask (uint16).

#include <cstdio>
#include <cstring>

#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/noise/noise.h"

namespace sextant {
namespace {

template <typename Pixel>
Image<Pixel> take(std::string_view& bytes, int width, int height) {
  Image<Pixel> image(width, height);
  const size_t n = image.size() * sizeof(Pixel);
  if (bytes.size() < n) fail("the input file is too short: expected {} more bytes", n - bytes.size());
  std::memcpy(image.data(), bytes.data(), n);
  bytes.remove_prefix(n);
  return image;
}

template <typename Pixel>
void put(std::string& bytes, const Image<Pixel>& image) {
  bytes.append(reinterpret_cast<const char*>(image.data()), image.size() * sizeof(Pixel));
}

void write_noisy_frame(const std::vector<std::string>& a) {
  const auto number = [&](size_t i) { return number_in(a.at(i)).value(); };
  const StereoCamera camera{{number(5), number(6), number(7), number(8)}, number(9)};
  const int width = static_cast<int>(number(10)), height = static_cast<int>(number(11));
  const std::string in = read_file(a.at(12));
  std::string_view rest = in;
  Frame frame;
  frame.index = static_cast<int>(number(4));
  frame.depth_m = take<float>(rest, width, height);
  frame.flow = take<Flow>(rest, width, height);
  frame.backward_flow = take<Flow>(rest, width, height);
  frame.mask = take<uint16_t>(rest, width, height);
  const Frame noisy =
      Noise::parse(a.at(0)).apply(frame, camera, Draws(std::stoull(a.at(1)), a.at(2), a.at(3))).frame;
  std::string out;
  put(out, noisy.depth_m);
  put(out, noisy.flow);
  put(out, noisy.backward_flow);
  put(out, noisy.mask);
  write_file(a.at(13), out);
}

}  // namespace
}  // namespace sextant

int main(int argc, char** argv) {
  try {
    sextant::write_noisy_frame({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "noise_reference: %s\n", error.what());
    return 2;
  }
}
