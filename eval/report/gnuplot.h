#pragma once

// The only place that runs gnuplot: no shell, no settings of the user, and the same time zone and language
// everywhere, so that a script draws the same bytes on every machine.

#include <filesystem>
#include <string>

namespace sextant {

/// Runs `script`, a file in `folder`, there. Throws Error with gnuplot's own words when it refuses, and one
/// that says what to install when there is no gnuplot. That gnuplot is content says nothing about a full
/// disk.
void run_gnuplot(const std::string& script, const std::filesystem::path& folder);

}  // namespace sextant
