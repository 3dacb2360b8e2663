#include "sextant/datasets/codec/yaml_camera.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <vector>

#include "sextant/base/error.h"
#include "sextant/base/text.h"

namespace sextant {
namespace {

// A reader of our own for lines "KEY: number": OpenCV's hangs on damaged files, and wraps large integers
// around.

/// The text behind a key, and its line.
struct Value {
  std::string_view text;
  int line;
};

/// What stands behind each key that begins a line, without comments.
std::map<std::string, Value> top_level(std::string_view text, const std::string& name) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  if (!text.starts_with("%YAML"))
    fail("{}: expected an OpenCV YAML file, whose first line is %YAML:1.0", name);
  std::map<std::string, Value> values;
  for (int line = 1; !text.empty(); ++line) {
    const std::string_view row = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(row.size() + 1, text.size()));
    const size_t colon = row.find(':');
    if (line == 1 || row.empty() || row[0] == '#' || row[0] == ' ' || colon == std::string_view::npos)
      continue;
    const std::string key(trimmed(row.substr(0, colon)));
    const std::string_view value = row.substr(colon + 1);
    if (!values.emplace(key, Value{trimmed(value.substr(0, value.find('#'))), line}).second)
      fail("{}:{}: key {} is there twice", name, line, key);
  }
  return values;
}

double positive(const Value& said, const std::string& name, const char* key) {
  const std::optional<double> value = number_in(said.text);
  if (!value) fail("{}: {}: expected a number in line {}, got '{}'", name, key, said.line, said.text.substr(0, 40));
  if (!(*value >= 1e-6 && *value < 1e9)) {
    fail("{}: {} = {}: expected a positive number from 1e-6 to 1e9 in line {}", name, key, said.text.substr(0, 40),
         said.line);
  }
  return *value;
}

}  // namespace

YamlCamera decode_yaml_camera(std::string_view text, const std::string& name) {
  const std::map<std::string, Value> values = top_level(text, name);
  std::vector<std::string> missing;
  for (const char* key : {"Camera.fx", "Camera.fy", "Camera.cx", "Camera.cy", "Camera.bf"})
    if (!values.contains(key)) missing.emplace_back(key);
  if (!missing.empty()) fail("{}: missing {}: add it as 'KEY: number'", name, fmt::join(missing, ", "));

  YamlCamera out;
  const auto read = [&](const char* key) { return positive(values.at(key), name, key); };
  out.camera.left = {read("Camera.fx"), read("Camera.fy"), read("Camera.cx"), read("Camera.cy")};
  out.camera.bf = read("Camera.bf");
  if (values.contains("Camera.fps")) out.rate_hz = read("Camera.fps");
  return out;
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
