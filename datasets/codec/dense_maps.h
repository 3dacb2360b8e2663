#pragma once

// Files of flow, depth and masks: PNG in the formats of KITTI, Virtual KITTI and TartanAir, .flo, and mask
// text.
//
// Encodings of 16-bit depth, disparity and flow images. Invalid pixels are NaN in the decoded image.
//
//   disparity (KITTI, VDO-SLAM folders):  z = bf / (n / 256)  (m), n = 0 invalid
//   depth in m / 256 (KITTI depth):       z = n / 256         (m), n = 0 invalid
//   depth in centimetres (Virtual KITTI): z = n / 100         (m), n = 65535 invalid (sky, beyond 655.34 m),
//                                         n = 0 invalid (no measurement)
//   flow (KITTI scene flow):              u = (R - 2^15) / 64, v = (G - 2^15) / 64  (px), B = 0 invalid
//   flow (Virtual KITTI):                 u = (2 R / 65535 - 1) (w - 1), v = (2 G / 65535 - 1) (h - 1)  (px),
//                                         B = 0 invalid

#include <string>
#include <string_view>

#include "sextant/datasets/codec/png.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// Decode images of depth (to m) and of flow (to px); `bf` = focal length times baseline, px m.
Image<float> depth_from_disparity256(const Image<uint16_t>& disparity, double bf);
Image<float> depth_from_depth256(const Image<uint16_t>& depth);
Image<float> depth_from_cm(const Image<uint16_t>& depth_cm);
Image<Flow> flow_from_kitti(const Image<Rgb16>& image);
Image<Flow> flow_from_vkitti(const Image<Rgb16>& image);

/// Encode depth (m) and flow (px), rounded to nearest; values outside the range of the format become invalid.
Image<uint16_t> disparity256_from_depth(const Image<float>& depth_m, double bf);
Image<uint16_t> depth256_from_depth(const Image<float>& depth_m);
Image<uint16_t> cm_from_depth(const Image<float>& depth_m);
Image<Rgb16> kitti_from_flow(const Image<Flow>& flow);
Image<Rgb16> vkitti_from_flow(const Image<Flow>& flow);

// Pixel formats of TartanAir V2's depth and flow images (tartanair.org/modalities.html). Invalid pixels are
// NaN in the decoded image.
//
//   depth  8-bit RGBA: the bytes B, G, R, A of a pixel are a little-endian float32, z in m. Values that are
//          not positive, not finite, or from tartanair_sky_m on (the sky sphere) are invalid
//   flow   16-bit RGB: u = (B - 2^15) / 64, v = (G - 2^15) / 64 (px); R is the mask, 0 = valid

/// Depths from here on belong to the sky sphere, which has a radius of 10 to 60 km in the rendered scenes.
inline constexpr float tartanair_sky_m = 5000;

Image<float> depth_from_tartanair(const Image<Rgba>& image);
Image<Flow> flow_from_tartanair(const Image<Rgb16>& image);

// Middlebury .flo optical flow: "PIEH" (the float 202021.25), int32 width, int32 height, then width*height
// pairs of float (u, v), px, row by row; all little-endian. A component of 1e9 or more in magnitude, or
// NaN, means "unknown" and is an invalid Flow here.
// Source: vision.middlebury.edu/flow/code/flow-code/README.txt

/// Decodes a .flo file. Throws Error on another magic number, a width or height outside 1..1000000, or a
/// number of bytes that does not match them.
Image<Flow> decode_flo(std::string_view bytes, const std::string& name);

/// Encodes a .flo file; invalid pixels are written as 1e10, as the format specifies.
std::string encode_flo(const Image<Flow>& flow);

// Instance masks as text (VDO-SLAM folders): one line per image row, integers 0..65535 separated by blanks
// or tabs, 0 = background. Trailing blanks, CRLF and empty lines at the end are accepted.

/// Decodes a mask. Throws Error "NAME:LINE:COLUMN: ..." on anything but a full matrix of such integers.
Image<uint16_t> decode_mask_text(std::string_view text, const std::string& name);

/// Encodes a mask as "0 0 1 \n", like the files of VDO-SLAM.
std::string encode_mask_text(const Image<uint16_t>& mask);

}  // namespace sextant
