#include "sextant/datasets/synthetic/frame_cache.h"

#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/files.h"
#include "sextant/base/machine.h"
#include "sextant/base/new_file.h"

namespace sextant::synthetic {
namespace {

/// The content of a scenario as bytes, one value after the other.
class Content {
 public:
  template <typename T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void add(const std::string& text) {
    add(text.size());
    bytes_ += text;
  }
  template <typename Scalar, int Rows>
  void add(const Eigen::Matrix<Scalar, Rows, 1>& vector) {
    for (int i = 0; i < Rows; ++i) add(vector[i]);
  }
  void add(const SE3& pose) {
    add(Eigen::Vector4d(pose.rotation().coeffs()));
    add(pose.translation());
  }
  void add(const Mesh& mesh) {
    add(mesh.vertices.size());
    for (const Eigen::Vector3d& vertex : mesh.vertices) add(vertex);
    add(mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
      for (const uint32_t vertex : triangle.vertices) add(vertex);
      add(triangle.patch);
    }
    add(mesh.patches.size());
    for (const Patch& patch : mesh.patches) {
      add(patch.look.material);
      add(patch.look.colour);
      add(patch.look.seed);
      add(patch.look.extent);
      add(patch.origin);
      add(patch.u_axis);
      add(patch.v_axis);
      add(patch.curved);
    }
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace

std::string content_key(const Scenario& scenario, const std::string& version) {
  Content content;
  content.add(version);
  const PinholeCamera& camera = scenario.camera.left;
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy, scenario.camera.bf})
    content.add(value);
  content.add(scenario.width);
  content.add(scenario.height);
  content.add(scenario.world);
  content.add(scenario.T_world_camera.size());
  for (const SE3& pose : scenario.T_world_camera) content.add(pose);
  for (const Actor& actor : scenario.actors) {
    content.add(actor.id);
    content.add(make_car(actor.shape));
    for (const std::optional<SE3>& pose : actor.T_world_object) {
      content.add(pose.has_value());
      if (pose) content.add(*pose);
    }
  }
  return sha256(content.bytes());
}

fs::path cache_folder(const std::string& option) {
  if (option != "auto") return option;
  const fs::path root = cache_root();
  return root.empty() ? root : root / "frames";
}

FrameCache::FrameCache(const fs::path& folder, const std::string& key, uint64_t max_bytes)
    : folder_(folder.empty() ? fs::path() : folder / key), max_bytes_(max_bytes) {
  if (folder.empty()) return;
  check_private_folder(folder);
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code gone;  // another program may be writing
    const uint64_t size = it->is_regular_file(gone) ? it->file_size(gone) : 0;
    if (!gone) used_bytes_ += size;
  }
}

std::string FrameCache::header(int width, int height, size_t pixel_bytes) {
  return fmt::format("sextant frame {}x{}x{} ", width, height, pixel_bytes);
}

fs::path FrameCache::file(int frame, const char* channel) const {
  return folder_ / fmt::format("{:05}-{}.bin", frame, channel);
}

bool FrameCache::load_bytes(int frame, const char* channel, const std::string& header, void* data,
                            size_t size) const {
  std::error_code error;
  if (folder_.empty() || !fs::is_regular_file(file(frame, channel), error)) return false;
  std::string bytes;
  try {
    bytes = read_file(file(frame, channel));
  } catch (const Error&) {
    return false;  // deleted in the meantime
  }
  constexpr size_t hash_size = 64;
  const size_t start = header.size() + hash_size + 1;
  if (bytes.size() != start + size || !bytes.starts_with(header)) return false;
  const std::string_view pixels = std::string_view(bytes).substr(start);
  if (sha256(pixels) != std::string_view(bytes).substr(header.size(), hash_size)) return false;
  std::memcpy(data, pixels.data(), size);
  return true;
}

void FrameCache::store_bytes(int frame, const char* channel, const std::string& header, const void* data,
                             size_t size) const {
  if (folder_.empty() || used_bytes_ + size > max_bytes_) return;
  const std::string_view pixels(static_cast<const char*>(data), size);
  std::string bytes = header + sha256(pixels) + "\n";
  bytes += pixels;
  std::error_code error;
  try {
    make_private_folder(folder_.parent_path());
    fs::create_directory(folder_, error);
    write_file(file(frame, channel), bytes);
    used_bytes_ += bytes.size();
  } catch (const Error&) {
    // A folder that cannot be written costs time and does not affect results.
  }
}

}  // namespace sextant::synthetic
