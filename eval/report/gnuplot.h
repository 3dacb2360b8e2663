#pragma once

// The only place that talks to gnuplot (through gnuplot-iostream).

#include <filesystem>
#include <string>

namespace sextant {

/// Runs the script in `folder`, where its relative file names are. Throws Error with gnuplot's own words when
/// it refuses, and one that says what to install when there is no gnuplot.
void run_gnuplot(const std::string& script, const std::filesystem::path& folder);

}  // namespace sextant
