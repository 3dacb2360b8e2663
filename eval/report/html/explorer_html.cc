
#include <algorithm>
#include <bit>
#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/json.h"
#include "sextant/eval/report/html/html.h"

namespace sextant {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

template <typename Number, typename List>
std::string packed(const List& list) {
  std::string bytes(list.size() * sizeof(Number), '\0');
  size_t at = 0;
  for (const auto& value : list) {
    const auto number = static_cast<Number>(value);
    std::memcpy(bytes.data() + at, &number, sizeof number);
    at += sizeof number;
  }
  return base64(bytes);
}

Json path_json(const ExploredPath& path, size_t n_curves) {
  const size_t n = path.time.size();
  SEXTANT_CHECK(n > 0 && path.begins.size() == n && path.values.size() == n_curves);
  Json position = Json::array(), values = Json::array(), begins = Json::array();
  for (int axis = 0; axis < 3 && !path.position_m.empty(); ++axis) {
    std::vector<double> coordinate;
    for (const Eigen::Vector3d& p : path.position_m) coordinate.push_back(p[axis]);
    position.push_back(packed<float>(coordinate));
  }
  for (const std::vector<double>& list : path.values) {
    SEXTANT_CHECK(list.empty() || list.size() == n);
    values.push_back(list.empty() ? Json() : Json(packed<float>(list)));
  }
  for (size_t i = 0; i < n; ++i) {
    if (path.begins[i]) begins.push_back(i);
  }
  const bool time_is_frame = path.frame.empty() || std::ranges::equal(path.time, path.frame);
  return {{"label", path.label},
          {"is_reference", path.is_reference},
          {"colour", path.colour},
          {"dash", path.dash},
          {"n", n},
          {"time", packed<float>(path.time)},
          {"frame", time_is_frame ? Json() : Json(packed<int32_t>(path.frame))},
          {"position", std::move(position)},
          {"values", std::move(values)},
          {"begins", std::move(begins)}};
}

}  // namespace

std::string explorer_html(const Explorer& explorer) {
  Json data = {{"time_title", explorer.time_title},
               {"axes", explorer.axes},
               {"curves", explorer.curves},
               {"note", explorer.note},
               {"paths", Json::array()}};
  for (const ExploredPath& path : explorer.paths)
    data["paths"].push_back(path_json(path, explorer.curves.size()));
  return fmt::format(
      "<div class=\"explorer\" id=\"{}\" hidden><script type=\"application/json\">{}</script></div>\n",
      explorer.name, script_json(data));
}

}  // namespace sextant
