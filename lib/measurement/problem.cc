#include "sextant/measurement/problem.h"

#include "sextant/base/error.h"

namespace sextant {

void Correspondences::reserve(size_t n) {
  for (std::vector<double>* array : {&u, &v, &depth, &flow_u, &flow_v, &depth_curr}) array->reserve(n);
}

void Correspondences::push_back(double u_px, double v_px, double depth_m, double flow_u_px, double flow_v_px,
                                double depth_curr_m) {
  u.push_back(u_px);
  v.push_back(v_px);
  depth.push_back(depth_m);
  flow_u.push_back(flow_u_px);
  flow_v.push_back(flow_v_px);
  depth_curr.push_back(depth_curr_m);
}

Correspondences Correspondences::subset(const std::vector<unsigned char>& keep) const {
  SEXTANT_CHECK(keep.size() == size());
  Correspondences out;
  out.reserve(size());
  for (size_t i = 0; i < size(); ++i) {
    if (!keep[i]) continue;
    out.push_back(u[i], v[i], depth[i], flow_u[i], flow_v[i], depth_curr[i]);
    if (!before_noise.empty()) out.before_noise.push_back(before_noise[i]);
  }
  return out;
}

}  // namespace sextant
