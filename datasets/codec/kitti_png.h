#pragma once

// What the numbers of 16-bit depth, disparity and flow images mean. Invalid pixels are NaN on our side.
//
//   disparity (KITTI, VDO-SLAM folders):  z = bf / (n / 256)  (m), n = 0 invalid
//   depth in m / 256 (KITTI depth):       z = n / 256         (m), n = 0 invalid
//   depth in centimetres (Virtual KITTI): z = n / 100         (m), n = 65535 invalid (sky, beyond 655.35 m)
//   flow (KITTI scene flow):              u = (R - 2^15) / 64, v = (G - 2^15) / 64  (px), B = 0 invalid
//   flow (Virtual KITTI):                 u = (2 R / 65535 - 1) (w - 1), v = (2 G / 65535 - 1) (h - 1)  (px),
//                                         B = 0 invalid

#include "sextant/datasets/codec/png.h"
#include "sextant/measurement/image.h"

namespace sextant {

/// `bf` = focal length times baseline, px m.
Image<float> depth_from_disparity256(const Image<uint16_t>& disparity, double bf);
Image<float> depth_from_depth256(const Image<uint16_t>& depth);
Image<float> depth_from_cm(const Image<uint16_t>& depth_cm);
Image<Flow> flow_from_kitti(const Image<Rgb16>& image);
Image<Flow> flow_from_vkitti(const Image<Rgb16>& image);

/// The inverses, rounded to nearest; what cannot be represented becomes invalid.
Image<uint16_t> disparity256_from_depth(const Image<float>& depth_m, double bf);
Image<uint16_t> depth256_from_depth(const Image<float>& depth_m);
Image<uint16_t> cm_from_depth(const Image<float>& depth_m);
Image<Rgb16> kitti_from_flow(const Image<Flow>& flow);
Image<Rgb16> vkitti_from_flow(const Image<Flow>& flow);

}  // namespace sextant
