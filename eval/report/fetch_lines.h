#pragma once

// The lines that get the data of the paper, and data like them. ROOT is the folder given by --data.

#include <string>

namespace sextant {

constexpr const char* fetch_demo = "scripts/fetch demo --out ROOT/kitti_03_demo";
constexpr const char* fetch_vkitti1_text = "scripts/fetch vkitti1 --text-only";
constexpr const char* fetch_vkitti1 = "scripts/fetch vkitti1 --rgb --depth --flow --masks";
constexpr const char* fetch_vkitti2 = "scripts/fetch vkitti2 --all";
constexpr const char* fetch_kitti = "scripts/fetch kitti_tracking --left --right";
constexpr const char* fetch_peers = "run the systems yourself; docs/reproduction.md says where their files go";

/// What fetches the data and then measures; where no script of ours fetches them, what to do instead.
inline std::string measuring_line(const std::string& fetch) {
  return fetch.starts_with("scripts/") ? fetch + " && sextant reproduce --data ROOT --out DIR" : fetch;
}

}  // namespace sextant
