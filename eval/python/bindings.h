#pragma once

// The parts of sextant._core. Python's side of each, with what users see and read, lies in the package
// beside.

#include <pybind11/pybind11.h>

namespace sextant {

void bind_trajectories(pybind11::module_& core);
void bind_motions(pybind11::module_& core);

}  // namespace sextant
