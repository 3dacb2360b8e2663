#pragma once

// The result file of evo (evo_ape --save_results, read by evo_res): a zip of
//
//   info.json     title, ref_name, est_name, label       stats.json    the seven statistics
//   error_array.npy and, as they exist, timestamps.npy, seconds_from_start.npy, distances.npy (estimate),
//   distances_from_start.npy (reference), alignment_transformation_sim3.npy
//
// .npy: numpy's format version 1.0, little-endian doubles, C order.

#include <filesystem>
#include <string>

#include "sextant/eval/evaluation/ego_evaluation.h"

namespace sextant {

/// Writes the zip under a temporary name, then renames it. Throws Error if it cannot be written.
void write_evo_result(const std::filesystem::path& path, const EgoResult& result, const EgoOptions& options,
                      const std::string& reference_name);

/// Encodes an .npy file of `rows` x `columns` doubles; with `columns` 0 the array is one-dimensional.
std::string encode_npy(std::span<const double> values, size_t columns = 0);

}  // namespace sextant
