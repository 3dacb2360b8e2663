// noise_on_images DEPTH.png FLOW.flo SEED OUT.flo
//
// Adds noise to depth (a 16-bit PNG in centimetres) and flow (a .flo file) of your own, and writes the flow.
// The random numbers are those that a sweep would draw for frame 0 of sequence "1" of the data set "mine", so
// that a method outside of Sextant can be tried with the noise of Sextant's reports.

#include <cstdio>
#include <string>

#include "sextant/base/files.h"
#include "sextant/base/text.h"
#include "sextant/datasets/codec/dense_maps.h"
#include "sextant/noise/noise.h"

namespace {

void corrupt(const std::string& depth_file, const std::string& flow_file, const std::string& seed,
             const std::string& out) {
  const auto number = sextant::number_in(seed);
  if (!number || *number < 0) sextant::fail("SEED '{}': expected a whole number of 0 or more", seed);
  sextant::Frame frame;
  frame.depth_m = sextant::depth_from_cm(sextant::decode_png16(sextant::read_file(depth_file), depth_file));
  frame.flow = sextant::decode_flo(sextant::read_file(flow_file), flow_file);
  if (frame.flow.width() != frame.depth_m.width() || frame.flow.height() != frame.depth_m.height())
    sextant::fail("{} and {}: expected images of equal size", depth_file, flow_file);
  const sextant::StereoCamera camera{{725, 725, 620.5, 187}, 387.57};  // px; px m
  const auto noise = sextant::Noise::parse(R"({"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.5}})");
  const sextant::Frame noisy =
      noise.apply(frame, camera, sextant::Draws(static_cast<uint64_t>(*number), "mine", "1")).frame;
  sextant::write_file(out, sextant::encode_flo(noisy.flow));
  std::printf("%s on %d x %d pixels\n", noise.name().c_str(), noisy.flow.width(), noisy.flow.height());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: noise_on_images DEPTH.png FLOW.flo SEED OUT.flo\n");
    return 2;
  }
  try {
    corrupt(argv[1], argv[2], argv[3], argv[4]);
    return 0;
  } catch (const sextant::Error& error) {
    std::fprintf(stderr, "noise_on_images: %s\n", error.what());
    return 2;
  }
}
