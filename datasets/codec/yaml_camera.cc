#include "sextant/datasets/codec/yaml_camera.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "sextant/base/error.h"

namespace sextant {
namespace {

cv::FileStorage open_storage(std::string_view text, const std::string& name) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  if (!text.starts_with("%YAML"))
    fail("{}: expected an OpenCV YAML file, whose first line is %YAML:1.0", name);
  return cv::FileStorage(std::string(text), cv::FileStorage::READ | cv::FileStorage::MEMORY);
}

/// OpenCV wraps integers of more than 32 bits around without a word: their digits are counted in the text.
bool is_wrapped(std::string_view text, const std::string& key) {
  const size_t at = text.find(key + ":");
  if (at == std::string_view::npos) return true;
  const size_t begin = std::min(text.find_first_not_of(" \t+0", at + key.size() + 1), text.size());
  return text.find_first_not_of("0123456789", begin) - begin > 9;
}

double positive(const cv::FileNode& node, std::string_view text, const std::string& name, const char* key) {
  if (!node.isReal() && !node.isInt()) fail("{}: {}: expected a number", name, key);
  const double value = node.real();
  if (!(std::isfinite(value) && value > 0 && value < 1e9) || (node.isInt() && is_wrapped(text, key)))
    fail("{}: {} = {}: expected a positive number below 1e9", name, key, value);
  return value;
}

YamlCamera decode(std::string_view text, const std::string& name) {
  const cv::FileStorage storage = open_storage(text, name);
  std::vector<std::string> missing;
  for (const char* key : {"Camera.fx", "Camera.fy", "Camera.cx", "Camera.cy", "Camera.bf"}) {
    if (storage[key].empty()) missing.emplace_back(key);
  }
  if (!missing.empty()) fail("{}: missing {}: add it as 'KEY: number'", name, fmt::join(missing, ", "));

  YamlCamera out;
  const auto read = [&](const char* key) { return positive(storage[key], text, name, key); };
  out.camera.left = {read("Camera.fx"), read("Camera.fy"), read("Camera.cx"), read("Camera.cy")};
  out.camera.bf = read("Camera.bf");
  if (!storage["Camera.fps"].empty()) out.rate_hz = read("Camera.fps");
  return out;
}

}  // namespace

YamlCamera decode_yaml_camera(std::string_view text, const std::string& name) {
  try {
    return decode(text, name);
  } catch (const cv::Exception& e) {  // also where the file holds no keys at all
    fail("{}: not valid OpenCV YAML, lines of 'KEY: number': {}", name, e.err);
  }
}

std::string encode_yaml_camera(const YamlCamera& camera) {
  const PinholeCamera& left = camera.camera.left;
  std::string out = fmt::format(
      "%YAML:1.0\n---\nCamera.fx: {:.17g}\nCamera.fy: {:.17g}\nCamera.cx: {:.17g}\nCamera.cy: {:.17g}\n"
      "Camera.bf: {:.17g}\n",
      left.fx, left.fy, left.cx, left.cy, camera.camera.bf);
  if (camera.rate_hz > 0) out += fmt::format("Camera.fps: {:.17g}\n", camera.rate_hz);
  return out;
}

}  // namespace sextant
